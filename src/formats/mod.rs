//! Files of shapes: what reads and what writes them.
//!
//! | file | what it does |
//! |---|---|
//! | `shape.rs` | [`Shape`], a mesh or a point cloud as its file gives it, and what every one must satisfy |
//! | `read.rs` | a file of any of the formats in, [`Shape`] out |
//! | `ply.rs`, `obj.rs`, `anime.rs` | one reader per format: bytes in, [`Shape`] (or [`Sequence`]) out |
//! | `write.rs` | meshes as new PLY and OBJ files |
//! | `carry.rs` | the input file again, its vertices moved |
//! | `appearance.rs` | colours, texture coordinates, groups and materials of a file |
//! | `error.rs` | what can be wrong with a file |

mod anime;
mod appearance;
mod carry;
mod error;
#[cfg(test)]
pub(crate) mod malformed;
mod obj;
mod ply;
mod read;
mod shape;
mod write;

pub(crate) use anime::Sequence;
pub(crate) use appearance::Appearance;
pub(crate) use carry::{CarryError, rewrite_vertices};
pub(crate) use error::{FEWEST_POINTS, ShapeError};
pub(crate) use read::{read, read_any};
pub use shape::Shape;
pub(crate) use shape::file_length;
pub use write::SurfaceFormat;
pub(crate) use write::{Attribute, WriteError, write_surface, write_surface_with};
