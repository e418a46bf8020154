//! What the methods cannot do, or not here: one line that says so, before anything is lost.

use std::fs;

use crate::methods::{EXTRACT, METHODS, named};
use crate::support::command::with;
use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::workplace::{names, turn};

#[test]
fn a_method_that_moves_no_points_refuses_to_carry_any() {
    let _turn = turn();
    for method in METHODS.into_iter().filter(|method| !method.has_motion) {
        let name = method.name;
        let (place, run) = method.trained();
        let refused = ["moves no points"];
        let elsewhere = with(EXTRACT, &["--carry", "-o", "out"]);
        place.isomorph(&elsewhere).refused(1, &refused);
        assert!(
            !place.path("out").exists(),
            "{name}: left by a refused command"
        );
        // What was extracted before stays a whole folder.
        place.isomorph(&with(EXTRACT, &[])).succeeded();
        let before = names(&run.path("meshes"));
        place
            .isomorph(&with(EXTRACT, &["--carry"]))
            .refused(1, &refused);
        assert_eq!(names(&run.path("meshes")), before, "{name}");
    }
}

#[test]
fn what_a_method_lacks_is_told_before_there_is_a_run() {
    let _turn = turn();
    let (normals, pairs) = ("data.normals=none", "data.correspondences=none");
    let cloud = "data.source=cloud.ply";
    let cases: [(&'static [&'static str], &str, &[&str]); 3] = [
        (&["lipmlp", "nfgp"], normals, &["data.normals", "\"auto\""]),
        (
            &["eigenbasis", "nfgp"],
            pairs,
            &["data.correspondences", "file of pairs"],
        ),
        (
            &["eigenbasis", "nfgp"],
            cloud,
            &["cloud.ply: a point cloud", "give a mesh"],
        ),
    ];
    for (methods, key, parts) in cases {
        for method in named(methods) {
            let name = method.name;
            let (place, old) = method.trained();
            place.write("cloud.ply", ply::cloud(&Mesh::sphere(1.0, 3).vertices));
            let before = old.networks();
            let new = with("train recipe.toml --quiet --run new --set", &[key]);
            let parts = [parts, &[name]].concat();
            place.isomorph(&new).refused(2, &parts);
            assert!(
                !place.path("new").exists(),
                "{name}, {key}: a run that never began"
            );
            let replace = with("train recipe.toml --quiet --run run --force --set", &[key]);
            place.isomorph(&replace).refused(2, &parts);
            assert!(
                old.networks() == before,
                "{name}, {key}: the run that was there is lost"
            );
        }
    }
}

#[test]
fn a_method_that_shares_its_steps_out_keeps_their_number() {
    let _turn = turn();
    for method in named(&["nise", "nise-velocity", "nfgp", "efis"]) {
        let name = method.name;
        let (place, run) = method.trained();
        let cut = place.run("cut");
        run.cut_at(8, &cut);
        let before = cut.networks();
        for steps in ["12", "32"] {
            let set = format!("training.steps={steps}");
            let parts = [
                "training.steps is 20 in the checkpoint",
                steps,
                "shares its steps out",
                "start a new run",
            ];
            let resume = ["resume", "cut", "--quiet", "--set", &set];
            place.isomorph(&resume).refused(1, &parts);
            assert!(cut.networks() == before, "{name}: trained on");
        }
        // The recipe of the run is as it was, and so it goes on.
        place
            .on_one_thread(&["resume", "cut", "--quiet"])
            .succeeded();
        assert!(
            cut.networks() == run.networks(),
            "{name}: the networks differ"
        );
    }
    // The others have no such turns.
    for method in named(&["mlp", "sdf-blend", "lipmlp", "eigenbasis"]) {
        let (place, run) = method.trained();
        let more = ["resume", "run", "--quiet", "--set", "training.steps=24"];
        place.isomorph(&more).succeeded();
        assert_eq!(run.step(), 24, "{}", method.name);
    }
}

/// What isomorph is compared with is compiled for one backend, since each method is a large part of the build.
#[test]
fn a_method_that_ours_is_compared_with_is_refused_on_other_backends_than_flex() {
    let _turn = turn();
    for method in METHODS.into_iter().skip(4) {
        let name = method.name;
        let place = method.place();
        let before = place.names();
        for backend in ["ndarray", "wgpu"] {
            let train = with("train recipe.toml --quiet --run run --backend", &[backend]);
            place
                .isomorph(&train)
                .refused(2, &[&format!("method.name = \"{name}\""), "flex"]);
            assert_eq!(place.names(), before, "{name}, {backend}");
        }
    }
    // Nor does a run of one go on, or give surfaces, elsewhere.
    let (place, run) = METHODS[4].trained();
    let recipe = || fs::read_to_string(run.path("recipe.toml")).expect("a recipe");
    let before = (run.networks(), recipe());
    for command in [
        "resume run --set training.steps=24 --quiet --backend ndarray",
        "extract run --quiet --backend ndarray",
    ] {
        place
            .isomorph(&with(command, &[]))
            .refused(2, &["method.name = \"mlp\"", "flex"]);
    }
    assert!(
        (run.networks(), recipe()) == before && !run.path("meshes").exists(),
        "a refused command changed the run"
    );
}
