//! The shape of a deformation, and how exactly its inverse is found.

/// The shape of an [`Nfgp`](super::Nfgp).
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
    /// How many parameter tensors one deformation has: a weight and a bias per layer.
    pub(super) fn parameters(&self) -> u64 {
        2 * (self.blocks * (self.depth + 1)) as u64
    }

    /// Panics unless every field has a value that its documentation allows.
    pub(super) fn check(&self) {
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
    /// by `bound`, so one of length `tolerance (1 - bound) / bound` means that this is reached; f32 allows about
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
