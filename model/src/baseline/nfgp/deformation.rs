//! The deformation of one pose: residual blocks, one after the other.

use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::block::{Block, Normalised};
use super::config::{FixedPoint, NfgpConfig};
use crate::autodiff::ModelBackend;

impl NfgpConfig {
    /// A deformation close to the identity, the same on every backend for one seed.
    ///
    /// # Panics
    /// If a field is outside the values its documentation allows.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> Nfgp<B> {
        self.numbered(seed, 0, device)
    }

    /// The same with its parameters numbered from `first + 1`.
    pub(super) fn numbered<B: ModelBackend>(
        &self,
        seed: u64,
        first: u64,
        device: &B::Device,
    ) -> Nfgp<B> {
        self.check();
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let per_block = self.parameters() / self.blocks as u64;
        let blocks =
            (0..self.blocks as u64).map(|k| Block::init(self, first + k * per_block, rng, device));
        Nfgp {
            blocks: blocks.collect(),
            config: *self,
        }
    }
}

/// The deformation `D` of one pose.
#[derive(Module, Debug)]
pub struct Nfgp<B: Backend> {
    pub(super) blocks: Vec<Block<B>>,
    #[module(skip)]
    pub(super) config: NfgpConfig,
}

impl<B: ModelBackend> Nfgp<B> {
    /// `D(x)`: where points of the source go.
    ///
    /// # Shapes
    /// `[n, 3]` to `[n, 3]`, normalised.
    pub fn forward(&self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        self.normalised().forward(x)
    }

    /// `D^-1(y)`: where points of the deformed space come from.
    ///
    /// Values only: the iteration is not tracked, neither by the weights nor by `y`.
    ///
    /// # Shapes
    /// `[n, 3]` to `[n, 3]`, normalised.
    pub fn inverse(&self, y: Tensor<B, 2>, until: FixedPoint) -> Tensor<B, 2> {
        self.normalised().inverse(y, until)
    }

    /// `J = dD/dx`, `J[i, k] = dD_i / dx_k`, by one forward sweep; differentiable by the weights.
    ///
    /// # Shapes
    /// `[n, 3]` to `[n, 3, 3]`.
    pub fn jacobian(&self, x: Tensor<B, 2>) -> Tensor<B, 3> {
        let n = x.dims()[0];
        // One sweep carries the three tangents, on layers that are normalised once.
        let (_, columns) = self.normalised().jet_by_axes(x);
        Tensor::cat(columns.map(|column| column.reshape([n, 3, 1])).into(), 2)
    }

    /// The weights as they act, each layer divided by its spectral bound, once for several sweeps.
    pub(super) fn normalised(&self) -> Normalised<B> {
        let config = &self.config;
        Normalised::new(self.blocks.iter().map(|block| block.residual(config)))
    }

    /// The values of `other` under this deformation's own parameter numbers.
    ///
    /// # Panics
    /// If the two are of different shapes.
    pub(super) fn with_weights_of(&self, other: &Self) -> Self {
        assert_eq!(self.config, other.config, "shapes of two deformations");
        let pairs = self.blocks.iter().zip(&other.blocks);
        Self {
            blocks: pairs
                .map(|(own, other)| own.with_weights_of(other))
                .collect(),
            config: self.config,
        }
    }
}
