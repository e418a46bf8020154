//! Geometry that knows no file, no network and no method: points, meshes and what is measured on them.
//!
//! | file | what it holds |
//! |---|---|
//! | `linear.rs` | vectors and 3 x 3 matrices as arrays, the mean of points, eigenvectors |
//! | `mesh.rs` | [`Mesh`], the only triangle mesh of the program: area, volume, normals, topology |
//! | `edges.rs` | how the triangles of a mesh share their edges |
//! | `extent.rs` | boxes round points |
//! | `connected.rs` | which vertices of a mesh are connected |
//! | `components.rs` | the connected pieces of a mesh, without the small ones if desired |
//! | `orient.rs` | triangles of a mesh turned outwards, each piece by itself |
//! | `neighbours.rs` | k nearest neighbours |
//! | `parts.rs` | groups of points with empty space between them |
//! | `density.rs` | the spacing of points, and the area that they stand for |
//! | `triangles.rs` | closest points of a mesh, and its winding number |
//! | `winding.rs` | winding numbers of points with normals |
//! | `natural.rs` | natural cubic splines |
//! | `similarity.rs` | turns, shifts and a factor of size, and rotations as quaternions |
//!
//! Conventions: triangles wind counter-clockwise seen from outside, so normals point outwards and the
//! volume of a closed surface is positive. Vertices are `f64` in the user's coordinates and `f32` in
//! normalised ones; measures are reckoned in `f64` in both cases.

mod components;
pub(crate) mod connected;
pub(crate) mod density;
mod edges;
mod extent;
pub(crate) mod linear;
mod mesh;
pub(crate) mod natural;
mod neighbours;
mod orient;
mod parts;
pub(crate) mod similarity;
#[cfg(test)]
pub(crate) mod testing;
mod triangles;
pub(crate) mod winding;

pub(crate) use components::Component;
pub(crate) use density::cloud_area;
pub(crate) use edges::EdgeSharing;
pub(crate) use edges::weld;
pub(crate) use extent::Extent;
pub(crate) use isomorph_training::data::Bounds;
pub use linear::Scalar;
pub use mesh::Mesh;
pub(crate) use mesh::vertex_normals;
pub(crate) use neighbours::{Neighbour, NeighbourSearch};
pub(crate) use orient::turned_outwards;
pub(crate) use parts::parts_apart;
pub(crate) use triangles::{Closest, TriangleSearch};
