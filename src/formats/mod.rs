//! Files of shapes: what reads and what writes them.
//!
//! | file | what it does |
//! |---|---|
//! | `shape.rs` | [`Shape`], a mesh or a point cloud as its file gives it, and what every one must satisfy |
//! | `read.rs` | a file of any of the formats in, [`Shape`] out |
//! | `ply.rs`, `obj.rs`, `stl.rs`, `off.rs`, `gltf/`, `npy.rs`, `cloud.rs`, `anime.rs` | one reader per format: bytes in, [`Shape`] (or [`Sequence`]) out |
//! | `lines.rs` | lines of text with their numbers |
//! | `polygons.rs` | polygons into triangles |
//! | `weld.rs` | vertices at the same place become one |
//! | `write.rs` | meshes as new PLY and OBJ files |
//! | `carry.rs` | the input file again, its vertices moved; formats other than PLY and OBJ become PLY |
//! | `appearance.rs` | colours, texture coordinates, groups and materials of a file |
//! | `error.rs` | what can be wrong with a file |

mod anime;
mod appearance;
mod carry;
mod cloud;
mod error;
mod gltf;
mod lines;
#[cfg(test)]
pub(crate) mod malformed;
mod npy;
mod obj;
mod off;
mod ply;
mod polygons;
mod read;
mod shape;
mod stl;
mod weld;
mod write;

pub(crate) use anime::Sequence;
pub(crate) use appearance::Appearance;
pub(crate) use carry::{CarryError, carried_extension, rewrite_vertices};
pub(crate) use error::{FEWEST_POINTS, ShapeError};
pub(crate) use lines::{fields, lines, refuse_utf_16, shown};
#[cfg(test)]
pub(crate) use npy::tests as test_arrays;
pub(crate) use npy::{Array, Arrays};
pub(crate) use read::{read, read_any};
pub(crate) use shape::Kept;
pub use shape::Shape;
pub(crate) use shape::file_bytes;
pub use write::SurfaceFormat;
pub(crate) use write::{Attribute, WriteError, write_surface, write_surface_with};
