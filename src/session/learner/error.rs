//! Why training stops before its last step.

use std::path::PathBuf;

use isomorph_training::engine::NotHere;

use crate::recipe::Change;
use crate::session::checkpoint::CheckpointError;

/// Why training stopped before its last step.
#[derive(Debug, thiserror::Error)]
pub enum LearnerError {
    /// A term of the objective or a weight is not a number any more.
    #[error(
        "step {step}: {what}; {last}; try a smaller training.learning-rate, or let training go back by itself with checkpoint.step-backs=3"
    )]
    NotFinite {
        /// The step, counted from 1.
        step: usize,
        /// The first such term and its value, or the network.
        what: String,
        /// Where the last good checkpoint is.
        last: String,
    },
    /// The method needs what the shapes do not have.
    #[error("{0}")]
    Missing(String),
    /// Splines cannot be solved for where networks could be trained.
    #[error("{0}")]
    Unsolved(String),
    /// The networks of the recipe are not those of the checkpoint.
    #[error(
        "{path}: {} is {} in the checkpoint and {} in the recipe: {why}; restore the value, or start a new run",
        change.key, change.before, change.after
    )]
    OtherNetworks {
        /// The checkpoint.
        path: PathBuf,
        /// What differs.
        change: Change,
        /// Why it may not.
        why: &'static str,
    },
    /// The shapes are not those of the checkpoint.
    #[error(
        "{0}: the shapes are not those that this run was started with (their joint size or place differs); restore the files, or start a new run"
    )]
    OtherShapes(PathBuf),
    /// The device computes something else than a processor does.
    #[error(
        "{device}: computes wrong numbers: the {what} is off by {off:.1e} of its size, and {allowed:.0e} is allowed; update the driver, choose another device with --device, or train with --backend flex"
    )]
    WrongNumbers {
        /// The device.
        device: String,
        /// What it computed.
        what: String,
        /// How far off, relative to the processor's result.
        off: f64,
        /// What is allowed.
        allowed: f64,
    },
    /// The method does not run on the backend.
    #[error(transparent)]
    NotHere(#[from] NotHere),
    /// Training has taken more memory than it may.
    #[error("{0}")]
    Memory(String),
    /// A checkpoint could not be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// An event could not be recorded, or networks not be encoded.
    #[error("{0}")]
    Record(#[from] std::io::Error),
}
