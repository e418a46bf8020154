//! The right sign and size away from the surface: `mean |f - d|` over the samples whose signed distance `d`
//! to the given points is more than 0.05 either way, 0 at the others.
//!
//! Points with normals do not determine the space far from all points. The Eikonal equation holds there with a
//! closed surface too many as well, such as a rest of the initial sphere between two legs. Near the surface,
//! where thin parts make `d` unreliable, the other terms decide.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

/// In normalised units: nearer than this the term is 0.
const FAR: f64 = 0.05;

/// The mean of `|f - d|` where `|d|` is above 0.05, and of 0 elsewhere; both `[n, 1]`.
pub fn distance<B: Backend>(value: Tensor<B, 2>, distance: Tensor<B, 2>) -> Tensor<B, 1> {
    let far = distance.clone().abs().greater_elem(FAR).float();
    ((value - distance).abs() * far).mean()
}
