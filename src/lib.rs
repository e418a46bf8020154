//! isomorph learns a continuous deformation between two shapes: a time-varying neural signed distance
//! field carried by an explicit velocity field. This library is all of the program but its `main`.
//!
//! A reader's path: `main.rs`, [`cli`] (`train.rs`), [`learner`] (`mod.rs`, `step.rs`), then the terms and
//! operators in [`isomorph_model`]. Arrows run one way: `cli -> learner -> model`,
//! `cli -> surface -> model`, `cli -> evaluate -> shape`, `cli -> matching -> shape`,
//! `cli -> compare -> evaluate`.

// The thrice lifted autodiff types nest deeper than the default limit allows.
#![recursion_limit = "256"]

pub mod atomic;
pub mod backend;
pub mod charts;
pub mod cli;
pub mod compare;
pub mod evaluate;
pub mod learner;
pub mod matching;
pub mod picture;
pub mod recipe;
pub mod report;
pub mod run_directory;
pub mod shape;
pub mod surface;
mod tensors;
mod workers;
