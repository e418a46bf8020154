//! Why a surface, or points that move with it, cannot be had.

use std::convert::Infallible;
use std::io;

use crate::cubes::{ExtractError, GridError};
use crate::formats::{CarryError, ShapeError, WriteError};
use crate::gltf::GltfError;

/// Why a frame cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FramesError {
    /// The grid cannot be made.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// Nothing moves points.
    #[error("{0}")]
    NoMotion(String),
    /// No surface at a time.
    #[error("time {time}: {reason}")]
    Extract {
        /// The time.
        time: f64,
        /// Why.
        reason: ExtractError<Infallible>,
    },
    /// The shape to be carried cannot be read.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The carried shape cannot be written.
    #[error(transparent)]
    Carry(#[from] CarryError),
    /// A surface cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// An animated file cannot be made.
    #[error(transparent)]
    Gltf(#[from] GltfError),
    /// `frames.json` cannot be written, or an event cannot be recorded.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// A method that moves no points.
pub(super) fn no_motion() -> FramesError {
    let text = "this method gives a surface and moves no points, so nothing can be carried";
    FramesError::NoMotion(text.to_owned())
}
