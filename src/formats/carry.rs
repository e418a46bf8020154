//! The input's own file, written again with its vertices moved: every face, colour, texture
//! coordinate, group and material stays as it was, in the file's own format and encoding.
//!
//! Normals must not be those of the shape before it moved. Where the file has one per vertex and
//! faces to tell them by, they are reckoned anew (mean of the faces around, weighted by area);
//! otherwise they are dropped, and viewers make their own.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use ply_rs::ply::{
    DefaultElement, ElementDef, Encoding, Header, Property, PropertyType, ScalarType,
};
use ply_rs::writer::Writer;

use super::error::ShapeError;
use super::obj::{self, Corner, Counts, parse_corner, statements, words};
use super::ply::PlyFile;
use super::read::{Format, read_any};
use super::shape::Shape;
use super::write::{SurfaceFormat, WriteError, write_surface};
use crate::atomic::write_atomically;
use crate::geometry::linear::is_finite;

/// The properties of a vertex that hold its position.
const POSITION: [&str; 3] = ["x", "y", "z"];

/// The properties of a vertex that hold its normal.
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];

/// Why a carried shape could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CarryError {
    /// The original cannot be read (again).
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// As many positions as vertices are needed.
    #[error("{}: {found} positions for {needed} vertices", .path.display())]
    Count {
        /// The original.
        path: PathBuf,
        /// Positions given.
        found: usize,
        /// Vertices of the original.
        needed: usize,
    },
    /// A position is NaN or infinite.
    #[error("{}: vertex {vertex} would move to {position:?}: positions must be finite numbers", .path.display())]
    NotFinite {
        /// The original.
        path: PathBuf,
        /// The vertex, counted from 0.
        vertex: usize,
        /// Where it would go.
        position: [f64; 3],
    },
    /// The original is kept, so its format is too.
    #[error("{}: is not the format that {} is carried in; end the name in .{needed}", .out.display(), .original.display())]
    OtherFormat {
        /// The file asked for.
        out: PathBuf,
        /// The file to be carried.
        original: PathBuf,
        /// The extension that it must have.
        needed: String,
    },
    /// The result cannot be written; the message names the file.
    #[error("{0}")]
    Write(io::Error),
    /// The result cannot be written as PLY; the message names the file.
    #[error(transparent)]
    Surface(#[from] WriteError),
}

/// Writes `original` again to `out`, its vertices at `positions` and all else as it was.
///
/// A format other than PLY and OBJ becomes PLY, with its geometry alone.
/// `positions` are in the user's coordinates and in the order in which [`read_any`] gives the
/// vertices. `out` may be the original's own name. PLY keeps its encoding and the types of its
/// coordinates, except that whole numbers become float64.
///
/// # Errors
/// One line: an original that cannot be read, a number of positions that is not that of its
/// vertices, positions that are not finite, a name that ends in another extension, a disk that
/// cannot be written. On any error `out` is as it was before.
pub(crate) fn rewrite_vertices(
    original: &Path,
    positions: &[[f64; 3]],
    out: &Path,
) -> Result<(), CarryError> {
    let needed = carried_extension(original);
    if extension(out) != needed {
        let (out, original) = (out.to_owned(), original.to_owned());
        return Err(CarryError::OtherFormat {
            out,
            original,
            needed,
        });
    }
    let mut shape = read_any(original)?;
    if positions.len() != shape.mesh.vertices.len() {
        let (found, needed) = (positions.len(), shape.mesh.vertices.len());
        return Err(CarryError::Count {
            path: original.to_owned(),
            found,
            needed,
        });
    }
    let infinite = |position: &[f64; 3]| !is_finite(position);
    // A point of a cloud that had no place has none now.
    let lost = |(position, before)| infinite(position) && (shape.is_mesh() || !infinite(before));
    if let Some(vertex) = positions.iter().zip(&shape.mesh.vertices).position(lost) {
        let (path, position) = (original.to_owned(), positions[vertex]);
        return Err(CarryError::NotFinite {
            path,
            vertex,
            position,
        });
    }
    shape.mesh.vertices = positions.to_vec();
    match Format::of(original) {
        Some(Format::Ply) => rewrite_ply(&shape, out),
        Some(Format::Obj) => rewrite_obj(&shape, out),
        _ => write_moved(shape, out),
    }
}

/// The extension of the carried file, in lower case: PLY and OBJ keep theirs, all others become PLY.
pub(crate) fn carried_extension(original: &Path) -> String {
    match Format::of(original) {
        Some(Format::Ply | Format::Obj) => extension(original),
        _ => "ply".to_owned(),
    }
}

/// The geometry alone, as PLY.
fn write_moved(mut shape: Shape, out: &Path) -> Result<(), CarryError> {
    if !shape.is_mesh() {
        shape.mesh.vertices.retain(is_finite);
    }
    let keeps_normals = shape.mesh.normals.take().is_some() && shape.is_mesh();
    shape.mesh.normals = keeps_normals.then(|| shape.mesh.vertex_normals());
    write_surface(&shape.mesh, out, SurfaceFormat::Ply)?;
    Ok(())
}

/// The extension in lower case.
fn extension(path: &Path) -> String {
    path.extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_ascii_lowercase()
}

/// `shape` is the original with its vertices moved. Element by element, so that a file of any size passes through in little memory.
fn rewrite_ply(shape: &Shape, out: &Path) -> Result<(), CarryError> {
    let mesh = &shape.mesh;
    let mut file = PlyFile::open(&shape.path)?;
    let normals = (mesh.normals.is_some() && shape.is_mesh()).then(|| mesh.vertex_normals());
    let header = moved_header(&file.header, normals.is_some());
    let write = |mut out: &mut dyn Write| -> io::Result<()> {
        let writer = Writer::<DefaultElement>::new();
        writer.write_header(&mut out, &header)?;
        let mut refused = None;
        let read = file.for_each::<DefaultElement>(|element, index, mut row| {
            let element = &header.elements[&element.name];
            if element.name == "vertex" {
                replace(&mut row, element, POSITION, mesh.vertices[index]);
                if let Some(normals) = &normals {
                    replace(&mut row, element, NORMAL, normals[index].map(f64::from));
                }
            }
            let written = match header.encoding {
                Encoding::Ascii => writer.write_ascii_element(&mut out, &row, element),
                Encoding::BinaryBigEndian => {
                    writer.write_big_endian_element(&mut out, &row, element)
                }
                Encoding::BinaryLittleEndian => {
                    writer.write_little_endian_element(&mut out, &row, element)
                }
            };
            written.map(drop).map_err(|reason| {
                let kind = reason.kind();
                refused = Some(reason);
                ShapeError::Unreadable {
                    path: shape.path.clone(),
                    reason: kind.into(),
                }
            })
        });
        match (refused, read) {
            (Some(reason), _) => Err(reason),
            (None, read) => read.map_err(io::Error::other),
        }
    };
    write_atomically(out, write).map_err(CarryError::Write)
}

/// The header with room for the moved positions, and without normals that are not kept.
fn moved_header(original: &Header, keep_normals: bool) -> Header {
    let mut header = original.clone();
    if let Some(vertex) = header.elements.get_mut("vertex") {
        if !keep_normals {
            vertex
                .properties
                .retain(|name, _| !NORMAL.contains(&name.as_str()));
        }
        for name in POSITION.into_iter().chain(NORMAL) {
            if let Some(property) = vertex.properties.get_mut(name)
                && property.data_type != PropertyType::Scalar(ScalarType::Float)
            {
                property.data_type = PropertyType::Scalar(ScalarType::Double);
            }
        }
    }
    header
}

/// Replaces three properties of a row by numbers of the types that the header gives them.
fn replace(row: &mut DefaultElement, element: &ElementDef, names: [&str; 3], values: [f64; 3]) {
    for (name, value) in names.into_iter().zip(values) {
        let single = PropertyType::Scalar(ScalarType::Float);
        let property = match &element.properties[name].data_type {
            kind if *kind == single => Property::Float(value as f32),
            _ => Property::Double(value),
        };
        row.insert(name.to_owned(), property);
    }
}

/// Line by line: what is not a vertex, a normal or a face is copied byte for byte.
fn rewrite_obj(shape: &Shape, out: &Path) -> Result<(), CarryError> {
    let mesh = &shape.mesh;
    let unreadable = |reason| ShapeError::Unreadable {
        path: shape.path.clone(),
        reason,
    };
    let bytes = std::fs::read(&shape.path).map_err(unreadable)?;
    let bytes = obj::text(&shape.path, &bytes)?;
    let normals =
        normals_are_those_of_vertices(&bytes, mesh.vertices.len()).then(|| mesh.vertex_normals());
    let write = |out: &mut dyn Write| -> io::Result<()> {
        let mut counts = Counts::default();
        for (line, (keyword, rest)) in bytes
            .split_inclusive(|&b| b == b'\n')
            .zip(statements(&bytes))
        {
            match keyword {
                b"v" => {
                    let position = mesh.vertices.get(counts.vertices).ok_or_else(changed)?;
                    write_numbers(out, line, *position)?;
                    counts.vertices += 1;
                }
                b"vn" => {
                    // Fewer normals than lines cannot be: they are one per vertex.
                    if let Some(normals) = &normals {
                        let normal = normals.get(counts.normals).ok_or_else(changed)?;
                        write_numbers(out, line, normal.map(f64::from))?;
                    }
                    counts.normals += 1;
                }
                b"f" if normals.is_none() => write_without_normals(out, line, rest)?,
                _ => out.write_all(line)?,
            }
        }
        Ok(())
    };
    write_atomically(out, write).map_err(CarryError::Write)
}

/// The original was read once already; it can only differ if someone wrote to it since.
fn changed() -> io::Error {
    io::Error::other("the original changed while it was read")
}

/// Whether normal i is that of vertex i: as many `vn` as `v` lines, and every corner of every face
/// names both by the same index.
fn normals_are_those_of_vertices(bytes: &[u8], vertices: usize) -> bool {
    let mut counts = Counts::default();
    let mut alike = true;
    let mut faces = 0;
    for (keyword, rest) in statements(bytes) {
        match keyword {
            b"v" => counts.vertices += 1,
            b"vn" => counts.normals += 1,
            b"f" => {
                faces += 1;
                alike &= words(rest).all(|word| {
                    let corner = parse_corner(&word, counts);
                    corner.is_ok_and(|Corner { vertex, normal }| normal == Some(vertex))
                });
            }
            _ => {}
        }
    }
    alike
        && faces > 0
        && counts
            == Counts {
                vertices,
                normals: vertices,
            }
}

/// The line with its first three numbers replaced; what follows them, and its end, is kept.
fn write_numbers(out: &mut dyn Write, line: &[u8], numbers: [f64; 3]) -> io::Result<()> {
    let mut rest = line;
    out.write_all(take_word(&mut rest))?;
    for number in numbers {
        take_word(&mut rest);
        write!(out, " {number}")?;
    }
    out.write_all(rest)
}

/// Takes the next word off the front of a line.
fn take_word<'a>(rest: &mut &'a [u8]) -> &'a [u8] {
    let line = rest.trim_ascii_start();
    let end = line
        .iter()
        .position(|byte| byte.is_ascii_whitespace() || *byte == b'#');
    let (word, after) = line.split_at(end.unwrap_or(line.len()));
    *rest = after;
    word
}

/// A face line with only the vertex and texture indices of its corners.
fn write_without_normals(out: &mut dyn Write, line: &[u8], rest: &[u8]) -> io::Result<()> {
    out.write_all(b"f")?;
    for word in words(rest) {
        let mut parts = word.split('/');
        let (vertex, texture) = (parts.next().unwrap_or_default(), parts.next());
        match texture.filter(|texture| !texture.is_empty()) {
            Some(texture) => write!(out, " {vertex}/{texture}")?,
            None => write!(out, " {vertex}")?,
        }
    }
    // A comment and the line's end.
    let end = line
        .iter()
        .position(|&byte| byte == b'#')
        .unwrap_or(line.trim_ascii_end().len());
    if line[end..].starts_with(b"#") {
        out.write_all(b" ")?;
    }
    out.write_all(&line[end..])
}

#[cfg(test)]
mod tests;
