//! Shapes appended to a run: what is there stays, and the motion goes on.

use std::fs;

use serde_json::Value;

use crate::sequences::{SMALL, falling, mean_z};
use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::run::{Run, json};
use crate::support::sequence::Sequence;
use crate::support::workplace::{Workplace, turn};

/// A small recipe through the first shapes of a falling sphere.
fn recipe(preset: &str, times: &[u32]) -> String {
    let keys: Vec<String> = times
        .iter()
        .map(|time| format!("  {{ file = \"scan-{time}.ply\", time = {time} }},\n"))
        .collect();
    format!(
        "preset = \"{preset}\"\n[data]\npoints = 2000\ncorrespondences = \"same-vertices\"\n\
         keyframe = [\n{}]\n[result]\nframes = 0\n[checkpoint]\nevery = 4\nkeep = 99\n",
        keys.concat()
    )
}

/// Small networks; `quick` in few steps.
const NETWORKS: &str = "[training]\nsteps = 240\nbatch = 600\n[implicit]\nwidth = 48\ndepth = 3\n\
                        [velocity]\nwidth = 48\ndepth = 3\n";

fn state(run: &Run, step: u64) -> Value {
    json(&run.path(&format!("checkpoints/step-{step:06}/state.json")))
}

/// Where the first shape's points are at a time, in the mean.
fn carried_to(place: &Workplace, run: &str, time: &str) -> f64 {
    let out = format!("carried-{time}");
    let extract = [
        "extract", run, "--times", time, "--carry", "-o", &out, "--quiet",
    ];
    let small = ["--resolution", "32"];
    place.isomorph(&[&extract[..], &small].concat()).succeeded();
    mean_z(&ply::Ply::read(&place.path(&out).join("carried-000.ply")).mesh())
}

#[test]
fn splines_go_on_to_a_shape_that_is_appended() {
    let _turn = turn();
    let place = falling(&[0, 1, 2, 3]);
    place.write("recipe.toml", recipe("instant", &[0, 1]));
    let train = ["train", "recipe.toml", "--run", "run", "--quiet"];
    place.isomorph(&[&train[..], &SMALL].concat()).succeeded();
    let run = place.run("run");
    let before = state(&run, 18);
    let ended = place
        .isomorph(&["resume", "run", "--append", "scan-2.ply"])
        .succeeded();
    let said = [
        "step 28 of 28",
        "3 key frames of",
        "training.steps: 18 -> 28",
    ];
    for said in said {
        assert!(ended.stderr.contains(said), "{said}: {}", ended.stderr);
    }
    // A recipe with more key frames is no reason to train anew.
    place.write("recipe.toml", recipe("instant", &[0, 1, 2, 3]));
    let again = ["train", "recipe.toml", "--run", "run", "--resume-if-exists"];
    let ended = place.isomorph(&[&again[..], &SMALL].concat());
    ended.refused(2, &["another recipe", "resume RUN --append FILE"]);
    // Lengths and places are as they were.
    let after = state(&run, 28);
    assert_eq!(after["normalisation"], before["normalisation"]);
    assert_eq!(after["grown"]["known"], 2);
    for (time, wanted) in [("1", -0.05), ("1.5", -0.1125), ("2", -0.2)] {
        let found = carried_to(&place, "run", time);
        assert!((found - wanted).abs() < 0.01, "{time}: {found}, {wanted}");
    }
    // And again: its time follows by itself.
    place
        .isomorph(&["resume", "run", "--append", "scan-3.ply", "--quiet"])
        .succeeded();
    let last = state(&run, 38);
    assert_eq!(last["normalisation"], before["normalisation"]);
    let info = place.isomorph(&["info", "run"]).succeeded().stdout;
    let lines = [
        "key frames   4, at 0 to 3\n",
        "appended     1 of them after step 28\n",
        "V            splines, in cells of 0.15, normalised\n",
    ];
    for line in lines {
        assert!(info.contains(line), "{line}: {info}");
    }
    let found = carried_to(&place, "run", "2.5");
    assert!((found + 0.3125).abs() < 0.01, "{found}");
    // What finished is finished.
    place.isomorph(&["resume", "run", "--quiet"]).succeeded();
    assert_eq!(run.step(), 38);
}

#[test]
fn a_run_that_was_killed_while_it_grew_ends_in_the_same_state() {
    let _turn = turn();
    for (preset, more) in [("instant", ""), ("quick", NETWORKS)] {
        let place = falling(&[0, 1, 2, 3]);
        let text = recipe(preset, &[0, 1, 2]) + more;
        place.write("recipe.toml", text.replace("every = 4", "every = 5"));
        let mut train = vec!["train", "recipe.toml", "--run", "run", "--quiet"];
        if preset == "instant" {
            train.extend(SMALL);
        }
        place.isomorph(&train).succeeded();
        let run = place.run("run");
        let first = run.step();
        // Networks that are not done keep nothing that is worth keeping.
        if preset == "quick" {
            let half = place.run("half");
            run.cut_at(100, &half);
            let append = ["resume", "half", "--append", "scan-3.ply"];
            let ended = place.isomorph(&append);
            ended.refused(2, &["step-000100: step 100 of 240", "to its end before"]);
        }
        // Twice 240 steps over two intervals would be 240: fewer will do.
        let fewer = ["--set", "training.steps=270"];
        let fewer = if more.is_empty() { &[][..] } else { &fewer };
        let append = ["resume", "run", "--append", "scan-3.ply", "--quiet"];
        place.isomorph(&[&append[..], fewer].concat()).succeeded();
        let wanted = run.networks();
        assert!(run.step() > first + 5);
        // Before its first checkpoint with the new shape, and after it.
        for step in [first, first + 5] {
            let name = format!("cut-{step}");
            let cut = place.run(&name);
            run.cut_at(step, &cut);
            place.isomorph(&["resume", &name, "--quiet"]).succeeded();
            assert_eq!(cut.step(), run.step());
            assert!(cut.networks() == wanted, "{preset}, cut at {step}");
        }
    }
}

#[test]
fn networks_keep_their_shapes_and_learn_the_motion_to_the_new_one() {
    let _turn = turn();
    let place = falling(&[0, 1, 2, 3]);
    place.write("recipe.toml", recipe("quick", &[0, 1, 2]) + NETWORKS);
    let train = ["train", "recipe.toml", "--run", "run", "--quiet"];
    place.isomorph(&train).succeeded();
    let run = place.run("run");
    let before = run.networks();
    place
        .isomorph(&["resume", "run", "--append", "scan-3.ply", "--quiet"])
        .succeeded();
    // Twice the steps of an interval.
    assert_eq!(run.step(), 480);
    let after = run.networks();
    for k in 0..3 {
        let file = format!("end-{k:04}.mpk");
        assert!(before[&file] == after[&file], "{file} changed");
    }
    assert!(after.contains_key("end-0003.mpk") && before["velocity.mpk"] != after["velocity.mpk"]);
    for (time, wanted) in [
        ("1", -0.05),
        ("1.5", -0.1125),
        ("2.5", -0.3125),
        ("3", -0.45),
    ] {
        let found = carried_to(&place, "run", time);
        assert!((found - wanted).abs() < 0.02, "{time}: {found}, {wanted}");
    }
}

#[test]
fn frames_of_a_sequence_are_appended_by_their_numbers() {
    let _turn = turn();
    let place = Workplace::new();
    let fallen =
        |k: u32| Mesh::sphere(1.0, 3).map(|x| [x[0], x[1], x[2] - 0.05 * f64::from(k * k)]);
    place.write("fall.anime", Sequence((0..3).map(fallen).collect()).anime());
    place.write("other.ply", ply::text(&fallen(3)));
    place.write(
        "recipe.toml",
        "preset = \"instant\"\n[data]\nsequence = \"fall.anime\"\nkeys = [0, 1]\n\
         correspondences = \"same-vertices\"\n[result]\nframes = 0\n",
    );
    let train = ["train", "recipe.toml", "--run", "run", "--quiet"];
    place.isomorph(&[&train[..], &SMALL].concat()).succeeded();
    let append = ["resume", "run", "--append", "other.ply"];
    let ended = place.isomorph(&append);
    ended.refused(
        2,
        &["other.ply", "frames of a sequence", "--set \"data.keys="],
    );
    let set = ["resume", "run", "--set", "data.keys=[0,1,2]", "--quiet"];
    place.isomorph(&set).succeeded();
    assert_eq!(place.run("run").step(), 28);
    let found = carried_to(&place, "run", "1.5");
    assert!((found + 0.1125).abs() < 0.01, "{found}");
}

#[test]
fn shapes_that_were_laid_onto_each_other_and_points_of_a_table_stay() {
    let _turn = turn();
    let place = falling(&[0, 1, 2, 3]);
    let count = Mesh::sphere(1.0, 3).vertices.len();
    let table: String = (0..count).map(|k| format!("{k},{k},{k}\n")).collect();
    place.write("points.csv", "a,b,c\n".to_owned() + &table);
    let text = recipe("instant", &[0, 1, 2]).replace("same-vertices", "points.csv");
    place.write(
        "recipe.toml",
        text.replace("points = 2000", "points = 2000\nalign = \"rigid\""),
    );
    let train = ["train", "recipe.toml", "--run", "run", "--quiet"];
    place.isomorph(&[&train[..], &SMALL].concat()).succeeded();
    let append = ["resume", "run", "--append", "scan-3.ply", "--quiet"];
    let pairs = ["--pairs", "same-vertices"];
    place.isomorph(&[&append[..], &pairs].concat()).succeeded();
    for (time, wanted) in [("1.5", -0.1125), ("3", -0.45)] {
        let found = carried_to(&place, "run", time);
        assert!((found - wanted).abs() < 0.02, "{time}: {found}, {wanted}");
    }
}

#[test]
fn what_cannot_be_appended_leaves_the_run_as_it_was() {
    let _turn = turn();
    let place = falling(&[0, 1, 2]);
    place.write("recipe.toml", recipe("instant", &[0, 1]));
    let train = ["train", "recipe.toml", "--run", "run", "--quiet"];
    place.isomorph(&[&train[..], &SMALL].concat()).succeeded();
    let run = place.run("run");
    let files = || {
        let text = fs::read(run.path("recipe.toml")).expect("a recipe");
        (
            text,
            run.checkpoints(),
            fs::read(run.path("metrics.jsonl")).expect("a log"),
        )
    };
    let before = files();
    place.write("pairs.csv", "source_index,target_index\n0,99999\n");
    for (given, code, parts) in [
        (
            &["scan-2.ply", "--times", "1"][..],
            2,
            &["its time 1 is not after 1"][..],
        ),
        (
            &["scan-2.ply", "--times", "2,3"],
            2,
            &["2 times for 1 shapes"],
        ),
        (&["scan-9.ply"], 1, &["scan-9.ply"]),
        (
            &["scan-2.ply", "--pairs", "samevertices"],
            2,
            &["samevertices", "same-vertices"],
        ),
        (
            &["scan-2.ply", "--pairs", "pairs.csv"],
            1,
            &["pairs.csv", "99999"],
        ),
        (
            &["scan-2.ply", "--set", "preset=quick"],
            1,
            &["a run keeps its method"],
        ),
    ] {
        let append = ["resume", "run", "--quiet", "--append"];
        place
            .isomorph(&[&append[..], given].concat())
            .refused(code, parts);
        assert!(files() == before, "{given:?} changed the run");
    }
}
