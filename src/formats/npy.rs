//! Arrays of numpy, `.npy` and `.npz`: points, and in an archive also faces and normals.
//!
//! An array of points has three columns, or six with normals. An archive has them under the name `points` or
//! `vertices`, corners of faces as `faces` or `triangles`, and normals as `normals`; an archive of one array needs no
//! name. Numbers may be of any width and byte order, and rows may be stored one after another or columns
//! (Fortran order).
//!
//! `array.rs` reads an array. The crate `npyz` 0.9.1 is not used: a header that states a shape such as
//! `(6148914691236517206, 3)` makes it panic in debug builds, by the overflow of its length, and it reads each type of
//! number by code of its own, so that most of `array.rs` would remain.

mod array;

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use zip::ZipArchive;

pub(crate) use self::array::Array;
use super::error::ShapeError;
use super::lines::shown;
use super::polygons::Polygons;
use super::shape::{Shape, file_length};
use crate::geometry::Mesh;
use crate::geometry::linear::unit;

/// Names of arrays in use, in lower case.
const POINTS: [&str; 7] = [
    "points",
    "vertices",
    "verts",
    "xyz",
    "positions",
    "pos",
    "v",
];
const FACES: [&str; 4] = ["faces", "triangles", "tris", "f"];
const NORMALS: [&str; 3] = ["normals", "vertex_normals", "vn"];

/// The arrays of a file: one in `.npy`, any number with names in `.npz`.
pub(crate) struct Arrays<'a> {
    path: &'a Path,
    archive: Option<ZipArchive<BufReader<File>>>,
    /// The names of the arrays, without their ending; of `.npy` an empty one.
    pub names: Vec<String>,
}

impl<'a> Arrays<'a> {
    /// Opens a file.
    ///
    /// # Errors
    /// What cannot be read, is empty, or is no archive where the name ends in `.npz`.
    pub(crate) fn open(path: &'a Path) -> Result<Self, ShapeError> {
        file_length(path)?;
        let is_archive = path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("npz"));
        if !is_archive {
            let names = vec![String::new()];
            return Ok(Self {
                path,
                archive: None,
                names,
            });
        }
        let archive = ZipArchive::new(BufReader::new(open(path)?));
        let archive = archive.map_err(|error| {
            let problem = format!(
                "{}: not an archive of numpy, or truncated",
                one_line(&error)
            );
            ShapeError::malformed(path, problem)
        })?;
        let named = archive
            .file_names()
            .map(|name| name.strip_suffix(".npy").unwrap_or(name).to_owned());
        // In the order of the archive, which the index of an entry is.
        let names = named.collect();
        Ok(Self {
            path,
            archive: Some(archive),
            names,
        })
    }

    /// The number of the first array that has one of these names, in either case.
    pub(crate) fn find(&self, wanted: &[&str]) -> Option<usize> {
        let is = |name: &&str| {
            self.names
                .iter()
                .position(|known| known.eq_ignore_ascii_case(name))
        };
        wanted.iter().find_map(is)
    }

    /// Reads an array.
    ///
    /// # Errors
    /// The file and the array: what is no array of numbers, or of another length than its header states.
    pub(crate) fn read(&mut self, index: usize) -> Result<Array, ShapeError> {
        let Some(archive) = &mut self.archive else {
            let mut file = BufReader::new(open(self.path)?);
            let read = Array::read(&mut file);
            return read.map_err(|problem| ShapeError::malformed(self.path, problem));
        };
        let entry = archive.by_index(index);
        let read = entry.map_err(|error| one_line(&error));
        let read = read.and_then(|mut entry| Array::read(&mut entry));
        read.map_err(|problem| self.wrong(index, &problem))
    }

    /// An error about an array.
    pub(crate) fn wrong(&self, index: usize, problem: &str) -> ShapeError {
        match self.names.get(index).filter(|name| !name.is_empty()) {
            Some(name) => ShapeError::malformed(self.path, format!("array {name:?}: {problem}")),
            None => ShapeError::malformed(self.path, problem),
        }
    }
}

fn open(path: &Path) -> Result<File, ShapeError> {
    File::open(path).map_err(|reason| ShapeError::Unreadable {
        path: path.to_owned(),
        reason,
    })
}

/// The message of a library in one line.
fn one_line(error: &dyn std::error::Error) -> String {
    shown(&error.to_string())
}

/// Reads the geometry of a file of arrays.
pub(super) fn read(path: &Path) -> Result<Shape, ShapeError> {
    let mut arrays = Arrays::open(path)?;
    let only = (arrays.names.len() == 1).then_some(0);
    let Some(at) = arrays.find(&POINTS).or(only) else {
        let names = shown(&arrays.names.join(", "));
        let problem =
            format!("no array named points or vertices (it has: {names}); name the points so");
        return Err(ShapeError::malformed(path, problem));
    };
    let array = arrays.read(at)?;
    let &[_, width @ (3 | 6)] = array.shape.as_slice() else {
        let shape = array.described();
        return Err(arrays.wrong(
            at,
            &format!("shape {shape}: must be (n, 3), or (n, 6) with normals"),
        ));
    };
    let rows = || array.values.chunks_exact(width);
    let vertices: Vec<[f64; 3]> = rows().map(|row| [row[0], row[1], row[2]]).collect();
    let own = (width == 6).then(|| rows().map(|row| unit([row[3], row[4], row[5]])).collect());
    let normals = match arrays.find(&NORMALS) {
        Some(at) => Some(normals(&mut arrays, at, vertices.len())?),
        None => own,
    };
    let triangles = match arrays.find(&FACES) {
        Some(at) => triangles(&mut arrays, at, &vertices)?,
        None => Vec::new(),
    };
    let mesh = Mesh {
        vertices,
        triangles,
        normals,
    };
    Ok(Shape::at(path, mesh))
}

fn normals(arrays: &mut Arrays, at: usize, count: usize) -> Result<Vec<[f32; 3]>, ShapeError> {
    let array = arrays.read(at)?;
    if array.shape != [count, 3] {
        let shape = array.described();
        return Err(arrays.wrong(
            at,
            &format!("shape {shape}: must be ({count}, 3), as the points"),
        ));
    }
    let rows = array.values.as_chunks::<3>().0.iter();
    Ok(rows.map(|normal| unit(*normal)).collect())
}

fn triangles(
    arrays: &mut Arrays,
    at: usize,
    vertices: &[[f64; 3]],
) -> Result<Vec<[u32; 3]>, ShapeError> {
    let array = arrays.read(at)?;
    let width = match array.shape[..] {
        [_, width] if width >= 3 => Some(width),
        _ => None,
    };
    let Some(width) = width else {
        let shape = array.described();
        return Err(arrays.wrong(
            at,
            &format!("shape {shape}: must be (m, 3), or (m, k) for polygons"),
        ));
    };
    let count = vertices.len();
    let mut polygons = Polygons::default();
    let mut corners = Vec::with_capacity(width);
    for (face, row) in array.values.chunks_exact(width).enumerate() {
        corners.clear();
        for &corner in row {
            if !(corner >= 0.0 && corner < count as f64 && corner.fract() == 0.0) {
                let problem = format!(
                    "face {face} refers to vertex {corner} (there are {count}, counted from 0)"
                );
                return Err(arrays.wrong(at, &problem));
            }
            corners.push(corner as u32);
        }
        polygons.push(&corners);
    }
    Ok(polygons.triangles(vertices))
}

#[cfg(test)]
pub(crate) mod tests;
