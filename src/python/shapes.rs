//! Files of shapes, normals of clouds, and pairs of points.

use std::path::PathBuf;

use isomorph::correspondence::{self, MatchOptions};
use isomorph::{Mesh, Shape, StopFlag, normals};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::{array, rows};
use crate::failure::raised;
use crate::fork::released;
use crate::watch::Watch;

/// Vertices, faces (none of a cloud), normals (if there are some), and notes.
type Parts<'py> = (
    Bound<'py, PyArray2<f64>>,
    Option<Bound<'py, PyArray2<u32>>>,
    Option<Bound<'py, PyArray2<f32>>>,
    Vec<String>,
);

/// Pairs of vertices, and how sure each is.
type Pairs<'py> = (Bound<'py, PyArray2<u32>>, Bound<'py, PyArray1<f64>>);

/// Reads a file.
#[pyfunction]
pub(crate) fn read_shape(py: Python<'_>, path: PathBuf) -> PyResult<Parts<'_>> {
    let shape = released(py, || Shape::read(&path)).map_err(raised)?;
    let is_mesh = shape.is_mesh();
    let Shape { mesh, notes, .. } = shape;
    Ok((
        array(py, mesh.vertices)?,
        is_mesh.then(|| array(py, mesh.triangles)).transpose()?,
        mesh.normals.map(|normals| array(py, normals)).transpose()?,
        notes,
    ))
}

/// Writes a file, by its ending.
#[pyfunction]
pub(crate) fn write_shape(
    py: Python<'_>,
    path: PathBuf,
    vertices: PyReadonlyArray2<'_, f64>,
    faces: Option<PyReadonlyArray2<'_, u32>>,
    normals: Option<PyReadonlyArray2<'_, f32>>,
) -> PyResult<()> {
    let shape = of(&vertices, faces.as_ref(), normals.as_ref())?;
    released(py, || shape.write(&path)).map_err(raised)
}

/// The normals of a cloud, out of the shape, `[n, 3]`.
#[pyfunction]
pub(crate) fn estimate_normals<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let shape = of(&points, None, None)?;
    let found = released(py, || normals::estimate(&shape));
    array(py, found.cloud.normals.unwrap_or_default())
}

/// Finds pairs of vertices, `[n, 2]`, and how sure each is, `[n]`.
#[pyfunction]
#[pyo3(signature = (source, target, aligned, least_confidence, on_event))]
pub(crate) fn match_shapes<'py>(
    py: Python<'py>,
    source: (
        PyReadonlyArray2<'py, f64>,
        Option<PyReadonlyArray2<'py, u32>>,
    ),
    target: (
        PyReadonlyArray2<'py, f64>,
        Option<PyReadonlyArray2<'py, u32>>,
    ),
    aligned: bool,
    least_confidence: f64,
    on_event: Option<Py<PyAny>>,
) -> PyResult<Pairs<'py>> {
    let source = of(&source.0, source.1.as_ref(), None)?;
    let target = of(&target.0, target.1.as_ref(), None)?;
    let options = MatchOptions {
        aligned,
        least_confidence,
        ..MatchOptions::default()
    };
    let mut watch = Watch::new(on_event, StopFlag::default());
    let found = released(py, || {
        correspondence::find(&source, &target, &options, |event| watch.hear(event))
    });
    let found = watch.end(found)?;
    let pairs = found.pairs.iter().map(|pair| [pair.source, pair.target]);
    let sure = found.pairs.iter().map(|pair| pair.confidence).collect();
    Ok((array(py, pairs.collect())?, PyArray1::from_vec(py, sure)))
}

fn of(
    vertices: &PyReadonlyArray2<'_, f64>,
    faces: Option<&PyReadonlyArray2<'_, u32>>,
    normals: Option<&PyReadonlyArray2<'_, f32>>,
) -> PyResult<Shape> {
    let faces = faces.map(|faces| rows(faces, "faces")).transpose()?;
    let mut mesh = Mesh::new(
        rows(vertices, "vertices")?.to_vec(),
        faces.unwrap_or_default().to_vec(),
    );
    let normals = normals
        .map(|normals| rows(normals, "normals"))
        .transpose()?;
    mesh.normals = normals.map(<[[f32; 3]]>::to_vec);
    Ok(Shape::of(mesh))
}
