//! A mesh or a point cloud as its file gives it, and what its readers share.

use std::path::{Path, PathBuf};

use super::error::{FEWEST_POINTS, ShapeError};
use crate::geometry::{Mesh, cloud_area};

/// A mesh or a point cloud as its file gives it: in the user's coordinates and vertex order.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Where it was read from; it opens every message about the shape.
    pub path: PathBuf,
    /// Positions in float64, so that georeferenced coordinates survive until normalised; polygons as fans
    /// of triangles, none for a point cloud; the file's normals, if it gives one for each vertex.
    pub mesh: Mesh<f64>,
    /// What was decided about the contents of the file, one sentence each.
    pub notes: Vec<String>,
}

impl Shape {
    /// A point cloud that is in no file.
    pub fn cloud(vertices: Vec<[f64; 3]>) -> Self {
        Self::of(Mesh::new(vertices, Vec::new()))
    }

    /// A mesh, or a point cloud, that is in no file.
    pub fn of(mesh: Mesh<f64>) -> Self {
        Self {
            path: PathBuf::from("shape"),
            mesh,
            notes: Vec::new(),
        }
    }

    /// A mesh, or a point cloud, of the file at `path`.
    pub(crate) fn at(path: &Path, mesh: Mesh<f64>) -> Self {
        Self {
            path: path.to_owned(),
            ..Self::of(mesh)
        }
    }

    /// Whether the shape has faces; without any it is a point cloud.
    pub fn is_mesh(&self) -> bool {
        !self.mesh.triangles.is_empty()
    }

    /// Surface area in the user's units squared: of the triangles of a mesh, or estimated from the
    /// density of a cloud ([`cloud_area`]).
    ///
    /// # Errors
    /// [`ShapeError::Area`] if it is zero or overflows.
    pub(crate) fn area(&self) -> Result<f64, ShapeError> {
        let area = if self.is_mesh() {
            self.mesh.area()
        } else {
            cloud_area(&self.mesh.vertices)
        };
        if area > 0.0 && area.is_finite() {
            Ok(area)
        } else {
            Err(ShapeError::Area {
                path: self.path.clone(),
                area,
            })
        }
    }

    /// What every shape must satisfy, whatever its format.
    pub(super) fn checked(self) -> Result<Self, ShapeError> {
        let infinite = |vertex: &[f64; 3]| vertex.iter().any(|coordinate| !coordinate.is_finite());
        let vertices = &self.mesh.vertices;
        if let Some(vertex) = vertices.iter().position(infinite) {
            let value = vertices[vertex];
            return Err(ShapeError::NotFinite {
                path: self.path,
                vertex,
                value,
            });
        }
        if !self.is_mesh() && vertices.len() < FEWEST_POINTS {
            let found = vertices.len();
            return Err(ShapeError::TooFewPoints {
                path: self.path,
                found,
            });
        }
        if vertices.iter().all(|vertex| vertex == &vertices[0]) {
            let (vertices, place) = (vertices.len(), vertices[0]);
            return Err(ShapeError::OnePlace {
                path: self.path,
                vertices,
                place,
            });
        }
        if self.is_mesh() {
            self.area()?;
        }
        Ok(self)
    }
}

/// The length of the file, or why it cannot be read; an empty one is refused here.
pub(super) fn file_length(path: &Path) -> Result<u64, ShapeError> {
    let unreadable = |reason| ShapeError::Unreadable {
        path: path.to_owned(),
        reason,
    };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(unreadable(std::io::ErrorKind::IsADirectory.into()));
    }
    match metadata.len() {
        0 => Err(ShapeError::Empty {
            path: path.to_owned(),
        }),
        length => Ok(length),
    }
}

/// The whole of a file; an empty one is refused.
pub(crate) fn file_bytes(path: &Path) -> Result<Vec<u8>, ShapeError> {
    file_length(path)?;
    std::fs::read(path).map_err(|reason| ShapeError::Unreadable {
        path: path.to_owned(),
        reason,
    })
}

/// Adds a polygon as a fan of triangles around its first corner: exact for convex polygons.
///
/// Polygons of fewer than three corners have no area and are passed over.
pub(super) fn push_fan(triangles: &mut Vec<[u32; 3]>, corners: &[u32]) {
    for edge in corners.get(1..).unwrap_or_default().windows(2) {
        triangles.push([corners[0], edge[0], edge[1]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_becomes_a_fan_and_less_than_a_triangle_becomes_nothing() {
        let mut triangles = Vec::new();
        push_fan(&mut triangles, &[]);
        push_fan(&mut triangles, &[1, 2]);
        push_fan(&mut triangles, &[4, 5, 6, 7]);
        assert_eq!(triangles, [[4, 5, 6], [4, 6, 7]]);
    }

    #[test]
    fn clouds_that_say_nothing_are_refused() {
        let cloud = |vertices: Vec<[f64; 3]>| {
            let path = PathBuf::from("cloud.ply");
            let mesh = Mesh::new(vertices, Vec::new());
            let shape = Shape {
                path,
                ..Shape::of(mesh)
            };
            shape.checked().expect_err("refused").to_string()
        };
        assert!(cloud(vec![[1.0; 3]; 12]).contains("12 points, at least 64 needed"));
        assert!(cloud(vec![[1.0; 3]; 100]).contains("all 100 vertices are at"));
        let mut vertices = vec![[1.0; 3]; 100];
        vertices[7][2] = f64::NAN;
        assert!(cloud(vertices).contains("vertex 7 "), "names the vertex");
    }

    #[test]
    fn a_mesh_without_area_is_refused() {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let path = PathBuf::from("line.obj");
        let mesh = Mesh::new(vertices, vec![[0, 1, 2]]);
        let shape = Shape {
            path,
            ..Shape::of(mesh)
        };
        let text = shape.checked().expect_err("refused").to_string();
        assert!(text.starts_with("line.obj: surface area 0"), "{text}");
    }
}
