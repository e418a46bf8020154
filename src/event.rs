//! What is reported while work goes on.
//!
//! The library computes and emits [`Event`]s; front ends show them. Steps are counted from 1 as they are
//! done: `step` is how many are.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

pub use crate::matching::MatchStage;
pub use crate::surface::trust::Trust;
pub use isomorph_training::report::{Phase, TermReport};

#[path = "event_json.rs"]
mod as_json;
#[path = "event_line.rs"]
mod line;

pub use line::duration;
pub(crate) use line::significant;

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
    /// Peak resident memory of this process, where the system says.
    pub peak_memory_bytes: Option<u64>,
}

/// Work before the first step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preparation {
    /// Points of the shapes are sampled, and normals estimated where there are none.
    Points,
    /// Clouds are closed to meshes, and meshes arranged for exact distances.
    Distances,
}

impl fmt::Display for Preparation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Points => "sampling points and normals",
            Self::Distances => "preparing exact distances",
        })
    }
}

/// Something that happened during matching, training, extraction or measuring.
#[non_exhaustive]
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
        /// Points sampled on each key frame.
        points: Vec<usize>,
        /// Known correspondences between them.
        correspondences: usize,
    },
    /// Something that a user should read, in a sentence.
    Note(String),
    /// Something that speaks against the result.
    Doubtful {
        /// What was found.
        finding: String,
        /// What to try next.
        cure: String,
    },
    /// Work before the first step begins that has no steps of its own.
    Preparing(Preparation),
    /// Pairs of two shapes are being found, which takes a few seconds.
    Matching {
        /// What is done now.
        stage: MatchStage,
        /// Steps of the stage that are done: 0 as it begins.
        done: usize,
        /// Steps of the stage.
        total: usize,
        /// From which key frame to the next, counted from 0, and how often in all.
        interval: [usize; 2],
    },
    /// Pairs of two shapes were found before training.
    Matched {
        /// From which key frame to the next, counted from 0, and how often in all.
        interval: [usize; 2],
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
    /// How far to believe a surface that was extracted.
    Trusted {
        /// Its time, 0 to 1.
        time: f64,
        /// How far.
        trust: Trust,
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
    /// All surfaces lie on the disk, and the picture of them is being drawn.
    Drawing,
    /// The page that shows the run lies on the disk.
    Reported {
        /// Its file.
        path: PathBuf,
    },
    /// Frames are being measured against the ground truth.
    Measuring {
        /// Frames done; none while the best times are found.
        done: usize,
        /// Frames in all.
        total: usize,
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

impl Event {
    /// The event as one line of text without its end, `None` for what needs no line. `left` is how long
    /// the remaining steps may take.
    pub fn line(&self, left: Option<Duration>) -> Option<String> {
        line::line(self, left)
    }

    /// The event as one JSON object, whose field `event` names the kind. What is not finite is null.
    pub fn json(&self) -> serde_json::Value {
        as_json::value(self)
    }
}

/// The event's line; of what needs none, how far the work has come.
impl fmt::Display for Event {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tick { step } => write!(formatter, "step {step}"),
            Self::Preparing(what) => what.fmt(formatter),
            Self::Measuring { done, total } => write!(formatter, "measured {done} of {total}"),
            Self::Matching {
                stage,
                done,
                total,
                interval,
            } => {
                let percent = (100 * done).checked_div(*total).unwrap_or(100);
                write!(formatter, "{}: {stage}", finding(*interval))?;
                match done {
                    0 => Ok(()),
                    _ => write!(formatter, ", {percent} %"),
                }
            }
            _ => formatter.write_str(&self.line(None).unwrap_or_default()),
        }
    }
}

/// That pairs are being found, between which key frames of many.
fn finding([k, intervals]: [usize; 2]) -> String {
    match intervals {
        0 | 1 => "finding pairs".to_owned(),
        _ => format!("finding pairs, {} of {intervals}", k + 1),
    }
}

impl StepReport {
    /// The total of the step and its largest terms: `total 1.23 (matching 0.810, 2 more 0.420)`. Values
    /// are weighted, so that they add up to the total.
    pub fn objective(&self) -> String {
        line::objective(self)
    }
}
