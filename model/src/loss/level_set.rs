//! The level-set equation that carries `f` along `V`, in the paper's two forms.
//!
//! ```text
//! OLSE:  f_t + <V, grad f> = 0
//! MLSE:  f_t + <V, grad f> + lambda_l f R = 0,   R = -<J n, n>,   n = grad f / |grad f|
//! ```
//!
//! `R` makes `|grad f| = 1` a property that the flow keeps. It acts only off the surface, where `f` is not
//! zero, so the residual is sampled there too.
//!
//! # Differs from the paper
//! The paper prints `lambda_l = 10`. On an exact moving distance field `d|grad f|/dt` along the flow
//! vanishes for `lambda_l = 1` and for no other value, so 1 is the default. `loss/tests/values.rs` checks that
//! on the expanding sphere.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::{ImplicitJet, VelocityJet};

/// `f_t + <V, grad f>`: the material derivative of `f`, `[n, 1]`.
pub fn material_derivative<B: Backend>(f: &ImplicitJet<B>, v: &VelocityJet<B>) -> Tensor<B, 2> {
    f.rate.clone() + (v.value.clone() * f.gradient.clone()).sum_dim(1)
}

/// `R = -<J n, n>`, `[n, 1]`.
pub fn stretch<B: Backend>(f: &ImplicitJet<B>, v: &VelocityJet<B>) -> Tensor<B, 2> {
    let n = f.normal();
    -(v.along(n.clone()) * n).sum_dim(1)
}

/// The residual of the level-set equation, `[n, 1]`; `lambda_l = 0` is the OLSE.
pub fn level_set_residual<B: Backend>(
    f: &ImplicitJet<B>,
    v: &VelocityJet<B>,
    lambda_l: f64,
) -> Tensor<B, 2> {
    let carried = material_derivative(f, v);
    // `R` divides by `|grad f|` and takes a product with `J`: not needed for the OLSE.
    if lambda_l == 0.0 {
        return carried;
    }
    carried + f.value.clone() * stretch(f, v) * lambda_l
}

/// The mean of `|level_set_residual|`.
pub fn level_set<B: Backend>(
    f: &ImplicitJet<B>,
    v: &VelocityJet<B>,
    lambda_l: f64,
) -> Tensor<B, 1> {
    level_set_residual(f, v, lambda_l).abs().mean()
}
