//! NFGP: deformation by an invertible network that is made to follow handles while it resists stretching
//! and bending (Yang, Belongie, Hariharan, Koltun, "Geometry Processing with Neural Fields", NeurIPS
//! 2021; its deformation part).
//!
//! `D = B_K ∘ … ∘ B_1` maps the source's space `R^3` onto that of the deformed shape by residual blocks
//! `B_k(x) = x + g_k(x)` with `Lip(g_k) <= bound < 1`. Each block is therefore one to one, its inverse is the
//! limit of `x <- y - g_k(x)`, and `D^-1` applies these from the last block to the first. One `D` holds one
//! pose: the intermediate times of a motion take one optimisation each ([`NfgpMotion`]).
//!
//! | file | what |
//! |---|---|
//! | `config` | the shape of a deformation, and how exactly it is inverted |
//! | `block` | one block `x + g(x)`, its derivative, its inverse, and why `Lip(g) <= bound` |
//! | `deformation` | the blocks, one after the other: the deformation of one pose |
//! | `energy` | the objective: handles, stretch, bend |
//! | `motion` | one deformation per trained time, as a [`crate::Motion`] |
//!
//! # Differs from the paper
//! * Layers are divided by an upper bound of their spectral norm instead of a power iteration's estimate,
//!   which lies below it, and start orthonormal (`block`).
//! * Stretch and bend are taken at given samples of the source surface. The paper has no samples of the
//!   source but a signed distance field, and draws them from that.
//! * The bend is a difference between neighbouring samples instead of a second derivative (`energy`).

mod block;
mod config;
mod deformation;
mod energy;
mod motion;

pub use self::config::{FixedPoint, NfgpConfig};
pub use self::deformation::Nfgp;
pub use self::energy::{NfgpSamples, NfgpWeights, SurfacePoint, bend, stretch, tangents};
pub use self::motion::{NfgpMotion, NfgpMotionConfig};

#[cfg(test)]
mod tests;
