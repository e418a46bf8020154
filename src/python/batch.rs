//! Many runs from one file of jobs.

use std::path::PathBuf;

use isomorph::StopFlag;
use isomorph::batch::{
    Batch as Jobs, Ended, RunBatch, Share, Told, at_a_time, collect, cores, estimate, run, run_one,
    statuses,
};
use pyo3::prelude::*;
use serde_json::json;

use crate::evaluation::json as text;
use crate::failure::raised;
use crate::fork::released;
use crate::train::chosen;
use crate::watch::Watch;

/// A file of jobs.
#[pyclass(frozen, module = "isomorph._native")]
pub(crate) struct Batch(Jobs);

#[pymethods]
impl Batch {
    #[new]
    fn new(path: PathBuf) -> PyResult<Self> {
        let jobs = Jobs::read(&path).map_err(raised)?;
        // What is wrong with a key is wrong with the first recipe already.
        jobs.recipe(&jobs.jobs[0]).map_err(raised)?;
        Ok(Self(jobs))
    }

    /// Where the runs go.
    fn folder(&self) -> PathBuf {
        self.0.folder.clone()
    }

    /// The names of all jobs, in the order of the file.
    fn names(&self) -> Vec<String> {
        self.0.jobs.iter().map(|job| job.name.clone()).collect()
    }

    /// Where each job stands, as JSON.
    fn status(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        released(py, || statuses(&self.0).collect::<Vec<_>>())
            .iter()
            .map(text)
            .collect()
    }

    /// Writes the figures of all runs; gives the files.
    fn collect(&self, py: Python<'_>) -> PyResult<[PathBuf; 4]> {
        let found = released(py, || collect(&self.0)).map_err(raised)?;
        Ok(found.files)
    }

    /// Works through the jobs. `command` is what runs one job with its name behind it. Gives the numbers of jobs that
    /// are done, have failed, and are left.
    #[pyo3(signature = (command, jobs_at_a_time, backend, device, on_event))]
    fn run(
        &self,
        py: Python<'_>,
        command: Vec<String>,
        jobs_at_a_time: Option<usize>,
        backend: &str,
        device: Option<String>,
        on_event: Option<Py<PyAny>>,
    ) -> PyResult<(usize, usize, usize)> {
        let backend = chosen(backend, device.as_deref())?;
        let options = RunBatch {
            command,
            at_a_time: jobs_at_a_time
                .unwrap_or_else(|| at_a_time(estimate(&self.0).memory_bytes, &backend)),
            cores: cores(),
            share: Share::ALL,
        };
        let stop = StopFlag::default();
        let mut watch = Watch::new(on_event, stop.clone());
        let ended = released(py, || {
            run(&self.0, &options, &stop, |told, ended| {
                watch.hear_json(|| event(&told, ended));
            })
        });
        let ended = watch.end(ended)?;
        Ok((ended.done, ended.failed, ended.left))
    }
}

/// Trains the run of one job, or goes on with it.
#[pyfunction]
pub(crate) fn run_job(
    py: Python<'_>,
    jobs: PathBuf,
    name: &str,
    backend: &str,
    device: Option<String>,
) -> PyResult<()> {
    let backend = chosen(backend, device.as_deref())?;
    let jobs = Jobs::read(&jobs).map_err(raised)?;
    let job = jobs.job(name).map_err(raised)?;
    let stop = StopFlag::default();
    let mut watch = Watch::new(None, stop.clone());
    let ended = released(py, || {
        run_one(&jobs, job, backend, stop, |event| watch.hear(event))
    });
    watch.end(ended)
}

/// What is told, as an event; none where nothing is new.
fn event(told: &Told<'_>, ended: Ended) -> Option<serde_json::Value> {
    let (name, job, more) = match told {
        Told::Started(job) => ("job_started", job, json!({})),
        Told::Done(job, seconds) => ("job_done", job, json!({ "seconds": seconds })),
        Told::Failed(job, reason) => ("job_failed", job, json!({ "reason": reason })),
        Told::Elsewhere(job, by) => ("job_elsewhere", job, json!({ "by": by })),
        Told::Nothing => return None,
    };
    let mut event = json!({ "event": name, "job": job.name });
    event["done"] = ended.done.into();
    event["failed"] = ended.failed.into();
    event["left"] = ended.left.into();
    for (key, value) in more.as_object().into_iter().flatten() {
        event[key] = value.clone();
    }
    Some(event)
}
