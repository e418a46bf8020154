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
    /// Nothing but a mesh that moves.
    #[error("this method has no distance field, so it has no layers")]
    NoField,
    /// No surface at a time.
    #[error("time {time}: {reason}")]
    Extract {
        /// The time.
        time: f64,
        /// Why.
        reason: ExtractError<Infallible>,
    },
    /// No surface at a distance from that of a time.
    #[error("time {time}, layer {offset}: {reason}; take a layer nearer to the surface")]
    Layer {
        /// The time.
        time: f64,
        /// The distance, in the user's unit.
        offset: f64,
        /// Why.
        reason: ExtractError<Infallible>,
    },
    /// A layer that reaches out of the box that was learned.
    #[error(
        "time {time}, layer {offset}: reaches out of the box around the shapes; take a layer nearer to the \
         surface, or train with a larger training.box-margin"
    )]
    LayerCutOff {
        /// The time.
        time: f64,
        /// The distance, in the user's unit.
        offset: f64,
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
