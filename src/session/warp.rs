//! Points of any kind moved along the motion of a run: landmarks, polylines, volume meshes.

use std::path::Path;

use super::sampled_field::{bytes, npy_header};
use super::trained::Trained;
use crate::atomic::write_atomically;
use crate::error::Result;
use crate::formats::{Shape, carried_extension, read_any, rewrite_vertices};
use crate::geometry::linear::{difference, length};

/// What was moved.
#[derive(Clone, Debug, PartialEq)]
pub struct Warped {
    /// Points of the file.
    pub points: usize,
    /// How many of them lie outside the box round the shapes in which the motion was learned: there it is a
    /// guess.
    pub outside: usize,
    /// The mean way between start and end, in the shapes' unit.
    pub mean: f64,
    /// The longest.
    pub longest: f64,
}

impl Trained {
    /// Moves the vertices of a file along the motion from time `from` to time `to`, and writes the file again as
    /// `out`.
    ///
    /// A PLY or an OBJ under a name of the same ending keeps all that is not a position: faces, edges, cells,
    /// colours, and other elements of a PLY. Else `out` has vertices and triangles as a PLY or OBJ, or vertices
    /// alone as text (`.xyz`) or as an array of numpy (`.npy`).
    /// `progress` is given the number of points moved so far.
    ///
    /// # Errors
    /// A file that cannot be read or written, a time out of range, a method that moves no points.
    pub fn warp(
        &self,
        file: &Path,
        [from, to]: [f64; 2],
        out: &Path,
        progress: impl FnMut(usize),
    ) -> Result<Warped> {
        let shape = read_any(file)?;
        let start = &shape.mesh.vertices;
        let moved = self.carry_with(start, from, to, progress)?;
        let ways = start.iter().zip(&moved);
        let ways: Vec<f64> = ways.map(|(a, b)| length(difference(*b, *a))).collect();
        let report = Warped {
            points: start.len(),
            outside: self.outside(start, from)?,
            mean: ways.iter().sum::<f64>() / ways.len().max(1) as f64,
            longest: ways.into_iter().fold(0.0, f64::max),
        };
        let ending = out.extension().unwrap_or_default();
        if ending.eq_ignore_ascii_case(carried_extension(file)) {
            rewrite_vertices(file, &moved, out)?;
        } else if ending.eq_ignore_ascii_case("xyz") {
            write_atomically(out, |to| {
                moved
                    .iter()
                    .try_for_each(|[x, y, z]| writeln!(to, "{x} {y} {z}"))
            })?;
        } else if ending.eq_ignore_ascii_case("npy") {
            write_atomically(out, |to| {
                to.write_all(&npy_header("<f8", &[moved.len(), 3]))?;
                to.write_all(&bytes(moved.as_flattened()))
            })?;
        } else {
            let mut mesh = shape.mesh;
            mesh.vertices = moved;
            mesh.normals = None;
            Shape::of(mesh).write(out)?;
        }
        Ok(report)
    }

    /// How many places lie outside the box in which the motion was learned, at a time.
    fn outside(&self, places: &[[f64; 3]], time: f64) -> Result<usize> {
        let learned = self.learned();
        let (place, bounds) = (
            learned.coordinates.at(self.clock().unit(time)?),
            &learned.bounds,
        );
        let is_inside = |x: &&[f64; 3]| {
            let x = place.apply(**x);
            (0..3).all(|axis| bounds.min[axis] <= x[axis] && x[axis] <= bounds.max[axis])
        };
        Ok(places.len() - places.iter().filter(is_inside).count())
    }
}
