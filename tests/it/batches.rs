//! Many runs from one file of jobs, and where single runs stand.

use std::fs;
use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::run::json;
use crate::support::workplace::{Ended, Workplace, turn};

/// Keys of small runs, as a file of jobs has them.
const SMALL: &str = "set = [\"result.frames=2\", \"result.resolution=32\", \"data.points=1000\", \"spline.band=1000\", \
                     \"data.correspondences=same-vertices\"]\n";

/// Spheres, each longer than the one before, `shapes/s-K.ply`, and a file of jobs with more in it.
fn shapes(count: usize, more: &str) -> Workplace {
    let place = Workplace::new();
    fs::create_dir(place.path("shapes")).expect("a folder");
    for k in 0..count {
        let long = 1.0 + 0.1 * k as f64;
        let sphere = Mesh::sphere(1.0, 3).map(|[x, y, z]| [long * x, y, z]);
        place.write(&format!("shapes/s-{k}.ply"), ply::text(&sphere));
    }
    place.write("jobs.toml", format!("folder = \"out\"\n{SMALL}{more}"));
    place
}

fn batch(place: &Workplace, words: &[&str]) -> Ended {
    place.isomorph(&[&["batch"], words].concat())
}

/// The state of each job.
fn states(place: &Workplace) -> Vec<(String, String)> {
    let said = batch(place, &["status", "jobs.toml", "--json"])
        .succeeded()
        .stdout;
    let lines = said
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let word = |value: &Value| value.as_str().expect("text").to_owned();
    lines
        .map(|job| (word(&job["name"]), word(&job["state"])))
        .collect()
}

#[test]
fn all_pairs_are_done_once_and_one_that_fails_stops_nothing() {
    let _turn = turn();
    let bad = "[all-pairs]\nfiles = \"shapes/*.ply\"\n[[job]]\nname = \"bad\"\nsource = \"shapes/s-0.ply\"\ntarget = \"no.ply\"\n";
    let place = shapes(3, bad);
    let plan = batch(&place, &["plan", "jobs.toml"]).succeeded().stdout;
    assert!(plan.contains("4 jobs") && plan.contains("4 left"), "{plan}");
    assert!(states(&place).iter().all(|(_, state)| state == "waiting"));
    let ended = batch(&place, &["run", "jobs.toml", "-n", "2"]);
    assert_eq!(ended.code, Some(1), "{ended:?}");
    for said in [
        "bad failed: ",
        "no.ply: cannot be read",
        "3 done, 1 failed",
        "1 of 4 jobs failed",
    ] {
        assert!(ended.stderr.contains(said), "{}", ended.stderr);
    }
    let named: Vec<_> = states(&place);
    assert_eq!(
        named
            .iter()
            .map(|(name, state)| (&name[..], &state[..]))
            .collect::<Vec<_>>(),
        [
            ("bad", "failed"),
            ("s-0-s-1", "done"),
            ("s-0-s-2", "done"),
            ("s-1-s-2", "done")
        ]
    );
    let written = |name: &str| {
        let found = fs::metadata(place.path(&format!("out/{name}/report.html"))).expect("a page");
        found.modified().expect("a time")
    };
    let before = written("s-0-s-1");
    // The file is extended, what failed is mended, and what is done stays.
    place.write(
        "no.ply",
        fs::read(place.path("shapes/s-2.ply")).expect("a shape"),
    );
    let sphere = Mesh::sphere(1.0, 3).map(|[x, y, z]| [x, 2.0 * y, z]);
    place.write("shapes/s-3.ply", ply::text(&sphere));
    let ended = batch(&place, &["run", "jobs.toml"]).succeeded();
    assert!(
        ended.stderr.contains("7 done, 0 failed"),
        "{}",
        ended.stderr
    );
    assert_eq!(written("s-0-s-1"), before, "what is done is not done again");
    let collected = batch(&place, &["collect", "jobs.toml"]).succeeded().stdout;
    assert!(
        collected.starts_with("7 jobs, 7 done, 0 failed\n"),
        "{collected}"
    );
    let csv = fs::read_to_string(place.path("out/results.csv")).expect("a table");
    assert_eq!(csv.lines().count(), 8, "{csv}");
    assert!(
        csv.lines()
            .skip(1)
            .all(|line| line.contains(",done,18,18,")),
        "{csv}"
    );
    let columns = fs::read(place.path("out/results.parquet")).expect("a file");
    assert!(columns.starts_with(b"PAR1") && columns.ends_with(b"PAR1"));
    let listed = json(&place.path("out/results.json"));
    assert_eq!(listed.as_array().map(Vec::len), Some(7));
    let page = fs::read_to_string(place.path("out/index.html")).expect("a page");
    assert_eq!(page.matches("/report.html\">").count(), 7);
    assert_eq!(page.matches("/meshes/preview.png\"").count(), 7);
}

#[test]
fn shares_take_every_nth_job_and_together_all() {
    let _turn = turn();
    let place = shapes(3, "[all-pairs]\nfiles = \"shapes/*.ply\"\n");
    batch(&place, &["run", "jobs.toml", "--share", "1/2", "--quiet"]).succeeded();
    let done = |place: &Workplace| -> Vec<bool> {
        states(place)
            .iter()
            .map(|(_, state)| state == "done")
            .collect()
    };
    assert_eq!(done(&place), [false, true, false]);
    batch(&place, &["run", "jobs.toml", "--share", "0/2", "--quiet"]).succeeded();
    assert_eq!(done(&place), [true; 3]);
    let wrong = batch(&place, &["run", "jobs.toml", "--share", "2/2"]);
    assert_eq!(wrong.code, Some(2), "{wrong:?}");
    assert!(wrong.stderr.contains("must be I/N"), "{}", wrong.stderr);
}

#[test]
fn a_batch_that_is_stopped_goes_on_with_the_same_command() {
    let _turn = turn();
    let place = shapes(4, "[all-pairs]\nfiles = \"shapes/*.ply\"\n");
    let mut work = place
        .command(&["batch", "run", "jobs.toml", "-n", "1"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let begun = Instant::now();
    while !place.path("out/s-0-s-1/recipe.toml").exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "nothing began");
        std::thread::sleep(Duration::from_millis(20));
    }
    let process = nix::unistd::Pid::from_raw(work.id() as i32);
    nix::sys::signal::kill(process, nix::sys::signal::Signal::SIGTERM).expect("it runs");
    let ended = work.wait().expect("it ends");
    assert_eq!(ended.code(), Some(130), "as after Ctrl-C");
    assert!(
        states(&place).iter().any(|(_, state)| state != "done"),
        "it was stopped early"
    );
    batch(&place, &["run", "jobs.toml", "--quiet"]).succeeded();
    assert!(states(&place).iter().all(|(_, state)| state == "done"));
}

#[test]
fn the_script_of_an_array_names_its_tasks_and_what_was_asked_for() {
    let place = shapes(4, "[all-pairs]\nfiles = \"shapes/*.ply\"\n");
    let words = [
        "submit",
        "jobs.toml",
        "--dry-run",
        "--array-size",
        "4",
        "--throttle",
        "2",
        "--time",
        "1:00:00",
        "--mem",
        "2G",
        "--partition",
        "long",
        "--sbatch",
        "--account=lab",
    ];
    let script = batch(&place, &words).succeeded().stdout;
    for line in [
        "#!/bin/bash",
        "#SBATCH --array=0-3%2",
        "#SBATCH --time=1:00:00",
        "#SBATCH --mem=2G",
        "#SBATCH --partition=long",
        "#SBATCH --account=lab",
        "#SBATCH --requeue",
        "#SBATCH --signal=B:USR1@120",
        "# 6 jobs in 4 tasks: task i takes the jobs i, i + 4, ... What is done is not done again.",
    ] {
        assert!(
            script.lines().any(|found| found == line),
            "{line}: {script}"
        );
    }
    assert!(!place.path("out").exists(), "nothing is written");
}

#[test]
fn a_run_goes_on_if_it_is_there_and_a_finished_one_is_left_alone() {
    let _turn = turn();
    let place = shapes(2, "");
    let recipe = "preset = \"instant\"\n[data]\nsource = \"shapes/s-0.ply\"\ntarget = \"shapes/s-1.ply\"\npoints = 1000\n\
                  correspondences = \"same-vertices\"\n[spline]\nband = 1000\n[result]\nframes = 2\nresolution = 32\n";
    place.write("recipe.toml", recipe);
    let told = |place: &Workplace| -> Value {
        let said = place
            .isomorph(&["info", "run", "--json"])
            .succeeded()
            .stdout;
        serde_json::from_str(&said).expect("JSON")
    };
    assert_eq!(told(&place)["state"], "waiting");
    let train = ["train", "recipe.toml", "--run", "run", "--resume-if-exists"];
    place.isomorph(&train).succeeded();
    let first = told(&place);
    assert_eq!(
        (&first["state"], &first["step"]),
        (&"done".into(), &18.into())
    );
    let ended = place.isomorph(&train).succeeded();
    assert!(
        ended.stderr.contains("run: is finished already"),
        "{}",
        ended.stderr
    );
    // Without its last checkpoint it goes on, and ends where it was.
    let run = place.run("run");
    let networks = run.networks();
    fs::remove_dir_all(run.newest()).expect("a checkpoint");
    assert_eq!(told(&place)["state"], "interrupted");
    place.isomorph(&train).succeeded();
    assert_eq!(run.networks(), networks);
    place.write(
        "recipe.toml",
        recipe.replace("points = 1000", "points = 1001"),
    );
    place
        .isomorph(&train)
        .refused(2, &["another recipe", "data.points"]);
}
