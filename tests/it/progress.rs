//! What is shown of a run in training: previews, and events for programs.

use std::collections::BTreeSet;
use std::fs;

use serde_json::Value;

use crate::support::workplace::{Workplace, names, turn};

/// A few steps.
const KEYS: &[&str] = &[
    "training.steps = 10",
    "training.log-every = 4",
    "checkpoint.every = 5",
];

/// Three small surfaces at the end.
const SURFACES: &[&str] = &["--set", "result.frames=3", "--set", "result.resolution=32"];

#[test]
fn previews_show_a_run_in_training_and_the_last_page_stands_still() {
    let _turn = turn();
    let keys = ["training.steps = 5", "result.preview-every = 2"];
    let place = Workplace::tiny(&keys);
    let run = place.train("run", &[]);
    assert_eq!(names(&run.path("meshes")), ["preview.png"]);
    let page = fs::read_to_string(run.path("report.html")).expect("a page");
    assert!(!page.contains("http-equiv=\"refresh\""));
    let log = fs::read_to_string(run.path("run.log")).expect("a log");
    assert!(!log.contains("no preview"), "{log}");
}

#[test]
fn events_are_json_lines_on_standard_output() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let words = ["train", "recipe.toml", "--json", "--run", "run"];
    let ended = place.isomorph(&[&words[..], SURFACES].concat()).succeeded();
    assert_eq!(ended.stderr, "");
    let events: Vec<Value> = ended
        .stdout
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let kinds: BTreeSet<&str> = events
        .iter()
        .map(|event| event["event"].as_str().expect("a kind"))
        .collect();
    for kind in [
        "started",
        "phase",
        "tick",
        "step",
        "checkpoint",
        "extracting",
        "extracted",
        "reported",
        "finished",
    ] {
        assert!(kinds.contains(kind), "no {kind}: {kinds:?}");
    }
    let last = events.iter().rfind(|event| event["event"] == "step");
    let last = last.expect("a step");
    assert_eq!(
        (last["step"].as_u64(), last["steps"].as_u64()),
        (Some(10), Some(10))
    );
    assert!(last["terms"]["data"]["weighted"].is_number(), "{last}");
    assert!(last.get("seconds_left").is_some(), "{last}");
}
