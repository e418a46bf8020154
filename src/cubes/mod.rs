//! Marching cubes: the surface `f = 0` of a field that is known only by its values at points.
//!
//! | file | what it holds |
//! |---|---|
//! | `grid.rs` | a box cut into cells, and what can go wrong on it |
//! | `extract.rs` | all of it in order: a field in, a mesh out |
//! | `search.rs` | which grid nodes need a value: scan, descend, follow the surface |
//! | `lattice.rs` | the values found so far, stored only where there are any |
//! | `cell.rs` | the closed loops in which a surface crosses one cell, and their triangles |
//! | `polygonise.rs` | cells joined into one mesh with shared vertices |
//!
//! A field is negative inside; triangles wind counter-clockwise seen from outside.

mod cell;
mod extract;
mod grid;
mod lattice;
mod polygonise;
mod search;

pub(crate) use extract::{Extraction, extract};
pub(crate) use grid::{ExtractError, Grid, GridError};
