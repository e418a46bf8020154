//! The default method: two end fields that a velocity carries.
//!
//! | file | what |
//! |---|---|
//! | [`trajectory`] | `phi(x, t)`: integration of many points at once, each over its own span of time |
//! | [`transport`] | normals and gradients that travel with the points |
//! | [`morph`] | the traits of every trained method: [`Geometry`], [`Motion`], [`Carried`] |
//! | `networks` | the same of the two networks of the paper |
//! | [`end_terms`] | samples at the two ends, and the terms made of them |
//! | [`end_fields`] | the signed distance fields `g` and `h` of the source and of the target |
//! | [`geometry`] | `f(x, t)`: both end fields, carried along `V` to the time of interest |
//!
//! Arrows run from lower rows to higher ones, to [`crate::operators`] and [`crate::loss`], and never to
//! [`crate::baseline`].

pub mod end_fields;
pub mod end_terms;
pub mod geometry;
pub mod morph;
mod networks;
pub mod trajectory;
pub mod transport;

pub use end_fields::{EndFields, EndFieldsConfig};
pub use end_terms::{EndSamples, EndWeights};
pub use geometry::FlowGeometry;
pub use morph::{Carried, Geometry, Motion};
