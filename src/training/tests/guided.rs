//! A velocity field that learns from another one first.

use burn::tensor::Tensor;
use isomorph_spline::{SplineField, TimeBasis};

use super::*;
use crate::alike::field_mut;
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

/// A field of splines that is there already.
struct Splines(SplineField);

impl Guide for Splines {
    fn velocities(&self, places: &[[f32; 3]], times: &[f32]) -> Vec<[f32; 3]> {
        let jets = self.0.jets(places, times).into_iter();
        jets.map(|jet| jet.value).collect()
    }

    fn carried(&self, places: &[[f32; 3]], from: &[f32], to: &[f32]) -> Vec<[f32; 3]> {
        self.0.carry_each(places, from, to, 8)
    }

    fn splines(&self) -> Option<&SplineField> {
        Some(&self.0)
    }
}

/// Splines around the spheres with other numbers at each node.
fn splines() -> SplineField {
    let at_rest = SplineField::at_rest([[-1.0; 3], [2.0; 3]], 0.5, 1, TimeBasis::Linear);
    let at_rest = at_rest.expect("a small grid");
    let number = |k: usize| (k as f32 * 0.7).sin() * 0.1;
    let numbers: Vec<f32> = (0..at_rest.coefficients().len()).map(number).collect();
    SplineField::from_parts(*at_rest.grid(), TimeBasis::Linear, &numbers).expect("its own grid")
}

const TRAINED: [&str; 4] = [
    "velocity.kind=trained-spline",
    "training.guided-until=0.4",
    "training.warm-up=0",
    "training.ramp-until=0",
];

/// The method with these splines, and its data.
fn of_splines() -> (Box<dyn Method<B>>, TrainingData) {
    let mut method = build(&recipe(&TRAINED), &data());
    method.take(&Splines(splines()));
    (method, data())
}

/// The record of V.
fn velocity(method: &dyn Method<B>) -> Vec<u8> {
    let records = method.records().expect("encodes");
    records.bytes("velocity.mpk").expect("V has one").to_vec()
}

#[test]
fn a_velocity_of_splines_is_its_guide_until_its_own_terms_train_it() {
    let (mut method, data) = of_splines();
    let places = [[0.4, 0.0, 0.1], [0.0, -0.3, 0.2]];
    let rows = |x: &[[f32; 3]]| crate::tensors::rows::<NdArray, 3>(x, &Default::default());
    let v = |method: &dyn Method<B>| {
        let motion = method.motion().expect("a flow has one");
        let v = motion.velocity(rows(&places), 0.3).expect("it has one");
        v.into_data().to_vec::<f32>().expect("numbers")
    };
    let wanted = splines().values(&places, 0.3);
    let off = |(a, b): (&f32, &f32)| (a - b).abs();
    let found = v(&*method);
    let worst = found.iter().zip(wanted.as_flattened()).map(off);
    assert!(worst.fold(0.0, f32::max) < 1e-6, "{found:?}, {wanted:?}");
    let before = velocity(&*method);
    for step in 0..6 {
        assert_eq!(velocity(&*method) == before, step <= 4, "step {step}");
        let terms = advance(&mut *method, &data, step);
        let has = |name: &str| terms.iter().any(|term| term.name == name);
        // What is given is not learned.
        assert_eq!([has("guide"), has("matching")], [false, step >= 4]);
        assert!(has("data"), "the end fields train");
    }
}

#[test]
fn records_of_splines_bring_their_grid_and_are_read_with_care() {
    let (mut method, data) = of_splines();
    (0..6).for_each(|step| drop(advance(&mut *method, &data, step)));
    let records = method.records().expect("encodes");
    // Before it has a grid.
    let mut again = build(&recipe(&TRAINED), &data);
    again.restore(&records).expect("records of the same method");
    assert!(networks(&*method) == networks(&*again));
    advance(&mut *method, &data, 6);
    advance(&mut *again, &data, 6);
    assert!(networks(&*method) == networks(&*again), "bit for bit");
    for (cells, problem) in [
        ([7, 8, 8], "has another shape"),
        ([u32::MAX; 3], "more than there are coefficients"),
        ([0, 8, 8], "grid"),
    ] {
        let mut changed = records.clone();
        let file = changed
            .0
            .iter_mut()
            .find(|(name, _)| name == "velocity.mpk");
        let (_, bytes) = file.expect("V has one");
        let mut value = rmpv::decode::read_value(&mut bytes.as_slice()).expect("MessagePack");
        let grid = field_mut(field_mut(&mut value, "item"), "grid");
        *field_mut(grid, "cells") = rmpv::Value::Array(cells.map(rmpv::Value::from).to_vec());
        bytes.clear();
        rmpv::encode::write_value(bytes, &value).expect("encoded");
        let refused = build(&recipe(&TRAINED), &data).restore(&changed);
        let said = refused.expect_err("another grid").to_string();
        assert!(said.starts_with("velocity.mpk: "), "{said}");
        assert!(said.contains(problem), "{said}");
    }
}
