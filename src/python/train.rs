//! Training: new runs, and those that go on.

use std::path::{Path, PathBuf};

use isomorph::morph::{MorphOptions, plan_morph};
use isomorph::{Appended, Backend, Recipe, Session};
use pyo3::prelude::*;

use crate::failure::raised;
use crate::fork::{allowed, released};
use crate::run::Run;
use crate::watch::Watch;

/// A recipe, every key with its value, as TOML. Paths in the text are relative to the folder of `origin`.
#[pyfunction]
pub(crate) fn recipe(text: &str, origin: PathBuf, changes: Vec<String>) -> PyResult<String> {
    let recipe = parsed(text, &origin, &changes)?;
    Ok(recipe.to_toml())
}

/// A recipe, what it takes for granted, and what may be wrong with it: a finding and a cure each.
type Plan = (String, Vec<String>, Vec<(String, String)>);

/// A recipe for files as TOML, what it takes for granted, and what may be wrong with it.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "a Python function with as many named arguments"
)]
pub(crate) fn plan(
    py: Python<'_>,
    files: Vec<PathBuf>,
    times: Option<Vec<f64>>,
    preset: String,
    pairs: Option<String>,
    align: String,
    frames: usize,
    changes: Vec<String>,
) -> PyResult<Plan> {
    let options = MorphOptions {
        align,
        pairs,
        preset,
        times,
        frames,
        changes,
    };
    let plan = released(py, || plan_morph(&files, &options));
    let plan = plan.map_err(raised)?;
    let doubts = plan
        .doubts
        .into_iter()
        .map(|doubt| (doubt.finding, doubt.cure));
    Ok((plan.recipe.to_toml(), plan.assumed, doubts.collect()))
}

/// Trains a recipe into a folder.
#[pyfunction]
#[pyo3(signature = (text, origin, changes, run, replace, backend, device, on_event))]
#[expect(
    clippy::too_many_arguments,
    reason = "a Python function with as many named arguments"
)]
pub(crate) fn train(
    py: Python<'_>,
    text: &str,
    origin: PathBuf,
    changes: Vec<String>,
    run: PathBuf,
    replace: bool,
    backend: &str,
    device: Option<String>,
    on_event: Option<Py<PyAny>>,
) -> PyResult<Run> {
    let recipe = parsed(text, &origin, &changes)?;
    let backend = chosen(backend, device.as_deref())?;
    let session = released(py, || Session::prepare(recipe, &run, backend.clone()));
    let session = session.map_err(raised)?;
    let session = if replace {
        session.replacing()
    } else {
        session
    };
    trained(py, session, backend, on_event)
}

/// Goes on with a run, and with further shapes where there are some.
#[pyfunction]
#[pyo3(signature = (run, appended, changes, backend, device, on_event))]
pub(crate) fn resume(
    py: Python<'_>,
    run: PathBuf,
    appended: (Vec<PathBuf>, Option<Vec<f64>>, Option<String>),
    changes: Vec<String>,
    backend: &str,
    device: Option<String>,
    on_event: Option<Py<PyAny>>,
) -> PyResult<Run> {
    let backend = chosen(backend, device.as_deref())?;
    let (shapes, times, known) = appended;
    let appended = Appended {
        shapes,
        times,
        known,
    };
    let session = released(py, || {
        Session::append(&run, &appended, &changes, backend.clone())
    });
    trained(py, session.map_err(raised)?, backend, on_event)
}

/// The backend of a name, on a device.
pub(crate) fn chosen(backend: &str, device: Option<&str>) -> PyResult<Backend> {
    let backend = Backend::named(backend, device).map_err(raised)?;
    allowed(&backend)?;
    Ok(backend)
}

fn parsed(text: &str, origin: &Path, changes: &[String]) -> PyResult<Recipe> {
    Recipe::parse(text, origin, changes).map_err(|error| raised(error.into()))
}

fn trained(
    py: Python<'_>,
    mut session: Session,
    backend: Backend,
    on_event: Option<Py<PyAny>>,
) -> PyResult<Run> {
    let mut watch = Watch::new(on_event, session.stop_flag());
    let ended = released(py, || session.train(|event| watch.hear(event)));
    let trained = watch.end(ended)?;
    Ok(Run::new(trained, backend))
}
