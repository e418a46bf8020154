//! Surfaces of a trained method at chosen times, and the points that it moves.
//!
//! | file | what it holds |
//! |---|---|
//! | `learned.rs` | what was learned: its surface at a time, where its motion takes points |
//! | `flow_map.rs` | a field that a flow carries, the flow followed at few points |
//! | `agreement.rs` | whether a method's surfaces and its motion say the same |
//! | `trust.rs` | the same place by place, for files and in words |
//! | `frames.rs` | the surfaces of chosen times, as files |
//! | `layers.rs` | layers beside the surface of a time |
//! | `animation.rs` | the same as animated files, one for all times |
//! | `error.rs` | why a surface cannot be had |
//!
//! The zero set itself is found in [`crate::cubes`], files are written by [`crate::formats`].

mod agreement;
mod animation;
mod error;
mod flow_map;
pub(crate) mod frames;
mod layers;
pub(crate) mod learned;
pub(crate) mod trust;

pub(crate) use animation::animations_in;
pub(crate) use error::FramesError;
