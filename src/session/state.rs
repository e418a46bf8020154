//! Where a run stands, from its folder alone.

use std::fs;
use std::path::Path;

use serde::Serialize;

use super::checkpoint;
use super::folder::RunFolder;
use super::lock;
use super::metrics::{self, Metrics};
use super::train::Session;
use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::recipe::Recipe;
use crate::surface::frames::FrameEntry;

/// The file that says why training failed; it goes when training begins again.
pub(super) const FAILED: &str = "failed.txt";

/// Where a run stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "state", rename_all = "kebab-case")]
pub enum RunState {
    /// There is no run yet.
    Waiting,
    /// A process trains in it.
    Running {
        /// Which, on which host, since when.
        by: String,
    },
    /// It ended before its last step, or before its surfaces; `isomorph resume` goes on.
    Interrupted,
    /// Training failed.
    Failed {
        /// With what.
        reason: String,
    },
    /// All steps are done, and all surfaces that the recipe asks for are written.
    Done,
}

/// A run in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunStatus {
    /// Where it stands.
    #[serde(flatten)]
    pub state: RunState,
    /// Steps that the newest checkpoint holds.
    pub step: usize,
    /// Steps of the whole run.
    pub steps: Option<usize>,
    /// Seconds of training, over all resumes.
    pub seconds: Option<f64>,
    /// Seconds from the first to the last line of its log: preparation and surfaces included, and the time between where
    /// it was interrupted.
    pub wall_seconds: Option<f64>,
    /// The largest peak of resident memory of its processes.
    pub peak_memory_bytes: Option<u64>,
    /// The objective at the last step that was logged.
    pub total: Option<f64>,
    /// Surfaces that are written.
    pub surfaces: usize,
    /// The greatest mean distance between surface and motion, normalised.
    pub consistency: Option<f64>,
    /// What speaks against the result, as it was said.
    pub doubts: Vec<String>,
}

impl RunStatus {
    pub(crate) fn none() -> Self {
        Self {
            state: RunState::Waiting,
            step: 0,
            steps: None,
            seconds: None,
            wall_seconds: None,
            peak_memory_bytes: None,
            total: None,
            surfaces: 0,
            consistency: None,
            doubts: Vec::new(),
        }
    }
}

impl Session {
    /// A new run of a recipe, or the run of that recipe that is in the folder; `None` if it is finished.
    ///
    /// # Errors
    /// Those of [`Session::prepare`] and [`Session::resume`]; a run of another recipe.
    pub fn begin_or_go_on(
        recipe: Recipe,
        folder: impl AsRef<Path>,
        backend: Backend,
    ) -> Result<Option<Self>> {
        let folder = folder.as_ref();
        let state = run_status(folder)?.state;
        if state == RunState::Waiting {
            return Self::prepare(recipe, folder, backend).map(Some);
        }
        let (stored, _) = RunFolder::open(folder)?.stored_recipe()?;
        if let Some(change) = stored.changes(&recipe).first() {
            let cure = match recipe.data.continues(&stored.data) {
                true => "append its further key frames with isomorph resume RUN --append FILE",
                false => "delete it, or choose another folder",
            };
            return Err(Error::usage(format!(
                "{}: is a run of another recipe ({change}); {cure}",
                folder.display()
            )));
        }
        match state {
            RunState::Done => Ok(None),
            _ => Self::resume(folder, &[], backend).map(Some),
        }
    }
}

/// Where the run in a folder stands; no run is one that waits.
///
/// # Errors
/// A recipe that cannot be read.
pub fn run_status(folder: impl AsRef<Path>) -> Result<RunStatus> {
    let mut status = RunStatus::none();
    let Ok(run) = RunFolder::open(folder.as_ref()) else {
        return Ok(status);
    };
    let (recipe, _) = run.stored_recipe()?;
    status.steps = Some(recipe.training.steps);
    let newest = checkpoint::list(&run.checkpoints());
    status.step = newest.last().map_or(0, |(step, _)| *step);
    let logged = Metrics::read(&run.path().join(metrics::FILE)).unwrap_or_default();
    if let Some(last) = logged.last() {
        (status.seconds, status.total) = (Some(last.seconds), last.total);
    }
    let peaks = logged.iter().filter_map(|line| line.peak_memory_bytes);
    status.peak_memory_bytes = peaks.max();
    let entries = fs::read_to_string(run.meshes().join("frames.json")).ok();
    let entries = entries.and_then(|text| serde_json::from_str::<Vec<FrameEntry>>(&text).ok());
    let entries = entries.unwrap_or_default();
    status.surfaces = entries.len();
    status.consistency = (entries.iter())
        .filter_map(|entry| entry.consistency)
        .reduce(f64::max);
    let log = fs::read_to_string(run.path().join("run.log")).unwrap_or_default();
    status.doubts = doubts(&log);
    status.wall_seconds = span(&log);
    let trained = status.step >= recipe.training.steps;
    let written = recipe.result.frames == 0 || !entries.is_empty();
    status.state = match lock::holder(run.path()) {
        Some(by) => RunState::Running { by },
        None if trained && written => RunState::Done,
        None => match fs::read_to_string(run.path().join(FAILED)) {
            Ok(reason) => RunState::Failed {
                reason: reason.trim().to_owned(),
            },
            Err(_) => RunState::Interrupted,
        },
    };
    Ok(status)
}

/// The seconds from the first line of a log to its last.
fn span(log: &str) -> Option<f64> {
    let time = |line: &str| humantime::parse_rfc3339(line.split(' ').next()?).ok();
    let first = log.lines().find_map(time)?;
    let last = log.lines().rev().find_map(time)?;
    last.duration_since(first)
        .ok()
        .map(|span| span.as_secs_f64())
}

/// What a log says against the result.
fn doubts(log: &str) -> Vec<String> {
    let lines = log
        .lines()
        .filter_map(|line| line.split_once(' ').map(|(_, text)| text));
    let said = lines.filter_map(|text| text.strip_prefix("doubtful: "));
    said.map(str::to_owned).collect()
}
