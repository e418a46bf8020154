//! `morph`: two files to an animation and a page, what it says it assumed, and its doubts.

use std::fs;

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::workplace::{Workplace, names, turn};

/// Small surfaces, few of them, and a solver with few samples.
const SMALL: [&str; 8] = [
    "--frames",
    "3",
    "--set",
    "result.resolution=32",
    "--set",
    "spline.band=3000",
    "--set",
    "data.points=3000",
];

/// A sphere, and the same moved along x and made larger, as `a.ply` and `b.ply`.
fn spheres(by: f64, scale: f64) -> Workplace {
    let place = Workplace::new();
    let sphere = Mesh::sphere(1.0, 3);
    place.write("a.ply", ply::text(&sphere));
    let other = sphere.map(|x| [scale * x[0] + by, scale * x[1], scale * x[2]]);
    place.write("b.ply", ply::text(&other));
    place
}

#[test]
fn two_files_become_an_animation_a_page_and_a_recipe_that_repeats_it() {
    let _turn = turn();
    let place = spheres(0.4, 1.0);
    let ended = place
        .isomorph(&[&["morph", "a.ply", "b.ply"], &SMALL[..]].concat())
        .succeeded();
    let run = place.run("runs/a-b");
    assert_eq!(
        names(&run.path("meshes")),
        ["carried.glb", "frames.json", "preview.png", "surface.glb"]
    );
    for file in [
        "report.html",
        "meshes/carried.glb",
        "meshes/surface.glb",
        "recipe.toml",
    ] {
        assert!(
            ended.stdout.contains(&format!("runs/a-b/{file}")),
            "{}",
            ended.stdout
        );
        assert!(run.path(file).is_file(), "{file}");
    }
    let animation = fs::read(run.path("meshes/carried.glb")).expect("a file");
    assert!(animation.starts_with(b"glTF"));
    for said in [
        "a.ply: a closed mesh of",
        "units: those of the files; 2.00 x 2.00 x 2.00",
        "frame: both files are in the same coordinates, unless size, place or a large turn speak against it; their centres are \
         0.400 apart",
        "pairs: vertices of equal number, since both files have the same faces",
        "preset: instant",
        "nothing speaks against the result",
    ] {
        assert!(ended.stderr.contains(said), "{said}: {}", ended.stderr);
    }
    // The recipe of the run is one.
    let recipe = run.path("recipe.toml");
    let recipe = recipe.to_str().expect("a path of text");
    place
        .isomorph(&["train", recipe, "--run", "again", "--quiet"])
        .succeeded();
    let weights = |run: &str| fs::read(place.run(run).newest().join("velocity.mpk")).expect("V");
    assert!(
        weights("runs/a-b") == weights("again"),
        "the same field, bit for bit"
    );
}

#[test]
fn what_is_likely_wrong_is_said_with_a_cure_and_an_existing_result_is_kept() {
    let _turn = turn();
    let place = spheres(0.0, 4.0);
    let morph = ["morph", "a.ply", "b.ply", "-o", "out", "--align", "none"];
    let ended = place.isomorph(&[&morph, &SMALL[..]].concat()).succeeded();
    let units = "doubtful: one shape is 4.00 times as large as the other; if their units differ";
    assert!(ended.stderr.contains(units), "{}", ended.stderr);
    let well = "nothing speaks against";
    assert!(!ended.stderr.contains(well), "{}", ended.stderr);
    let apart = spheres(4.0, 1.0);
    let ended = apart.isomorph(&[&morph, &SMALL[..]].concat()).succeeded();
    let far = "doubtful: the centres of the shapes are 4.00 apart, more than their size";
    assert!(ended.stderr.contains(far), "{}", ended.stderr);
    let exists = "out: exists already; choose another with -o";
    place.isomorph(&morph).refused(2, &[exists]);
}

#[test]
fn a_file_or_a_preset_that_is_none_leaves_nothing_behind() {
    let place = spheres(0.4, 1.0);
    let missing = ["morph", "a.ply", "c.ply"];
    place.isomorph(&missing).refused(1, &["c.ply"]);
    let preset = ["morph", "a.ply", "b.ply", "--preset", "fast"];
    place.isomorph(&preset).refused(2, &["fast", "instant"]);
    assert_eq!(place.names(), ["a.ply", "b.ply"]);
}

#[test]
fn where_splines_fail_networks_go_on() {
    let _turn = turn();
    let place = Workplace::new();
    let cloud = |by: f64| {
        let mut cloud = Mesh::sphere(1.0, 3).map(|x| [x[0] + by, x[1], x[2]]);
        cloud.triangles.clear();
        ply::text(&cloud)
    };
    place.write("a.ply", cloud(0.0));
    place.write("b.ply", cloud(0.3));
    let morph = "morph a.ply b.ply --pairs same-vertices --frames 2 --set training.steps=18 \
                 --set result.resolution=32 --set data.points=600 --set data.normals=none";
    let morph: Vec<&str> = morph.split_whitespace().collect();
    // The preset that is asked for by name is kept.
    let alone = place.isomorph(&[&morph[..], &["--preset", "instant"]].concat());
    assert_eq!(alone.code, Some(2), "{alone:?}");
    assert!(alone.stderr.contains("the preset \"quick\""), "{alone:?}");
    assert!(!place.path("runs/a-b").exists(), "nothing is left behind");
    let ended = place.isomorph(&morph).succeeded();
    let said = "the preset instant failed";
    assert!(ended.stderr.contains(said), "{ended:?}");
    let recipe = fs::read_to_string(place.path("runs/a-b/recipe.toml")).expect("a recipe");
    assert!(recipe.contains("preset = \"quick\""), "{recipe}");
    assert!(place.path("runs/a-b/report.html").is_file());
}
