//! `view`: the page of a run, made where it is missing or old, and what it refuses.

use std::fs;
use std::time::{Duration, SystemTime};

use serde_json::Value;

use crate::support::ply;
use crate::support::sequence::Sequence;
use crate::support::workplace::{Workplace, turn};

const KEYS: &[&str] = &["training.steps = 10", "training.log-every = 4"];

/// What the page holds of the run.
fn described(html: &str) -> Value {
    let (_, rest) = html.split_once("id=\"run\">").expect("data");
    let (text, _) = rest.split_once("</script>").expect("its end");
    serde_json::from_str(text).expect("JSON")
}

fn lengths(list: &Value) -> usize {
    list.as_array().expect("a list").len()
}

#[test]
fn a_page_is_made_where_none_is_and_again_where_the_run_is_newer() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let run = place.train("run", &[]);
    let page = run.path("report.html");
    assert!(!page.exists(), "no surfaces were asked for, so no page");
    let view = ["view", "run", "--no-browser"];
    let ended = place.isomorph(&view).succeeded();
    assert_eq!(ended.stdout.trim(), "run/report.html");
    let html = fs::read_to_string(&page).expect("a page");
    let found = described(&html);
    // Found for the page alone, five of them.
    assert_eq!(lengths(&found["surfaces"]), 5);
    assert_eq!(lengths(&found["quality"]), 5);
    let values = &found["surfaces"][2]["values"];
    assert!(
        values["consistency"]["most"]
            .as_f64()
            .is_some_and(|most| most > 0.0),
        "{values}"
    );
    assert!(values.get("truth").is_none(), "there is no ground truth");
    assert_eq!(found["training"]["steps"].to_string(), "[1,4,8,10]");
    assert_eq!(lengths(&found["carried"]["times"]), 25);
    assert!(
        found["recipe"]
            .as_str()
            .is_some_and(|text| text.contains("steps = 10"))
    );
    // A page that is newer than the run stays.
    let changed = || {
        fs::metadata(&page)
            .and_then(|found| found.modified())
            .expect("a time")
    };
    let before = changed();
    place.isomorph(&view).succeeded();
    assert_eq!(changed(), before);
    let old = SystemTime::now() - Duration::from_secs(3600);
    let file = fs::File::options().write(true).open(&page).expect("a page");
    file.set_modified(old).expect("a time");
    place.isomorph(&view).succeeded();
    assert!(changed() > old, "the run is newer");
}

#[test]
fn a_page_shows_the_surfaces_of_the_run_and_their_distance_to_the_truth() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let sequence = Sequence::tiny();
    sequence.write_folder(&place, "truth");
    place.write("source.ply", ply::text(&sequence.0[0]));
    place.write("target.ply", ply::text(&sequence.0[4]));
    place.train(
        "run",
        &["--set", "result.frames=3", "--set", "result.resolution=32"],
    );
    let html = fs::read_to_string(place.path("run/report.html")).expect("a page");
    let found = described(&html);
    assert_eq!(lengths(&found["surfaces"]), 3);
    let log = fs::read_to_string(place.path("run/run.log")).expect("a log");
    assert!(log.contains("report: run/report.html"), "{log}");
    let truth = ["--ground-truth", "truth", "--from", "0", "--to", "4"];
    let view = ["view", "run", "--no-browser"];
    place.isomorph(&[&view[..], &truth].concat()).succeeded();
    let html = fs::read_to_string(place.path("run/report.html")).expect("a page");
    let found = described(&html);
    for (k, row) in found["quality"]
        .as_array()
        .expect("rows")
        .iter()
        .enumerate()
    {
        let mean = row["truth"].as_f64().expect("a mean distance");
        let most = found["surfaces"][k]["values"]["truth"]["most"].as_f64();
        // Normalised, of spheres of radius 0.28 that are less than a diameter apart.
        assert!(mean > 0.0 && mean < 0.3, "{mean}");
        assert!(most.is_some_and(|most| most > 0.0), "{most:?}");
    }
    let others = ["--ground-truth", "truth", "--from", "1", "--to", "4"];
    let ended = place.isomorph(&[&view[..], &others].concat());
    assert_ne!(ended.code, Some(0), "frame 1 is not the source: {ended:?}");
}

#[test]
fn what_is_no_run_has_no_page() {
    let place = Workplace::tiny(KEYS);
    let ended = place.isomorph(&["view", "nothing", "--no-browser"]);
    ended.refused(2, &["nothing", "not a run"]);
}
