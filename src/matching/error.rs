//! Why two shapes could not be matched.

use std::path::PathBuf;

use crate::shape::ShapeError;

/// What went wrong, in a line: where, what, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MatchError {
    /// A shape cannot be used.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// An option out of range.
    #[error("{option} {found}: must be {allowed}")]
    Option {
        /// The flag.
        option: &'static str,
        /// Its value.
        found: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// No pair is sure enough.
    #[error(
        "{} and {}: no pair of vertices has a confidence of {least} or more; check that both show the same \
         thing, lower the least confidence (such as 0.1), or give pairs by hand",
        .source_path.display(), .target_path.display()
    )]
    NoPairs {
        /// The source's file.
        source_path: PathBuf,
        /// The target's file.
        target_path: PathBuf,
        /// The least confidence that was asked for.
        least: f64,
    },
}
