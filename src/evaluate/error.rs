//! What can be wrong with a ground truth, or go wrong while a method is measured against it: one
//! line each, *where: what is wrong (found, allowed); what to do*.

use std::fmt::{Debug, Display};
use std::path::PathBuf;

use super::truth::{FEWEST_FRAMES, SAME_SHAPE_WITHIN};
use crate::shape::ShapeError;

/// Why a ground truth cannot be used. Frames count from 0.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TruthError {
    /// A frame cannot be read.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The path is neither a sequence nor a folder.
    #[error(
        "{}: is not a sequence (allowed: a .anime file, or a folder of .ply, .obj or .off meshes)",
        .path.display()
    )]
    NoSequence {
        /// What was given.
        path: PathBuf,
    },
    /// Too few frames to have any in between.
    #[error(
        "{}: {found} frames, at least {} needed: two ends and one in between",
        .path.display(), FEWEST_FRAMES
    )]
    TooFewFrames {
        /// The sequence.
        path: PathBuf,
        /// How many frames it has.
        found: usize,
    },
    /// A frame has no triangles.
    #[error("{}: a point cloud: ground truth needs meshes", .path.display())]
    Cloud {
        /// The file.
        path: PathBuf,
    },
    /// Two frames are not of one mesh.
    #[error(
        "{}: {problem} of {}: all frames must have the same vertices and triangles in the same \
         order",
        .path.display(), .first.display()
    )]
    Inconsistent {
        /// The file that differs.
        path: PathBuf,
        /// In what.
        problem: String,
        /// The file of the first frame.
        first: PathBuf,
    },
    /// No frame lies between these ends.
    #[error(
        "{}: frames {from} to {to}: the first must come before the last with at least one frame in \
         between (the sequence has frames 0 to {last})",
        .path.display()
    )]
    Span {
        /// The sequence.
        path: PathBuf,
        /// The frame asked for as the first.
        from: usize,
        /// The frame asked for as the last.
        to: usize,
        /// The last frame there is.
        last: usize,
    },
    /// An option of the evaluation is out of range.
    #[error("{option} = {found}: must be {allowed}")]
    Option {
        /// Its name.
        option: &'static str,
        /// Its value.
        found: usize,
        /// What is allowed.
        allowed: String,
    },
    /// An end of the run is not the frame that it is compared with.
    #[error(
        "{}: frame {frame} is not the run's {end}: on average the {end} is {distance:.4} away from \
         it (in units of the square root of the area; at most {} allowed); name the frames that \
         the run was trained on, in the coordinates of its shapes",
        .path.display(), SAME_SHAPE_WITHIN
    )]
    OtherShape {
        /// The sequence.
        path: PathBuf,
        /// The frame.
        frame: usize,
        /// `source` or `target`.
        end: &'static str,
        /// Mean distance, normalised.
        distance: f64,
    },
    /// The straight lines between the ends pass through a shape without area.
    #[error(
        "{}: at frame {frame} the straight lines between the ends make a shape without area; \
         choose ends that are closer to each other",
        .path.display()
    )]
    Collapsed {
        /// The sequence.
        path: PathBuf,
        /// The frame.
        frame: usize,
    },
}

/// Why a method could not be measured; `E` is the method's own error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum EvaluateError<E: Debug + Display> {
    /// The method could not give what a frame is compared with.
    #[error("frame {frame}, time {time:.4}: {reason}")]
    Candidate {
        /// The frame that is compared, or the one nearest to the time while aligning.
        frame: usize,
        /// The time, 0 to 1.
        time: f64,
        /// What the method said.
        reason: E,
    },
    /// The method could not carry the vertices of the first frame.
    #[error("vertices carried from frame {from}: {reason}")]
    Carrying {
        /// The first frame.
        from: usize,
        /// What the method said.
        reason: E,
    },
    /// The method carried another number of vertices, or to another number of times.
    #[error(
        "vertices carried from frame {from}: {} vertices at {} times, {} at {} needed",
        .found.1, .found.0, .needed.1, .needed.0
    )]
    Count {
        /// The first frame.
        from: usize,
        /// Times and vertices per time that came back; the vertices of the first time that differs.
        found: (usize, usize),
        /// Times and vertices asked for.
        needed: (usize, usize),
    },
    /// A surface without area, or with vertices that are not finite numbers.
    #[error(
        "frame {frame}, time {time:.4}: the {kind} mesh has {vertices} vertices, {triangles} \
         triangles and area {area}: must be positive and finite"
    )]
    Area {
        /// The frame that is compared, or the one nearest to the time while aligning.
        frame: usize,
        /// The time, 0 to 1.
        time: f64,
        /// `surface` or `carried`.
        kind: &'static str,
        /// Its vertices.
        vertices: usize,
        /// Its triangles.
        triangles: usize,
        /// Its area, normalised.
        area: f64,
    },
    /// The caller asked to stop.
    #[error("stopped after {done} of {total} frames")]
    Stopped {
        /// Frames measured.
        done: usize,
        /// Frames to be measured.
        total: usize,
    },
}
