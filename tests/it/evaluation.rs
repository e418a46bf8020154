//! `evaluate`: the numbers of a run against a true sequence, their JSON, and what it refuses.

use std::collections::BTreeSet;
use std::fs;

use serde_json::Value;

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::run::{Run, json};
use crate::support::sequence::Sequence;
use crate::support::workplace::{Ended, Workplace, names, turn};

/// Few steps: what is held here is how a run is measured, not how good it is.
const KEYS: &[&str] = &["training.steps = 10"];

/// What every evaluation here is called with: coarse, so that it takes a second.
const COARSE: &[&str] = &["--samples", "1000", "--resolution", "24"];

/// A run on the ends of the tiny sequence, and the sequence as the folder `truth`.
fn trained() -> (Workplace, Run) {
    let place = Workplace::tiny(KEYS);
    let sequence = Sequence::tiny();
    sequence.write_folder(&place, "truth");
    // The same numbers as in the sequence.
    place.write("source.ply", ply::text(&sequence.0[0]));
    place.write("target.ply", ply::text(&sequence.0[4]));
    let run = place.train("run", &[]);
    (place, run)
}

fn evaluate(place: &Workplace, truth: &str, [from, to]: [&str; 2], more: &[&str]) -> Ended {
    let fixed = [
        "evaluate",
        "run",
        "--ground-truth",
        truth,
        "--from",
        from,
        "--to",
        to,
    ];
    place.isomorph(&[&fixed, COARSE, more].concat())
}

fn keys(value: &Value) -> BTreeSet<&str> {
    let object = value.as_object().expect("an object");
    object.keys().map(String::as_str).collect()
}

fn number(value: &Value, name: &str) -> f64 {
    let found = value[name].as_f64();
    found.unwrap_or_else(|| panic!("{name} is no number in {value}"))
}

/// Of every surface that is compared with the truth.
const METRICS: [&str; 11] = [
    "time",
    "chamfer",
    "chamfer_squared",
    "hausdorff",
    "hausdorff_squared",
    "hausdorff95",
    "normal_consistency",
    "volume_ratio",
    "area_ratio",
    "components",
    "outside_largest",
];

/// Holds metrics to these fields and no others, all of them finite numbers: JSON has no word for the others.
#[track_caller]
fn assert_metrics(value: &Value, more: &[&str]) {
    let wanted: BTreeSet<&str> = METRICS.iter().chain(more).copied().collect();
    let mut found = keys(value);
    found.remove("aligned");
    assert_eq!(found, wanted);
    for name in wanted {
        let number = number(value, name);
        assert!(number.is_finite() && number >= 0.0, "{name} = {number}");
    }
    let (plain, squared) = (number(value, "chamfer"), number(value, "chamfer_squared"));
    // The mean of squares is at least the square of the mean, in both directions together.
    assert!(
        squared >= 2.0 * plain * plain * (1.0 - 1e-12),
        "{squared} of {plain}"
    );
    assert!(number(value, "hausdorff") >= number(value, "hausdorff95"));
    assert!(number(value, "hausdorff95") >= 0.5 * plain);
}

/// Holds a frame, or the mean of frames, to what is documented.
#[track_caller]
fn assert_frame(frame: &Value, more: &[&str]) {
    let kinds = ["surface", "carried", "linear", "floor"];
    let wanted: BTreeSet<&str> = kinds.iter().chain(more).copied().collect();
    assert_eq!(keys(frame), wanted);
    for (kind, own) in [
        ("surface", "slope_error"),
        ("carried", "tracked_rmse"),
        ("linear", "tracked_rmse"),
    ] {
        assert_metrics(&frame[kind], &[own]);
        assert_metrics(&frame[kind]["aligned"], &[own]);
        assert!(frame[kind]["aligned"].get("aligned").is_none());
    }
    assert_metrics(&frame["floor"], &[]);
    assert!(frame["floor"].get("aligned").is_none());
}

/// A field more or less is a change of the format, which others read.
#[test]
fn the_json_of_an_evaluation_has_the_fields_that_are_documented_and_no_others() {
    let _turn = turn();
    let (place, run) = trained();
    let ended = evaluate(&place, "truth", ["0", "4"], &["--json"]).succeeded();
    let value: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert_eq!(keys(&value), BTreeSet::from(["frames", "mean", "ends"]));
    assert_frame(&value["mean"], &[]);
    let ends = value["ends"].as_array().expect("a list");
    assert_eq!(ends.len(), 2);
    for (end, (frame, time)) in ends.iter().zip([(0, 0.0), (4, 1.0)]) {
        assert_frame(end, &["frame", "time"]);
        assert_eq!((&end["frame"], number(end, "time")), (&frame.into(), time));
    }
    let frames = value["frames"].as_array().expect("a list");
    assert_eq!(frames.len(), 3);
    let mut aligned_before = 0.0;
    for (frame, wanted) in frames.iter().zip(1..) {
        assert_frame(frame, &["frame", "time"]);
        let time = f64::from(wanted) / 4.0;
        assert_eq!(
            (&frame["frame"], number(frame, "time")),
            (&Value::from(wanted), time)
        );
        assert_eq!(number(&frame["surface"], "time"), time);
        // The best times are in the order of the frames, on a grid of 129.
        let aligned = number(&frame["surface"]["aligned"], "time");
        assert!(
            aligned >= aligned_before && (aligned * 128.0).fract() == 0.0,
            "{aligned}"
        );
        aligned_before = aligned;
    }
    let mean = frames
        .iter()
        .map(|frame| number(&frame["carried"], "chamfer"))
        .sum::<f64>()
        / 3.0;
    // Three additions in float64, in whatever order.
    assert!((number(&value["mean"]["carried"], "chamfer") / mean - 1.0).abs() < 1e-12);
    let kept = fs::read_to_string(run.path("evaluation.json")).expect("a file");
    assert_eq!(kept, ended.stdout, "the run keeps what is printed");
}

#[test]
fn straight_lines_are_exact_for_a_sphere_that_moves_and_so_at_the_floor() {
    let _turn = turn();
    let (place, _run) = trained();
    let ended = evaluate(&place, "truth", ["0", "4"], &["--json"]).succeeded();
    let value: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    for frame in value["frames"].as_array().expect("a list") {
        let (linear, floor) = (&frame["linear"], &frame["floor"]);
        // Coordinates below 1 in float32: 6e-8 each.
        assert!(number(linear, "tracked_rmse") < 2e-7, "{linear}");
        for ratio in ["volume_ratio", "area_ratio"] {
            assert!((number(linear, ratio) - 1.0).abs() < 1e-6, "{linear}");
        }
        // Means over 2000 distances whose standard deviation is half their mean: 1.2 % of it each.
        let off = number(linear, "chamfer") / number(floor, "chamfer") - 1.0;
        assert!(off.abs() < 0.08, "{off} off the floor");
        // 1000 samples of an area of 1 are 1 / (2 sqrt 1000) from a point of it on average.
        let expected = 0.5 / 1000_f64.sqrt();
        let off = number(floor, "chamfer") / expected - 1.0;
        assert!(off.abs() < 0.08, "the floor is {off} off what is expected");
    }
}

/// A power of two scales every coordinate, area and length without rounding.
#[test]
fn the_unit_of_the_coordinates_changes_no_number() {
    let _turn = turn();
    let [metres, millimetres] = [1.0, 1024.0].map(|unit| {
        let place = Workplace::tiny(KEYS);
        let sequence = Sequence::tiny().map(|x| x.map(|part| unit * part));
        sequence.write_folder(&place, "truth");
        place.write("source.ply", ply::text(&sequence.0[0]));
        place.write("target.ply", ply::text(&sequence.0[4]));
        let train = ["train", "recipe.toml", "--quiet", "--run", "run"];
        place.on_one_thread(&train).succeeded();
        let evaluate = [
            "evaluate",
            "run",
            "--ground-truth",
            "truth",
            "--from",
            "0",
            "--to",
            "4",
        ];
        let more = ["--every", "2", "--json"];
        place
            .on_one_thread(&[&evaluate, COARSE, &more].concat())
            .succeeded()
            .stdout
    });
    assert_eq!(metres, millimetres);
    let value: Value = serde_json::from_str(&metres).expect("JSON");
    let frames = value["frames"].as_array().expect("a list");
    assert_eq!(frames.len(), 1, "--every 2");
    assert_eq!(frames[0]["frame"], 2);
    // The sphere is half a radius from its source here; the radius of a sphere of area 1 is 0.28. A run of
    // ten steps has hardly moved: less than half the way, in whichever direction.
    let way = 0.5 / (4.0 * std::f64::consts::PI).sqrt();
    let behind = number(&value["mean"]["carried"], "tracked_rmse");
    assert!(
        (0.5 * way..1.5 * way).contains(&behind),
        "{behind} of {way}"
    );
}

#[test]
fn an_anime_file_and_a_folder_of_meshes_are_the_same_truth() {
    let _turn = turn();
    let (place, _run) = trained();
    place.write("truth.anime", Sequence::tiny().anime());
    let [folder, file] = ["truth", "truth.anime"].map(|truth| {
        let json = ["--json", "--every", "2"];
        evaluate(&place, truth, ["0", "4"], &json)
            .succeeded()
            .stdout
    });
    assert_eq!(folder, file);
}

#[test]
fn without_json_the_means_are_a_table_on_stdout() {
    let _turn = turn();
    let (place, run) = trained();
    let ended = evaluate(&place, "truth", ["0", "4"], &[]).succeeded();
    assert_eq!(ended.stderr, "", "a bar for nobody");
    let mean = json(&run.path("evaluation.json"))["mean"].clone();
    let row = |name: &str| {
        let line = ended
            .stdout
            .lines()
            .find(|line| line.split("  ").next() == Some(name));
        let line = line.unwrap_or_else(|| panic!("no row {name} in\n{}", ended.stdout));
        let cells = line.trim_start_matches(name).split_whitespace();
        let cells = cells.map(str::to_owned);
        cells.collect::<Vec<_>>()
    };
    for (name, metrics) in [
        ("surface", &mean["surface"]),
        ("surface, aligned", &mean["surface"]["aligned"]),
        ("carried", &mean["carried"]),
        ("carried, aligned", &mean["carried"]["aligned"]),
        ("linear", &mean["linear"]),
        ("floor", &mean["floor"]),
    ] {
        let cells = row(name);
        assert_eq!(
            cells[0],
            format!("{:.4}", 1e3 * number(metrics, "chamfer_squared")),
            "{name}"
        );
        assert_eq!(
            cells[1],
            format!("{:.5}", number(metrics, "chamfer")),
            "{name}"
        );
        let tracked = metrics.get("tracked_rmse").and_then(Value::as_f64);
        let tracked = tracked.map_or_else(|| "-".to_owned(), |rmse| format!("{rmse:.5}"));
        assert_eq!(cells.last(), Some(&tracked), "{name}");
    }
}

#[test]
fn frames_that_are_not_there_or_out_of_order_are_a_mistake_of_the_command_line() {
    let _turn = turn();
    let (place, run) = trained();
    let before = names(&run.0);
    for [from, to] in [["3", "1"], ["2", "2"], ["0", "1"], ["0", "9"], ["7", "9"]] {
        let asked = format!("frames {from} to {to}");
        let ended = evaluate(&place, "truth", [from, to], &[]);
        ended.refused(2, &["truth: ", &asked, "frames 0 to 4"]);
    }
    for [flag, found] in [["--samples", "5"], ["--every", "0"], ["--resolution", "4"]] {
        let fixed = [
            "evaluate",
            "run",
            "--ground-truth",
            "truth",
            "--from",
            "0",
            "--to",
            "4",
        ];
        let ended = place.isomorph(&[&fixed[..], &[flag, found]].concat());
        assert_eq!(ended.code, Some(2), "{ended:?}");
        assert!(
            ended.stderr.contains(flag) && ended.stderr.contains(found),
            "{ended:?}"
        );
    }
    assert_eq!(names(&run.0), before, "left behind by refused commands");
}

#[test]
fn another_sequence_than_that_of_the_run_is_refused() {
    let _turn = turn();
    let (place, run) = trained();
    let before = names(&run.0);
    // The right sequence and the wrong frames.
    let parts = ["truth: frame 3 is not the run's target", "name the frames"];
    evaluate(&place, "truth", ["0", "3"], &[]).refused(1, &parts);
    // Centimetres instead of metres, say.
    let large = Sequence::tiny().map(|x| x.map(|part| 100.0 * part));
    large.write_folder(&place, "large");
    let parts = ["large: frame 0 is not the run's source", "coordinates"];
    evaluate(&place, "large", ["0", "4"], &[]).refused(1, &parts);
    assert_eq!(names(&run.0), before, "left behind by refused commands");
}

#[test]
fn what_is_no_sequence_of_one_mesh_is_told_so() {
    let _turn = turn();
    let (place, run) = trained();
    let before = names(&run.0);
    let sequence = Sequence::tiny();
    let two = Sequence(sequence.0[..2].to_vec());
    two.write_folder(&place, "two");
    let mut other = sequence.clone();
    other.0[2] = Mesh::sphere(1.0, 2);
    other.write_folder(&place, "other");
    sequence.write_folder(&place, "cloud");
    place.write("cloud/frame-1.ply", ply::cloud(&sequence.0[1].vertices));
    fs::create_dir(place.path("empty")).expect("a folder");
    let anime = sequence.anime();
    place.write("torn.anime", &anime[..anime.len() - 100]);
    let cases: [(&str, &[&str]); 7] = [
        ("two", &["two: 2 frames", "at least 3"]),
        (
            "other",
            &[
                "frame-2.ply: 66 vertices instead of the 258",
                "frame-0.ply",
                "the same vertices",
            ],
        ),
        ("cloud", &["frame-1.ply: a point cloud", "meshes"]),
        ("empty", &["empty: 0 frames", "at least 3"]),
        ("torn.anime", &["torn.anime: ", "bytes"]),
        (
            "source.ply",
            &["source.ply: is not a sequence", ".anime", "folder"],
        ),
        ("nowhere", &["nowhere: cannot be read", "No such file"]),
    ];
    for (truth, parts) in cases {
        evaluate(&place, truth, ["0", "4"], &[]).refused(1, parts);
    }
    assert_eq!(names(&run.0), before, "left behind by refused commands");
}

#[test]
fn only_a_run_with_a_checkpoint_can_be_measured() {
    let _turn = turn();
    let (place, run) = trained();
    let command = |run| {
        [
            "evaluate",
            run,
            "--ground-truth",
            "truth",
            "--from",
            "0",
            "--to",
            "4",
        ]
    };
    for folder in ["truth", "nowhere"] {
        let told = format!("{folder}: not a run");
        place
            .isomorph(&command(folder))
            .refused(2, &[&told, "name the folder"]);
    }
    fs::remove_dir_all(run.path("checkpoints")).expect("a folder");
    place
        .isomorph(&command("run"))
        .refused(1, &["no checkpoint"]);
    assert!(!run.path("evaluation.json").exists(), "numbers of nothing");
}
