//! The Implicit-Net `f(x, t)`: the signed distance to the surface at time `t`, negative inside
//! (the paper, Section 4).
//!
//! `f(x, t) = mlp([encode(x), t])` with softplus, initialised as the sphere `|x| - r0`. With the sine
//! activation `f(x, t) = mlp([encode(x), t]) + sqrt(|x|^2 + eps) - sqrt(r0^2 + eps)`, `eps = 0.01`, so
//! that it too starts as a sphere of radius `r0`.
//!
//! # Differs from the paper
//! The paper's sphere has radius 1 in coordinates of its own; here the radius is a setting, in
//! normalised units (the mean surface area of the shapes is 1), and the initial sphere is fitted: random
//! weights alone bend it by half its radius at width 128, so the output layer is moved, by regularised
//! least squares, to where `f` is the distance to the sphere throughout the neighbourhood.

use burn::module::{Module, ParamId};
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::encoding::{encode, encoded_width, encoding_scale};
use super::initial;
use super::mlp::{HostLayer, Mlp, MlpConfig};
use crate::autodiff::{Activation, ModelBackend};

/// Under the root of the sphere that a sine network is added to, so that it is smooth at 0.
const ROUNDING: f64 = 0.01;

/// The shape of an [`ImplicitNet`] and of the sphere that it starts as.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImplicitNetConfig {
    /// Hidden layers.
    pub depth: usize,
    /// Columns of each hidden layer.
    pub width: usize,
    /// Applied after each hidden layer.
    pub activation: Activation,
    /// Octaves of the positional encoding; 0 feeds the points as they are.
    pub frequencies: usize,
    /// The hidden layer that reads the input again; 0 for none.
    pub skip: usize,
    /// Radius of the initial sphere, in normalised units.
    pub sphere_radius: f64,
}

impl ImplicitNetConfig {
    /// The perceptron inside.
    pub fn mlp(&self) -> MlpConfig {
        MlpConfig {
            inputs: encoded_width(self.frequencies) + 1,
            outputs: 1,
            depth: self.depth,
            width: self.width,
            activation: self.activation,
            skip: self.skip,
        }
    }

    /// A network whose zero set is the sphere, the same on every backend for one seed.
    ///
    /// # Panics
    /// If `skip` is not below `depth`.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> ImplicitNet<B> {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let config = self.mlp();
        match self.activation {
            Activation::Sine { omega } => {
                self.assemble(&initial::sine(&config, omega, 1e-3, rng), device)
            }
            Activation::Softplus { .. } => {
                let scale = encoding_scale(self.frequencies);
                let mut layers = initial::sphere(&config, scale, self.sphere_radius, rng);
                self.fit_sphere::<B>(&mut layers, device);
                self.assemble(&layers, device)
            }
        }
    }

    fn assemble<B: ModelBackend>(
        &self,
        layers: &[HostLayer],
        device: &B::Device,
    ) -> ImplicitNet<B> {
        ImplicitNet {
            mlp: self.mlp().init(layers, device),
            frequencies: self.frequencies,
            sphere: matches!(self.activation, Activation::Sine { .. })
                .then_some(self.sphere_radius),
        }
    }

    /// Moves the output layer so that `f` is the distance to the sphere in a ball around it.
    fn fit_sphere<B: ModelBackend>(&self, layers: &mut [HostLayer], device: &B::Device) {
        let net = self.assemble::<B>(layers, device);
        let (rows, radii) = ball(self.sphere_radius);
        let count = radii.len();
        let x = Tensor::<B, 2>::from_data(TensorData::new(rows, [count, 3]), device);
        let t = Tensor::zeros([count, 1], device);
        let features = net.features(x, t);
        let hidden = net.mlp.last_hidden(features);
        let read = |tensor: Tensor<B, 2>| tensor.into_data().iter::<f64>().collect::<Vec<f64>>();
        let values = read(net.mlp.output().forward(hidden.clone()));
        let missing: Vec<f64> = radii
            .iter()
            .zip(values)
            .map(|(radius, f)| radius - self.sphere_radius - f)
            .collect();
        // `f` is linear in the output layer, so the best one is found without iterating on the network.
        let change = initial::ridge(&read(hidden), &missing);
        if let Some(output) = layers.last_mut() {
            let weights = output.weight.iter_mut().chain(output.bias.iter_mut());
            weights
                .zip(change)
                .for_each(|(weight, by)| *weight += by as f32);
        }
    }
}

/// Points of a ball of three times the radius, denser inwards, and their distances from its centre.
fn ball(radius: f64) -> (Vec<f64>, Vec<f64>) {
    const SHELLS: usize = 24;
    let shells = (1..=SHELLS).map(|k| 3.0 * radius * k as f64 / SHELLS as f64);
    let on_shell = |r: f64| {
        directions(96)
            .into_iter()
            .map(move |d| (d.map(|c| c * r), r))
    };
    let (points, radii): (Vec<[f64; 3]>, Vec<f64>) = shells.flat_map(on_shell).unzip();
    (points.into_iter().flatten().collect(), radii)
}

/// Evenly spread unit vectors: a Fibonacci lattice.
pub(crate) fn directions(count: usize) -> Vec<[f64; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let direction = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / count as f64;
        let (ring, angle) = ((1.0 - z * z).sqrt(), golden * k as f64);
        [ring * angle.cos(), ring * angle.sin(), z]
    };
    (0..count).map(direction).collect()
}

/// The network `f(x, t)`.
#[derive(Module, Debug)]
pub struct ImplicitNet<B: Backend> {
    pub(crate) mlp: Mlp<B>,
    pub(crate) frequencies: usize,
    /// The radius of the sphere that the perceptron is added to, of a sine network.
    #[module(skip)]
    sphere: Option<f64>,
}

impl<B: ModelBackend> ImplicitNet<B> {
    /// `f(x, t)`.
    ///
    /// # Shapes
    /// `x`: `[n, 3]`, normalised; `t`: `[n, 1]`, in `[0, 1]`; result `[n, 1]`, normalised distance.
    pub fn forward(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let value = self.mlp.forward(self.features(x.clone(), t));
        match self.sphere {
            None => value,
            Some(radius) => {
                let rounded = (x.clone() * x).sum_dim(1) + ROUNDING;
                value + rounded.sqrt() - (radius * radius + ROUNDING).sqrt()
            }
        }
    }

    /// The weight matrices between two hidden layers.
    pub fn hidden_weights(&self) -> Vec<ParamId> {
        self.mlp.hidden_weights()
    }

    /// What the perceptron reads, `[n, 3 (2 m + 1) + 1]`.
    pub(crate) fn features(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        Tensor::cat(vec![encode(x, self.frequencies), t], 1)
    }

    /// The value and gradient of what is added to the perceptron, if anything is.
    pub(crate) fn sphere_jet(&self, x: Tensor<B, 2>) -> Option<(Tensor<B, 2>, Tensor<B, 2>)> {
        let radius = self.sphere?;
        let root = ((x.clone() * x.clone()).sum_dim(1) + ROUNDING).sqrt();
        let gradient = x / root.clone();
        Some((root - (radius * radius + ROUNDING).sqrt(), gradient))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, Train, host, points};

    fn config(activation: Activation, frequencies: usize, skip: usize) -> ImplicitNetConfig {
        let sphere_radius = 0.4;
        ImplicitNetConfig {
            depth: 5,
            width: 128,
            activation,
            frequencies,
            skip,
            sphere_radius,
        }
    }

    #[test]
    fn the_initial_zero_set_is_the_sphere_and_the_gradient_has_length_one() {
        let soft = Activation::Softplus { beta: 100.0 };
        let sine = Activation::Sine { omega: 20.0 };
        let cases = [
            (soft, 0, 0),
            (soft, 6, 0),
            (soft, 0, 2),
            (soft, 6, 2),
            (sine, 0, 0),
        ];
        for (activation, frequencies, skip) in cases {
            for seed in 0..3 {
                let net =
                    config(activation, frequencies, skip).init::<Train>(seed, &Default::default());
                let x = (points::<Train>(&directions(512)) * 0.4).require_grad();
                let t = Tensor::full([512, 1], 0.3, &Default::default());
                let value = net.forward(x.clone(), t);
                let off = host(value.clone()).into_iter().map(f64::abs);
                let off = off.fold(0.0, f64::max);
                let gradient = x.grad(&value.sum().backward()).expect("f depends on x");
                let norms = host(gradient.powf_scalar(2.0).sum_dim(1).sqrt());
                let steep = norms.iter().map(|norm| (norm - 1.0).abs()).sum::<f64>() / 512.0;
                let label = format!("{activation:?} m {frequencies} skip {skip} seed {seed}");
                // Random weights of width 128 bend the sphere by some hundredths of its radius; the
                // rounded norm under a sine has the slope r / sqrt(r^2 + 0.01) = 0.97.
                assert!(off < 0.06, "{label}: |f| up to {off} on the sphere");
                assert!(steep < 0.12, "{label}: mean ||grad f| - 1| = {steep}");
            }
        }
    }

    #[test]
    fn inside_is_negative_and_outside_positive() {
        let soft = Activation::Softplus { beta: 100.0 };
        let net = config(soft, 0, 0).init::<Plain>(1, &Default::default());
        for (radius, sign) in [(0.1, -1.0), (0.3, -1.0), (0.5, 1.0), (1.2, 1.0)] {
            let x = points::<Plain>(&directions(512)) * radius;
            let values = host(net.forward(x, Tensor::zeros([512, 1], &Default::default())));
            assert!(values.iter().all(|f| f * sign > 0.0), "radius {radius}");
        }
    }
}
