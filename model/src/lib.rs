//! The mathematics of isomorph: a time-varying neural signed distance field `f(x, t)` carried by an
//! explicit velocity field `V`, their derivatives, and the objective that trains them together.
//!
//! The method is that of "Implicit Neural Surface Deformation with Explicit Velocity Fields"
//! (ICLR 2025), called *the paper* below. This crate knows burn; it knows no file, no clock and no
//! terminal.
//!
//! | paper | here | shape |
//! |---|---|---|
//! | `x` | points | `[n, 3]` |
//! | `t` | times, in `[0, 1]` | `[n, 1]` |
//! | `f(x, t)` | [`ImplicitNet::forward`] | `[n, 1]` |
//! | `grad f`, `f_t` | [`operators::ImplicitJet`] | `[n, 3]`, `[n, 1]` |
//! | `V(x)`, `V(x, t)` | [`VelocityNet::forward`] | `[n, 3]` |
//! | `J = dV/dx`, `div V`, Laplacian of `V` | [`operators::VelocityJet`] | `[n, 3, 3]`, `[n, 1]`, `[n, 3]` |
//! | `phi(x, t)` | [`trajectory::integrate`] | `[n, 3]` |
//! | `f(x, t)` of two end fields carried by `V` | [`FlowGeometry`] | `[n, 1]` |
//! | `gamma(x)`, positional encoding | [`encoding::encode`] | `[n, 3 (2 m + 1)]` |
//! | `L_f`, `L_v`, `L_m` | one file per term in [`loss`], summed by [`Objective`] | `[1]` |
//! | the methods compared with | one file each in [`baseline`], seen as [`Geometry`] or [`Motion`] | |
//!
//! Networks, operators and terms are generic over the burn backend. A training backend is
//! `Autodiff<Inner>`; derivatives by the input lift it by one or two further levels of autodiff
//! ([`operators::Derivatives::Nested`]) or run one sweep of ordinary operations
//! ([`operators::Derivatives::Forward`]).

// The thrice lifted autodiff types nest deeper than the default limit allows.
#![recursion_limit = "256"]

pub mod activation;
pub mod backend;
pub mod baseline;
pub mod encoding;
mod flow;
#[cfg(any(feature = "ndarray", feature = "flex"))]
mod host;
mod implicit_net;
mod initial;
pub mod jet;
#[cfg(any(feature = "ndarray", feature = "flex"))]
mod kernel;
pub mod linear;
pub mod loss;
mod machine;
mod mlp;
mod morph;
mod objective;
pub mod operators;
mod product;
pub mod trajectory;
mod velocity_net;

pub use backend::{ModelBackend, TrainBackend};
pub use flow::FlowGeometry;
pub use implicit_net::{ImplicitNet, ImplicitNetConfig};
pub use machine::without_denormals;
pub use mlp::{Mlp, MlpConfig};
pub use morph::{Carried, Geometry, Motion};
pub use objective::{Objective, Term};
pub use product::product;
pub use velocity_net::{VelocityNet, VelocityNetConfig};

#[cfg(test)]
mod testing;
