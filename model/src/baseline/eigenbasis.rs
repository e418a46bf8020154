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
//! are unlikely. What is trained is `z`, in which that prior is `|z|^2`: each mode's curl is brought to the
//! same size by `lambda^(-1/2)`, then to its deviation. So one learning rate suits all modes: 2e-3 to
//! 1e-2 in Adam.
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
mod tests {
    use super::*;
    use crate::testing::learning::{check_gradients, directions, trained};
    use crate::testing::{Plain, Train, host, points, shaken};

    fn config(modes: usize) -> EigenbasisConfig {
        EigenbasisConfig {
            modes,
            lower: [-0.4, -0.5, -0.3],
            upper: [0.4, 0.3, 0.5],
            padding: 0.2,
            steps: Steps::Even(4),
            integrator: Integrator::Rk4,
        }
    }

    /// Points of a ball of radius 0.3.
    fn cloud(count: usize) -> Vec<[f64; 3]> {
        let radius = |k: usize| 0.3 * (0.755 * k as f64).fract().sqrt();
        let at = |(k, d): (usize, &[f64; 3])| d.map(|c| c * radius(k));
        directions(count).iter().enumerate().map(at).collect()
    }

    #[test]
    fn one_mode_is_the_curl_worked_by_hand() {
        let mut field = config(1).init::<Plain>(&Default::default());
        // The box is [-0.56, -0.66, -0.46] + 1.12 [0, 1]^3; A = (0, 0, a phi), a = lambda^(-1/2).
        field.coefficients = field.coefficients.map(|_| points(&[[0.0, 0.0, 1.0]]));
        let u = [0.25, 1.0 / 3.0, 0.5f64];
        let x = [
            -0.56 + 1.12 * u[0],
            -0.66 + 1.12 * u[1],
            -0.46 + 1.12 * u[2],
        ];
        let wave = PI / 1.12;
        let a = 1.0 / (3.0f64.sqrt() * wave);
        let (s, c) = (u.map(|u| (PI * u).sin()), u.map(|u| (PI * u).cos()));
        let wanted = [
            a * wave * s[0] * c[1] * s[2],
            -a * wave * c[0] * s[1] * s[2],
            0.0,
        ];
        for (got, wanted) in host(field.velocity(points(&[x]))).into_iter().zip(wanted) {
            // f32 rounding of numbers below 1, the angle's included.
            assert!((got - wanted).abs() < 1e-6, "{got}, wanted {wanted}");
        }
    }

    #[test]
    fn the_divergence_is_zero_to_rounding() {
        let field: Eigenbasis<Train> = shaken(config(6).init(&Default::default()), 1.0);
        let x = cloud(50);
        let rows: Vec<Vec<f64>> = (0..3)
            .map(|i| {
                let x = points::<Train>(&x).require_grad();
                let component = field.velocity(x.clone()).slice([0..50, i..i + 1]);
                host(x.grad(&component.sum().backward()).expect("V depends on x"))
            })
            .collect();
        let largest = rows
            .iter()
            .flatten()
            .fold(0.0f64, |most, d| most.max(d.abs()));
        assert!(largest > 1.0, "the field hardly varies: {largest}");
        for n in 0..50 {
            let divergence: f64 = (0..3).map(|i| rows[i][3 * n + i]).sum();
            // Three f32 sums of 648 numbers below 1 each, beside derivatives of size 10.
            assert!(
                divergence.abs() < 3e-6 * largest,
                "{divergence} beside {largest}"
            );
        }
    }

    #[test]
    fn nothing_crosses_the_walls_of_the_padded_box() {
        let field: Eigenbasis<Plain> = shaken(config(6).init(&Default::default()), 1.0);
        let inside = cloud(50);
        for axis in 0..3 {
            for wall in [field.lower[axis], field.lower[axis] + field.size[axis]] {
                let on_wall = inside.iter().map(|x| {
                    let mut x = *x;
                    x[axis] = wall;
                    x
                });
                let velocity = host(field.velocity(points(&on_wall.collect::<Vec<_>>())));
                let along = |d: usize| velocity.iter().skip(d).step_by(3).map(|v| v.abs());
                let normal = along(axis).fold(0.0, f64::max);
                let tangential = along((axis + 1) % 3).fold(0.0, f64::max);
                // The wall's f32 coordinate is off by 1e-7, times derivatives of size 10.
                assert!(normal < 1e-5 && tangential > 0.1, "{normal}, {tangential}");
            }
        }
    }

    #[test]
    fn carrying_there_and_back_returns() {
        let field: Eigenbasis<Plain> = shaken(config(4).init(&Default::default()), 0.1);
        let x = cloud(50);
        let there = field.carry(points(&x), 0.2, 0.9);
        let back = host(field.carry(there.clone(), 0.9, 0.2));
        let ways = host(there).into_iter().zip(x.iter().flatten());
        let moved = ways.fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(moved > 0.05, "moved by {moved} only");
        for (got, wanted) in back.into_iter().zip(x.iter().flatten()) {
            // RK4 in 23 steps of ways of 0.1, where the field's scale is 0.3: f32 rounding.
            assert!((got - wanted).abs() < 1e-5, "{got}, wanted {wanted}");
        }
    }

    /// Turned by `angle` about the first axis.
    fn turned(x: &[[f64; 3]], angle: f64) -> Vec<[f64; 3]> {
        let (s, c) = angle.sin_cos();
        let turn = |x: &[f64; 3]| [x[0], c * x[1] - s * x[2], s * x[1] + c * x[2]];
        x.iter().map(turn).collect()
    }

    #[test]
    fn it_fits_a_rotation_and_turns_evenly() {
        let start = cloud(200);
        let field = config(6).init::<Train>(&Default::default());
        let weights = |robust_scale| EigenbasisWeights {
            matching: 1.0,
            robust_scale,
            prior: 1e-5,
        };
        let end = turned(&start, 0.7);
        for robust_scale in [0.0, 0.2] {
            let error = |field: &Eigenbasis<Train>| {
                field
                    .objective(points(&start), points(&end), &weights(0.0))
                    .read()[0]
            };
            let before = error(&field);
            let fitted = trained(field.clone(), 150, 5e-3, |field| {
                field.objective(points(&start), points(&end), &weights(robust_scale))
            });
            let after = error(&fitted);
            assert!(before > 0.1 && after < 0.1 * before, "{before} to {after}");
            // Half way in time is half way round: the field is stationary.
            let half = host(fitted.carry(points::<Train>(&start), 0.0, 0.5));
            let wanted = turned(&start, 0.35).concat();
            let off = half
                .iter()
                .zip(&wanted)
                .map(|(a, b)| (a - b).abs())
                .sum::<f64>();
            // The mean error of a coordinate, against ways of 0.1.
            assert!(off / 600.0 < 0.01, "{}", off / 600.0);
        }
    }

    #[test]
    fn the_gradient_of_every_term_reaches_the_coefficients() {
        let (start, end) = (cloud(20), turned(&cloud(20), 0.4));
        let field: Eigenbasis<Train> = shaken(config(3).init(&Default::default()), 0.2);
        for robust_scale in [0.0, 0.2] {
            check_gradients(&field, |field: &Eigenbasis<Train>| {
                let weights = EigenbasisWeights {
                    matching: 1.0,
                    robust_scale,
                    prior: 1.0,
                };
                field.objective(points(&start), points(&end), &weights)
            });
        }
    }
}
