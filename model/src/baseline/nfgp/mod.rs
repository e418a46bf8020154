//! NFGP: deformation by an invertible network that is made to follow handles while it resists stretching
//! and bending (Yang, Belongie, Hariharan, Koltun, "Geometry Processing with Neural Fields", NeurIPS
//! 2021; its deformation part).
//!
//! `D = B_K ∘ … ∘ B_1` maps the source's space `R^3` onto that of the deformed shape by residual blocks
//! `B_k(x) = x + g_k(x)` with `Lip(g_k) <= bound < 1`. Each block is therefore one to one, its inverse is the
//! limit of `x <- y - g_k(x)`, and `D^-1` applies these from the last block to the first. One `D` holds one
//! pose: the intermediate times of a motion take one optimisation each ([`NfgpMotion`]).
//!
//! | file | what |
//! |---|---|
//! | `block` | one block `x + g(x)`, its derivative, its inverse, and why `Lip(g) <= bound` |
//! | `energy` | the objective: handles, stretch, bend |
//! | `motion` | one deformation per trained time, as a [`crate::Motion`] |
//!
//! # Differs from the paper
//! * Layers are divided by an upper bound of their spectral norm instead of a power iteration's estimate,
//!   which lies below it, and start orthonormal (`block`).
//! * Stretch and bend are taken at given samples of the source surface. The paper has no samples of the
//!   source but a signed distance field, and draws them from that.
//! * The bend is a difference between neighbouring samples instead of a second derivative (`energy`).

mod block;
mod energy;
mod motion;

use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use self::block::{Block, Normalised};
pub use self::energy::{NfgpSamples, NfgpWeights, SurfacePoint, bend, stretch, tangents};
pub use self::motion::{NfgpMotion, NfgpMotionConfig};
use crate::backend::ModelBackend;

/// The shape of an [`Nfgp`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NfgpConfig {
    /// Residual blocks, at least 1. `D` stretches by at most `(1 + bound)^blocks`.
    pub blocks: usize,
    /// Hidden layers of each block, at least 1.
    pub depth: usize,
    /// Columns of each hidden layer, at least 1.
    pub width: usize,
    /// Octaves of the positional encoding; 0 feeds the points as they are.
    pub frequencies: usize,
    /// The Lipschitz constant that no `g` exceeds, in `(0, 1)`. Inverting a block to a tolerance takes
    /// iterations in proportion to `1 / (1 - bound)` at worst.
    pub bound: f64,
}

impl Default for NfgpConfig {
    /// The six blocks of width 256 with five octaves of the authors' published settings; two hidden layers
    /// and the bound are ours.
    fn default() -> Self {
        Self {
            blocks: 6,
            depth: 2,
            width: 256,
            frequencies: 5,
            bound: 0.9,
        }
    }
}

impl NfgpConfig {
    /// A deformation close to the identity, the same on every backend for one seed.
    ///
    /// # Panics
    /// If a field is outside the values its documentation allows.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> Nfgp<B> {
        self.numbered(seed, 0, device)
    }

    /// The same with its parameters numbered from `first + 1`.
    fn numbered<B: ModelBackend>(&self, seed: u64, first: u64, device: &B::Device) -> Nfgp<B> {
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

    /// How many parameter tensors one deformation has: a weight and a bias per layer.
    fn parameters(&self) -> u64 {
        2 * (self.blocks * (self.depth + 1)) as u64
    }

    fn check(&self) {
        let Self {
            blocks,
            depth,
            width,
            bound,
            ..
        } = *self;
        assert!(
            blocks > 0 && depth > 0 && width > 0,
            "NfgpConfig: blocks {blocks}, depth {depth}, width {width}: each must be at least 1"
        );
        assert!(
            bound > 0.0 && bound < 1.0,
            "NfgpConfig: bound {bound}: must be between 0 and 1, both excluded"
        );
    }
}

/// When the fixed-point iteration of a block ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedPoint {
    /// How far from the block's exact inverse a point may be, in normalised units, above 0. Steps shrink
    /// by `bound`, so one of length `tolerance (1 - bound) / bound` tells that this is reached; f32 allows about
    /// 1e-6.
    pub tolerance: f64,
    /// Iterations per block after which it ends in any case.
    pub iterations: usize,
}

impl Default for FixedPoint {
    /// A tolerance of 1e-5, which `bound` 0.9 reaches in 131 iterations from a point that is one unit off.
    fn default() -> Self {
        Self {
            tolerance: 1e-5,
            iterations: 200,
        }
    }
}

/// The deformation `D` of one pose.
#[derive(Module, Debug)]
pub struct Nfgp<B: Backend> {
    blocks: Vec<Block<B>>,
    #[module(skip)]
    config: NfgpConfig,
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
        let (_, columns) = self.normalised().jet_by_axes(x);
        Tensor::cat(columns.map(|column| column.reshape([n, 3, 1])).into(), 2)
    }

    /// The weights as they act, each layer divided by its spectral bound, once for several sweeps.
    fn normalised(&self) -> Normalised<B> {
        let config = &self.config;
        Normalised::new(self.blocks.iter().map(|block| block.residual(config)))
    }

    /// The values of `other` under this deformation's own parameter numbers.
    ///
    /// # Panics
    /// If the two are of different shapes.
    fn with_weights_of(&self, other: &Self) -> Self {
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

#[cfg(test)]
mod tests;
