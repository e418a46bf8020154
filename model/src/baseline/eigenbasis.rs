//! The flow of a stationary divergence-free field, a sum of curls of sine modes of a box, fitted to
//! correspondences (Eisenberger, Laehner, Cremers, "Divergence-Free Shape Interpolation and
//! Correspondence", Eurographics 2019): no network, and a strong method where pairs are known.
//!
//! On the box, `u = (x - lower) / size` in `[0, 1]^3`, with `k = 1 .. modes` along each axis:
//!
//! ```text
//! phi_k(x) = sin(pi k_1 u_1) sin(pi k_2 u_2) sin(pi k_3 u_3),      lambda_k = pi^2 sum (k_d / size_d)^2
//! V = curl A,    A_j = sum_k a_kj phi_k                            div V = 0,  <V, n> = 0 on the walls
//! a_kj = z_kj lambda_k^(-1/2) (lambda_k / lambda_min)^(-3/4)
//! ```
//!
//! The source takes `V` for a Gaussian field whose modes have variances `lambda^(-D/2)`, `D = 3`: rough ones
//! are unlikely. What is trained is `z`, in which that prior is `|z|^2`. One learning rate then suits all
//! modes: 2e-3 to 1e-2 in Adam.
//!
//! The factor `lambda^(-1/2)` bounds the curls of the modes and does not make them equal: their sizes are in
//! proportion to `sqrt(1 - (pi k_j / size_j)^2 / lambda_k)`. On a cube that is 0.82 for `k = (1, 1, 1)`, and 0.14
//! for `k = (10, 1, 1)` where `A` points along the first axis. For the same `V`, `|z|^2` weighs more there.
//!
//! ```text
//! matching   mean |phi(x_0, 1) - x_1|, or its bounded form (crate::loss::matching)
//! prior      sum z^2 / 2
//! ```
//!
//! # Differs from the source
//! The source alternates with a search for correspondences and solves by Gauss-Newton; here the
//! correspondences are given and any optimiser of first order will do. The box is that of both shapes, padded.

use std::f64::consts::PI;

use burn::module::{Module, Param, ParamId};
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};

use crate::autodiff::{ModelBackend, product};
use crate::flow::morph::{Motion, follow};
use crate::flow::trajectory::{Integrator, Steps, integrate};
use crate::loss;
use crate::objective::Objective;

/// A quarter of the dimension: the exponent of the eigenvalue in a mode's standard deviation.
const DECAY: f64 = 0.75;

/// The basis and how its flow is integrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EigenbasisConfig {
    /// Modes along each axis; `3 modes^3` coefficients.
    pub modes: usize,
    /// The lower corner of the bounding box of both shapes, normalised units.
    pub lower: [f64; 3],
    /// Its upper corner.
    pub upper: [f64; 3],
    /// By what share of its longest side the box is widened on each side: nothing crosses its walls.
    pub padding: f64,
    /// How the time from 0 to 1 is divided in training.
    pub steps: Steps,
    /// The method of integration in training.
    pub integrator: Integrator,
}

impl EigenbasisConfig {
    /// A field that is zero.
    ///
    /// # Panics
    /// If the padded box is flat or there are no modes.
    pub fn init<B: ModelBackend>(&self, device: &B::Device) -> Eigenbasis<B> {
        let sides = [0, 1, 2].map(|axis| self.upper[axis] - self.lower[axis]);
        let pad = self.padding * sides[0].max(sides[1]).max(sides[2]);
        let size = sides.map(|side| side + 2.0 * pad);
        let flat = size.iter().any(|side| *side <= 0.0);
        assert!(
            self.modes > 0 && !flat,
            "Eigenbasis: {} modes in a box of {size:?}: at least one mode and a box with a volume",
            self.modes
        );
        let coefficients = Tensor::zeros([self.modes.pow(3), 3], device).require_grad();
        Eigenbasis {
            coefficients: Param::initialized(ParamId::from(1), coefficients),
            modes: self.modes,
            lower: self.lower.map(|corner| corner - pad),
            size,
            steps: self.steps,
            integrator: self.integrator,
        }
    }
}

/// The weight of each term and the form of the matching.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EigenbasisWeights {
    /// Corresponding points meet.
    pub matching: f64,
    /// The scale of the bounded mismatch, normalised units; 0 for the plain distance.
    pub robust_scale: f64,
    /// Rough modes are unlikely.
    pub prior: f64,
}

/// The field `V` and its flow.
#[derive(Module, Debug)]
pub struct Eigenbasis<B: Backend> {
    /// `z`, `[modes^3, 3]`: a row per mode (the third axis runs fastest), a column per component of `A`.
    coefficients: Param<Tensor<B, 2>>,
    modes: usize,
    #[module(skip)]
    lower: [f64; 3],
    #[module(skip)]
    size: [f64; 3],
    #[module(skip)]
    steps: Steps,
    #[module(skip)]
    integrator: Integrator,
}

impl<B: ModelBackend> Eigenbasis<B> {
    /// `V(x)`.
    ///
    /// # Shapes
    /// `x`: `[n, 3]`, normalised, inside the padded box (outside `V` goes on as its mirror image); result
    /// `[n, 3]`, normalised units per unit of time.
    pub fn velocity(&self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        product(self.derivatives(x), self.mixing())
    }

    /// The terms "matching" and "prior"; `x0` and `x1`: corresponding points at t = 0 and t = 1, `[n, 3]`.
    pub fn objective(
        &self,
        x0: Tensor<B, 2>,
        x1: Tensor<B, 2>,
        weights: &EigenbasisWeights,
    ) -> Objective<B> {
        let mut objective = Objective::new();
        objective.add("matching", weights.matching, || {
            let from = Tensor::zeros([x0.dims()[0], 1], &x0.device());
            let to = from.ones_like();
            let mixing = self.mixing();
            let rhs = |x, _| product(self.derivatives(x), mixing.clone());
            let arrived = integrate(rhs, x0, from, to, self.steps, self.integrator);
            loss::matching::matching(arrived, x1, weights.robust_scale)
        });
        objective.add("prior", weights.prior, || {
            let z = self.coefficients.val();
            (z.clone() * z).sum() * 0.5
        });
        objective
    }

    /// `d phi_k / d u_d / (pi k_d)`, `[n, 3 modes^3]`: all modes for the first axis, then for the others.
    fn derivatives(&self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        let waves: Vec<f64> = (1..=self.modes).map(|k| PI * k as f64).collect();
        let waves = Tensor::from_data(TensorData::new(waves, [1, self.modes]), &x.device());
        let [n, _] = x.dims();
        let axes = [0, 1, 2].map(|axis| {
            let along = x.clone().slice([0..n, axis..axis + 1]);
            let angle = (along - self.lower[axis]) / self.size[axis] * waves.clone();
            (angle.clone().sin(), angle.cos())
        });
        // A mode is a product over the axes: three waves per frequency and axis give all `modes^3` of them.
        let [(s1, c1), (s2, c2), (s3, c3)] = axes;
        let first = products(c1, products(s2.clone(), s3.clone()));
        let second = products(s1.clone(), products(c2, s3));
        let third = products(s1, products(s2, c3));
        Tensor::cat(vec![first, second, third], 1)
    }

    /// What [`Self::derivatives`] is multiplied by to give `curl A`, `[3 modes^3, 3]`.
    fn mixing(&self) -> Tensor<B, 2> {
        let z = self.coefficients.val();
        let count = z.dims()[0];
        // a_j pi k_d / size_d: the coefficients of d A_j / d x_d.
        let [d1, d2, d3] = self.slopes().map(|factor| {
            let factor = Tensor::from_data(TensorData::new(factor, [count, 1]), &z.device());
            let scaled = z.clone() * factor;
            [0, 1, 2].map(|j| scaled.clone().slice([0..count, j..j + 1]))
        });
        // The curl is linear in `z`: written as a matrix, it makes `V` one product, and it is built once for all
        // steps of a trajectory.
        let zero = Tensor::zeros([count, 1], &z.device());
        // V = (d2 A3 - d3 A2, d3 A1 - d1 A3, d1 A2 - d2 A1).
        let [_, d1_a2, d1_a3] = d1;
        let [d2_a1, _, d2_a3] = d2;
        let [d3_a1, d3_a2, _] = d3;
        let rows = [
            [zero.clone(), -d1_a3, d1_a2],
            [d2_a3, zero.clone(), -d2_a1],
            [-d3_a2, d3_a1, zero],
        ];
        Tensor::cat(rows.map(|row| Tensor::cat(row.to_vec(), 1)).to_vec(), 0)
    }

    /// `pi k_d / size_d` times the size of each mode in terms of its `z`, for each axis `d`.
    fn slopes(&self) -> [Vec<f64>; 3] {
        let frequency = |axis: usize, k: usize| PI * k as f64 / self.size[axis];
        let eigenvalue = |k: [usize; 3]| {
            (0..3)
                .map(|axis| frequency(axis, k[axis]).powi(2))
                .sum::<f64>()
        };
        let smallest = eigenvalue([1; 3]);
        let all = 1..=self.modes;
        let pairs = |i| {
            all.clone()
                .flat_map(move |j| (1..=self.modes).map(move |k| [i, j, k]))
        };
        let modes: Vec<[usize; 3]> = all.clone().flat_map(pairs).collect();
        [0, 1, 2].map(|axis| {
            let each = modes.iter().map(|k| {
                let lambda = eigenvalue(*k);
                frequency(axis, k[axis]) / lambda.sqrt() * (lambda / smallest).powf(-DECAY)
            });
            each.collect()
        })
    }
}

impl<B: ModelBackend> Motion<B> for Eigenbasis<B> {
    fn carry(&self, x: Tensor<B, 2>, from: f64, to: f64) -> Tensor<B, 2> {
        let mixing = self.mixing();
        follow(
            |x, _| product(self.derivatives(x), mixing.clone()),
            x,
            from,
            to,
        )
    }
}

/// All products of a column of `a` with a column of `b`, those of `b` running fastest.
///
/// `[n, p]` and `[n, q]` to `[n, p q]`.
fn products<B: Backend>(a: Tensor<B, 2>, b: Tensor<B, 2>) -> Tensor<B, 2> {
    let ([n, p], [_, q]) = (a.dims(), b.dims());
    (a.reshape([n, p, 1]) * b.reshape([n, 1, q])).reshape([n, p * q])
}

#[cfg(test)]
mod tests;
