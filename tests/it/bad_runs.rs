//! Runs that are taken, damaged, changed or out of room: one line that says where, what, and what to do,
//! exit status 2 for what another command line would mend and 1 for all else; what was there stays.

use std::fs;

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::run::{Run, copy_folder};
use crate::support::workplace::{Ended, Workplace, names, turn};

/// A run of a few steps in a place of its own.
fn trained() -> (Workplace, Run) {
    let place = Workplace::tiny(&["training.steps = 4", "checkpoint.every = 2"]);
    let run = place.train("run", &[]);
    (place, run)
}

#[test]
fn a_run_is_not_overwritten_without_force_and_force_replaces_nothing_but_a_run() {
    let _turn = turn();
    let (place, run) = trained();
    let before = run.networks();
    let train = [
        "train",
        "recipe.toml",
        "--quiet",
        "--set",
        "training.steps=2",
    ];
    let ended = place.isomorph(&[&train[..], &["--run", "run"]].concat());
    ended.refused(2, &["run: exists already", "isomorph resume", "--force"]);
    assert!(run.networks() == before, "the run changed");
    place
        .isomorph(&[&train[..], &["--run", "run", "--force"]].concat())
        .succeeded();
    assert_eq!((run.step(), run.checkpoints().len()), (2, 1));

    fs::create_dir(place.path("thesis")).expect("a folder");
    place.write("thesis/chapter.tex", "precious");
    let ended = place.isomorph(&[&train[..], &["--run", "thesis", "--force"]].concat());
    ended.refused(2, &["thesis: exists and is not a run", "another folder"]);
    let ended = place.isomorph(&[&train[..], &["--run", "thesis"]].concat());
    ended.refused(2, &["thesis: exists already", "another folder"]);
    assert_eq!(
        fs::read(place.path("thesis/chapter.tex")).expect("still there"),
        b"precious"
    );
}

#[test]
fn bad_data_does_not_cost_the_run_that_force_would_replace() {
    let _turn = turn();
    let (place, run) = trained();
    let before = run.networks();
    place.write("source.ply", "");
    let train = ["train", "recipe.toml", "--force", "--run", "run"];
    place.isomorph(&train).refused(1, &["the file is empty"]);
    assert!(run.networks() == before, "the run changed");
}

#[test]
fn a_damaged_checkpoint_is_refused_with_its_file_and_what_to_do() {
    let _turn = turn();
    let (place, run) = trained();
    let state = fs::read_to_string(run.newest().join("state.json")).expect("a state");
    let record = &run.networks()["velocity.mpk"];
    let mut flipped = record.clone();
    flipped[record.len() / 2] ^= 1;
    let later = state.replacen("\"format_version\": 1", "\"format_version\": 999", 1);
    let cases: [(&str, &[u8], &[&str]); 6] = [
        (
            "velocity.mpk",
            &record[..record.len() / 2],
            &["bytes", "damaged", "delete"],
        ),
        ("velocity.mpk", &[], &["0 bytes", "damaged"]),
        ("velocity.mpk", &flipped, &["checksum", "damaged"]),
        (
            "state.json",
            &state.as_bytes()[..state.len() / 2],
            &["damaged", "delete"],
        ),
        ("state.json", b"[]", &["damaged"]),
        (
            "state.json",
            later.as_bytes(),
            &["format version 999", "update isomorph"],
        ),
    ];
    for (file, content, parts) in cases {
        let copy = place.run("copy");
        copy_folder(&run.0, &copy.0);
        fs::write(copy.newest().join(file), content).expect("a file");
        let parts = [&[file], parts].concat();
        let more = ["resume", "copy", "--quiet", "--set", "training.steps=6"];
        place.isomorph(&more).refused(1, &parts);
        let recipe = |run: &Run| fs::read(run.path("recipe.toml")).expect("a recipe");
        assert!(recipe(&copy) == recipe(&run), "the recipe changed");
        place
            .isomorph(&["extract", "copy", "--quiet"])
            .refused(1, &parts);
        assert!(
            !copy.path("meshes").exists(),
            "surfaces of a damaged checkpoint"
        );
        // The cure that the message names.
        fs::remove_dir_all(copy.newest()).expect("a folder");
        place.isomorph(&more).succeeded();
        assert_eq!(copy.step(), 6);
        fs::remove_dir_all(&copy.0).expect("a folder");
    }
}

#[test]
fn a_checkpoint_with_a_missing_file_is_refused_with_its_name() {
    let _turn = turn();
    let (place, run) = trained();
    for file in ["velocity.mpk", "state.json"] {
        fs::remove_file(run.newest().join(file)).expect("a file");
        place
            .isomorph(&["extract", "run", "--quiet"])
            .refused(1, &[file, "No such file"]);
    }
}

#[test]
fn a_changed_network_is_refused_with_both_values_and_the_run_stays_as_it_is() {
    let _turn = turn();
    let (place, run) = trained();
    let recipe = fs::read_to_string(run.path("recipe.toml")).expect("a recipe");
    let before = run.networks();
    let ended = place.isomorph(&["resume", "run", "--quiet", "--set", "velocity.width=25"]);
    ended.refused(
        1,
        &[
            "velocity.width is 24 in the checkpoint and 25",
            "start a new run",
        ],
    );
    assert_eq!(
        fs::read_to_string(run.path("recipe.toml")).expect("a recipe"),
        recipe
    );
    assert!(run.networks() == before, "the run changed");
}

#[test]
fn a_run_does_not_go_on_with_other_shapes() {
    let _turn = turn();
    let (place, _run) = trained();
    place.write("target.ply", ply::text(&Mesh::sphere(2.0, 3)));
    let ended = place.isomorph(&["resume", "run", "--quiet", "--set", "training.steps=6"]);
    ended.refused(
        1,
        &[
            "the shapes are not those that this run was started with",
            "start a new run",
        ],
    );
}

#[test]
fn what_is_not_a_run_is_told_so() {
    let _turn = turn();
    let (place, run) = trained();
    for command in ["resume", "extract", "info"] {
        fs::create_dir_all(place.path("folder")).expect("a folder");
        place
            .isomorph(&[command, "folder"])
            .refused(2, &["folder: not a run", "name the folder"]);
    }
    place
        .isomorph(&["resume", "nowhere"])
        .refused(2, &["nowhere: not a run"]);
    place
        .isomorph(&["info", "nowhere"])
        .refused(1, &["nowhere"]);
    fs::remove_dir_all(run.path("checkpoints")).expect("a folder");
    place
        .isomorph(&["extract", "run", "--quiet"])
        .refused(1, &["no checkpoint"]);
}

#[test]
fn extraction_refuses_times_outside_and_a_grid_of_nothing() {
    let _turn = turn();
    let (place, run) = trained();
    for (times, found) in [("0.5,1.5", "time 1.5"), ("nan", "time NaN")] {
        let ended = place.isomorph(&["extract", "run", "--times", times]);
        ended.refused(2, &[found, "must be 0 to 1"]);
    }
    for bad in [
        ["--resolution", "0"],
        ["--frames", "0"],
        ["--times", "half"],
        ["--format", "stl"],
    ] {
        let ended = place.isomorph(&[&["extract", "run"][..], &bad].concat());
        assert_eq!(ended.code, Some(2), "{ended:?}");
        assert!(
            ended.stderr.contains(bad[0]) && ended.stderr.contains(bad[1]),
            "{ended:?}"
        );
    }
    let share = ["extract", "run", "--smallest-component", "1.5"];
    place
        .isomorph(&share)
        .refused(2, &["smallest component 1.5", "0 to 1"]);
    assert!(
        !run.path("meshes").exists(),
        "surfaces of a refused command"
    );
}

#[test]
fn training_that_diverges_names_the_term_the_step_and_the_cure() {
    let _turn = turn();
    // Gradients beyond any size, steep sines, and nothing that holds them.
    let place = Workplace::tiny(&[
        "training.steps = 400",
        "training.optimiser = \"adam\"",
        "training.guided-until = 0",
        "training.learning-rate = 1",
        "training.velocity-learning-rate = 1",
        "training.clip = 0",
        "training.log-every = 1",
        "implicit.activation = \"sine\"",
        "velocity.activation = \"sine\"",
        "implicit.beta = 1000",
        "velocity.beta = 1000",
        "checkpoint.every = 1",
    ]);
    let ended = place.isomorph(&["train", "recipe.toml", "--quiet", "--run", "run"]);
    ended.refused(1, &["step ", "not finite", "learning-rate", "step-backs"]);
    let run = place.run("run");
    let last = format!(
        "last good checkpoint {}",
        run.checkpoints().last().expect("one before it")
    );
    assert!(ended.stderr.contains(&last), "{}", ended.stderr);
}

/// A full disk, as any user can have one: files may not grow beyond 15 kB (30 blocks of 512 bytes), which
/// holds the recipe and not the records.
#[cfg(unix)]
#[test]
fn a_full_disk_is_told_and_leaves_nothing_under_a_final_name() {
    let _turn = turn();
    let place = Workplace::tiny(&["training.steps = 4"]);
    let limited = |arguments: &str| {
        let mut shell = std::process::Command::new("sh");
        // The signal's default would end the program before it sees the error.
        let line = format!("trap '' XFSZ; ulimit -f 30; exec \"$0\" {arguments}");
        shell
            .args(["-c", &line, env!("CARGO_BIN_EXE_isomorph")])
            .current_dir(place.path(""));
        Ended::from(shell.output().expect("a shell"))
    };
    let ended = limited("train recipe.toml --quiet --run run");
    ended.refused(1, &["run/checkpoints/step-000004", "File too large"]);
    let run = place.run("run");
    assert_eq!(run.checkpoints(), [""; 0], "half a checkpoint");
    // Once there is room, the run goes on.
    place.isomorph(&["resume", "run", "--quiet"]).succeeded();
    assert_eq!(run.step(), 4);

    let ended = limited("extract run --quiet --times 0 --resolution 32 -o surfaces");
    ended.refused(1, &["surfaces/surface-000.ply", "File too large"]);
    let left = names(&place.path("surfaces"));
    assert_eq!(left, [""; 0], "half a surface");
}

#[test]
fn a_run_without_a_surface_says_so_and_keeps_its_networks() {
    let _turn = turn();
    // The sphere that f starts from lies outside the box, and two steps do not bring it in.
    let place = Workplace::tiny(&["training.steps = 2", "implicit.sphere-radius = 9"]);
    let surfaces = ["--set", "result.frames=2", "--set", "result.resolution=32"];
    let train = ["train", "recipe.toml", "--quiet", "--run", "run"];
    let ended = place.isomorph(&[&train[..], &surfaces].concat());
    ended.refused(1, &["time 0: ", "no surface", "train longer"]);
    let run = place.run("run");
    assert_eq!(run.step(), 2);
    assert!(
        !run.path("meshes/frames.json").exists(),
        "a list of surfaces that are not there"
    );
    place
        .isomorph(&["extract", "run", "--quiet"])
        .refused(1, &["time 0: ", "no surface"]);
}
