//! The backends against each other, and both ways to differentiate against each other: one seed, one
//! recipe, a few steps through all phases, the same terms.
//!
//! ndarray with nested derivatives is what the others are held against. All compute in f32 and add in
//! different orders; burn-ndarray's vectorised reciprocal is good to 4e-5 only, and Adam amplifies what
//! it is given: its first steps go the full learning rate along the sign of a gradient, however small.
//! So the first step, before any update, must agree more closely than the last. On the machine where the
//! tolerances were chosen the worst were 2.1e-7 and 1.4e-6, over all tests here; they leave room for
//! processors with coarser reciprocals.
//!
//! wgpu needs a Vulkan driver; Mesa's in software will do (mesa-vulkan-drivers). Without one its test
//! fails: it does not pass over what it cannot see.

use crate::support::run::Logged;
use crate::support::workplace::{Workplace, turn};

/// Two steps of warm-up, one of ramp, two of both networks, one of f alone.
const PHASES: &[&str] = &[
    "training.steps = 6",
    "training.log-every = 1",
    "training.warm-up = 0.3333",
    "training.ramp-until = 0.5",
    "training.velocity-until = 0.8333",
    "training.batch = 100",
    "implicit.width = 16",
    "velocity.width = 16",
];

/// What the presets are made of, with the Laplacian of V.
const PLAIN: &[&str] = &["loss.smoothness = 1"];

/// Everything that the presets leave out: sines, encodings, inputs given again, a V that depends on time,
/// the other integrator, the original level-set equation.
const ORNATE: &[&str] = &[
    "implicit.activation = \"sine\"",
    "implicit.beta = 20",
    "implicit.frequencies = 2",
    "implicit.skip = 2",
    "velocity.activation = \"sine\"",
    "velocity.beta = 4",
    "velocity.depth = 3",
    "velocity.frequencies = 2",
    "velocity.skip = 1",
    "velocity.time-dependent = true",
    "loss.smoothness = 1",
    "loss.strain = 0",
    "loss.steadiness = 1",
    "loss.off-surface = 30",
    "loss.level-set-form = \"olse\"",
    "training.integrator = \"rk4\"",
    "training.time-steps = 2",
    "training.times = \"grid\"",
];

/// Two end fields that the flow carries, and every prior of V.
const FLOW: &[&str] = &[
    "implicit.geometry = \"flow\"",
    "velocity.time-dependent = true",
    "loss.strain-scale = 0.1",
    "loss.deviatoric = 1",
    "loss.stretch = 1",
    "loss.steadiness = 1",
    "loss.screw = 1",
    "loss.acceleration = 1",
];

/// The logged steps of a run with these keys.
fn logged(keys: &[&str], backend: &str, derivatives: &str) -> Vec<Logged> {
    let place = Workplace::tiny(&[]);
    // Overrides, since `tiny` sets some of these keys itself.
    let all = PHASES
        .iter()
        .chain(keys)
        .map(|key| key.replace(" = ", "=").replace('"', ""));
    let all: Vec<String> = all
        .chain([format!("training.derivatives={derivatives}")])
        .collect();
    let mut arguments = vec!["--backend", backend];
    arguments.extend(all.iter().flat_map(|key| ["--set", key]));
    let run = place.train("run", &arguments);
    let made_by = run.state()["backend"].as_str().expect("a name").to_owned();
    assert!(made_by.contains(backend), "{made_by} instead of {backend}");
    run.metrics()
}

/// Before any update: a few of the coarse reciprocals.
const FIRST_STEP: f64 = 1e-4;
/// After up to five updates by Adam.
const ALL_STEPS: f64 = 1e-3;

/// Holds two runs against each other, term by term, relative to each (to 0.001 where a term is smaller).
#[track_caller]
fn assert_agree(found: &[Logged], wanted: &[Logged], what: &str) {
    assert_eq!(found.len(), 6);
    // The end fields of the flow train from the first step: no warm-up.
    let first = match wanted[0].terms.contains_key("data") {
        true => "ramp",
        false => "warm_up",
    };
    let phases = [first, first, "ramp", "joint", "joint", "implicit_only"];
    let (mut worst_first, mut worst) = (0.0_f64, 0.0_f64);
    let mut where_worst = String::new();
    for ((found, wanted), phase) in found.iter().zip(wanted).zip(phases) {
        assert_eq!((found.step, wanted.phase.as_str()), (wanted.step, phase));
        assert_eq!(
            found.terms.len(),
            wanted.terms.len(),
            "{what}, step {}",
            wanted.step
        );
        for (name, value) in &wanted.terms {
            let off = (found.terms[name] - value).abs() / value.abs().max(1e-3);
            if off > worst {
                (worst, where_worst) = (off, format!("{name} at step {}", wanted.step));
            }
            if wanted.step == 1 {
                worst_first = worst_first.max(off);
            }
        }
    }
    println!("{what}: {worst_first:.1e} off at step 1, {worst:.1e} at most ({where_worst})");
    assert!(
        worst_first <= FIRST_STEP && worst <= ALL_STEPS,
        "{what}: {where_worst} is {worst:.1e} off"
    );
}

#[test]
fn the_processor_backends_and_both_kinds_of_derivatives_agree() {
    let _turn = turn();
    for (name, keys) in [("plain", PLAIN), ("ornate", ORNATE), ("flow", FLOW)] {
        let wanted = logged(keys, "ndarray", "nested");
        for (backend, derivatives) in [
            ("ndarray", "forward"),
            ("flex", "nested"),
            ("flex", "forward"),
        ] {
            let what = format!("{name}, {backend}, {derivatives}");
            assert_agree(&logged(keys, backend, derivatives), &wanted, &what);
        }
    }
}

#[test]
fn wgpu_agrees_with_ndarray() {
    let _turn = turn();
    for (name, keys, derivatives) in [
        ("plain", PLAIN, "nested"),
        ("ornate", ORNATE, "forward"),
        ("flow", FLOW, "forward"),
    ] {
        let wanted = logged(keys, "ndarray", "nested");
        let what = format!("{name}, wgpu, {derivatives}");
        assert_agree(&logged(keys, "wgpu", derivatives), &wanted, &what);
    }
}
