//! The methods that ours is compared with, as a user trains, resumes and extracts them: `method.name`.

use std::path::Path;

use serde_json::Value;

use crate::support::command::with;
use crate::support::mesh::{Mesh, distance};
use crate::support::ply::{self, Ply};
use crate::support::run::{Run, json};
use crate::support::workplace::{NETWORK, Workplace, turn};

/// A method as a recipe chooses it, and what it has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Method {
    pub(crate) name: &'static str,
    /// What chooses it, and sizes with which a step takes milliseconds: its own keys alone, since a recipe holds
    /// none that does nothing.
    keys: &'static [&'static str],
    /// A field whose zero set is its surface.
    pub(crate) has_field: bool,
    /// A motion of points.
    pub(crate) has_motion: bool,
}

/// Ours as it ships, the paper's geometry, splines, these beside networks, and every other `method.name`.
pub(crate) const METHODS: [Method; 12] = [
    Method {
        name: "shipped",
        keys: &[],
        has_field: true,
        has_motion: true,
    },
    Method {
        name: "network",
        keys: NETWORK,
        has_field: true,
        has_motion: true,
    },
    Method {
        name: "spline",
        keys: &[
            "velocity.kind = \"spline\"",
            "spline.band = 2000",
            "spline.surface-samples = 50",
        ],
        has_field: true,
        has_motion: true,
    },
    Method {
        name: "trained-spline",
        keys: &[
            "velocity.kind = \"trained-spline\"",
            "training.guided-until = 0.4",
            "spline.spacing = 0.1",
            "spline.band = 2000",
            "spline.surface-samples = 50",
        ],
        has_field: true,
        has_motion: true,
    },
    at_ends("mlp", &["method.name = \"mlp\"", SOFT[0], SOFT[1], SOFT[2]]),
    at_ends(
        "sdf-blend",
        &["method.name = \"sdf-blend\"", SOFT[0], SOFT[1], SOFT[2]],
    ),
    at_ends("lipmlp", &["method.name = \"lipmlp\"", SOFT[0]]),
    at_ends("nise", &["method.name = \"nise\"", SOFT[0]]),
    at_ends(
        "nise-velocity",
        &["method.name = \"nise-velocity\"", SOFT[0]],
    ),
    Method {
        name: "eigenbasis",
        keys: &["method.name = \"eigenbasis\""],
        has_field: false,
        has_motion: true,
    },
    Method {
        name: "nfgp",
        keys: &["method.name = \"nfgp\"", "nfgp.deformations = 4"],
        has_field: false,
        has_motion: true,
    },
    Method {
        name: "efis",
        keys: &["method.name = \"efis\"", "efis.width = 16"],
        has_field: true,
        has_motion: true,
    },
];

/// Softplus networks, as comparisons have them.
const SOFT: [&str; 3] = [
    "training.learning-rate = 2e-3",
    "implicit.activation = \"softplus\"",
    "implicit.beta = 100",
];

/// A method that fits a field and moves no points.
const fn at_ends(name: &'static str, keys: &'static [&'static str]) -> Method {
    Method {
        name,
        keys,
        has_field: true,
        has_motion: false,
    }
}

/// Twenty steps: the end fields of `nise` and `efis` train until step 8, the deformations of `nfgp` take turns of
/// five steps each.
const KEYS: &[&str] = &[
    "data.points = 2000",
    "result.frames = 0",
    "training.steps = 20",
    "training.log-every = 3",
    "checkpoint.every = 4",
    "checkpoint.keep = 100",
];

impl Method {
    /// The sizes that act in it.
    fn sizes(self) -> &'static [&'static str] {
        match self.name {
            "shipped" | "network" => &[
                "implicit.depth = 3",
                "implicit.width = 32",
                "velocity.depth = 2",
                "velocity.width = 24",
                "training.batch = 200",
                "training.correspondence-batch = 40",
            ],
            "spline" | "eigenbasis" => &["training.correspondence-batch = 40"],
            "trained-spline" | "efis" => &[
                "implicit.depth = 3",
                "implicit.width = 32",
                "training.batch = 200",
                "training.correspondence-batch = 40",
            ],
            "nfgp" => &[
                "implicit.width = 32",
                "training.batch = 200",
                "training.correspondence-batch = 40",
            ],
            _ => &[
                "implicit.depth = 3",
                "implicit.width = 32",
                "training.batch = 200",
            ],
        }
    }

    /// A place with its recipe.
    pub(crate) fn place(self) -> Workplace {
        Workplace::tiny_with(self.sizes(), &[KEYS, self.keys].concat())
    }

    /// A place in which it was trained on one thread, and the run.
    pub(crate) fn trained(self) -> (Workplace, Run) {
        let place = self.place();
        let train = ["train", "recipe.toml", "--quiet", "--run", "run"];
        place.on_one_thread(&train).succeeded();
        let run = place.run("run");
        (place, run)
    }
}

/// The methods of these names.
pub(crate) fn named(names: &'static [&'static str]) -> impl Iterator<Item = Method> {
    let found = METHODS
        .into_iter()
        .filter(|method| names.contains(&method.name));
    assert_eq!(found.clone().count(), names.len(), "{names:?}");
    found
}

/// Surfaces of the run at both ends.
pub(crate) const EXTRACT: &str = "extract run --quiet --times 0,1 --resolution 32";

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
    for method in METHODS {
        let name = method.name;
        let (place, whole) = method.trained();
        assert_eq!((whole.step(), whole.checkpoints().len()), (20, 5), "{name}");
        for step in [4, 8, 12] {
            let cut = format!("cut-at-{step}");
            whole.cut_at(step, &place.run(&cut));
            place
                .on_one_thread(&["resume", &cut, "--quiet"])
                .succeeded();
            let resumed = place.run(&cut);
            assert_eq!(resumed.metrics(), whole.metrics(), "{name}, {cut}");
            // Not assert_eq!, which would print them.
            assert!(
                resumed.networks() == whole.networks(),
                "{name}, {cut}: the networks differ"
            );
        }
    }
}

#[test]
fn every_method_moves_towards_its_data() {
    let _turn = turn();
    for method in METHODS {
        let name = method.name;
        let (_place, run) = method.trained();
        let metrics = run.metrics();
        // Terms that the first and the last logged step of one phase both have; one of them must fall.
        let last = metrics.last().expect("a line");
        let first = metrics
            .iter()
            .find(|line| line.phase == last.phase)
            .expect("a line");
        assert!(first.step < last.step, "{name}: one line in its last phase");
        let falls = |(term, value): (&String, &f64)| last.terms[term] < 0.99 * value;
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
    for method in METHODS {
        let name = method.name;
        let (place, run) = method.trained();
        place.isomorph(&with(EXTRACT, &[])).succeeded();
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
                method.has_field,
                "{name}: {entry}"
            );
        }
    }
}

#[test]
fn a_method_that_moves_points_carries_the_mesh_of_the_source() {
    let _turn = turn();
    for method in METHODS.into_iter().filter(|method| method.has_motion) {
        let name = method.name;
        let (place, _run) = method.trained();
        let source = Ply::read(&place.path("source.ply")).mesh();
        place
            .isomorph(&with(EXTRACT, &["--carry", "-o", "out"]))
            .succeeded();
        let carried = |k: usize| Ply::read(&place.path(&format!("out/carried-00{k}.ply"))).mesh();
        assert_eq!(carried(0), source, "{name}: time 0 is the input itself");
        assert_eq!(carried(1).triangles, source.triangles, "{name}");
        assert_ne!(
            carried(1).vertices,
            source.vertices,
            "{name}: nothing moved"
        );
    }
}

#[test]
fn the_surface_of_a_method_without_a_field_is_the_mesh_of_the_source_carried() {
    let _turn = turn();
    for method in METHODS.into_iter().filter(|method| !method.has_field) {
        let name = method.name;
        let (place, run) = method.trained();
        let source = Ply::read(&place.path("source.ply")).mesh();
        // Its resolution is that of the mesh, whatever the command line says.
        for resolution in ["16", "64"] {
            let carry = "extract run --quiet --times 0,1 --carry --resolution";
            place.isomorph(&with(carry, &[resolution])).succeeded();
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
    for method in METHODS {
        let name = method.name;
        let set = "--set result.frames=2 --set result.resolution=24";
        let place = method.place();
        let run = place.train("run", &with(set, &[]));
        let (meshes, _) = surfaces(&run.path("meshes"));
        assert!(
            meshes.len() == 2 && meshes.iter().all(|mesh| !mesh.triangles.is_empty()),
            "{name}"
        );
    }
}

#[test]
fn fields_that_are_fitted_to_points_learn_without_normals_and_correspondences() {
    let _turn = turn();
    let without = "--set data.normals=none --set data.correspondences=none";
    const FITTED: &[&str] = &[
        "shipped",
        "network",
        "mlp",
        "sdf-blend",
        "nise",
        "nise-velocity",
        "efis",
    ];
    for method in named(FITTED) {
        let place = method.place();
        let run = place.train("run", &with(without, &[]));
        // Between their ends `nise` and `efis` take the normals of their own end fields.
        let metrics = run.metrics();
        let mut fitted = metrics.iter().filter(|line| line.phase != "between");
        assert!(
            fitted.all(|line| !line.terms.contains_key("normals")),
            "{}: {metrics:?}",
            method.name
        );
    }
}

/// The scale of the shapes goes through the JSON of a checkpoint; one bit lost of it, and a run that stops
/// cannot go on. Of twenty sizes about four lose one in a reader that rounds twice.
#[test]
fn a_run_goes_on_whatever_the_size_of_its_shapes() {
    let _turn = turn();
    for method in named(&["mlp"]) {
        for k in 0..20 {
            let size = 1.01 + 0.05 * f64::from(k);
            let sphere = Mesh::sphere(size, 2);
            let target = sphere.clone().map(|x| [x[0] + size, x[1], x[2]]);
            let place = method.place();
            place.write("source.ply", ply::text(&sphere));
            place.write("target.ply", ply::text(&target));
            let run = place.train("run", &["--set", "training.steps=4"]);
            let more = ["resume", "run", "--quiet", "--set", "training.steps=8"];
            let ended = place.isomorph(&more);
            assert_eq!(ended.code, Some(0), "size {size}: {ended:?}");
            assert_eq!(run.step(), 8);
        }
    }
}
