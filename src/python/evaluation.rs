//! Runs held against true frames.

use std::path::PathBuf;

use isomorph::evaluation::{EvaluateOptions, GroundTruth};
use isomorph::{Error, StopFlag};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use serde::Serialize;

use crate::arrays::rows;
use crate::failure::{TrainingError, raised};
use crate::fork::released;
use crate::run::Run;
use crate::watch::Watch;

/// True frames: of a file or a folder, or in memory.
#[pyclass(frozen, module = "isomorph._native")]
pub(crate) struct Frames(GroundTruth);

#[pymethods]
impl Frames {
    /// Reads a sequence.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let truth = released(py, || GroundTruth::read(&path));
        truth.map(Self).map_err(|error| raised(error.into()))
    }

    /// The vertices of each frame, and the faces of all.
    #[staticmethod]
    fn of(
        vertices: Vec<PyReadonlyArray2<'_, f64>>,
        faces: PyReadonlyArray2<'_, u32>,
    ) -> PyResult<Self> {
        let frames = vertices
            .iter()
            .map(|frame| Ok(rows(frame, "frames")?.to_vec()));
        let frames = frames.collect::<PyResult<_>>()?;
        let truth = GroundTruth::of(frames, rows(&faces, "faces")?.to_vec());
        truth.map(Self).map_err(|error| raised(Error::from(error)))
    }

    fn __len__(&self) -> usize {
        self.0.frame_count()
    }
}

/// The numbers of a run as JSON, and a table of them. `keys` are the frames that are its key frames.
#[pyfunction]
#[pyo3(signature = (run, frames, keys, samples, every, resolution, on_event))]
#[expect(
    clippy::too_many_arguments,
    reason = "a Python function with as many named arguments"
)]
pub(crate) fn evaluate(
    py: Python<'_>,
    run: &Run,
    frames: &Frames,
    keys: Vec<usize>,
    samples: usize,
    every: usize,
    resolution: Option<usize>,
    on_event: Option<Py<PyAny>>,
) -> PyResult<(String, String)> {
    let options = EvaluateOptions {
        samples,
        every,
        resolution,
    };
    let stop = StopFlag::default();
    let mut watch = Watch::new(on_event, stop.clone());
    let (trained, truth) = (run.ready()?, &frames.0);
    if let [from, to] = keys[..] {
        let ended = released(py, || {
            trained.evaluate(truth, [from, to], &options, &stop, |event| {
                watch.hear(event);
            })
        });
        let found = watch.end(ended)?;
        return Ok((json(&found)?, found.table([from, to])));
    }
    let ended = released(py, || {
        trained.evaluate_keys(truth, &keys, &options, &stop, |event| watch.hear(event))
    });
    let found = watch.end(ended)?;
    Ok((json(&found)?, found.table()))
}

/// As JSON in text.
pub(crate) fn json(value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| TrainingError::new_err(error.to_string()))
}
