//! The kind of every error inside the library: the one place where it is decided what an error is to a
//! caller, and so with which status a program ends. Nothing imports this file.

use std::fmt;
use std::io;

use isomorph_training::engine::NotHere;

use crate::backend::BackendError;
use crate::charts::ChartError;
use crate::compare::{DigestError, PlanError, ReportError, StoreError};
use crate::cubes::GridError;
use crate::error::{Error, ErrorKind};
use crate::evaluate::TruthError;
use crate::formats::{CarryError, ShapeError, WriteError};
use crate::matching::MatchError;
use crate::recipe::RecipeError;
use crate::session::checkpoint::CheckpointError;
use crate::session::folder::FolderError;
use crate::session::learner::LearnerError;
use crate::session::metrics::MetricsError;
use crate::surface::FramesError;

/// Each inner error with the rule for its kind.
macro_rules! kinds {
    ($($Inner:ty: $kind:expr;)+) => { $(
        impl From<$Inner> for Error {
            fn from(error: $Inner) -> Self {
                let kind: fn(&$Inner) -> ErrorKind = $kind;
                Self::of(kind(&error), error)
            }
        }
    )+ };
}

kinds! {
    RecipeError: |_| ErrorKind::Usage;
    PlanError: |_| ErrorKind::Usage;
    GridError: |_| ErrorKind::Usage;
    NotHere: |_| ErrorKind::Usage;
    ShapeError: |_| ErrorKind::Input;
    WriteError: |_| ErrorKind::Failure;
    CarryError: |error| match error {
        CarryError::Shape(_) => ErrorKind::Input,
        _ => ErrorKind::Failure,
    };
    StoreError: |_| ErrorKind::Failure;
    DigestError: |_| ErrorKind::Failure;
    ReportError: |_| ErrorKind::Failure;
    io::Error: |_| ErrorKind::Failure;
    serde_json::Error: |_| ErrorKind::Failure;
    fmt::Error: |_| ErrorKind::Failure;
    ChartError: |_| ErrorKind::Failure;
    BackendError: |error| match error {
        BackendError::Absent(_) | BackendError::Device { .. } => ErrorKind::Usage,
        BackendError::NoDevice { .. } => ErrorKind::Failure,
    };
    LearnerError: |error| match error {
        LearnerError::Missing(_) | LearnerError::Unsolved(_) | LearnerError::NotHere(_) => {
            ErrorKind::Usage
        }
        _ => ErrorKind::Failure,
    };
    MatchError: |error| match error {
        MatchError::Option { .. } => ErrorKind::Usage,
        _ => ErrorKind::Input,
    };
    TruthError: |error| match error {
        TruthError::Span { .. } | TruthError::Option { .. } => ErrorKind::Usage,
        _ => ErrorKind::Input,
    };
    CheckpointError: |error| match error {
        CheckpointError::Io { .. } => ErrorKind::Failure,
        _ => ErrorKind::Input,
    };
    MetricsError: |_| ErrorKind::Input;
    FolderError: |error| match error {
        FolderError::Io { .. } => ErrorKind::Failure,
        _ => ErrorKind::Usage,
    };
    FramesError: |error| match error {
        FramesError::Grid(_) => ErrorKind::Usage,
        FramesError::Shape(_) => ErrorKind::Input,
        _ => ErrorKind::Failure,
    };
}

impl Error {
    /// Whether splines (the preset `instant`) failed on shapes on which networks (`quick`) may still succeed.
    pub fn calls_for_networks(&self) -> bool {
        let cause = self.cause().and_then(|cause| cause.downcast_ref());
        matches!(cause, Some(LearnerError::Unsolved(_)))
    }
}
