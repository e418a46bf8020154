//! Where all jobs stand, and what the rest will take.

use std::fs;

use serde::Serialize;

use super::jobs::{Batch, Job};
use crate::session::state::{RunState, RunStatus, run_status};

/// A job and where its run stands.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JobStatus {
    /// The job's name.
    pub name: String,
    /// Its shapes.
    pub files: [String; 2],
    /// Its run.
    #[serde(flatten)]
    pub run: RunStatus,
}

/// Where each job stands, by the folders alone. One run at a time is read.
pub fn statuses(batch: &Batch) -> impl Iterator<Item = JobStatus> {
    batch.jobs.iter().map(|job| JobStatus {
        name: job.name.clone(),
        files: job.files(),
        run: status(batch, job),
    })
}

/// Where a job stands: its run, or what kept it from having one.
fn status(batch: &Batch, job: &Job) -> RunStatus {
    let failed = |reason: String| RunState::Failed { reason };
    let mut status = match run_status(batch.run(job)) {
        Ok(status) => status,
        Err(error) => RunStatus {
            state: failed(error.to_string()),
            ..RunStatus::none()
        },
    };
    let is_open = matches!(status.state, RunState::Waiting | RunState::Interrupted);
    if is_open && let Ok(reason) = fs::read_to_string(batch.error_file(job)) {
        status.state = failed(reason.trim().to_owned());
    }
    status
}

/// What the jobs that are left will take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Jobs that are not done.
    pub left: usize,
    /// Seconds of one on two cores, surfaces included.
    pub seconds: Option<f64>,
    /// Peak memory of one.
    pub memory_bytes: Option<u64>,
    /// Whether the numbers are those of jobs that are done.
    pub is_measured: bool,
}

/// What one run of a preset takes on two cores with the fox of `data/fox`, 13 surfaces included: `bench --size instant` and
/// the guide's chapter on performance. Only the order of magnitude counts.
const USUAL: [(&str, f64, u64); 4] = [
    ("instant", 10.0, 200 << 20),
    ("quick", 30.0, 250 << 20),
    ("default", 110.0, 300 << 20),
    ("quality", 900.0, 500 << 20),
];

/// Estimates by the median of the jobs that are done, else by what the preset usually takes.
pub fn estimate(batch: &Batch) -> Estimate {
    let (mut seconds, mut memory, mut left) = (Vec::new(), Vec::new(), 0);
    for job in statuses(batch) {
        if job.run.state == RunState::Done {
            seconds.extend(job.run.wall_seconds);
            memory.extend(job.run.peak_memory_bytes);
        } else {
            left += 1;
        }
    }
    seconds.sort_by(f64::total_cmp);
    memory.sort_unstable();
    let usual = USUAL
        .iter()
        .find(|(name, ..)| Some(*name) == batch.preset());
    let is_measured = !seconds.is_empty();
    Estimate {
        left,
        seconds: match is_measured {
            true => Some(seconds[seconds.len() / 2]),
            false => usual.map(|usual| usual.1),
        },
        memory_bytes: memory.last().copied().or(usual.map(|usual| usual.2)),
        is_measured,
    }
}
