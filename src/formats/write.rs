//! Surfaces as files that MeshLab, Blender and the like open: binary PLY and OBJ.
//!
//! Coordinates are the user's own, in f64. Files hold them as 32-bit numbers where that is fine
//! enough: a 32-bit number is off by up to 6e-8 of its size, so as long as coordinates are at most
//! 100 times larger than the shape itself the error is below 6e-6 of the shape, a fraction of a
//! cell at every resolution. Beyond that (map coordinates, say) they are written as 64-bit numbers.
//!
//! PLY files are written by `ply-rs`, row by row: a million triangles take 0.1 seconds.

use std::io::{self, Write};
use std::path::Path;

use ply_rs::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType,
};
use ply_rs::writer::Writer;

use super::error::ShapeError;
use super::shape::Shape;
use crate::atomic::write_atomically;
use crate::geometry::Mesh;

/// Coordinates this many times larger than the shape are written as 64-bit numbers.
const LARGEST_FOR_F32: f64 = 100.0;
const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];

/// The kinds of surface files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceFormat {
    /// Binary little-endian PLY.
    Ply,
    /// Wavefront OBJ, text.
    Obj,
}

impl SurfaceFormat {
    /// The ending of its file names, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Obj => "obj",
        }
    }

    /// The format that the ending of a file's name says, in either case.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        let is = |format: &Self| {
            let ending = path.extension();
            ending.is_some_and(|given| given.eq_ignore_ascii_case(format.extension()))
        };
        [Self::Ply, Self::Obj].into_iter().find(is)
    }
}

/// A surface that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// A triangle names a vertex that is not there.
    #[error(
        "{path}: triangle {triangle} uses vertex {vertex}: must be 0 to {last}; extract it again",
        last = *vertices as i64 - 1
    )]
    Index {
        /// The file that was to be written.
        path: String,
        /// Number of the triangle, from 0.
        triangle: usize,
        /// The index found.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// Normals that do not match the vertices.
    #[error(
        "{path}: {normals} normals for {vertices} vertices: one each is needed; extract it again"
    )]
    Normals {
        /// The file that was to be written.
        path: String,
        /// How many normals there are.
        normals: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A coordinate that is NaN or infinite.
    #[error("{path}: vertex {vertex} lies at {at:?}: must be finite; extract it again")]
    NotFinite {
        /// The file that was to be written.
        path: String,
        /// Number of the vertex, from 0.
        vertex: usize,
        /// Its coordinates.
        at: [f64; 3],
    },
    /// What the file system says; names the file.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Writes a mesh in the user's coordinates under its final name, whole or not at all.
///
/// # Errors
/// Indices out of range, normals that do not match, coordinates that are not finite, or the file
/// system's errors; in all cases `path` keeps what it held before.
pub(crate) fn write_surface(
    surface: &Mesh<f64>,
    path: &Path,
    format: SurfaceFormat,
) -> Result<(), WriteError> {
    write_surface_with(surface, &[], path, format)
}

/// A number for each vertex, under the name that it has in a PLY file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attribute<'a> {
    /// Its name.
    pub name: &'a str,
    /// One for each vertex.
    pub values: &'a [f32],
}

/// [`write_surface`] with more numbers for each vertex; OBJ holds none.
///
/// # Errors
/// Those of [`write_surface`].
///
/// # Panics
/// If an attribute has not one number for each vertex.
pub(crate) fn write_surface_with(
    surface: &Mesh<f64>,
    attributes: &[Attribute<'_>],
    path: &Path,
    format: SurfaceFormat,
) -> Result<(), WriteError> {
    check(surface, path)?;
    let count = surface.vertices.len();
    assert!(
        attributes.iter().all(|each| each.values.len() == count),
        "{}: attributes of other vertices",
        path.display()
    );
    let wide = needs_f64(&surface.vertices);
    write_atomically(path, |out| match format {
        SurfaceFormat::Ply => write_ply(surface, attributes, wide, out),
        SurfaceFormat::Obj => write_obj(surface, wide, out),
    })?;
    Ok(())
}

fn check(surface: &Mesh<f64>, path: &Path) -> Result<(), WriteError> {
    let path = || path.display().to_string();
    let vertices = surface.vertices.len();
    let normals = surface.normals.as_ref().map(Vec::len);
    if let Some(normals) = normals.filter(|&normals| normals != vertices) {
        return Err(WriteError::Normals {
            path: path(),
            normals,
            vertices,
        });
    }
    let infinite = |at: &[f64; 3]| !at.iter().all(|part| part.is_finite());
    if let Some(vertex) = surface.vertices.iter().position(infinite) {
        return Err(WriteError::NotFinite {
            path: path(),
            vertex,
            at: surface.vertices[vertex],
        });
    }
    for (triangle, corners) in surface.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&vertex| vertex as usize >= vertices) {
            return Err(WriteError::Index {
                path: path(),
                triangle,
                vertex,
                vertices,
            });
        }
    }
    Ok(())
}

/// Whether 32-bit numbers would be too coarse for these coordinates.
fn needs_f64(vertices: &[[f64; 3]]) -> bool {
    let (mut largest, mut extent) = (0.0_f64, 0.0_f64);
    for axis in 0..3 {
        let along = || vertices.iter().map(|vertex| vertex[axis]);
        let (low, high) = (
            along().fold(f64::INFINITY, f64::min),
            along().fold(f64::NEG_INFINITY, f64::max),
        );
        largest = largest.max(low.abs()).max(high.abs());
        extent = extent.max(high - low);
    }
    // Numbers beyond the range of f32 need f64 too.
    !vertices.is_empty() && (largest > LARGEST_FOR_F32 * extent || largest > f64::from(f32::MAX))
}

/// One row of a PLY file: a vertex or a face, whichever its element asks for.
#[derive(Default)]
struct Row<'a> {
    position: [f64; 3],
    normal: [f32; 3],
    corners: [i32; 3],
    attributes: &'a [Attribute<'a>],
    vertex: usize,
}

impl PropertyAccess for Row<'_> {
    fn new() -> Self {
        Self::default()
    }

    fn get_double(&self, name: &str) -> Option<f64> {
        POSITION
            .iter()
            .position(|&known| known == name)
            .map(|axis| self.position[axis])
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        let normal = NORMAL
            .iter()
            .position(|&known| known == name)
            .map(|axis| self.normal[axis]);
        let attribute = || {
            let named = self.attributes.iter().find(|each| each.name == name);
            named.map(|each| each.values[self.vertex])
        };
        normal
            .or_else(attribute)
            .or_else(|| Some(self.get_double(name)? as f32))
    }

    fn get_list_int(&self, _name: &str) -> Option<&[i32]> {
        Some(&self.corners)
    }
}

fn write_ply(
    surface: &Mesh<f64>,
    attributes: &[Attribute<'_>],
    wide: bool,
    mut out: &mut dyn Write,
) -> io::Result<()> {
    let [mut vertex, face] = elements(surface, wide);
    let float = PropertyType::Scalar(ScalarType::Float);
    for each in attributes {
        let property = PropertyDef::new(each.name.into(), float.clone());
        vertex.properties.add(property);
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.comments.push("written by isomorph".into());
    header.elements.add(vertex.clone());
    header.elements.add(face.clone());
    let writer = Writer::<Row<'_>>::new();
    writer.write_header(&mut out, &header)?;
    let mut row = Row {
        attributes,
        ..Row::default()
    };
    for (i, &position) in surface.vertices.iter().enumerate() {
        row.vertex = i;
        row.position = position;
        row.normal = surface
            .normals
            .as_ref()
            .map_or([0.0; 3], |normals| normals[i]);
        writer.write_little_endian_element(&mut out, &row, &vertex)?;
    }
    for triangle in &surface.triangles {
        // Indices are below the number of vertices, and 2^31 of those would fill 48 GiB.
        row.corners = triangle.map(|vertex| vertex as i32);
        writer.write_little_endian_element(&mut out, &row, &face)?;
    }
    Ok(())
}

/// The definitions of vertices and faces.
fn elements(surface: &Mesh<f64>, wide: bool) -> [ElementDef; 2] {
    let define = |name: &str, count: usize, properties: Vec<(&str, PropertyType)>| {
        let mut element = ElementDef::new(name.into());
        element.count = count;
        for (name, kind) in properties {
            element.properties.add(PropertyDef::new(name.into(), kind));
        }
        element
    };
    let number = if wide {
        ScalarType::Double
    } else {
        ScalarType::Float
    };
    let mut numbers: Vec<_> = POSITION
        .iter()
        .map(|&axis| (axis, PropertyType::Scalar(number.clone())))
        .collect();
    if surface.normals.is_some() {
        numbers.extend(
            NORMAL
                .iter()
                .map(|&axis| (axis, PropertyType::Scalar(ScalarType::Float))),
        );
    }
    let corners = PropertyType::List(ScalarType::UChar, ScalarType::Int);
    [
        define("vertex", surface.vertices.len(), numbers),
        define(
            "face",
            surface.triangles.len(),
            vec![("vertex_indices", corners)],
        ),
    ]
}

fn write_obj(surface: &Mesh<f64>, wide: bool, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "# written by isomorph")?;
    for &[x, y, z] in &surface.vertices {
        if wide {
            writeln!(out, "v {x} {y} {z}")?;
        } else {
            // The shortest text that reads back as the same 32-bit number.
            writeln!(out, "v {} {} {}", x as f32, y as f32, z as f32)?;
        }
    }
    for [x, y, z] in surface.normals.iter().flatten() {
        writeln!(out, "vn {x} {y} {z}")?;
    }
    for [a, b, c] in surface
        .triangles
        .iter()
        .map(|triangle| triangle.map(|vertex| vertex + 1))
    {
        if surface.normals.is_some() {
            writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?;
        } else {
            writeln!(out, "f {a} {b} {c}")?;
        }
    }
    Ok(())
}

impl Shape {
    /// Writes the shape, PLY or OBJ by the ending of the name; whole or not at all.
    ///
    /// # Errors
    /// Another ending; indices out of range; what the file system says.
    pub fn write(&self, path: impl AsRef<Path>) -> crate::Result<()> {
        let path = path.as_ref();
        let format = SurfaceFormat::of(path).ok_or_else(|| ShapeError::UnknownFormat {
            path: path.to_owned(),
            extension: path
                .extension()
                .unwrap_or_default()
                .to_string_lossy()
                .into(),
            allowed: ".ply, .obj".to_owned(),
        })?;
        Ok(write_surface(&self.mesh, path, format)?)
    }
}

#[cfg(test)]
mod tests;
