//! A velocity field that learns from another one first.

use burn::tensor::Tensor;

use super::*;
use crate::data::Guide;
use crate::report::Phase;

/// A turn about z by one radian.
pub(super) struct Turning;

impl Guide for Turning {
    fn velocities(&self, places: &[[f32; 3]], _: &[f32]) -> Vec<[f32; 3]> {
        places.iter().map(|[x, y, _]| [-y, *x, 0.0]).collect()
    }

    fn carried(&self, places: &[[f32; 3]], from: &[f32], to: &[f32]) -> Vec<[f32; 3]> {
        let turned = |(k, &[x, y, z]): (usize, &[f32; 3])| {
            let (sin, cos) = (to[k] - from[k]).sin_cos();
            [cos * x - sin * y, sin * x + cos * y, z]
        };
        places.iter().enumerate().map(turned).collect()
    }
}

/// How far a method carries a place beside where the guide carries it, in the mean of some places.
fn off(method: &dyn Method<B>) -> f32 {
    let places = [[0.4, 0.0, 0.1], [0.0, -0.3, 0.2], [-0.3, 0.3, 0.0]];
    let x = crate::tensors::rows::<NdArray, 3>(&places, &Default::default());
    let motion = method.motion().expect("a flow has one");
    let arrived = motion.carry(x, 0.0, 1.0);
    let there = Turning.carried(&places, &[0.0; 3], &[1.0; 3]);
    let there = crate::tensors::rows::<NdArray, 3>(&there, &Default::default());
    let squares: Tensor<NdArray, 2> = (arrived - there).powi_scalar(2).sum_dim(1);
    squares.sqrt().mean().into_scalar()
}

const ALL_GUIDED: [&str; 4] = [
    FLOW,
    "training.guided-until=1",
    "training.steps=300",
    "training.velocity-learning-rate=1e-2",
];

#[test]
fn a_guided_velocity_field_becomes_its_guide_and_the_end_fields_train_beside_it() {
    let data = data();
    let mut method = build(&recipe(&ALL_GUIDED), &data);
    let before = off(&*method);
    let terms: Vec<Vec<TermReport>> = (0..300)
        .map(|step| advance(&mut *method, &data, step))
        .collect();
    let named = |step: usize, name: &str| {
        let term = terms[step].iter().find(|term| term.name == name);
        term.map(|term| term.raw)
    };
    assert_eq!(named(0, "matching"), None, "it has no term of its own");
    let (first, last) = (named(0, "guide"), named(299, "guide"));
    assert!(
        last < first.map(|value| 0.05 * value),
        "{first:?}, {last:?}"
    );
    assert!(named(299, "data") < named(0, "data").map(|value| 0.8 * value));
    let after = off(&*method);
    assert!(after < 0.25 * before, "{after}, of {before}");
}

#[test]
fn its_own_terms_take_over_after_the_guided_steps() {
    let data = data();
    let recipe = recipe(&[
        FLOW,
        "training.guided-until=0.4",
        "training.warm-up=0",
        "training.ramp-until=0",
    ]);
    let mut method = build(&recipe, &data);
    for step in 0..6 {
        let is_guided = step < 4;
        assert_eq!(
            method.phase(step) == Phase::Guided,
            is_guided,
            "step {step}"
        );
        let terms = advance(&mut *method, &data, step);
        let has = |name: &str| terms.iter().any(|term| term.name == name);
        assert_eq!([has("guide"), has("matching")], [is_guided, !is_guided]);
    }
}

#[test]
fn parts_of_guided_samples_are_the_whole() {
    let data = data();
    let recipe = recipe(&[FLOW, "training.guided-until=1", "training.batch=880"]);
    let method = build(&recipe, &data);
    let (drawn, parts) = (method.draw(&data, 3), method.parts());
    assert_eq!(parts, 4);
    let whole = &drawn.guided;
    assert!(!whole.velocities.is_empty());
    let of = (0..parts).map(|index| drawn.part(Part { index, of: parts }).guided);
    let of: Vec<_> = of.collect();
    assert!(
        of.iter()
            .all(|part| part.velocities.len() == whole.velocities.len() / parts)
    );
    for (k, place) in whole.at.points.iter().enumerate() {
        let part = &of[k % parts];
        assert_eq!(part.at.points[k / parts], *place);
        assert_eq!(part.velocities[k / parts], whole.velocities[k]);
    }
}
