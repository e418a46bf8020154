//! A run that stops and goes on ends in the same networks as one that never stopped.
//!
//! On one thread the networks are equal byte for byte, on each backend that runs on the CPU: batches and
//! learning rates are pure functions of the seed and the step, and checkpoints hold every bit of the
//! networks and of their optimisers.

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use crate::support::run::Run;
use crate::support::workplace::{Ended, Workplace, turn};

/// A run through all phases: warm-up to step 13, ramp to 16, joint to 28, implicit only to 40.
const KEYS: &[&str] = &[
    "training.steps = 40",
    "training.log-every = 3",
    "checkpoint.every = 4",
    "checkpoint.keep = 100",
    "training.warm-up = 0.32",
];

/// The steps that such a run logs: the first, every third, those of checkpoints, and the last.
fn logged(steps: u64, every: u64) -> Vec<u64> {
    (1..=steps)
        .filter(|step| *step == 1 || step % 3 == 0 || step % every == 0)
        .collect()
}

/// Both runs are the same in every network, every logged step and every logged term.
#[track_caller]
fn assert_same(resumed: &Run, whole: &Run) {
    assert_eq!(resumed.step(), whole.step());
    // Not assert_eq!, which would print them.
    assert!(
        resumed.networks() == whole.networks(),
        "the networks differ"
    );
    assert_eq!(resumed.metrics(), whole.metrics());
}

fn resume_on_one_thread(place: &Workplace, run: &str, backend: &str) -> Ended {
    place
        .on_one_thread(&["resume", run, "--quiet", "--backend", backend])
        .succeeded()
}

fn whole_on_one_thread(place: &Workplace, backend: &str) -> Run {
    let arguments = [
        "train",
        "recipe.toml",
        "--quiet",
        "--run",
        "whole",
        "--backend",
        backend,
    ];
    place.on_one_thread(&arguments).succeeded();
    place.run("whole")
}

#[test]
fn a_run_cut_at_any_checkpoint_and_resumed_equals_a_whole_one() {
    let _turn = turn();
    for backend in ["ndarray", "flex"] {
        let place = Workplace::tiny(KEYS);
        let whole = whole_on_one_thread(&place, backend);
        assert_eq!(whole.logged_steps(), logged(40, 4));
        // One in each phase, and the one before the last.
        for step in [4, 16, 24, 36] {
            let name = format!("cut-at-{step}");
            whole.cut_at(step, &place.run(&name));
            resume_on_one_thread(&place, &name, backend);
            assert_same(&place.run(&name), &whole);
        }
    }
}

#[test]
fn a_finished_run_that_is_resumed_stays_as_it_is() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let whole = whole_on_one_thread(&place, "flex");
    let (networks, metrics) = (whole.networks(), whole.metrics());
    resume_on_one_thread(&place, "whole", "flex");
    assert!(whole.networks() == networks, "the networks changed");
    assert_eq!(whole.metrics(), metrics);
}

/// Several threads may add in another order, which is what this test would see. Measured on two threads:
/// no difference at all, on ndarray or flex. No backend promises that, so what is held to is the
/// tolerance between backends.
#[test]
fn on_all_threads_a_resumed_run_ends_in_the_same_terms() {
    let _turn = turn();
    for backend in ["ndarray", "flex"] {
        let place = Workplace::tiny(KEYS);
        let whole = place.train("whole", &["--backend", backend]);
        whole.cut_at(20, &place.run("cut"));
        place
            .isomorph(&["resume", "cut", "--quiet", "--backend", backend])
            .succeeded();
        assert_last_terms_agree(&place.run("cut"), &whole);
    }
}

/// The terms of the last step agree to a thousandth of each: 40 times what was measured between backends.
#[track_caller]
fn assert_last_terms_agree(found: &Run, wanted: &Run) {
    let last = |run: &Run| run.metrics().pop().expect("at least one line");
    let (found, wanted) = (last(found), last(wanted));
    assert_eq!(
        (found.step, found.terms.len()),
        (wanted.step, wanted.terms.len())
    );
    for (name, wanted) in &wanted.terms {
        let off = (found.terms[name] - wanted).abs() / wanted.abs();
        println!("{name}: {off:.1e} off");
        assert!(
            off <= 1e-3,
            "{name}: {} instead of {wanted}",
            found.terms[name]
        );
    }
}

/// The backends round differently, and Adam amplifies that, since it divides by gradients near zero. The
/// worst that was measured is 2.6e-5 of a term, in the Eikonal one.
#[test]
fn a_run_begun_on_one_backend_goes_on_on_another_and_back() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let whole = place.train("whole", &["--backend", "ndarray"]);
    whole.cut_at(20, &place.run("moved"));
    for (backend, until, name) in [
        ("flex", 28, "flex"),
        ("wgpu", 32, "wgpu"),
        ("ndarray", 40, "ndarray"),
    ] {
        let moved = place.run("moved");
        place
            .isomorph(&["resume", "moved", "--quiet", "--backend", backend])
            .succeeded();
        assert_eq!(moved.step(), 40);
        let written_by = moved.state()["backend"]
            .as_str()
            .expect("a name")
            .to_owned();
        assert!(written_by.contains(name), "{written_by}");
        assert_last_terms_agree(&moved, &whole);
        if until < 40 {
            // The next backend goes on from a checkpoint that this one wrote.
            moved.cut_at(until, &place.run("next"));
            fs::remove_dir_all(&moved.0).expect("a folder");
            fs::rename(place.path("next"), &moved.0).expect("a folder");
        }
    }
}

#[test]
fn a_run_may_be_trained_for_longer_and_its_log_says_so() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let run = place.train("run", &["--backend", "flex"]);
    let more = [
        "resume",
        "run",
        "--backend",
        "flex",
        "--set",
        "training.steps=44",
    ];
    let ended = place.isomorph(&more).succeeded();
    assert_eq!((run.step(), run.logged_steps()), (44, logged(44, 4)));
    assert!(
        ended.stderr.contains("training.steps"),
        "the change is told: {}",
        ended.stderr
    );
    let log = fs::read_to_string(run.path("run.log")).expect("a log");
    assert!(
        log.contains("training.steps"),
        "the change is recorded: {log}"
    );
    // A later resume needs no --set: the run's recipe is the new one.
    place
        .isomorph(&["resume", "run", "--quiet", "--backend", "flex"])
        .succeeded();
    assert_eq!(run.step(), 44);
}

#[test]
fn what_a_torn_checkpoint_left_is_swept_away() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let whole = whole_on_one_thread(&place, "flex");
    let cut = place.run("cut");
    whole.cut_at(8, &cut);
    let torn = cut.path("checkpoints/.step-x7Gq2a");
    fs::create_dir(&torn).expect("a folder");
    fs::write(torn.join("implicit.mpk"), &whole.networks()[0][..1000]).expect("a torn file");
    resume_on_one_thread(&place, "cut", "flex");
    assert_eq!(cut.checkpoints(), whole.checkpoints());
    assert_same(&cut, &whole);
}

/// A run of a second or more that can be stopped in the middle.
const LONGER: &[&str] = &[
    "training.steps = 2000",
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
        .stderr(Stdio::null());
    command.spawn().expect("the program starts")
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
fn a_run_killed_again_and_again_ends_in_the_same_networks() {
    let _turn = turn();
    let place = Workplace::tiny(LONGER);
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
    assert_eq!(run.logged_steps(), logged(2000, 25));
    assert_eq!(
        run.checkpoints(),
        ["step-001975", "step-002000"],
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
        let mut child = start(&place, &[&train[..], &never].concat());
        let run = place.run(name);
        wait_until("a few steps", || holds_a_line(&run.path("metrics.jsonl")));
        let pid = i32::try_from(child.id()).expect("a process number");
        kill(Pid::from_raw(pid), signal).expect("a signal");
        assert_eq!(child.wait().expect("a child").code(), Some(130), "{signal}");
        let step = run.step();
        assert!(
            (1..2000).contains(&step),
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
