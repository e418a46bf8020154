//! The deformation and the motion made of it, against closed forms and differences; the terms are in
//! `energy`.

mod energy;

use std::collections::HashSet;

use burn::module::{Module, ModuleMapper, Param, list_param_ids};
use burn::tensor::{Tensor, TensorData};

use super::block::{self, spectral_bound};
use super::*;
use crate::autodiff::ModelBackend;
use crate::flow::Motion;
use crate::operators::length;
use crate::testing::{Plain, host, points, shaken};

const SMALL: NfgpConfig = NfgpConfig {
    blocks: 3,
    depth: 2,
    width: 16,
    frequencies: 2,
    bound: 0.9,
};

/// Far from the identity: shaken so hard that every layer is at its bound.
fn strong<B: ModelBackend>() -> Nfgp<B> {
    shaken(SMALL.init(5, &Default::default()), 0.6)
}

/// Points spread over the cube of half width `size`, the same at every call.
fn scattered(count: usize, size: f64) -> Vec<[f64; 3]> {
    let coordinate = |k: usize, step: f64| size * (2.0 * (step * (k + 1) as f64).fract() - 1.0);
    // Multiples of irrational numbers fill the unit interval evenly.
    let point = |k| [0.819_172, 0.671_043, 0.549_700].map(|step| coordinate(k, step));
    (0..count).map(point).collect()
}

/// The largest distance of corresponding points.
fn farthest(a: Tensor<Plain, 2>, b: Tensor<Plain, 2>) -> f64 {
    block::largest(a - b)
}

#[test]
fn the_spectral_bound_is_the_norm_from_above() {
    let bound = |values: Vec<f64>, shape: [usize; 2]| {
        let data = TensorData::new(values, shape);
        host(spectral_bound(Tensor::<Plain, 2>::from_data(
            data,
            &Default::default(),
        )))[0]
    };
    // Singular values 3 and 1: the second adds 3^-128.
    let oblong = bound(vec![0.0, 3.0, 0.0, 1.0, 0.0, 0.0], [2, 3]);
    assert!((oblong - 3.0).abs() < 1e-5, "{oblong}");
    // Eight equal ones: 8^(1/128), the loosest case. f32 rounding, a few parts in 1e7.
    let turn = (0..64).map(|k| f64::from(u8::from(k / 8 == (k + 3) % 8)));
    let turn = bound(turn.collect(), [8, 8]);
    assert!((turn - 8f64.powf(1.0 / 128.0)).abs() < 2e-6, "{turn}");
    // Where f32 could not hold the 64th power of W^T W.
    for size in [1e-5, 1e4] {
        let scaled = bound(vec![size, 0.0, 0.0, 0.5 * size], [2, 2]);
        assert!((scaled / size - 1.0).abs() < 1e-5, "{scaled} of {size}");
    }
    assert!(bound(vec![0.0; 6], [3, 2]) < 1e-6);
}

/// The largest of `|g(x) - g(x + step)| / |step|` over all blocks and points.
fn steepest(net: &Nfgp<Plain>, x: &[[f64; 3]], steps: &[[f64; 3]]) -> f64 {
    let (near, away) = (points::<Plain>(x), points(x) + points(steps));
    let quotients = net.blocks.iter().map(|block| {
        let residual = block.residual(&net.config);
        let change = residual.value(near.clone()) - residual.value(away.clone());
        let quotient = length(change) / length(near.clone() - away.clone());
        host(quotient).into_iter().fold(0.0, f64::max)
    });
    quotients.fold(0.0, f64::max)
}

#[test]
fn no_block_exceeds_its_lipschitz_bound() {
    for (net, name) in [(strong::<Plain>(), "strong"), (steep(), "steep")] {
        for apart in [1e-2, 0.1, 1.0] {
            let mut steps = scattered(4000, apart);
            steps.reverse();
            let largest = steepest(&net, &scattered(4000, 1.0), &steps);
            // f32 rounding of differences of 1e-2 and more of values of size 1: 1e-4 of 1.
            assert!(largest <= SMALL.bound + 1e-4, "{name}, {apart}: {largest}");
        }
    }
}

#[test]
fn a_block_can_reach_its_lipschitz_bound() {
    // At the origin the encoding of the first coordinate moves along the direction that is read, and over
    // the step the cosines of the encoding stay within (2 pi 0.02)^2 / 6 of 1 on average.
    let largest = steepest(&steep(), &[[0.0; 3]], &[[0.02, 0.0, 0.0]]);
    assert!(largest > 0.997 * SMALL.bound, "{largest}");
}

/// As steep as a block can be: one unit per layer in its linear range, and a first layer along the
/// encoding's derivative by the first coordinate at the origin, three times too large everywhere.
fn steep() -> Nfgp<Plain> {
    struct Steep;
    impl ModuleMapper<Plain> for Steep {
        fn map_float<const D: usize>(
            &mut self,
            param: Param<Tensor<Plain, D>>,
        ) -> Param<Tensor<Plain, D>> {
            param.map(|weights| {
                let dims = weights.dims();
                let mut values = vec![0.0; dims[0] * dims[1]];
                // The x, sin_0 and sin_1 columns of the first coordinate; elsewhere the first unit.
                let rows: &[usize] = match dims[0] {
                    15 => &[0, 3, 9],
                    _ => &[0],
                };
                rows.iter().for_each(|row| values[row * dims[1]] = 3.0);
                Tensor::from_data(TensorData::new(values, dims), &Default::default())
            })
        }
    }
    SMALL.init(5, &Default::default()).map(&mut Steep)
}

#[test]
fn the_inverse_is_an_inverse() {
    let net = strong::<Plain>();
    let x = points(&scattered(500, 0.8));
    let y = net.forward(x.clone());
    let moved = farthest(x.clone(), y.clone());
    assert!(
        moved > 0.2,
        "close to the identity, {moved}, nothing would be tested"
    );
    // Each of three blocks within 1e-5, and what an earlier one makes of it.
    let back = farthest(net.inverse(y.clone(), FixedPoint::default()), x);
    assert!(back < 1e-4, "{back}");
    let again = farthest(
        net.forward(net.inverse(y.clone(), FixedPoint::default())),
        y,
    );
    assert!(again < 1e-4, "{again}");
}

#[test]
fn a_deformation_starts_close_to_the_identity() {
    let net = NfgpConfig::default().init::<Plain>(1, &Default::default());
    let x = points(&scattered(50, 1.0));
    let moved = farthest(net.forward(x.clone()), x);
    assert!(moved > 0.0 && moved < 0.1, "{moved}");
}

#[test]
fn layers_start_with_singular_values_that_are_all_alike() {
    let net = SMALL.init::<Plain>(1, &Default::default());
    for layer in &net.blocks[1].layers {
        let (weight, [inputs, outputs]) = (layer.weight.val(), layer.weight.dims());
        let norm = if outputs == 3 { 0.01 } else { 1.0 };
        let weight = if inputs < outputs {
            weight.transpose()
        } else {
            weight
        } / norm;
        let short = inputs.min(outputs);
        let gram = host(weight.clone().transpose().matmul(weight));
        for (place, entry) in gram.into_iter().enumerate() {
            let wanted = f64::from(u8::from(place / short == place % short));
            // Sums of at most 16 products of f32 numbers below 1.
            assert!(
                (entry - wanted).abs() < 1e-5,
                "{inputs} x {outputs}: {entry}"
            );
        }
    }
}

#[test]
fn the_jacobian_is_that_of_central_differences() {
    let (net, h) = (strong::<Plain>(), 2e-3);
    let x = scattered(20, 0.7);
    let jacobian = host(net.jacobian(points(&x)));
    for axis in 0..3 {
        let moved = |by: f64| {
            let moved: Vec<[f64; 3]> = x
                .iter()
                .map(|x| std::array::from_fn(|k| x[k] + if k == axis { by } else { 0.0 }))
                .collect();
            host(net.forward(points(&moved)))
        };
        let (ahead, behind) = (moved(h), moved(-h));
        for (entry, (a, b)) in ahead.iter().zip(behind).enumerate() {
            let (difference, written) = ((a - b) / (2.0 * h), jacobian[3 * entry + axis]);
            // f32 rounding over the step, 1e-4, and truncation: h^2 / 6 of third derivatives of size 100.
            assert!(
                (difference - written).abs() < 1e-3,
                "{entry}, {axis}: {difference} {written}"
            );
        }
    }
}

/// A motion whose poses lie as close together as trained ones.
fn motion() -> NfgpMotion<Plain> {
    let inverse = FixedPoint::default();
    let config = NfgpMotionConfig {
        deformation: SMALL,
        times: 4,
        inverse,
    };
    let mut motion = config.init::<Plain>(3, &Default::default());
    motion.replace(0, &shaken(motion.start(0), 0.1));
    for k in 1..4 {
        motion.replace(k, &shaken(motion.start(k), 0.05));
    }
    motion
}

#[test]
fn a_motion_goes_through_its_deformations_and_straight_in_between() {
    let (motion, x) = (motion(), points(&scattered(200, 0.6)));
    let carry = |to: f64| motion.carry(x.clone(), 0.0, to);
    assert_eq!(host(carry(0.0)), host(x.clone()));
    for k in 0..4 {
        let wanted = motion.deformation(k).forward(x.clone());
        // The same operations on the same numbers.
        assert_eq!(host(carry(motion.time(k))), host(wanted), "deformation {k}");
    }
    // Two f32 roundings of numbers of size 1.
    let early = x.clone() * 0.6 + carry(0.25) * 0.4;
    assert!(farthest(carry(0.1), early) < 1e-6);
    let late = carry(0.5) * 0.25 + carry(0.75) * 0.75;
    assert!(farthest(carry(0.6875), late) < 1e-6);
    let path = motion.path(x.clone(), &[0.1, 0.5]);
    let both = path.into_iter().map(host).collect::<Vec<_>>();
    assert_eq!(both, [host(carry(0.1)), host(carry(0.5))]);
}

#[test]
fn carrying_there_and_back_leaves_points_where_they_were() {
    let (motion, x) = (motion(), points(&scattered(200, 0.6)));
    for (from, to) in [
        (0.0, 1.0),
        (1.0, 0.0),
        (0.0, 0.9),
        (0.3, 0.75),
        (0.1, 0.6),
        (0.62, 0.62),
    ] {
        let there = motion.carry(x.clone(), from, to);
        let back = farthest(motion.carry(there, to, from), x.clone());
        // Two inverses, each within 1e-5 per block and what later blocks make of it.
        assert!(back < 1e-4, "{from} to {to}: {back}");
    }
    let moved = farthest(motion.carry(x.clone(), 0.3, 0.75), x);
    assert!(moved > 0.01, "a motion of {moved} tests nothing");
}

#[test]
fn the_parameters_of_all_times_have_numbers_of_their_own_and_keep_them() {
    let motion = motion();
    let ids = list_param_ids(&motion);
    let different: HashSet<_> = ids.iter().collect();
    assert_eq!((ids.len(), different.len()), (4 * 18, 4 * 18));
    let started = motion.start(2);
    assert_eq!(
        list_param_ids(&started),
        list_param_ids(motion.deformation(2))
    );
    let x = points(&scattered(10, 0.5));
    let (own, before) = (started.forward(x.clone()), motion.deformation(1).forward(x));
    assert_eq!(host(own), host(before));
}
