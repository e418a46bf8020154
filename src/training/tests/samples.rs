//! Samples, and the parts into which they are divided.

use burn::module::ParamId;
use burn::optim::GradientsParams;

use super::*;
use crate::learner::batch::{BatchSizes, draw};

#[test]
fn a_batch_is_a_function_of_seed_and_step_alone() {
    let (pair, recipe) = (pair(), recipe(&[]));
    let sizes = BatchSizes::new(&recipe.training, pair.correspondences.len(), 1);
    assert_eq!(sizes.total(), recipe.training.batch);
    let at = |step| draw(&pair, &recipe.training, sizes, step);
    assert_eq!(at(17), at(17));
    assert_ne!(at(17), at(18));
    let mut other = recipe.training.clone();
    other.seed = 1;
    assert_ne!(at(17), draw(&pair, &other, sizes, 17));
}

#[test]
fn a_batch_has_the_sizes_and_ranges_that_it_says() {
    for times in ["random", "grid"] {
        let (pair, recipe) = (pair(), recipe(&[&format!("training.times={times}")]));
        let sizes = BatchSizes::new(&recipe.training, pair.correspondences.len(), 1);
        let batch = draw(&pair, &recipe.training, sizes, 3);
        assert_eq!(batch.ends.points.len(), 2 * sizes.ends);
        assert_eq!(batch.ends.normals.len(), 2 * sizes.ends);
        assert_eq!(batch.stops.len(), 2 * sizes.carried);
        assert_eq!(
            (batch.offsets.len(), batch.uniform.points.len()),
            (sizes.band, sizes.uniform)
        );
        assert_eq!(batch.matched.0.len(), 8);
        assert!(
            batch.stops.iter().all(|t| (0.0..=1.0).contains(t)),
            "{:?}",
            batch.stops
        );
        let on_grid = batch
            .stops
            .iter()
            .all(|t| (t * 3.0 - (t * 3.0).round()).abs() < 1e-6);
        assert_eq!(on_grid, times == "grid");
        let bounds = pair.bounds.padded(recipe.training.box_margin as f32);
        let inside = |x: &[f32; 3]| {
            (0..3).all(|axis| (bounds.min[axis]..=bounds.max[axis]).contains(&x[axis]))
        };
        assert!(batch.uniform.points.iter().all(inside));
    }
}

#[test]
fn the_parts_of_a_step_add_up_to_the_whole() {
    // As drawn for 88 points and 8 correspondences, all numbers are even.
    let of = 2;
    for name in [
        "method.name=velocity-field",
        FLOW,
        "method.name=mlp",
        "method.name=sdf-blend",
        "method.name=lipmlp",
        "method.name=nise",
    ] {
        let learner = learner(&[name, "training.warm-up=0", "training.ramp-until=0"]);
        let solve = |part: Part| {
            learner
                .method
                .objective(&learner.data, 5, part)
                .solve(part.of, true)
        };
        let (whole, gradients) = solve(Part::WHOLE);
        let (terms, parts): (Vec<_>, Vec<_>) =
            (0..of).map(|index| solve(Part { index, of })).unzip();
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
        for network in 0..gradients.len() {
            let read = |params: &GradientsParams| {
                let first = params
                    .get::<NdArray, 2>(ParamId::from(1))
                    .expect("of the first layer");
                first.into_data().to_vec::<f32>().expect("f32")
            };
            let whole = read(&gradients[network]);
            let mut sum = vec![0.0; whole.len()];
            for part in &parts {
                sum.iter_mut()
                    .zip(read(&part[network]))
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

#[test]
fn large_batches_are_divided_on_a_processor_alone() {
    let parts = |batch: usize| method::parts::<B>(batch);
    assert_eq!([88, 511, 512, 1000, 2200].map(parts), [1, 1, 4, 4, 4]);
    assert_eq!([4000, 4086, 16_000].map(parts), [8, 8, 32]);
    #[cfg(feature = "wgpu")]
    assert_eq!(
        <burn_wgpu::Wgpu as isomorph_model::ModelBackend>::POINTS_AT_A_TIME,
        None
    );
}
