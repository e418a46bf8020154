//! What training leaves and prints: the files of a run and their fields, surfaces, recipes.

use std::collections::BTreeSet;
use std::fs;

use serde_json::Value;

use crate::support::mesh::{Mesh, dot, length};
use crate::support::ply::{self, Ply};
use crate::support::run::{frames, json};
use crate::support::workplace::{Workplace, names, turn};

/// A few steps and three small surfaces. So early the fields are still close to the sphere that they start
/// from, which is a surface like any other.
const KEYS: &[&str] = &[
    "training.steps = 10",
    "training.log-every = 4",
    "checkpoint.every = 5",
];

const SURFACES: &[&str] = &["--set", "result.frames=3", "--set", "result.resolution=32"];

fn keys(value: &Value) -> BTreeSet<&str> {
    value
        .as_object()
        .expect("an object")
        .keys()
        .map(String::as_str)
        .collect()
}

#[test]
fn training_leaves_a_whole_run_and_nothing_else() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let run = place.train("run", SURFACES);
    let wanted = [
        ".lock",
        "checkpoints",
        "meshes",
        "metrics.jsonl",
        "recipe.toml",
        "report.html",
        "run.log",
    ];
    assert_eq!(names(&run.0), wanted);
    assert_eq!(run.checkpoints(), ["step-000005", "step-000010"]);
    let of = |name: &str| {
        let parts = ["-muon-optimiser", "-optimiser", ""];
        parts.map(|part| format!("{name}{part}.mpk"))
    };
    let state = ["state.json".to_owned()];
    let wanted = [&of("ends")[..], &state, &of("velocity")].concat();
    assert_eq!(names(&run.newest()), wanted);
    let surfaces = ["surface-000.ply", "surface-001.ply", "surface-002.ply"];
    let meshes = run.path("meshes");
    assert_eq!(
        names(&meshes),
        [&["frames.json", "preview.png"][..], &surfaces].concat()
    );
    let picture = fs::read(meshes.join("preview.png")).expect("a picture");
    assert!(picture.starts_with(b"\x89PNG\r\n\x1a\n") && picture.len() > 1000);
    let log = fs::read_to_string(run.path("run.log")).expect("a log");
    // As in 2026-03-01T12:00:00Z.
    let stamped = |line: &str| {
        let bytes = line.as_bytes();
        bytes.get(19..21) == Some(b"Z ") && bytes.get(10) == Some(&b'T')
    };
    assert!(log.lines().count() > 5 && log.lines().all(stamped), "{log}");
}

/// A field more or less is a change of the format, which others read.
#[test]
fn the_json_of_a_run_has_the_fields_that_are_documented_and_no_others() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let run = place.train("run", SURFACES);
    let text = fs::read_to_string(run.path("metrics.jsonl")).expect("metrics");
    let line: Value = serde_json::from_str(text.lines().last().expect("a line")).expect("JSON");
    let fields = [
        "learning_rate",
        "peak_memory_bytes",
        "phase",
        "seconds",
        "step",
        "terms",
        "total",
        "velocity_learning_rate",
    ];
    assert_eq!(keys(&line), BTreeSet::from(fields));
    for term in line["terms"].as_object().expect("terms").values() {
        assert_eq!(keys(term), BTreeSet::from(["raw", "weighted"]));
    }
    for entry in json(&run.path("meshes/frames.json"))
        .as_array()
        .expect("a list")
    {
        assert_eq!(
            keys(entry),
            BTreeSet::from([
                "consistency",
                "round_trip",
                "slope_error",
                "surface",
                "time"
            ])
        );
    }
    let state = [
        "bounds",
        "burn_version",
        "backend",
        "files",
        "format_version",
        "isomorph_version",
        "normalisation",
        "recipe",
        "seconds",
        "seed",
        "step",
    ];
    assert_eq!(keys(&run.state()), BTreeSet::from(state));
}

#[test]
fn surfaces_are_closed_and_their_normals_point_outwards() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let run = place.train("run", SURFACES);
    let frames = frames(&run.path("meshes"));
    assert_eq!(
        frames.iter().map(|frame| frame.time).collect::<Vec<_>>(),
        [0.0, 0.5, 1.0]
    );
    for frame in frames {
        let file = Ply::read(&frame.surface);
        assert_eq!(file.properties, ["x", "y", "z", "nx", "ny", "nz"]);
        let mesh = file.mesh();
        assert!(mesh.is_closed() && mesh.volume() > 0.0);
        let [x, y, z] = ["nx", "ny", "nz"].map(|name| file.column(name));
        let centre = [0.5, 0.0, 0.0];
        let outwards = mesh.vertices.iter().enumerate().filter(|(k, vertex)| {
            let normal = [x[*k], y[*k], z[*k]];
            // Unit vectors of 32-bit numbers.
            assert!((length(normal) - 1.0).abs() < 1e-5, "{normal:?}");
            dot(
                normal,
                std::array::from_fn(|axis| vertex[axis] - centre[axis]),
            ) > 0.0
        });
        // Nearly a sphere around that centre.
        assert!(outwards.count() as f64 > 0.95 * mesh.vertices.len() as f64);
    }
}

#[test]
fn the_recipe_in_a_run_is_complete_and_trains_to_the_same_networks() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let train = [
        "train",
        "recipe.toml",
        "--quiet",
        "--run",
        "run",
        "--set",
        "training.seed=7",
    ];
    place.on_one_thread(&train).succeeded();
    let resolved = fs::read_to_string(place.path("run/recipe.toml")).expect("a recipe");
    let again = place.isomorph(&["info", "run/recipe.toml"]).succeeded();
    assert_eq!(
        again.stdout, resolved,
        "resolving it once more changes nothing"
    );
    place
        .on_one_thread(&["train", "run/recipe.toml", "--quiet", "--run", "again"])
        .succeeded();
    assert!(
        place.run("again").networks() == place.run("run").networks(),
        "the networks differ"
    );
}

#[test]
fn results_go_to_standard_output_and_all_else_to_standard_error() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let train = [&["train", "recipe.toml", "--run", "run"][..], SURFACES].concat();
    let ended = place.isomorph(&train).succeeded();
    assert_eq!(ended.stdout, "", "a run is its folder");
    assert!(
        ended.stderr.contains("10") && ended.stderr.contains("surface-002.ply"),
        "{ended:?}"
    );
    assert!(
        ended
            .stderr
            .contains("key frames of 2,000 and 2,000 points"),
        "{ended:?}"
    );
    assert!(
        !ended.stderr.contains('\x1b'),
        "colours where there is no terminal"
    );
    let extract = [
        "extract",
        "run",
        "--frames",
        "1",
        "--resolution",
        "32",
        "-o",
        "out",
    ];
    let ended = place.isomorph(&extract).succeeded();
    assert_eq!(ended.stdout, "out/frames.json\n");
    let quiet = place
        .isomorph(&[&extract[..], &["--quiet"]].concat())
        .succeeded();
    assert_eq!(
        (quiet.stdout.as_str(), quiet.stderr.as_str()),
        ("out/frames.json\n", "")
    );
}

#[test]
fn without_run_a_run_is_named_after_the_recipe() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    fs::create_dir(place.path("pair")).expect("a folder");
    for name in ["recipe.toml", "source.ply", "target.ply"] {
        fs::rename(place.path(name), place.path("pair").join(name)).expect("a file");
    }
    place
        .isomorph(&["train", "pair/recipe.toml", "--quiet"])
        .succeeded();
    assert_eq!(place.run("runs/pair-recipe").step(), 10);
}

#[test]
fn clouds_without_normals_train_and_are_carried() {
    let _turn = turn();
    let place = Workplace::new();
    let sphere = Mesh::sphere(1.0, 4).vertices;
    place.write("source.ply", ply::cloud(&sphere));
    let away: Vec<_> = sphere.iter().map(|x| [x[0] + 1.0, x[1], x[2]]).collect();
    place.write("target.ply", ply::cloud(&away[..1000]));
    let recipe = place.isomorph(&["init", "source.ply", "target.ply", "--preset", "quick"]);
    place.write("recipe.toml", recipe.succeeded().stdout);
    let set = ["--set", "training.steps=10", "--set", "training.batch=200"];
    let train = [
        &["train", "recipe.toml", "--run", "run"][..],
        &set,
        SURFACES,
    ]
    .concat();
    let ended = place.isomorph(&train).succeeded();
    assert!(
        ended.stderr.contains("no normals: estimated"),
        "{}",
        ended.stderr
    );
    let run = place.run("run");
    let last = run.metrics().pop().expect("a line");
    assert!(last.terms.contains_key("normals"), "{last:?}");
    assert_eq!(
        Ply::read(&run.path("meshes/surface-000.ply"))
            .mesh()
            .components(),
        1
    );
    let extract = [
        "extract",
        "run",
        "--quiet",
        "--times",
        "0",
        "--resolution",
        "32",
    ];
    place
        .isomorph(&[&extract[..], &["--carry", "-o", "out"]].concat())
        .succeeded();
    let carried = Ply::read(&place.path("out/carried-000.ply"));
    assert_eq!(carried.rows, Ply::read(&place.path("source.ply")).rows);
    assert!(carried.triangles.is_empty());
}

/// The keys that people change, which stand first.
const FIRST: [&str; 10] = [
    "preset",
    "data.correspondences",
    "data.normals",
    "loss.divergence",
    "loss.strain",
    "loss.matching-scale",
    "training.steps",
    "training.seed",
    "result.frames",
    "result.resolution",
];

/// The number of the line that gives a key its value, as it counts or as a comment.
fn line_of(recipe: &str, key: &str) -> Option<usize> {
    let begins = format!("{key} = ");
    let mut lines = recipe.lines();
    lines.position(|line| line.trim_start_matches(['#', ' ']).starts_with(&begins))
}

#[test]
fn the_recipe_that_init_prints_trains() {
    let _turn = turn();
    let place = Workplace::tiny(&[]);
    let init = [
        "init",
        "source.ply",
        "target.ply",
        "--correspondences",
        "same-vertices",
    ];
    let printed = place.isomorph(&init).succeeded().stdout;
    let at = |key: &str| line_of(&printed, key).unwrap_or_else(|| panic!("no {key} in {printed}"));
    // The shapes, then the ten keys that people change, then the rest of the method, all of it explained.
    let first = FIRST.map(at);
    assert!(first.is_sorted(), "{first:?} in {printed}");
    assert!(at("data.source") < first[0] && at("data.target") < first[0]);
    for key in [
        "data.points",
        "implicit.depth",
        "velocity.width",
        "loss.screw",
        "checkpoint.every",
    ] {
        assert!(at(key) > first[9], "{key} among the first in {printed}");
    }
    assert!(
        printed
            .lines()
            .filter(|line| line.starts_with("# "))
            .count()
            > 50,
        "{printed}"
    );
    // Of other geometries and methods nothing, until it is wanted.
    let others = ["loss.level-set", "nfgp.deformations", "nise.omega"];
    assert!(others.iter().all(|key| line_of(&printed, key).is_none()));
    let all = place
        .isomorph(&[&init[..], &["--all"]].concat())
        .succeeded()
        .stdout;
    assert!(
        others.iter().all(|key| line_of(&all, key).is_some()),
        "{all}"
    );
    for (name, text) in [("pair", &printed), ("all", &all)] {
        let recipe = format!("{name}.toml");
        place.write(&recipe, text);
        let small = ["--set", "training.steps=3", "--set", "training.batch=64"];
        let train = ["train", &recipe, "--quiet", "--run", name];
        place
            .isomorph(&[&train[..], &small, SURFACES].concat())
            .succeeded();
        assert_eq!(place.run(name).step(), 3);
    }
}
