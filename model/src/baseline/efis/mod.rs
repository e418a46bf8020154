//! EFIS: two fitted distance fields, joined by an invertible flow that needs no integrator (Buonomo, Digne,
//! Chaine, "Explicit Flows for Implicit Surfaces", ACM Transactions on Graphics 45(4), 2026).
//!
//! `Phi_t` maps a space of its own onto that of time `t`: a chain of affine couplings conditioned on `t` (RealNVP;
//! Dinh, Sohl-Dickstein, Bengio 2017). It has an exact inverse and an exact determinant. With
//!
//! ```text
//! flow(x; s -> t) = Phi_t(Phi_s^-1(x))
//! f(x, t) = (1 - t) g(flow(x; t -> 0)) + t h(flow(x; t -> 1))
//! ```
//!
//! the surface at `t` is made of the fields `g` and `h` of both ends, which are constants while the flow is trained.
//!
//! | file | what |
//! |---|---|
//! | `coupling` | one affine coupling, its inverse, and the derivatives of both |
//! | `flow` | the couplings, one after the other: `Phi_t`, and `flow` as a [`crate::Motion`] |
//! | `geometry` | `f(x, t)` as a [`crate::Geometry`] |
//! | `objective` | the terms that train the flow |
//!
//! # Differs from the paper
//! * The flow starts within 1e-3 of the identity. The source trains it to the identity for 500 steps.
//! * The source carries points of an end to the other end by way of a random time between. That time cancels:
//!   `flow(flow(x; 0 -> t); t -> 1) = flow(x; 0 -> 1)`.
//! * Data and landmarks are squared distances of one weight. The source's weight of the landmarks was not known here.
//! * Normals to be reached are those of the end fields, as everywhere else are their signs.

mod coupling;
mod flow;
mod geometry;
mod objective;

pub use self::coupling::CarriedJet;
pub use self::flow::{CouplingFlow, CouplingFlowConfig};
pub use self::geometry::EfisGeometry;
pub use self::objective::{EfisSamples, EfisWeights, isometry, objective};

#[cfg(test)]
mod tests;
