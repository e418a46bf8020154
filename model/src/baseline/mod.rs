//! The methods that the paper compares with, on the same networks, terms and samples.
//!
//! | file | method | source | gives |
//! |---|---|---|---|
//! | [`linear`] | straight lines between corresponding points | | points |
//! | [`mlp`] | `f(x, t)` fitted at t = 0, 1 and nowhere else | the paper, Section 5 | surface |
//! | [`blend`] | `(1 - t) g + t h` of the two distance fields | Payne and Toga 1992 | surface |
//! | [`lipmlp`] | `f(x, t)` with a trained, regularised bound on its slope in time | Liu et al. 2022 | surface |
//! | [`nise`] | `f(x, t)` under a level-set equation between `g` and `h` | Novello et al. 2023 | surface |
//! | [`nfgp`] | an invertible deformation that keeps lengths and curvature | Yang et al. 2021 | points |
//! | [`eigenbasis`] | the flow of a divergence-free field in a sine basis | Eisenberger et al. 2019 | points |
//! | [`efis`] | an invertible flow of affine couplings between two fields | Buonomo et al. 2026 | surface, points |
//!
//! A method that gives a surface implements [`crate::Geometry`], one that moves points [`crate::Motion`].
//! Each has a configuration (`init`), a burn module, and an [`crate::Objective`] of named terms made from
//! samples given as tensors; [`crate::flow::end_terms`] holds what several of them share. Samples and steps of
//! the optimiser are made elsewhere.

pub mod blend;
pub mod efis;
pub mod eigenbasis;
pub mod linear;
pub mod lipmlp;
pub mod mlp;
pub mod nfgp;
pub mod nise;
