//! How close a learned deformation comes to the true one: metrics against vertex-consistent frames.
//!
//! | file | what it holds |
//! |---|---|
//! | `truth.rs` | the true frames, and which of them are the ends of a run |
//! | `candidate.rs` | what a method must answer to be measured |
//! | `reference.rs` | what does not depend on the method: straight lines, sampling floor |
//! | `measure.rs` | one method against the reference, frame by frame |
//! | `align.rs` | the best times of a method, in the order of the frames |
//! | `vertex_path.rs` | vertices over time: what is carried, and straight lines |
//! | `natural.rs` | the natural cubic spline through the true vertices of key frames |
//! | `sampled.rs` | a surface ready to be compared: samples, search, measures of its mesh |
//! | `metrics.rs` | two such surfaces compared |
//! | `pieces.rs` | connected pieces of a mesh |
//! | `evaluation.rs`, `mean.rs` | the results as they are printed, and their means |
//! | `table.rs` | the same as a table for people |
//! | `error.rs` | what can go wrong |
//!
//! ```text
//! GroundTruth::read -> span -> check_ends -> Reference::new -> Reference::evaluate(candidate)
//! ```
//!
//! Everything but [`GroundTruth`] is in normalised coordinates. Nothing here knows a network:
//! methods come in as [`Candidate`]s.

mod align;
mod candidate;
mod error;
mod evaluation;
mod mean;
mod measure;
mod metrics;
mod natural;
mod pieces;
mod reference;
mod sampled;
mod table;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod truth;
mod vertex_path;

pub(crate) use candidate::{Candidate, Carried, Purpose};
pub(crate) use error::{EvaluateError, TruthError};
pub use evaluation::{Compared, Drift, Evaluation, FrameResult, KeysEvaluation, Metrics};
pub(crate) use metrics::mean_squared_error;
pub(crate) use reference::{Options, Reference};
pub use truth::GroundTruth;
pub(crate) use truth::Span;
