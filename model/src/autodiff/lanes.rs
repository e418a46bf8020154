//! What passes through the layers of a network beside the value, stacked along the batch axis.
//!
//! A *lane* is one block of `n` rows: the value, then tangents, then a Laplacian. One matrix product and one
//! activation per layer serve all of them.

use burn::tensor::backend::Backend;
use burn::tensor::ops::FloatTensor;
use burn::tensor::{Tensor, TensorPrimitive};

/// Directions of space, whose tangents the Laplacian is made from.
pub(crate) const SPATIAL: usize = 3;

/// What passes through the layers beside the value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lanes {
    /// Tangents: none, the three of space, or these and that of time.
    pub tangents: usize,
    /// Whether the Laplacian follows them.
    pub laplacian: bool,
}

impl Lanes {
    /// The value alone.
    pub const VALUE: Self = Self {
        tangents: 0,
        laplacian: false,
    };

    /// Blocks of rows, the value's included.
    pub const fn blocks(self) -> usize {
        1 + self.tangents + self.laplacian as usize
    }
}

/// A tensor of a primitive.
pub(crate) fn tensor<B: Backend>(primitive: FloatTensor<B>) -> Tensor<B, 2> {
    Tensor::from_primitive(TensorPrimitive::Float(primitive))
}

/// The primitive of a tensor.
pub(crate) fn primitive<B: Backend>(tensor: Tensor<B, 2>) -> FloatTensor<B> {
    tensor.into_primitive().tensor()
}

/// Rows of block `k`.
pub(crate) fn block<B: Backend>(stacked: &Tensor<B, 2>, k: usize, n: usize) -> Tensor<B, 2> {
    let [rows, columns] = stacked.dims();
    // A slice that takes everything is still an operation, and a node on every level of autodiff.
    if rows == n {
        return stacked.clone();
    }
    stacked.clone().slice([k * n..(k + 1) * n, 0..columns])
}
