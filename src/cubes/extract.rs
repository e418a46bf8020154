//! The surface `f = 0` of a field that is known only by its values at points.
//!
//! Each value costs a pass through a neural network, so the work is to ask for few of them:
//! `search.rs` finds the grid nodes next to the surface, `polygonise.rs` makes the mesh.
//!
//! # What the mesh is
//! Where the surface does not reach the box the mesh is closed, consistently oriented and
//! 2-manifold, whatever the field: two triangles at every edge, one ring of triangles round every
//! vertex. Where it reaches the box it ends there, and [`Extraction::touches_box`] says so.
//! Vertices lie on grid edges and keep 1/1000 of a cell from grid nodes, so no two coincide.
//! Triangles may be thin, and where two sheets share a cell they may come as close as a cell allows.
//!
//! # What can be missed
//! * As in every method on a grid: what lies between nodes. A sheet or thread thinner than a
//!   cell may fall between them, and so may a separate piece smaller than two cells.
//! * A larger piece only if it is separate from all others, so that following the surface does not
//!   lead to it, and no node of the first scan (32 to 63 cells along the longest side) lies in it,
//!   and the field rises from it more than twice as steeply as between any two neighbouring nodes
//!   that were evaluated.

use super::grid::{ExtractError, Grid};
use super::polygonise::polygonise;
use super::search::Search;
use crate::geometry::Mesh;

/// What [`extract`] found.
#[derive(Clone, Debug)]
pub(crate) struct Extraction {
    /// The surface, without normals.
    pub mesh: Mesh<f32>,
    /// How many points the field was evaluated at.
    #[cfg(test)]
    pub evaluated: usize,
    /// How many nodes the whole grid has.
    #[cfg(test)]
    pub grid_points: usize,
    /// Whether the surface, or the inside of the shape, reaches the box: the mesh may be open
    /// there.
    pub touches_box: bool,
}

/// Extracts the surface `f = 0` inside the grid's box; `f` is negative inside the shape.
///
/// `field` takes points and returns one value for each. It is asked for up to 65,536 points at a
/// time, and always for as many as are known to be needed. A value of exactly 0 counts as outside.
///
/// # Errors
/// What `field` returns; a wrong number of values; a value that is not finite; no surface.
pub(crate) fn extract<E: std::error::Error>(
    field: impl FnMut(&[[f32; 3]]) -> Result<Vec<f32>, E>,
    grid: &Grid,
) -> Result<Extraction, ExtractError<E>> {
    let mut search = Search::new(grid, field);
    search.find_surface()?;
    let (mesh, crosses_box) = polygonise(&mut search)?;
    if mesh.triangles.is_empty() {
        let [least, most] = search.range;
        return Err(ExtractError::NoSurface { least, most });
    }
    Ok(Extraction {
        mesh,
        #[cfg(test)]
        evaluated: search.evaluated,
        #[cfg(test)]
        grid_points: grid.points(),
        touches_box: crosses_box || search.inside_at_box(),
    })
}

#[cfg(test)]
mod tests;
