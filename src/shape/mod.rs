//! Shapes on their way from files to what the networks are trained on.
//!
//! | file | what it does |
//! |---|---|
//! | `sample.rs` | area-uniform points on a mesh |
//! | `exposed.rs` | such points, none of them inside another part of the mesh |
//! | `solid.rs` | the signed distance of a shape as it is |
//! | `far.rs` | the same far from its surface, interpolated |
//! | `distance.rs` | signed distances to points with normals |
//! | `reconstruct.rs` | a closed mesh from points with normals |
//! | `border.rs` | the border of what is known of a shape, and where it is known |
//! | `clean.rs` | raw scans without what is no part of their surface |
//! | `normals.rs` | normals of a raw cloud, pointing outwards |
//! | `sides.rs` | normals of a file held against the cloud |
//! | `mismatch.rs` | two shapes that may not be in one unit or frame |
//! | `correspond.rs` | pairs of vertices that are known to correspond |
//! | `pairs_file.rs` | files of them |
//! | `normalise.rs` | the joint frame in which the networks work, and the way back |
//! | `coordinates.rs` | the same where shapes were laid onto each other, at any time |
//! | `points.rs` | the points, normals and closed mesh of one shape |
//! | `keyframes.rs` | all of it in order: shapes in, [`Keyframes`] out |
//! | `completing.rs` | a shape that is known in part with points where it is not |
//! | `trained.rs` | key frames as methods sample them |
//!
//! The files are read in [`crate::formats`], points and meshes are measured in [`crate::geometry`].
//!
//! Naming rule: a *vertex* is what a file lists (float64, the user's own coordinates, the file's
//! order, counted from 0); a *point* is what the networks are trained on (float32, normalised).

mod border;
mod clean;
mod completing;
mod coordinates;
mod correspond;
mod distance;
mod exposed;
mod far;
mod keyframes;
mod mismatch;
mod normalise;
mod normals;
mod pairs_file;
mod points;
mod reconstruct;
mod sample;
mod sides;
mod solid;
mod trained;

pub(crate) use crate::formats::{FEWEST_POINTS, Shape, ShapeError};
pub(crate) use crate::geometry::{Bounds, NeighbourSearch};
pub(crate) use border::{LEAST_MISSING, share_beyond};
pub use clean::CleanOptions;
pub(crate) use completing::{complete, thicken};
pub(crate) use coordinates::{Coordinates, Place, Placements};
pub(crate) use correspond::Correspondences;
pub(crate) use keyframes::{CorrespondenceSource, DataOptions, prepare, wound_outwards};
pub use keyframes::{Keyframe, Keyframes, PointCloud};
pub(crate) use keyframes::{columns, key_name};
pub(crate) use normalise::Normalisation;
pub(crate) use normals::estimate_normals;
pub(crate) use points::{NormalSource, points_of};
pub(crate) use sample::{SurfaceSamples, sample_surface};
pub(crate) use solid::{Solid, SolidParts};
pub(crate) use trained::trained;
