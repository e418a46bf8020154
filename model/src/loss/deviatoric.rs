//! A velocity that keeps angles: `mean |D - (tr D / 3) I|^2`, the part of the strain rate `D` that changes
//! shape and not size (a conformal Killing energy). Beside the divergence it weighs shear apart from
//! growth; alone it suits shapes whose parts grow.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::strain::squared_norm;
use crate::operators::VelocityJet;

/// The mean over points of `|D|^2 - (tr D)^2 / 3`, which is the squared norm of the deviatoric part.
pub fn deviatoric<B: Backend>(v: &VelocityJet<B>) -> Tensor<B, 1> {
    let trace = v.divergence();
    (squared_norm(v.strain_rate()) - trace.clone() * trace / 3.0).mean()
}
