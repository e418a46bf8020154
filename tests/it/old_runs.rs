//! Runs that an earlier isomorph made go on and give surfaces: one of the default method, one of a method whose
//! keys then stood under `[method]`, with keys that do nothing in either.
//!
//! `golden/old-run/` holds them as release 0.1.0 left them after two of four steps, at commit 8e4525c. The paths
//! of the machine are replaced by OLD-RUN, and the comments of the recipes are cut; no number is written anew.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::mesh::length;
use crate::support::ply::Ply;
use crate::support::run::{Run, copy_folder, frames};
use crate::support::workplace::{Workplace, turn};

/// Stands for the folder of the two shapes.
const FOLDER: &str = "OLD-RUN";

/// The files in which it stands, in the folder of a run.
const WITH_PATHS: [&str; 2] = ["recipe.toml", "checkpoints/step-000002/state.json"];

fn stored() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/old-run")
}

/// A copy of an old run, with the paths of the place where it is now.
fn moved_in(name: &str) -> (Workplace, Run) {
    let place = Workplace::new();
    for shape in ["source.ply", "target.ply"] {
        fs::copy(stored().join(shape), place.path(shape)).expect("a copy");
    }
    let run = place.run("run");
    copy_folder(&stored().join(name), &run.0);
    let here = place.path("");
    let here = here.to_str().expect("a path of text").trim_end_matches('/');
    for file in WITH_PATHS {
        let text = fs::read_to_string(run.path(file)).expect("a file of text");
        assert_eq!(text.matches(FOLDER).count(), 2, "{name}/{file}");
        fs::write(run.path(file), text.replace(FOLDER, here)).expect("a file");
    }
    (place, run)
}

#[test]
fn a_run_of_an_earlier_version_goes_on_and_gives_surfaces() {
    let _turn = turn();
    for (name, networks) in [
        ("flow", ["ends.mpk", "velocity.mpk"]),
        ("nise", ["ends.mpk", "implicit.mpk"]),
    ] {
        let (place, run) = moved_in(name);
        assert_eq!(run.step(), 2, "{name}");
        let before = run.networks();
        assert!(before.keys().eq(networks), "{name}: {:?}", before.keys());
        // From the old checkpoint itself, before anything of this version is written.
        let extract = "extract run --quiet --resolution 24 --times 0,0.5,1 -o";
        extracted(&place, extract, "before", name);
        place.isomorph(&["resume", "run", "--quiet"]).succeeded();
        assert_eq!(run.step(), 4, "{name}");
        assert_eq!(run.logged_steps(), [1, 2, 3, 4], "{name}");
        assert!(run.networks() != before, "{name}: nothing was trained");
        extracted(&place, extract, "after", name);
        place.isomorph(&["info", "run"]).succeeded();
    }
}

/// The values that the old run was given under `[method]` are still its own: another one is a change.
#[test]
fn the_keys_of_an_old_method_keep_their_values() {
    let (place, run) = moved_in("nise");
    let set = ["resume", "run", "--quiet", "--set", "nise.omega=11"];
    place
        .isomorph(&set)
        .refused(1, &["nise.omega is 10 in the checkpoint and 11"]);
    assert_eq!(run.step(), 2);
}

/// Three closed surfaces near the two spheres of radius 1, around (0, 0, 0) and (1/2, 0, 0).
#[track_caller]
fn extracted(place: &Workplace, command: &str, folder: &str, name: &str) {
    let words: Vec<&str> = command.split(' ').chain([folder]).collect();
    place.isomorph(&words).succeeded();
    let frames = frames(&place.path(folder));
    assert_eq!(frames.len(), 3, "{name}");
    for frame in frames {
        let mesh = Ply::read(&frame.surface).mesh();
        assert!(mesh.is_closed() && mesh.components() == 1, "{name}");
        for [x, y, z] in mesh.vertices {
            // The fields start from a sphere of radius 0.4 / 0.289 = 1.4, and hardly trained.
            let away = length([x - 0.25, y, z]);
            assert!((0.5..2.5).contains(&away), "{name}: {away}");
        }
    }
}
