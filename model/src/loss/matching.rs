//! Corresponding points meet: `mean |phi(x_0, 1) - x_1|` (the paper, `L_m`, last part).
//!
//! The distance is not squared, which is already robust against wrong pairs; with a scale `c > 0` it is
//! replaced by the bounded `c q / (1 + q)`, `q = (distance / c)^2` (Geman and McClure 1985).
//!
//! # Differs from the paper
//! The learner matches in both directions of time, forwards from `x_0` and backwards from `x_1`.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::length;

/// The robust distance of each arrival from its mark, `[n, 3]` twice to `[n, 1]`.
///
/// `scale` is in normalised units; 0 gives the plain distance.
pub fn mismatch<B: Backend>(arrived: Tensor<B, 2>, mark: Tensor<B, 2>, scale: f64) -> Tensor<B, 2> {
    let distance = length(arrived - mark);
    if scale == 0.0 {
        return distance;
    }
    let ratio = distance / scale;
    let squared = ratio.clone() * ratio;
    squared.clone() * scale / (squared + 1.0)
}

/// The mean of [`mismatch`].
pub fn matching<B: Backend>(arrived: Tensor<B, 2>, mark: Tensor<B, 2>, scale: f64) -> Tensor<B, 1> {
    mismatch(arrived, mark, scale).mean()
}
