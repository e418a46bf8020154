//! What is trained: the Implicit-Net `f(x, t)`, the Velocity-Net `V(x, t)` or a spline in its place, and what
//! these are made of.
//!
//! | file | what |
//! |---|---|
//! | [`implicit_net`] | `f(x, t)`, a signed distance that starts as that of a sphere |
//! | [`velocity_net`] | `V(x)` or `V(x, t)`, which starts close to zero |
//! | [`spline_velocity`], [`spline_grid`] | `V` of B-splines on a grid, in the place of the Velocity-Net |
//! | [`sequence_velocity`] | `V(x, t)` through many key frames: a Velocity-Net with a last layer that changes with time |
//! | [`mlp`] | the multilayer perceptron inside both |
//! | [`encoding`] | the positional encoding of the points that enter it |
//! | `initial` | the initial weights |
//! | `renumber` | the numbers of parameters, where one module holds several networks |
//!
//! These files use [`crate::autodiff`] and nothing above it. Derivatives of the networks are in [`crate::operators`].

pub mod encoding;
pub mod implicit_net;
pub(crate) mod initial;
pub mod mlp;
mod renumber;
pub mod sequence_velocity;
pub mod spline_grid;
pub mod spline_velocity;
pub mod velocity_net;

pub use implicit_net::{ImplicitNet, ImplicitNetConfig};
pub use mlp::{Mlp, MlpConfig};
pub(crate) use renumber::{apart, renumbered};
pub use sequence_velocity::{IntervalVelocity, SequenceVelocity, SequenceVelocityConfig};
pub use spline_grid::SplineGrid;
pub use spline_velocity::SplineVelocity;
pub use velocity_net::{VelocityNet, VelocityNetConfig};
