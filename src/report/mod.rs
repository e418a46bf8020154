//! Pictures of runs.
//!
//! | file | what it holds |
//! |---|---|
//! | `picture.rs` | surfaces side by side in one PNG |
//! | `camera.rs`, `raster.rs` | what a picture shows, and how it is drawn |

mod camera;
pub mod picture;
mod raster;
