//! The mathematics of isomorph: a time-varying neural signed distance field `f(x, t)` carried by an
//! explicit velocity field `V`, their derivatives, and the objective that trains them together.
//!
//! The method is that of "Implicit Neural Surface Deformation with Explicit Velocity Fields"
//! (ICLR 2025), called *the paper* below. This crate uses burn, and the package `isomorph-spline`. It reads no file and no clock, and writes
//! to no terminal.
//!
//! | paper | here | shape |
//! |---|---|---|
//! | `x` | points | `[n, 3]` |
//! | `t` | times, in `[0, 1]` | `[n, 1]` |
//! | `f(x, t)` | [`ImplicitNet::forward`] | `[n, 1]` |
//! | `grad f`, `f_t` | [`operators::ImplicitJet`] | `[n, 3]`, `[n, 1]` |
//! | `V(x)`, `V(x, t)` | [`VelocityNet::forward`], or a spline, [`SplineVelocity::forward`] | `[n, 3]` |
//! | `J = dV/dx`, `div V`, Laplacian of `V` | [`operators::VelocityJet`] | `[n, 3, 3]`, `[n, 1]`, `[n, 3]` |
//! | `phi(x, t)` | [`trajectory::integrate`] | `[n, 3]` |
//! | `f(x, t)` of two end fields carried by `V` | [`FlowGeometry`] | `[n, 1]` |
//! | `gamma(x)`, positional encoding | [`nets::encoding::encode`] | `[n, 3 (2 m + 1)]` |
//! | `L_f`, `L_v`, `L_m` | one file per term in [`loss`], summed by [`Objective`] | `[1]` |
//! | the methods compared with | one file each in [`baseline`], each a [`Geometry`] or a [`Motion`] | |
//!
//! Networks, operators and terms are generic over the burn backend. A training backend is
//! `Autodiff<Inner>`; derivatives by the input lift it by one or two further levels of autodiff
//! ([`operators::Derivatives::Nested`]) or run one sweep of ordinary operations
//! ([`operators::Derivatives::Forward`]).
//!
//! Each folder uses those above it in this table and none below:
//!
//! | folder | what |
//! |---|---|
//! | [`autodiff`] | products, activations and their kernels, differentiable at every level |
//! | [`nets`] | the two networks |
//! | [`operators`] | their derivatives by the inputs |
//! | [`loss`] | the terms of the objective |
//! | [`flow`] | the default method: end fields, trajectories, and the geometry that both make |
//! | [`baseline`] | the methods compared with |

// The thrice lifted autodiff types nest deeper than the default limit allows.
#![recursion_limit = "256"]

pub mod autodiff;
pub mod baseline;
pub mod flow;
pub mod linear;
pub mod loss;
pub mod nets;
mod objective;
pub mod operators;

pub use autodiff::{ModelBackend, TrainBackend, product, without_denormals};
pub use flow::{Carried, FlowGeometry, Geometry, Motion, trajectory};
pub use nets::{
    ImplicitNet, ImplicitNetConfig, IntervalVelocity, Mlp, MlpConfig, SequenceVelocity,
    SequenceVelocityConfig, SplineGrid, SplineVelocity, VelocityNet, VelocityNetConfig,
};
pub use objective::{Objective, Term};

#[cfg(test)]
mod testing;
