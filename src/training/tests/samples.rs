//! Samples, their streams, and the parts into which they are divided.

use std::num::NonZeroUsize;
use std::sync::Arc;

use burn::module::ParamId;

use super::*;
use crate::data::Surroundings;
use crate::samples::{Batch, BatchSizes, EndBatch, parts};

#[test]
fn a_batch_is_a_function_of_seed_and_step_alone() {
    let (data, recipe) = (data(), recipe(&[]));
    let training = &recipe.training;
    let sizes = BatchSizes::new(training, &data);
    let at = |step| Batch::draw(&data, training, sizes, step);
    assert_eq!(at(17), at(17));
    assert_ne!(at(17), at(18));
    let mut other = training.clone();
    other.seed = 1;
    assert_ne!(at(17), Batch::draw(&data, &other, sizes, 17));
}

#[test]
fn a_batch_has_the_sizes_and_ranges_that_it_says() {
    for times in ["random", "grid"] {
        let (data, recipe) = (data(), recipe(&[&format!("training.times={times}")]));
        let sizes = BatchSizes::new(&recipe.training, &data);
        let batch = Batch::draw(&data, &recipe.training, sizes, 3);
        assert_eq!(batch.ends.points.len(), 2 * sizes.ends);
        assert_eq!(batch.ends.normals.len(), 2 * sizes.ends);
        assert_eq!(batch.stops.len(), 2 * sizes.carried);
        assert_eq!(
            (batch.offsets.len(), batch.uniform.points.len()),
            (sizes.band, sizes.uniform)
        );
        assert_eq!(
            2 * (sizes.ends + sizes.carried) + sizes.band + sizes.uniform,
            recipe.training.batch
        );
        assert_eq!(batch.matched.len(), 8);
        assert!(
            batch.stops.iter().all(|t| (0.0..=1.0).contains(t)),
            "{:?}",
            batch.stops
        );
        let on_grid = |t: &f32| (t * 3.0 - (t * 3.0).round()).abs() < 1e-6;
        assert_eq!(batch.stops.iter().all(on_grid), times == "grid");
        let bounds = data.bounds.padded(recipe.training.box_margin as f32);
        let inside = |x: &[f32; 3]| {
            (0..3).all(|axis| (bounds.min[axis]..=bounds.max[axis]).contains(&x[axis]))
        };
        assert!(batch.uniform.points.iter().all(inside));
    }
}

/// The points of two lists that are equal at the same place, the second shifted to where most are.
fn most_in_step(one: &[[f32; 3]], other: &[[f32; 3]]) -> usize {
    let equal = |shift: usize| {
        let shifted = other.iter().skip(shift);
        one.iter().zip(shifted).filter(|(a, b)| a == b).count()
    };
    (0..other.len()).map(equal).max().unwrap_or(0)
}

#[test]
fn no_two_kinds_of_sample_share_their_random_numbers() {
    // Two lists of 300 of 2000 points have one in seven in step by chance; of the 4 million shifts that are
    // tried, one with eight would be luck. Kinds that shared a stream had 150 in step.
    const LUCK: usize = 8;
    let data = TrainingData::spheres(2000, 2000);
    let recipe = recipe(&["training.batch=2200", "training.correspondence-batch=300"]);
    let training = &recipe.training;
    let sizes = BatchSizes::new(training, &data);
    let kinds = |step: usize| {
        let batch = Batch::draw(&data, training, sizes, step);
        let ends = EndBatch::draw(&data, training, step, true);
        let source = |points: &[[f32; 3]]| points[..points.len() / 2].to_vec();
        [
            ("ends", source(&batch.ends.points)),
            ("starts", source(&batch.starts.points)),
            ("surface", source(&ends.surface.points)),
            ("matched", batch.matched.sources),
        ]
    };
    let all: Vec<_> = kinds(5).into_iter().chain(kinds(6)).collect();
    for (k, (name, one)) in all.iter().enumerate() {
        assert!(one.len() >= 300, "{name}: {}", one.len());
        assert_eq!(most_in_step(one, one), one.len());
        for (other_name, other) in &all[k + 1..] {
            let most = most_in_step(one, other).max(most_in_step(other, one));
            assert!(most < LUCK, "{name} and {other_name}: {most} in step");
        }
    }
    // The same numbers for a time and for a coordinate would show as equal shares.
    let batch = Batch::draw(&data, training, sizes, 5);
    let between = EndBatch::draw(&data, training, 5, true).between;
    let shared = batch.stops.iter().zip(&between).filter(|(a, b)| a == b);
    let inner = shared.filter(|(a, _)| **a > 0.0 && **a < 1.0).count();
    assert!(inner < LUCK, "{inner} times");
}

#[test]
fn the_parts_of_a_step_add_up_to_the_whole_in_every_method() {
    // As drawn for 88 points and 8 correspondences, all numbers are even.
    const OF: usize = 2;
    for spec in trained() {
        let (data, name) = (data(), spec.described());
        let early = ["training.warm-up=0", "training.ramp-until=0"];
        let extra = if spec.is_baseline { &[][..] } else { &early };
        let recipe = recipe_of(spec, extra);
        let method = build(&recipe, &data);
        let drawn = method.draw(&data, 5);
        let (whole, gradients) = solve(&*method, &data, &drawn, 5, Part::WHOLE);
        let part = |index| solve(&*method, &data, &drawn, 5, Part { index, of: OF });
        let (terms, parts): (Vec<_>, Vec<_>) = (0..OF).map(part).unzip();
        assert!(!whole.is_empty(), "{name}");
        for (whole, sum) in whole.iter().zip(posed::mean_of(&terms)) {
            assert_eq!(whole.name, sum.name);
            // Means of some dozen f32 of the size of the term, in another order.
            let off = (whole.raw - sum.raw).abs();
            assert!(
                off <= 1e-5 * whole.raw.abs().max(1e-3),
                "{name}, {}: {whole:?} and {sum:?}",
                whole.name
            );
        }
        for (network, of_network) in gradients.iter().enumerate() {
            let whole = first_layer(of_network).expect("of the first layer");
            let mut sum = vec![0.0; whole.len()];
            for part in &parts {
                let part = first_layer(&part[network]).expect("of the first layer");
                sum.iter_mut()
                    .zip(part)
                    .for_each(|(sum, value)| *sum += value);
            }
            let size = whole
                .iter()
                .fold(0.0f32, |most, value| most.max(value.abs()));
            assert!(size > 0.0, "{name}: the first layer has a gradient");
            for (whole, sum) in whole.iter().zip(sum) {
                // Cancelling sums of f32 as large as the weighted terms.
                assert!(
                    (whole - sum).abs() <= 1e-3 * size,
                    "{name}: {whole} and {sum} of {size}"
                );
            }
        }
    }
}

/// The gradient by the weights with the least number, whatever their shape.
pub(super) fn first_layer(gradients: &GradientsParams) -> Option<Vec<f32>> {
    let read = |id: u64| {
        let id = ParamId::from(id);
        let matrix = gradients.get::<NdArray, 2>(id);
        matrix.map(|matrix| matrix.into_data().to_vec::<f32>().expect("f32"))
    };
    (0..100).find_map(read)
}

#[test]
fn parts_are_a_function_of_the_batch_alone_and_hold_every_sample_once() {
    assert_eq!([88, 511, 512, 1000, 2200].map(parts), [1, 1, 4, 4, 4]);
    assert_eq!([4000, 4086, 16_000].map(parts), [8, 8, 32]);
    // No backend appears here: what is drawn is the same for all, and so is what a part of it holds.
    let data = TrainingData::spheres(500, 77);
    for batch in [64, 513, 1001, 2200] {
        let recipe = recipe(&[
            &format!("training.batch={batch}"),
            "training.correspondence-batch=50",
        ]);
        let (training, of) = (&recipe.training, parts(batch));
        let drawn = Drawn {
            batch: Batch::draw(&data, training, BatchSizes::new(training, &data), 2),
            ends: EndBatch::draw(&data, training, 2, true),
            ..Drawn::default()
        };
        let share = |index: usize| drawn.part(Part { index, of });
        let sizes = |drawn: &Drawn| {
            let (batch, ends) = (&drawn.batch, &drawn.ends);
            let of_v = [
                batch.starts.points.len(),
                batch.offsets.len(),
                batch.matched.len(),
            ];
            let of_f = [
                batch.ends.points.len(),
                ends.surface.points.len(),
                ends.space.points.len(),
            ];
            [of_v, of_f].concat()
        };
        let whole = sizes(&drawn);
        for index in 0..of {
            let equal: Vec<usize> = sizes(&share(index)).iter().map(|size| size * of).collect();
            assert_eq!(equal, whole, "{batch}");
        }
        let mut united: Vec<_> = (0..of).flat_map(|k| share(k).batch.starts.points).collect();
        let mut points = drawn.batch.starts.points.clone();
        united.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
        points.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
        assert_eq!(united, points, "{batch}");
    }
}

/// A ball of radius 0.4 with a hollow of radius 0.3.
struct Hollow;

impl Surroundings for Hollow {
    fn signed_distance(&self, x: [f32; 3]) -> Option<f32> {
        let r = radius(x);
        Some((r - 0.4).max(0.3 - r))
    }

    fn nearest(&self, _: usize, _: NonZeroUsize) -> Vec<usize> {
        Vec::new()
    }
}

fn radius(x: [f32; 3]) -> f32 {
    x.iter().map(|part| part * part).sum::<f32>().sqrt()
}

#[test]
fn half_of_the_samples_of_the_box_lie_in_a_hollow_where_distances_are_measured() {
    let mut data = data();
    // Those of the band are near the points, far from the hollow.
    for key in &mut data.keys {
        key.points = vec![[5.0, 0.0, 0.0]; 10].into();
        key.normals = Some(vec![[1.0, 0.0, 0.0]; 10].into());
    }
    data.keys[1].around = Arc::new(Hollow);
    let recipe = recipe(&["training.batch=2200", "training.band-share=0.75"]);
    let share = |measured: bool| {
        let drawn = EndBatch::draw(&data, &recipe.training, 7, measured);
        [0.0, 1.0].map(|time| {
            let space = drawn.space.points.iter().zip(&drawn.space.times);
            let in_box = space.filter(|(x, t)| **t == time && x[0] < 3.0);
            let (mut deep, mut all) = (0.0, 0.0);
            for (x, _) in in_box {
                all += 1.0;
                deep += f64::from(u8::from(radius(*x) < 0.3));
            }
            deep / all
        })
    };
    // The hollow has 0.11 of a box of about 1.
    let [source, target] = share(true);
    assert!(source < 0.2 && target > 0.5, "{source} {target}");
    let [source, target] = share(false);
    assert!(source < 0.2 && target < 0.2, "{source} {target}");
}
