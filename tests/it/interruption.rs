//! A run that is killed or interrupted loses nothing, and ends in the same networks as one that never stopped.

use std::fs;
use std::path::Path;
use std::process::{Child, Output, Stdio};
use std::time::{Duration, Instant};

use crate::resume::{assert_same, logged, resume_on_one_thread, whole_on_one_thread};
use crate::support::workplace::{Workplace, turn};

/// A run of a second or more that can be stopped in the middle.
const LONGER: &[&str] = &[
    "training.steps = 1000",
    "training.log-every = 3",
    "checkpoint.every = 25",
    "checkpoint.keep = 2",
];

/// Starts a command on one thread and lets it run.
fn start(place: &Workplace, arguments: &[&str]) -> Child {
    let mut command = place.command(arguments);
    command
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    command.spawn().expect("the program starts")
}

/// Waits for its end, and what it wrote to standard error.
fn end(child: Child) -> Output {
    child.wait_with_output().expect("a child")
}

const TRAIN: &[&str] = &[
    "train",
    "recipe.toml",
    "--quiet",
    "--run",
    "run",
    "--backend",
    "flex",
];
const RESUME: &[&str] = &["resume", "run", "--quiet", "--backend", "flex"];

/// Waits until something is there; a minute is far more than it takes.
fn wait_until(what: &str, is_there: impl Fn() -> bool) {
    let start = Instant::now();
    while !is_there() {
        assert!(
            start.elapsed() < Duration::from_secs(60),
            "{what} does not come"
        );
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn holds_a_line(path: &Path) -> bool {
    fs::read(path).is_ok_and(|bytes| bytes.contains(&b'\n'))
}

#[test]
fn a_folder_that_is_moved_away_meanwhile_is_said_and_goes_on_where_it_is_put_back() {
    let _turn = turn();
    let keys = [LONGER, &["training.guided-until = 0"]].concat();
    let place = Workplace::tiny(&keys);
    let child = start(&place, TRAIN);
    wait_until("a checkpoint", || {
        place.path("run/checkpoints/step-000025").exists()
    });
    fs::rename(place.path("run"), place.path("elsewhere")).expect("a free name");
    let ended = end(child);
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(
        said.contains("run: the folder is gone: it was moved or deleted"),
        "{said}"
    );
    assert!(!place.path("run").exists(), "half a run in its place");
    fs::rename(place.path("elsewhere"), place.path("run")).expect("a free name");
    place.isomorph(RESUME).succeeded();
    assert!(place.path("run/checkpoints/step-001000").exists());
}

#[test]
fn a_run_killed_again_and_again_ends_in_the_same_networks() {
    let _turn = turn();
    // Each attempt would find the splines anew, and be killed before its first step.
    let keys = [LONGER, &["training.guided-until = 0"]].concat();
    let place = Workplace::tiny(&keys);
    let whole = whole_on_one_thread(&place, "flex");
    // Times that have nothing to do with those of steps and checkpoints; the first falls before
    // training begins, the later ones anywhere.
    let delays = [11, 283, 347, 419, 307, 521, 379];
    let mut killed = 0;
    for (attempt, delay) in delays.into_iter().enumerate() {
        // Killed before it had written its recipe, it is no run yet.
        let begun = place.path("run/recipe.toml").exists();
        let mut child = start(&place, if begun { RESUME } else { TRAIN });
        std::thread::sleep(Duration::from_millis(delay));
        if child.try_wait().expect("a child").is_some() {
            assert!(
                attempt > 2,
                "the run ended before it was killed {attempt} times"
            );
            break;
        }
        child.kill().expect("SIGKILL");
        child.wait().expect("a child that was killed");
        killed += 1;
    }
    println!("killed {killed} times");
    assert!(killed >= 3, "killed {killed} times only");
    resume_on_one_thread(&place, "run", "flex");
    let run = place.run("run");
    assert_eq!(run.logged_steps(), logged(1000, 25));
    assert_eq!(
        run.checkpoints(),
        ["step-000975", "step-001000"],
        "nothing torn is left"
    );
    assert_same(&run, &whole);
}

#[test]
fn a_run_killed_before_its_first_checkpoint_starts_again() {
    let _turn = turn();
    let place = Workplace::tiny(LONGER);
    let whole = whole_on_one_thread(&place, "flex");
    let never = ["--set", "checkpoint.every=100000"];
    let mut child = start(&place, &[TRAIN, &never].concat());
    let run = place.run("run");
    wait_until("the first line of the metrics", || {
        holds_a_line(&run.path("metrics.jsonl"))
    });
    child.kill().expect("SIGKILL");
    child.wait().expect("a child that was killed");
    assert!(!run.path("checkpoints").exists() || run.checkpoints().is_empty());
    let set = [
        "resume",
        "run",
        "--backend",
        "flex",
        "--set",
        "checkpoint.every=25",
    ];
    let ended = place.on_one_thread(&set).succeeded();
    assert!(
        ended.stderr.contains("no checkpoint yet"),
        "{}",
        ended.stderr
    );
    assert_same(&run, &whole);
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_a_checkpoint_of_the_present_step_and_exits_130() {
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    let _turn = turn();
    let place = Workplace::tiny(LONGER);
    let whole = whole_on_one_thread(&place, "flex");
    let never = ["--set", "checkpoint.every=100000"];
    for (signal, name) in [
        (Signal::SIGINT, "interrupted"),
        (Signal::SIGTERM, "terminated"),
    ] {
        let train = [
            "train",
            "recipe.toml",
            "--quiet",
            "--run",
            name,
            "--backend",
            "flex",
        ];
        let child = start(&place, &[&train[..], &never].concat());
        let run = place.run(name);
        wait_until("a few steps", || holds_a_line(&run.path("metrics.jsonl")));
        let pid = i32::try_from(child.id()).expect("a process number");
        kill(Pid::from_raw(pid), signal).expect("a signal");
        let ended = end(child);
        assert_eq!(ended.status.code(), Some(130), "{signal}");
        // What was done is in the checkpoint: no error, and nothing to say with --quiet.
        let told = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(told, "", "{signal}");
        let step = run.step();
        assert!(
            (1..1000).contains(&step),
            "{signal}: stopped at step {step}"
        );
        assert!(run.logged_steps().iter().all(|logged| *logged <= step));
        let log = fs::read_to_string(run.path("run.log")).expect("a log");
        assert!(
            log.lines()
                .last()
                .is_some_and(|line| line.contains(&step.to_string())),
            "{log}"
        );
        let set = [
            "resume",
            name,
            "--quiet",
            "--backend",
            "flex",
            "--set",
            "checkpoint.every=25",
        ];
        place.on_one_thread(&set).succeeded();
        assert_same(&run, &whole);
    }
}

/// Without `--quiet` the last line says what to do, and is no error either.
#[cfg(unix)]
#[test]
fn an_interrupt_says_how_to_go_on() {
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    let _turn = turn();
    let place = Workplace::tiny(LONGER);
    let train = ["train", "recipe.toml", "--run", "run", "--backend", "flex"];
    let child = start(&place, &train);
    let metrics = place.run("run").path("metrics.jsonl");
    wait_until("a few steps", || holds_a_line(&metrics));
    let pid = i32::try_from(child.id()).expect("a process number");
    kill(Pid::from_raw(pid), Signal::SIGINT).expect("a signal");
    let ended = end(child);
    assert_eq!(ended.status.code(), Some(130));
    let told = String::from_utf8_lossy(&ended.stderr);
    let last = told.lines().last().expect("a line");
    assert!(last.contains("isomorph resume run"), "{told}");
    assert!(!told.contains("error:"), "{told}");
}

#[test]
fn a_run_in_training_is_locked_for_others_and_names_who_has_it() {
    let _turn = turn();
    let place = Workplace::tiny(LONGER);
    let mut first = start(&place, TRAIN);
    let run = place.run("run");
    wait_until("the first line of the metrics", || {
        holds_a_line(&run.path("metrics.jsonl"))
    });
    let again = [TRAIN, &["--force"]].concat();
    for second in [RESUME, &again] {
        let who = format!("process {}", first.id());
        place.isomorph(second).refused(2, &["in use", &who]);
    }
    first.kill().expect("SIGKILL");
    first.wait().expect("a child that was killed");
    // The lock has ended with its process.
    place.isomorph(RESUME).succeeded();
    assert_eq!(run.step(), 1000);
}

/// With these rates velocities grow beyond all numbers in the first steps, with most seeds.
const OVERFLOWS: &[&str] = &[
    "training.steps = 30",
    "training.learning-rate = 1",
    "training.velocity-learning-rate = 1",
    "training.clip = 0",
    "training.batch = 100",
    "training.correspondence-batch = 20",
    "implicit.depth = 2",
    "implicit.width = 8",
    "velocity.depth = 4",
    "velocity.width = 16",
    "data.points = 2000",
    "result.frames = 0",
    "checkpoint.every = 5",
];

#[test]
fn numbers_that_are_not_finite_end_a_run_or_take_it_back_with_smaller_rates() {
    let _turn = turn();
    let place = Workplace::tiny_with(&[], OVERFLOWS);
    let mut taken_back = 0;
    for seed in 0..5 {
        let seed = format!("training.seed={seed}");
        let set = ["--set", "preset=paper", "--set", &seed, "--force"];
        let train = [TRAIN, &set].concat();
        let ended = place.isomorph(&train);
        let run = place.run("run");
        if ended.code == Some(0) {
            continue;
        }
        ended.refused(1, &["step ", "checkpoint.step-backs"]);
        let back = ["--set", "checkpoint.step-backs=10"];
        place.isomorph(&[&train[..], &back].concat()).succeeded();
        assert_eq!(run.step(), 30, "{seed}");
        let log = fs::read_to_string(run.path("run.log")).expect("a log");
        let note = ", with half of all learning rates";
        let times = log.matches(note).count();
        assert!((1..=10).contains(&times), "{log}");
        let rate = format!("\nlearning-rate = {}\n", 0.5_f64.powi(times as i32));
        let recipe = fs::read_to_string(run.path("recipe.toml")).expect("a recipe");
        assert!(recipe.contains(&rate), "{rate} in {recipe}");
        taken_back += 1;
    }
    assert!(taken_back > 0, "no seed overflows");
}
