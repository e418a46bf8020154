//! The samples of a step depend on recipe, seed and step alone: the first steps of `quick` exactly as it
//! ships, on every backend.
//!
//! On CPUs a step of this batch is divided into parts, on wgpu it is not. While the numbers of the samples were
//! rounded to multiples of the parts, the first step on wgpu differed from that on flex by up to 4 %.

use std::path::Path;

use crate::support::run::Logged;
use crate::support::workplace::{Workplace, turn};

/// Of a term in the first step, before any update: samples, weights and terms are the same, and f32 is added in
/// another order. burn-ndarray's vectorised reciprocal is good to 4e-5.
const FIRST_STEP: f64 = 1e-4;
/// After one update: Adam goes the full learning rate along the sign of a gradient, however small.
const SECOND_STEP: f64 = 1e-3;

/// The first two steps of `data/fox/quick.toml`, every term of them.
fn first_steps(backend: &str, key: &str) -> Vec<Logged> {
    let recipe = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/fox/quick.toml");
    let recipe = recipe.to_str().expect("a path of text");
    let place = Workplace::new();
    let train = ["train", recipe, "--quiet", "--run", "run"];
    let steps = ["--set", "training.steps=2", "--set", "training.log-every=1"];
    let more = ["--set", "result.frames=0", "--backend", backend];
    let key = ["--set", key];
    place
        .isomorph(&[&train[..], &steps, &more, &key].concat())
        .succeeded();
    place.run("run").metrics()
}

#[test]
fn the_first_steps_of_quick_as_it_ships_are_the_same_on_all_backends() {
    let _turn = turn();
    same_on_all_backends("training.guided-until=1", &["guide"]);
}

#[test]
fn the_first_steps_of_quick_without_splines_are_the_same_on_all_backends() {
    let _turn = turn();
    let of_motion = ["divergence", "matching", "screw", "strain"];
    same_on_all_backends("training.guided-until=0", &of_motion);
}

/// Holds the terms of the first steps on each backend to those on flex; the end fields have terms always,
/// V those named.
fn same_on_all_backends(key: &str, of_motion: &[&str]) {
    let wanted = first_steps("flex", key);
    assert_eq!(wanted.len(), 2);
    let of_ends = ["data", "distance", "eikonal", "normals"];
    for name in of_ends.iter().chain(of_motion) {
        assert!(wanted[0].terms.contains_key(*name), "no {name}: {wanted:?}");
    }
    for backend in ["ndarray", "wgpu"] {
        let found = first_steps(backend, key);
        assert_eq!(found.len(), 2, "{backend}");
        for ((found, wanted), limit) in found.iter().zip(&wanted).zip([FIRST_STEP, SECOND_STEP]) {
            assert_eq!(found.step, wanted.step);
            assert!(
                found.terms.keys().eq(wanted.terms.keys()),
                "{backend}: {found:?} instead of {wanted:?}"
            );
            for (name, wanted_value) in &wanted.terms {
                let off = (found.terms[name] - wanted_value).abs() / wanted_value.abs();
                println!("{backend}, step {}, {name}: {off:.1e} off", wanted.step);
                assert!(
                    off <= limit,
                    "{backend}, step {}: {name} is {} instead of {wanted_value}",
                    wanted.step,
                    found.terms[name]
                );
            }
        }
    }
}
