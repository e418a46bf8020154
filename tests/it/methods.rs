//! The methods that ours is compared with, as a user trains, resumes and extracts them: `method.name`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::command::with;
use crate::support::mesh::{Mesh, distance};
use crate::support::ply::{self, Ply};
use crate::support::run::{Run, json};
use crate::support::workplace::{Workplace, names, turn};

/// Our method with `implicit.geometry = "flow"`.
const FLOW: &str = "flow";

/// Every `method.name` and our own with the other geometry, and what it has: a field whose zero set is its
/// surface, a motion of points.
const METHODS: [(&str, bool, bool); 9] = [
    ("velocity-field", true, true),
    (FLOW, true, true),
    ("mlp", true, false),
    ("sdf-blend", true, false),
    ("lipmlp", true, false),
    ("nise", true, false),
    ("nise-velocity", true, false),
    ("eigenbasis", false, true),
    ("nfgp", false, true),
];

/// Twenty steps: the end fields of `nise` train until step 8, the deformations of `nfgp` take turns of
/// five steps each.
const KEYS: &[&str] = &[
    "training.steps = 20",
    "training.log-every = 3",
    "checkpoint.every = 4",
    "checkpoint.keep = 100",
    "method.deformations = 4",
];

fn method(name: &str) -> String {
    match name {
        FLOW => "implicit.geometry=flow".to_owned(),
        name => format!("method.name={name}"),
    }
}

/// Trains a method on one thread.
fn train(place: &Workplace, name: &str) -> Run {
    let set = method(name);
    let train = [
        "train",
        "recipe.toml",
        "--quiet",
        "--run",
        name,
        "--set",
        &set,
    ];
    place.on_one_thread(&train).succeeded();
    place.run(name)
}

/// Surfaces of a run, to be named, at both ends.
const EXTRACT: &str = "extract --quiet --times 0,1 --resolution 32";

/// The networks of the newest checkpoint by the names of their files.
fn networks(run: &Run) -> BTreeMap<String, Vec<u8>> {
    let files = names(&run.newest()).into_iter();
    let networks = files.filter(|name| name.ends_with(".mpk") && !name.contains("optimiser"));
    networks
        .map(|name| {
            (
                name.clone(),
                fs::read(run.newest().join(name)).expect("a record"),
            )
        })
        .collect()
}

/// The surfaces in a folder, in the order of `frames.json`, and its entries.
fn surfaces(folder: &Path) -> (Vec<Mesh>, Value) {
    let frames = json(&folder.join("frames.json"));
    let entries = frames.as_array().expect("a list").iter();
    let surface = |entry: &Value| folder.join(entry["surface"].as_str().expect("a file"));
    let meshes = entries.map(|entry| Ply::read(&surface(entry)).mesh());
    (meshes.collect(), frames)
}

/// Cut before the fields between and after them, in the first turn and in a later one.
#[test]
fn every_method_that_is_cut_and_resumed_ends_in_the_networks_of_a_whole_run() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    for (name, ..) in METHODS {
        let whole = train(&place, name);
        assert_eq!((whole.step(), whole.checkpoints().len()), (20, 5), "{name}");
        for step in [4, 8, 12] {
            let cut = format!("{name}-cut-at-{step}");
            whole.cut_at(step, &place.run(&cut));
            place
                .on_one_thread(&["resume", &cut, "--quiet"])
                .succeeded();
            let resumed = place.run(&cut);
            assert_eq!(resumed.metrics(), whole.metrics(), "{cut}");
            // Not assert_eq!, which would print them.
            assert!(
                networks(&resumed) == networks(&whole),
                "{cut}: the networks differ"
            );
        }
    }
}

#[test]
fn every_method_moves_towards_its_data() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    for (name, ..) in METHODS {
        let run = train(&place, name);
        let metrics = run.metrics();
        // Terms that the first and the last logged step of one phase both have; one of them must fall.
        let last = metrics.last().expect("a line");
        let first = metrics
            .iter()
            .find(|line| line.phase == last.phase)
            .expect("a line");
        assert!(first.step < last.step, "{name}: one line in its last phase");
        let falls = |(term, value): (&String, &f64)| last.terms[term] < 0.98 * value;
        assert!(first.terms.iter().any(falls), "{name}: {first:?} {last:?}");
        assert!(
            last.terms.values().all(|term| term.is_finite()),
            "{name}: {last:?}"
        );
    }
}

#[test]
fn every_method_gives_surfaces() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    for (name, has_field, _) in METHODS {
        let run = train(&place, name);
        place.isomorph(&with(EXTRACT, &[name])).succeeded();
        let (meshes, frames) = surfaces(&run.path("meshes"));
        assert_eq!(meshes.len(), 2);
        for (mesh, entry) in meshes.iter().zip(frames.as_array().expect("a list")) {
            assert!(
                mesh.triangles.len() > 100 && mesh.vertices.len() > 50,
                "{name}"
            );
            let mut parts = mesh.vertices.iter().flatten();
            assert!(parts.all(|part| part.is_finite()), "{name}");
            // How far a field is from a distance; there is nothing to say of a carried mesh.
            assert_eq!(
                entry.get("slope_error").is_some(),
                has_field,
                "{name}: {entry}"
            );
        }
    }
}

#[test]
fn a_method_that_moves_points_carries_the_mesh_of_the_source() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let source = Ply::read(&place.path("source.ply")).mesh();
    for (name, ..) in METHODS.into_iter().filter(|(_, _, has_motion)| *has_motion) {
        train(&place, name);
        place
            .isomorph(&with(EXTRACT, &[name, "--carry", "-o", "out"]))
            .succeeded();
        let carried = |k: usize| Ply::read(&place.path(&format!("out/carried-00{k}.ply"))).mesh();
        assert_eq!(carried(0), source, "{name}: time 0 is the input itself");
        assert_eq!(carried(1).triangles, source.triangles, "{name}");
        assert_ne!(
            carried(1).vertices,
            source.vertices,
            "{name}: nothing moved"
        );
        fs::remove_dir_all(place.path("out")).expect("a folder");
    }
}

#[test]
fn a_method_that_moves_no_points_refuses_to_carry_any() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    for (name, ..) in METHODS.into_iter().filter(|(_, _, has_motion)| !has_motion) {
        let run = train(&place, name);
        let refused = ["moves no points", "--carry"];
        let elsewhere = with(EXTRACT, &[name, "--carry", "-o", "out"]);
        place.isomorph(&elsewhere).refused(1, &refused);
        assert!(
            !place.path("out").exists(),
            "{name}: left by a refused command"
        );
        // What was extracted before stays a whole folder.
        place.isomorph(&with(EXTRACT, &[name])).succeeded();
        let before = names(&run.path("meshes"));
        place
            .isomorph(&with(EXTRACT, &[name, "--carry"]))
            .refused(1, &refused);
        assert_eq!(names(&run.path("meshes")), before, "{name}");
    }
}

#[test]
fn the_surface_of_a_method_without_a_field_is_the_mesh_of_the_source_carried() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let source = Ply::read(&place.path("source.ply")).mesh();
    for name in ["eigenbasis", "nfgp"] {
        let run = train(&place, name);
        // Its resolution is that of the mesh, whatever is asked for.
        for resolution in ["16", "64"] {
            let carry = "extract --quiet --times 0,1 --carry --resolution";
            place
                .isomorph(&with(carry, &[resolution, name]))
                .succeeded();
            let (meshes, _) = surfaces(&run.path("meshes"));
            // Float32 in coordinates below 2: 1.2e-7, there and back again.
            let off = |a: &Mesh, b: &Mesh| {
                assert_eq!(a.triangles, b.triangles, "{name}");
                let pairs = a.vertices.iter().zip(&b.vertices);
                pairs.map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max)
            };
            assert!(
                off(&meshes[0], &source) < 1e-6,
                "{name}: {}",
                off(&meshes[0], &source)
            );
            let carried = Ply::read(&run.path("meshes/carried-001.ply")).mesh();
            assert!(
                off(&meshes[1], &carried) < 1e-6,
                "{name}: {}",
                off(&meshes[1], &carried)
            );
            assert!(off(&meshes[1], &source) > 1e-3, "{name}: nothing moved");
        }
    }
}

#[test]
fn training_writes_the_surfaces_of_every_method() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    for (name, ..) in METHODS {
        let set = [&method(name), "result.frames=2", "result.resolution=24"].map(str::to_owned);
        let set = set
            .iter()
            .flat_map(|key| ["--set", key])
            .collect::<Vec<_>>();
        let run = place.train(name, &set);
        let (meshes, _) = surfaces(&run.path("meshes"));
        assert!(
            meshes.len() == 2 && meshes.iter().all(|mesh| !mesh.triangles.is_empty()),
            "{name}"
        );
    }
}

#[test]
fn what_a_method_lacks_is_told_before_there_is_a_run() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    place.write("cloud.ply", ply::cloud(&Mesh::sphere(1.0, 3).vertices));
    let old = place.train("old", &[]);
    let before = networks(&old);
    let (normals, pairs) = ("data.normals=none", "data.correspondences=none");
    let cloud = "data.source=cloud.ply";
    let cases: [(&str, &str, &[&str]); 6] = [
        ("lipmlp", normals, &["data.normals", "\"auto\""]),
        ("nfgp", normals, &["data.normals", "\"auto\""]),
        ("nfgp", pairs, &["data.correspondences", "file of pairs"]),
        (
            "eigenbasis",
            pairs,
            &["data.correspondences", "file of pairs"],
        ),
        (
            "eigenbasis",
            cloud,
            &["cloud.ply: a point cloud", "give a mesh"],
        ),
        ("nfgp", cloud, &["cloud.ply: a point cloud", "give a mesh"]),
    ];
    for (name, key, parts) in cases {
        let set = ["--set", &method(name), "--set", key];
        let new = with("train recipe.toml --quiet --run new", &set);
        let parts = [parts, &[name]].concat();
        place.isomorph(&new).refused(2, &parts);
        assert!(
            !place.path("new").exists(),
            "{name}, {key}: a run that never began"
        );
        let replace = with("train recipe.toml --quiet --run old --force", &set);
        place.isomorph(&replace).refused(2, &parts);
        assert!(
            networks(&old) == before,
            "{name}, {key}: the run that was there is lost"
        );
    }
}

#[test]
fn fields_that_are_fitted_to_points_learn_without_normals_and_correspondences() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    for name in [
        "velocity-field",
        FLOW,
        "mlp",
        "sdf-blend",
        "nise",
        "nise-velocity",
    ] {
        let without = "--set data.normals=none --set data.correspondences=none --set";
        let run = place.train(name, &with(without, &[&method(name)]));
        // Between its ends `nise` takes the normals of its own end fields.
        let metrics = run.metrics();
        let mut fitted = metrics.iter().filter(|line| line.phase != "between");
        assert!(
            fitted.all(|line| !line.terms.contains_key("normals")),
            "{name}: {metrics:?}"
        );
    }
}

#[test]
fn a_method_that_shares_its_steps_out_keeps_their_number() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    for name in ["nise", "nise-velocity", "nfgp"] {
        let run = train(&place, name);
        let cut = place.run("cut");
        run.cut_at(8, &cut);
        let before = networks(&cut);
        for steps in ["12", "32"] {
            let set = format!("training.steps={steps}");
            let parts = [
                "training.steps is 20 in the checkpoint",
                steps,
                name,
                "isomorph train",
            ];
            let resume = ["resume", "cut", "--quiet", "--set", &set];
            place.isomorph(&resume).refused(1, &parts);
            assert!(networks(&cut) == before, "{name}: trained on");
        }
        // The recipe of the run is as it was, and so it goes on.
        place
            .on_one_thread(&["resume", "cut", "--quiet"])
            .succeeded();
        assert!(
            networks(&cut) == networks(&run),
            "{name}: the networks differ"
        );
        fs::remove_dir_all(&cut.0).expect("a folder");
    }
    // The others have no such turns.
    for name in ["mlp", "sdf-blend", "lipmlp", "eigenbasis"] {
        let run = train(&place, name);
        let more = ["resume", name, "--quiet", "--set", "training.steps=24"];
        place.isomorph(&more).succeeded();
        assert_eq!(run.step(), 24, "{name}");
    }
}

/// The scale of the shapes goes through the JSON of a checkpoint; one bit lost of it, and a run that stops
/// cannot go on. Of twenty sizes about four lose one in a reader that rounds twice.
#[test]
fn a_run_goes_on_whatever_the_size_of_its_shapes() {
    let _turn = turn();
    let keys = [KEYS, &["method.name = \"mlp\""]].concat();
    for k in 0..20 {
        let size = 1.01 + 0.05 * f64::from(k);
        let sphere = Mesh::sphere(size, 2);
        let target = sphere.clone().map(|x| [x[0] + size, x[1], x[2]]);
        let place = Workplace::tiny(&keys);
        place.write("source.ply", ply::text(&sphere));
        place.write("target.ply", ply::text(&target));
        let run = place.train("run", &["--set", "training.steps=4"]);
        let more = ["resume", "run", "--quiet", "--set", "training.steps=8"];
        let ended = place.isomorph(&more);
        assert_eq!(ended.code, Some(0), "size {size}: {ended:?}");
        assert_eq!(run.step(), 8);
    }
}
