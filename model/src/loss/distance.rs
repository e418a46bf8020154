//! The right sign and size away from the surface: `mean |f - d|` over the samples whose signed distance `d`
//! to the given points is more than 0.05 either way, 0 at the others.
//!
//! Points with normals say nothing of the space that no point is near, where the Eikonal equation alone is as
//! content with a closed surface too many as without it: what is left of the initial sphere between two legs,
//! say. Near the surface, where thin parts make `d` unreliable, the other terms rule.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

/// In normalised units: nearer than this the term says nothing.
const FAR: f64 = 0.05;

/// The mean of `|f - d|` where `|d|` is above 0.05, and of 0 elsewhere; both `[n, 1]`.
pub fn distance<B: Backend>(value: Tensor<B, 2>, distance: Tensor<B, 2>) -> Tensor<B, 1> {
    let far = distance.clone().abs().greater_elem(FAR).float();
    ((value - distance).abs() * far).mean()
}
