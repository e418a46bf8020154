//! Shapes as they come from files, and as the networks see them.
//!
//! | file | what it does |
//! |---|---|
//! | `ply.rs`, `obj.rs`, `anime.rs` | one reader per format: bytes in, [`Shape`] (or [`Sequence`]) out |
//! | `mesh.rs` | measures of a triangle mesh: area, volume, how its edges are shared |
//! | `connected.rs` | which vertices of a mesh hang together |
//! | `sample.rs` | area-uniform points on a mesh |
//! | `neighbours.rs` | k nearest neighbours |
//! | `winding.rs` | winding numbers of points with normals, and areas of points |
//! | `distance.rs` | signed distances to points with normals |
//! | `normals.rs` | normals of a raw cloud, pointing outwards |
//! | `correspond.rs` | pairs of vertices that are known to correspond |
//! | `normalise.rs` | the joint frame in which the networks work, and the way back |
//! | `keyframes.rs` | all of it in order: shapes in, [`Keyframes`] ready for training out |
//!
//! Naming rule: a *vertex* is what a file lists (float64, the user's own coordinates, the file's
//! order, counted from 0); a *point* is what the networks are trained on (float32, normalised).

mod anime;
pub(crate) mod connected;
mod correspond;
mod distance;
mod error;
mod keyframes;
#[cfg(test)]
mod malformed;
pub mod mesh;
mod neighbours;
mod normalise;
mod normals;
pub(crate) mod obj;
pub(crate) mod ply;
mod sample;
#[cfg(test)]
mod testing;
mod winding;

pub use anime::Sequence;
pub use correspond::Correspondences;
pub use distance::SignedDistance;
pub use error::ShapeError;
pub use neighbours::{Neighbour, NeighbourSearch};
pub use isomorph_training::data::Bounds;
pub use normalise::{Normalisation, cloud_area};
pub use normals::{EstimatedNormals, estimate_normals};
pub(crate) use keyframes::points_of;
pub use keyframes::{
    Cloud, CorrespondenceSource, DataOptions, Keyframe, Keyframes, NormalSource, prepare,
};
pub use sample::{SurfaceSamples, sample_surface};

use std::path::{Path, PathBuf};

use crate::surface::write::{SurfaceFormat, SurfaceView, write_surface};

/// The least number of points that a cloud, or a sample of a mesh, may have: fewer say too little
/// about a surface, and leave nothing to estimate normals and areas from.
pub const FEWEST_POINTS: usize = 64;

/// A mesh or a point cloud as its file gives it: in the user's coordinates and vertex order.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Where it was read from; it opens every message about the shape.
    pub path: PathBuf,
    /// Positions in float64, so that georeferenced coordinates survive until normalised.
    pub vertices: Vec<[f64; 3]>,
    /// Polygons as fans of triangles; empty for a point cloud.
    pub triangles: Vec<[u32; 3]>,
    /// One unit normal per vertex if the file gives them; `[0, 0, 0]` where the file's own is zero
    /// or not finite.
    pub normals: Option<Vec<[f32; 3]>>,
}

impl Shape {
    /// A point cloud that is in no file.
    pub fn cloud(vertices: Vec<[f64; 3]>) -> Self {
        Self::mesh(vertices, Vec::new())
    }

    /// A mesh that is in no file; triangles are counter-clockwise seen from outside.
    pub fn mesh(vertices: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            path: PathBuf::from("shape"),
            vertices,
            triangles,
            normals: None,
        }
    }

    /// Reads a mesh or a point cloud, PLY or OBJ by the ending of its name.
    ///
    /// # Errors
    /// One line that names the file, the place in it, what was found there and what is allowed.
    ///
    /// # Examples
    /// ```no_run
    /// let fox = isomorph::Shape::read("data/fox/source.ply".as_ref())?;
    /// println!("{} vertices, {} triangles", fox.vertices.len(), fox.triangles.len());
    /// # Ok::<(), isomorph::Error>(())
    /// ```
    pub fn read(path: &Path) -> crate::Result<Self> {
        Ok(read(path)?)
    }

    /// Writes the shape, PLY or OBJ by the ending of the name; whole or not at all.
    ///
    /// # Errors
    /// Another ending; indices out of range; what the file system says.
    pub fn write(&self, path: &Path) -> crate::Result<()> {
        let format = SurfaceFormat::of(path).ok_or_else(|| ShapeError::UnknownFormat {
            path: path.to_owned(),
            extension: path.extension().unwrap_or_default().to_string_lossy().into(),
        })?;
        let view = SurfaceView {
            vertices: &self.vertices,
            triangles: &self.triangles,
            normals: self.normals.as_deref(),
        };
        Ok(write_surface(view, path, format)?)
    }

    /// Whether the shape has faces; without any it is a point cloud.
    pub fn is_mesh(&self) -> bool {
        !self.triangles.is_empty()
    }

    /// Surface area in the user's units squared: of the triangles of a mesh, or estimated from the
    /// density of a cloud ([`cloud_area`]).
    ///
    /// # Errors
    /// [`ShapeError::Area`] if it is zero or overflows.
    pub fn area(&self) -> Result<f64, ShapeError> {
        let area = if self.is_mesh() {
            mesh::area(&self.vertices, &self.triangles)
        } else {
            cloud_area(&self.vertices)
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
    fn checked(self) -> Result<Self, ShapeError> {
        let infinite = |vertex: &[f64; 3]| vertex.iter().any(|coordinate| !coordinate.is_finite());
        if let Some(vertex) = self.vertices.iter().position(infinite) {
            let value = self.vertices[vertex];
            return Err(ShapeError::NotFinite {
                path: self.path,
                vertex,
                value,
            });
        }
        if !self.is_mesh() && self.vertices.len() < FEWEST_POINTS {
            let found = self.vertices.len();
            return Err(ShapeError::TooFewPoints {
                path: self.path,
                found,
            });
        }
        if self
            .vertices
            .iter()
            .all(|vertex| vertex == &self.vertices[0])
        {
            let (vertices, place) = (self.vertices.len(), self.vertices[0]);
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

/// Reads a mesh or a point cloud; the extension says which format it is in, in either case.
///
/// PLY and OBJ, polygons triangulated as fans, vertices in the order of the file. A sequence of
/// frames (`.anime`) is read by [`Sequence::read`].
///
/// # Errors
/// One line that names the file, the place in it, what was found there and what is allowed: a file
/// that is missing, empty, truncated or not of its format, coordinates that are not finite, faces
/// that refer to vertices that do not exist, a cloud of fewer than [`FEWEST_POINTS`] points,
/// vertices all in one place, no area.
pub fn read(path: &Path) -> Result<Shape, ShapeError> {
    let extension = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_ascii_lowercase();
    let shape = match extension.as_str() {
        "ply" => ply::read(path)?,
        "obj" => obj::read(path)?,
        "anime" => {
            return Err(ShapeError::NotOneShape {
                path: path.to_owned(),
            });
        }
        _ => {
            return Err(ShapeError::UnknownFormat {
                path: path.to_owned(),
                extension,
            });
        }
    };
    shape.checked()
}

/// The length of the file, or why it cannot be read; an empty one is refused here.
fn file_length(path: &Path) -> Result<u64, ShapeError> {
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

/// Adds a polygon as a fan of triangles around its first corner: exact for convex polygons.
///
/// Polygons of fewer than three corners have no area and are passed over.
fn push_fan(triangles: &mut Vec<[u32; 3]>, corners: &[u32]) {
    for edge in corners.get(1..).unwrap_or_default().windows(2) {
        triangles.push([corners[0], edge[0], edge[1]]);
    }
}

/// The vector scaled to unit length, or zero where it has no direction.
fn unit(v: [f64; 3]) -> [f32; 3] {
    let length = mesh::length(v);
    if length > 0.0 && length.is_finite() {
        v.map(|coordinate| (coordinate / length) as f32)
    } else {
        [0.0; 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(path: &Path) -> String {
        read(path).expect_err("refused").to_string()
    }

    #[test]
    fn the_extension_decides_and_an_unknown_one_lists_what_is_allowed() {
        let text = message(Path::new("shape.stl"));
        assert!(
            text.contains("shape.stl") && text.contains(".ply, .obj"),
            "{text}"
        );
        assert!(message(Path::new("walk.ANIME")).contains("sequence"));
        assert!(message(Path::new("no/such.PLY")).starts_with("no/such.PLY: cannot be read"));
    }

    #[test]
    fn a_folder_and_an_empty_file_are_refused_by_name() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("shape.obj");
        std::fs::write(&path, b"").expect("written");
        assert!(message(&path).ends_with("shape.obj: the file is empty"));
        std::fs::create_dir(folder.path().join("folder.ply")).expect("created");
        assert!(message(&folder.path().join("folder.ply")).contains("cannot be read"));
    }

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
            let shape = Shape {
                path,
                vertices,
                triangles: Vec::new(),
                normals: None,
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
        let shape = Shape {
            path,
            vertices,
            triangles: vec![[0, 1, 2]],
            normals: None,
        };
        let text = shape.checked().expect_err("refused").to_string();
        assert!(text.starts_with("line.obj: surface area 0"), "{text}");
    }
}
