//! A run that was trained.

use std::path::{Path, PathBuf};

use isomorph::{
    Backend, ExtractOptions, OutputFormat, Precision, StopFlag, Trained, current_report,
};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

use crate::arrays::{array, rows};
use crate::failure::raised;
use crate::fork::{allowed, released};
use crate::train::chosen;
use crate::watch::Watch;

/// What was trained, opened.
#[pyclass(frozen, module = "isomorph._native")]
pub(crate) struct Run {
    trained: Trained,
    backend: Backend,
}

/// Opens the newest checkpoint of a run.
#[pyfunction]
pub(crate) fn open(
    py: Python<'_>,
    run: PathBuf,
    backend: &str,
    device: Option<String>,
) -> PyResult<Run> {
    let backend = chosen(backend, device.as_deref())?;
    let opened = released(py, || Trained::open(&run, backend.clone()));
    let trained = opened.map_err(raised)?;
    Ok(Run::new(trained, backend))
}

impl Run {
    pub(crate) fn new(trained: Trained, backend: Backend) -> Self {
        Self { trained, backend }
    }

    /// What was trained, for something to compute.
    ///
    /// # Errors
    /// It was opened on a GPU, by the process from which this one was forked.
    pub(crate) fn ready(&self) -> PyResult<&Trained> {
        allowed(&self.backend)?;
        Ok(&self.trained)
    }
}

#[pymethods]
impl Run {
    /// The folder.
    fn path(&self) -> PathBuf {
        self.trained.path()
    }

    /// The times of the key frames.
    fn key_times(&self) -> Vec<f64> {
        self.trained.key_times()
    }

    /// The recipe as TOML.
    fn recipe(&self) -> String {
        self.trained.recipe().to_toml()
    }

    /// The logged steps, each as a JSON object in text.
    fn metrics(&self) -> PyResult<Vec<String>> {
        let metrics = self.trained.metrics().map_err(raised)?;
        let text = |each| serde_json::to_string(each);
        let lines = metrics.iter().map(text).collect::<Result<_, _>>();
        lines.map_err(|error| PyOSError::new_err(error.to_string()))
    }

    /// Vertices, faces and normals of the surface at a time.
    #[expect(clippy::type_complexity, reason = "three arrays")]
    fn surface<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        resolution: usize,
    ) -> PyResult<(
        Bound<'py, PyArray2<f64>>,
        Bound<'py, PyArray2<u32>>,
        Bound<'py, PyArray2<f32>>,
    )> {
        let trained = self.ready()?;
        let found = released(py, || trained.surface(t, resolution)).map_err(raised)?;
        let mesh = found.mesh;
        Ok((
            array(py, mesh.vertices)?,
            array(py, mesh.triangles)?,
            array(py, mesh.normals.unwrap_or_default())?,
        ))
    }

    /// Where points at time `start` are at time `end`.
    fn carry<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        start: f64,
        end: f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (points, trained) = (rows(&points, "points")?, self.ready()?);
        let moved = released(py, || trained.carry(points, start, end));
        array(py, moved.map_err(raised)?)
    }

    /// The velocities at points and a time.
    fn velocity<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        t: f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (points, trained) = (rows(&points, "points")?, self.ready()?);
        let found = released(py, || trained.velocity(points, t));
        array(py, found.map_err(raised)?)
    }

    /// The signed distances at points and a time, and their gradients.
    #[expect(clippy::type_complexity, reason = "two arrays")]
    fn distance<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        t: f64,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>)> {
        let (points, trained) = (rows(&points, "points")?, self.ready()?);
        let found = released(py, || trained.distance(points, t)).map_err(raised)?;
        Ok((
            PyArray1::from_vec(py, found.distances),
            array(py, found.gradients)?,
        ))
    }

    /// Writes the animated files `surface.glb` and, of a mesh, `carried.glb` into a folder.
    #[pyo3(signature = (folder, frames, resolution, compact, on_event))]
    fn animate(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        frames: usize,
        resolution: Option<usize>,
        compact: bool,
        on_event: Option<Py<PyAny>>,
    ) -> PyResult<()> {
        let trained = self.ready()?;
        let mut options = ExtractOptions::of(trained.recipe());
        options.format = OutputFormat::Animation(match compact {
            true => Precision::Compact,
            false => Precision::Full,
        });
        options.times = trained.even_times(frames);
        options.resolution = resolution.unwrap_or(options.resolution);
        options.carry = true;
        options.folder = Some(folder);
        let stop = StopFlag::default();
        let mut watch = Watch::new(on_event, stop.clone());
        let ended = released(py, || {
            trained.extract(&options, &stop, |event| watch.hear(event))
        });
        watch.end(ended).map(drop)
    }

    /// The page of the run, made anew where it is older than the run.
    fn page(&self, py: Python<'_>) -> PyResult<PathBuf> {
        let trained = self.ready()?;
        let made = || match current_report(trained.path())? {
            Some(page) => Ok(page),
            None => trained.report(None),
        };
        released(py, made).map_err(raised)
    }

    fn __fspath__(&self) -> PathBuf {
        self.trained.path()
    }

    fn __repr__(&self) -> String {
        format!("<isomorph run {}>", shown(&self.trained.path()))
    }
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}
