//! The Velocity-Net `V(x)` or `V(x, t)`: displacement per unit of time (the paper, Section 4).
//!
//! `V = mlp(encode(x))`, or `mlp([encode(x), (2 t - 1) / 2])` where it depends on time. It starts close
//! to zero, so that training starts from the identity.
//!
//! # Differs from the paper
//! The paper does not say whether V depends on time; here that is a setting.
//!
//! A stationary field holds every rotation exactly, and is determined between the ends by what it is elsewhere.
//! It cannot move two limbs through one place in different directions. A field of time can, but nothing holds
//! it between the ends, so it needs a regulariser ([`crate::loss::screw`]).
//!
//! Time enters at half scale, as a coordinate between -1/2 and 1/2 like those of the points: the first weights
//! then make V vary with time about as fast as with the position, and not twice as fast.

use burn::module::{Module, ParamId};
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::encoding::{encode, encoded_width};
use super::initial;
use super::mlp::{Mlp, MlpConfig};
use crate::autodiff::{Activation, ModelBackend};

/// The output layer's share of its usual initial size: V starts near zero.
const INITIAL_OUTPUT: f64 = 0.01;

/// The shape of a [`VelocityNet`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityNetConfig {
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
    /// Whether V depends on time.
    pub time_dependent: bool,
}

impl VelocityNetConfig {
    /// The perceptron inside.
    pub fn mlp(&self) -> MlpConfig {
        MlpConfig {
            inputs: encoded_width(self.frequencies) + usize::from(self.time_dependent),
            outputs: 3,
            depth: self.depth,
            width: self.width,
            activation: self.activation,
            skip: self.skip,
        }
    }

    /// A network close to zero, the same on every backend for one seed.
    ///
    /// # Panics
    /// If `skip` is not below `depth`.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> VelocityNet<B> {
        self.init_with(3, seed, device)
    }

    /// The same with so many outputs.
    pub(crate) fn init_with<B: ModelBackend>(
        &self,
        outputs: usize,
        seed: u64,
        device: &B::Device,
    ) -> VelocityNet<B> {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let config = MlpConfig {
            outputs,
            ..self.mlp()
        };
        let layers = match self.activation {
            Activation::Softplus { .. } => initial::he(&config, INITIAL_OUTPUT, rng),
            Activation::Sine { omega } => initial::sine(&config, omega, INITIAL_OUTPUT, rng),
        };
        VelocityNet {
            mlp: config.init(&layers, device),
            frequencies: self.frequencies,
            time_dependent: self.time_dependent,
        }
    }
}

/// The network `V(x)` or `V(x, t)`.
#[derive(Module, Debug)]
pub struct VelocityNet<B: Backend> {
    pub(crate) mlp: Mlp<B>,
    pub(crate) frequencies: usize,
    pub(crate) time_dependent: bool,
}

impl<B: ModelBackend> VelocityNet<B> {
    /// `V(x, t)`.
    ///
    /// # Shapes
    /// `x`: `[n, 3]`, normalised; `t`: `[n, 1]`, in `[0, 1]`, unused by a stationary field; result
    /// `[n, 3]`, normalised units per unit of time.
    pub fn forward(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.mlp.forward(self.features(x, t))
    }

    /// The weight matrices between two hidden layers.
    pub fn hidden_weights(&self) -> Vec<ParamId> {
        self.mlp.hidden_weights()
    }

    /// What the perceptron reads: `[n, 3 (2 m + 1)]`, and a column of time where V depends on it.
    pub(crate) fn features(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let encoded = encode(x, self.frequencies);
        if self.time_dependent {
            // (2 t - 1) / 2: the reason for half of the scale is in this file's head.
            Tensor::cat(vec![encoded, t - 0.5], 1)
        } else {
            encoded
        }
    }
}
