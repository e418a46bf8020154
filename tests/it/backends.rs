//! The backends against each other, and both ways to differentiate against each other: one seed, one
//! recipe, a few steps through all phases, the same terms. Both columns, as they are and with what the presets
//! leave out.
//!
//! ndarray with nested derivatives is what the others are held against. All compute in f32 and add in
//! different orders; burn-ndarray's vectorised reciprocal is good to 4e-5 only, and Adam amplifies what
//! it is given: its first steps go the full learning rate along the sign of a gradient, however small.
//! So the first step, before any update, must agree more closely than the last. On the machine where the
//! tolerances were chosen the worst were 3.5e-7 and 1.6e-5 (ornate shipped) between the CPU backends, and 2.1e-7
//! and 2.3e-6 with wgpu on the network's column; they leave room for processors with coarser reciprocals. Of
//! wgpu on the shipped column the worst were 1.3e-6 and 1.6e-5 (ornate).
//!
//! wgpu needs a Vulkan driver; Mesa's in software will do (mesa-vulkan-drivers). Without one its test
//! fails: it does not pass over what it cannot see.

use crate::support::run::Logged;
use crate::support::workplace::{NETWORK, SHIPPED, TINY, Workplace, turn};

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

/// With splines V has one term, and none of its own.
const WITHOUT_SPLINES: &str = "training.guided-until = 0";

/// The Laplacian of V, which the preset `paper` has.
const SMOOTH: &[&str] = &["loss.smoothness = 1"];

/// What the presets leave out and both columns can have: encodings, inputs given again, sines in V, times on
/// the grid.
const ORNATE: &[&str] = &[
    "implicit.frequencies = 2",
    "implicit.skip = 2",
    "velocity.activation = \"sine\"",
    "velocity.beta = 4",
    "velocity.depth = 3",
    "velocity.frequencies = 2",
    "velocity.skip = 1",
    "loss.smoothness = 1",
    "loss.off-surface = 30",
    "training.times = \"grid\"",
];

/// What the network's column alone can have, or does not have by itself: sines in f, a V that depends on time,
/// the other integrator, the original level-set equation.
const ORNATE_NETWORK: &[&str] = &[
    "implicit.activation = \"sine\"",
    "implicit.beta = 20",
    "velocity.time-dependent = true",
    "loss.strain = 0",
    "loss.screw = 1",
    "loss.level-set-form = \"olse\"",
    "training.integrator = \"rk4\"",
    "training.time-steps = 2",
];

/// The same for the product as it ships: softplus in the end fields, the other integrator, the robust forms.
const ORNATE_SHIPPED: &[&str] = &[
    "implicit.activation = \"softplus\"",
    "implicit.beta = 100",
    "loss.strain-scale = 0.1",
    "loss.matching-scale = 0.05",
    "training.integrator = \"midpoint\"",
    "training.time-steps = 3",
];

/// Splines as V, trained from the first step on.
const TRAINED_SPLINE: &[&str] = &[
    "velocity.kind = \"trained-spline\"",
    "spline.spacing = 0.1",
    "spline.band = 2000",
    "spline.surface-samples = 50",
];

/// What is compared, with its name.
fn cases() -> [(&'static str, Vec<&'static str>); 6] {
    [
        ("shipped", SHIPPED.to_vec()),
        ("shipped, without splines", vec![WITHOUT_SPLINES]),
        ("network", [NETWORK, SMOOTH].concat()),
        (
            "ornate shipped",
            [ORNATE, ORNATE_SHIPPED, &[WITHOUT_SPLINES]].concat(),
        ),
        ("ornate network", [NETWORK, ORNATE, ORNATE_NETWORK].concat()),
        (
            "trained spline",
            [TRAINED_SPLINE, SMOOTH, &[WITHOUT_SPLINES]].concat(),
        ),
    ]
}

/// The logged steps of a run with these keys.
fn logged(keys: &[&str], backend: &str, derivatives: &str) -> Vec<Logged> {
    // Splines have no layers.
    let is_spline = keys.contains(&TRAINED_SPLINE[0]);
    let acts = |key: &&&str| !(is_spline && key.starts_with("velocity."));
    let of = |keys: &[&'static str]| -> Vec<&str> { keys.iter().filter(acts).copied().collect() };
    let place = Workplace::tiny_with(&of(TINY), &[keys, &of(PHASES)].concat());
    let set = format!("training.derivatives={derivatives}");
    let run = place.train("run", &["--backend", backend, "--set", &set]);
    let made_by = run.state()["backend"].as_str().expect("a name").to_owned();
    assert!(made_by.contains(backend), "{made_by} instead of {backend}");
    run.metrics()
}

/// Before any update: a few of the coarse reciprocals.
const FIRST_STEP: f64 = 1e-4;
/// After up to five updates.
const ALL_STEPS: f64 = 1e-3;

/// Holds two runs against each other, term by term, relative to each (to 0.001 where a term is smaller).
#[track_caller]
fn assert_agree(found: &[Logged], wanted: &[Logged], what: &str) {
    assert_eq!(found.len(), 6);
    let has = |name: &str| wanted[0].terms.contains_key(name);
    // The end fields of the flow train from the first step: no warm-up.
    let phases = match (has("guide"), has("data")) {
        (true, _) => ["guided"; 6],
        (false, true) => ["ramp", "ramp", "ramp", "joint", "joint", "implicit_only"],
        (false, false) => [
            "warm_up",
            "warm_up",
            "ramp",
            "joint",
            "joint",
            "implicit_only",
        ],
    };
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
    for (name, keys) in cases() {
        let wanted = logged(&keys, "ndarray", "nested");
        for (backend, derivatives) in [
            ("ndarray", "forward"),
            ("flex", "nested"),
            ("flex", "forward"),
        ] {
            let what = format!("{name}, {backend}, {derivatives}");
            assert_agree(&logged(&keys, backend, derivatives), &wanted, &what);
        }
    }
}

#[test]
fn wgpu_agrees_with_ndarray() {
    let _turn = turn();
    for (name, keys) in cases() {
        let wanted = logged(&keys, "ndarray", "nested");
        for derivatives in ["nested", "forward"] {
            let what = format!("{name}, wgpu, {derivatives}");
            assert_agree(&logged(&keys, "wgpu", derivatives), &wanted, &what);
        }
    }
}

#[test]
fn the_gpu_is_compared_with_a_processor_before_it_trains_and_by_a_command_of_its_own() {
    let _turn = turn();
    let place = Workplace::tiny(PHASES);
    place.train("run", &["--backend", "wgpu"]);
    let log = std::fs::read_to_string(place.path("run/run.log")).expect("a log");
    let note = "computes what a processor does: 8 operations of this run agree";
    assert!(log.contains(note), "{log}");
    let ended = place
        .isomorph(&["self-test", "recipe.toml", "--json"])
        .succeeded();
    let test: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
    // The driver's own name, by which results are filed.
    let device = test["device"].as_str().expect("a name");
    assert!(device.contains('('), "{device}");
    for operation in test["operations"].as_array().expect("a list") {
        let off = operation["off"].as_f64().expect("a number");
        assert!((0.0..1e-4).contains(&off), "{operation}");
    }
}
