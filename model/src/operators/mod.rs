//! Derivatives of the networks by their inputs, differentiable once more by the weights.
//!
//! | file | how |
//! |---|---|
//! | [`nested`] | repeated autodiff: the network is lifted onto further levels of autodiff and differentiated there |
//! | [`forward`] | one sweep of ordinary operations that carries value, tangents and Laplacian through `V` |
//! | [`reverse`] | one written-out reverse sweep, for `grad f` and `J^T w`, for one direction of the output |
//! | [`spline`] | the derivatives of B-splines, which are known |
//! | [`velocity_field`] | the trait of all that may be `V` |
//!
//! The first two ways stand behind one trait, [`Operators`], and must agree to f32 rounding. Naming: a *jet* is a
//! value together with its derivatives at the same points ([`jets`]).
//!
//! What nesting costs depends on the size and on the terms. A whole training step takes 1.8 to 3.0 times as long
//! with the Laplacian of `V`, and a quarter longer without it. `model/benches/README.md` has the table.

pub mod forward;
pub mod jets;
pub(crate) mod length;
pub mod nested;
pub mod reverse;
pub mod spline;
pub mod velocity_field;

use burn::tensor::Tensor;

pub use self::jets::{ImplicitJet, VelocityJet, VelocityRequest};
pub use self::length::length;
pub use self::velocity_field::VelocityField;
use crate::autodiff::ModelBackend;
use crate::nets::ImplicitNet;

/// The derivatives that the objective is made of, at `[n, 3]` positions and `[n, 1]` times.
///
/// All results are differentiable by the weights, and by the positions where those are tracked.
pub trait Operators {
    /// `f`, `grad f`, `f_t`.
    fn implicit_jet<B: ModelBackend>(
        &self,
        net: &ImplicitNet<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
    ) -> ImplicitJet<B>;

    /// `V`, `J`, and what `request` names.
    fn velocity_jet<B: ModelBackend>(
        &self,
        net: &dyn VelocityField<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        request: VelocityRequest,
    ) -> VelocityJet<B>;

    /// `V` and `J^T w` for one direction `w`, `[n, 3]`, per point: a vector-Jacobian product.
    fn pulled_back<B: ModelBackend>(
        &self,
        net: &dyn VelocityField<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        w: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>);
}

/// The two implementations, chosen by the recipe's `training.derivatives`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivatives {
    /// Repeated autodiff through the backend.
    Nested,
    /// Sweeps of ordinary operations: forward mode for `V`, a written-out reverse sweep for `f`.
    Forward,
}

impl Operators for Derivatives {
    fn implicit_jet<B: ModelBackend>(
        &self,
        net: &ImplicitNet<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
    ) -> ImplicitJet<B> {
        match self {
            Self::Nested => nested::implicit_jet(net, x, t),
            Self::Forward => reverse::implicit_jet(net, x, t),
        }
    }

    fn velocity_jet<B: ModelBackend>(
        &self,
        net: &dyn VelocityField<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        request: VelocityRequest,
    ) -> VelocityJet<B> {
        net.jet(*self, x, t, request)
    }

    fn pulled_back<B: ModelBackend>(
        &self,
        net: &dyn VelocityField<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        w: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>) {
        net.pulled_back(*self, x, t, w)
    }
}

#[cfg(test)]
mod tests;
