//! What the learner reports while it works.
//!
//! The learner computes and emits [`Event`]s; it knows no terminal and no file of theirs.
//! [`crate::report`] renders them. Steps are counted from 1 as they are done: `step` is how many are.

use std::fmt;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// A stretch of training in which the same networks and terms take part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Only the Velocity-Net trains.
    WarmUp,
    /// Both train; the weight of the coupled terms of f grows.
    Ramp,
    /// Both train with full weights.
    Joint,
    /// The Velocity-Net is done; only the Implicit-Net trains.
    ImplicitOnly,
    /// A method it is compared with: what is fitted at t = 0 and t = 1.
    Ends,
    /// A method it is compared with: what lies between, the ends being done.
    Between,
    /// A method it is compared with: what moves points.
    Motion,
}

impl fmt::Display for Phase {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::WarmUp => "velocity warm-up",
            Self::Ramp => "ramp",
            Self::Joint => "joint",
            Self::ImplicitOnly => "implicit only",
            Self::Ends => "ends",
            Self::Between => "between",
            Self::Motion => "motion",
        })
    }
}

/// One term of the objective at one step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TermReport {
    /// Its name, as in the recipe's `[loss]`.
    pub name: &'static str,
    /// Its value before the weight.
    pub raw: f64,
    /// What it adds to the total.
    pub weighted: f64,
}

/// The objective and the rates at one logged step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport {
    /// Steps done, this one included.
    pub step: usize,
    /// Steps of the whole run.
    pub steps: usize,
    /// The phase of this step.
    pub phase: Phase,
    /// Seconds of training since the run began, over all resumes.
    pub seconds: f64,
    /// The weighted sum of the terms.
    pub total: f64,
    /// The terms that took part in this step.
    pub terms: Vec<TermReport>,
    /// Learning rate of the Implicit-Net.
    pub learning_rate: f64,
    /// Learning rate of the Velocity-Net.
    pub velocity_learning_rate: f64,
    /// See [`peak_memory_bytes`](super::memory::peak_memory_bytes).
    pub peak_memory_bytes: Option<u64>,
}

/// Something that happened during training or extraction.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Training is about to make its first step in this process.
    Started {
        /// Name of the backend.
        backend: String,
        /// Device of the backend.
        device: String,
        /// Steps of the whole run.
        steps: usize,
        /// Steps that were done before: 0, or those of the checkpoint.
        first_step: usize,
        /// The networks and how many weights each has.
        networks: Vec<(&'static str, usize)>,
        /// Points sampled on the source.
        source_points: usize,
        /// Points sampled on the target.
        target_points: usize,
        /// Known correspondences between them.
        correspondences: usize,
    },
    /// Something that the user should know, in a sentence.
    Note(String),
    /// Pairs of the two shapes were found before training.
    Matched {
        /// How many.
        pairs: usize,
        /// Shares of the source and of the target that have one of them near, 0 to 1.
        coverage: [f64; 2],
        /// The median and the 95 % quantile of how far points come back from where they began that are
        /// carried from the source to the target and back, in normalised units.
        cycle: [f64; 2],
        /// Wall-clock seconds that it took.
        seconds: f64,
    },
    /// The next step is the first of a phase, or of this process.
    PhaseEntered {
        /// The phase.
        phase: Phase,
        /// Steps done before it.
        step: usize,
    },
    /// A step is done.
    Tick {
        /// Steps done.
        step: usize,
    },
    /// A step is done whose terms were read back.
    Step(StepReport),
    /// A checkpoint lies on the disk, whole.
    Checkpoint {
        /// Steps done.
        step: usize,
        /// Its folder.
        path: PathBuf,
    },
    /// Surfaces are about to be extracted.
    Extracting {
        /// How many.
        frames: usize,
    },
    /// A surface lies on the disk.
    Extracted {
        /// Its time, 0 (source) to 1 (target).
        time: f64,
        /// Its file.
        path: PathBuf,
        /// Number of vertices.
        vertices: usize,
        /// Number of triangles.
        triangles: usize,
        /// Number of connected components.
        components: usize,
        /// Components that were too small to be kept.
        left_out: usize,
        /// How far it is from the surfaces of both ends carried to its time, in the mean and normalised; none
        /// where nothing carries them.
        consistency: Option<f64>,
        /// Whether the box that was searched cuts it off.
        touches_box: bool,
    },
    /// Training stopped on request, and a checkpoint holds all of it.
    Interrupted {
        /// Steps done.
        step: usize,
    },
    /// All steps are done.
    Finished {
        /// Steps done.
        step: usize,
        /// Seconds of training since the run began, over all resumes.
        seconds: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_are_padded_like_text() {
        assert_eq!(
            format!("[{:>6}|{:<14}]", Phase::Ramp, Phase::ImplicitOnly),
            "[  ramp|implicit only ]"
        );
    }
}
