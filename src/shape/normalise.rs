//! The joint frame in which the networks work, and the way back to the user's coordinates.
//!
//! `normalised = (x - centre) * scale`, the same for both shapes: the union of their bounding boxes
//! is centred at the origin and the mean of their surface areas is 1. Positions are float64 until
//! they are in this frame, float32 from then on, so that georeferenced coordinates (5e5 m and more)
//! lose nothing.

use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use super::{NeighbourSearch, Shape, ShapeError};

/// Neighbours that the area of a cloud is estimated from: with fewer the estimate of one point
/// scatters, with more it reaches around edges.
const AREA_NEIGHBOURS: usize = 8;

/// The transform between the user's coordinates and the normalised ones; stored in checkpoints.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
pub struct Normalisation {
    /// The point that becomes the origin, in the user's coordinates.
    pub centre: [f64; 3],
    /// Normalised length per unit of the user's length.
    pub scale: f64,
}

impl Normalisation {
    /// The frame shared by these shapes: union bounding box centred, mean area 1.
    ///
    /// The box is that of the vertices that belong to the surface: of a mesh only those in a
    /// triangle. A mesh contributes the area of its triangles, a cloud that of [`cloud_area`].
    ///
    /// # Errors
    /// [`ShapeError::Area`] if the area of a shape is zero or overflows.
    ///
    /// # Panics
    /// If there are no shapes.
    pub fn joint(shapes: &[&Shape]) -> Result<Self, ShapeError> {
        assert!(!shapes.is_empty(), "a joint frame of no shapes");
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        let mut area = 0.0;
        for shape in shapes {
            area += shape.area()? / shapes.len() as f64;
            let mut include = |vertex: &[f64; 3]| {
                for axis in 0..3 {
                    low[axis] = low[axis].min(vertex[axis]);
                    high[axis] = high[axis].max(vertex[axis]);
                }
            };
            if shape.is_mesh() {
                let used = shape.triangles.iter().flatten();
                used.for_each(|&index| include(&shape.vertices[index as usize]));
            } else {
                shape.vertices.iter().for_each(include);
            }
        }
        let centre = [0, 1, 2].map(|axis| low[axis] + (high[axis] - low[axis]) / 2.0);
        Ok(Self {
            centre,
            scale: area.sqrt().recip(),
        })
    }

    /// From the user's coordinates to normalised ones.
    pub fn apply(&self, x: [f64; 3]) -> [f32; 3] {
        [0, 1, 2].map(|axis| ((x[axis] - self.centre[axis]) * self.scale) as f32)
    }

    /// From normalised coordinates to the user's.
    pub fn invert(&self, x: [f32; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| f64::from(x[axis]) / self.scale + self.centre[axis])
    }

    /// A vertex in the user's coordinates moved as its normalised place moves from `start` to `end`: where
    /// nothing moves it stays as it was, to the last bit.
    pub fn displaced(&self, vertex: [f64; 3], start: [f32; 3], end: [f32; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| {
            let by = f64::from(end[axis]) - f64::from(start[axis]);
            vertex[axis] + by / self.scale
        })
    }

    /// A normalised length in the user's unit.
    pub fn invert_length(&self, length: f64) -> f64 {
        length / self.scale
    }
}

/// The area of the surface that a point cloud was sampled from, estimated from its density.
///
/// On a surface sampled at random with density `rho` the k-th neighbour of a point lies at `r_k`
/// with `E[pi r_k^2] = k / rho`, so every point stands for `pi r_k^2 / k` of the area, and the
/// sum over all points estimates the whole; k = 8. It assumes neither triangles nor normals. Evenly
/// spaced points are not at random: a square grid, the worst case, comes out at pi / 4 of its area,
/// a tenth off in length, which changes the common scale and nothing else.
pub fn cloud_area(points: &[[f64; 3]]) -> f64 {
    if points.len() <= AREA_NEIGHBOURS {
        return 0.0;
    }
    // One more than k: every point finds itself first.
    let count = NonZeroUsize::new(AREA_NEIGHBOURS + 1).expect("one more than a count");
    let neighbours = NeighbourSearch::new(points).nearest_of_each(points, count);
    let last = neighbours
        .iter()
        .map(|found| found[AREA_NEIGHBOURS].squared_distance);
    last.sum::<f64>() * std::f64::consts::PI / AREA_NEIGHBOURS as f64
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::path::PathBuf;

    use super::*;
    use crate::shape::mesh;
    use crate::shape::testing::{sphere_cloud, tetrahedron, torus_cloud};

    fn shape(vertices: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Shape {
        Shape {
            path: PathBuf::from("shape.ply"),
            vertices,
            triangles,
            normals: None,
        }
    }

    #[test]
    fn two_meshes_are_centred_and_their_mean_area_is_one() {
        let (small, triangles) = tetrahedron(0.0);
        let large = small.iter().map(|v| v.map(|x| 3.0 * x + 10.0)).collect();
        let shapes = [shape(small, triangles.clone()), shape(large, triangles)];
        let frame = Normalisation::joint(&[&shapes[0], &shapes[1]]).expect("areas");
        assert_eq!(frame.centre, [6.5; 3]);
        let normalised = |shape: &Shape| -> f64 {
            let points: Vec<[f64; 3]> = shape
                .vertices
                .iter()
                .map(|&v| frame.apply(v).map(f64::from))
                .collect();
            mesh::area(&points, &shape.triangles)
        };
        let mean = (normalised(&shapes[0]) + normalised(&shapes[1])) / 2.0;
        // Positions are float32 here: 1e-6 is a few of its roundings.
        assert!((mean - 1.0).abs() < 1e-6, "{mean}");
    }

    #[test]
    fn a_vertex_in_no_triangle_does_not_move_the_frame() {
        let (mut vertices, triangles) = tetrahedron(0.0);
        let without = Normalisation::joint(&[&shape(vertices.clone(), triangles.clone())]);
        vertices.push([1e6; 3]);
        let with = Normalisation::joint(&[&shape(vertices, triangles)]);
        assert_eq!(without.expect("area"), with.expect("area"));
    }

    #[test]
    fn georeferenced_coordinates_survive_there_and_back() {
        let (mut vertices, triangles) = tetrahedron(0.0);
        // A shape of 2 m in UTM coordinates, where float32 would keep 3 to 50 cm.
        vertices
            .iter_mut()
            .for_each(|v| *v = [5.0e5 + 2.0 * v[0], 5.2e6 + 2.0 * v[1], v[2]]);
        let utm = shape(vertices, triangles);
        let frame = Normalisation::joint(&[&utm]).expect("area");
        for &vertex in &utm.vertices {
            let error = mesh::difference(frame.invert(frame.apply(vertex)), vertex);
            // Half a float32 step of a normalised coordinate below 1 is 3e-8, times 2 m.
            assert!(mesh::length(error) < 2e-7, "{error:?}");
        }
        assert!(
            (frame.invert_length(frame.scale) - 1.0).abs() < 1e-15,
            "one rounding each way"
        );
    }

    #[test]
    fn the_area_of_a_random_cloud_is_that_of_its_surface_within_three_per_cent() {
        // Each point's share scatters by 1/sqrt(8), the mean of 5,000 (neighbours overlap: about
        // 600 independent) by 1.4 %; borders and curvature add less. Three per cent is two sigma,
        // and the seeds are fixed.
        let sphere = cloud_area(&sphere_cloud(5000, 2.0, 11)) / (4.0 * PI * 4.0);
        assert!((sphere - 1.0).abs() < 0.03, "{sphere}");
        let torus: Vec<_> = torus_cloud(5000, 1.0, 0.3, 12)
            .into_iter()
            .map(|at| at.0)
            .collect();
        let torus = cloud_area(&torus) / (4.0 * PI * PI * 0.3);
        assert!((torus - 1.0).abs() < 0.03, "{torus}");
        // Inside a square grid the eighth neighbour is across a diagonal: pi * 2 / 8 per cell. The
        // 4 % of the points at the border have it farther away.
        let grid = (0..10_000).map(|i| [f64::from(i % 100), f64::from(i / 100), 0.0]);
        let grid = cloud_area(&grid.collect::<Vec<_>>()) / 10_000.0;
        assert!(grid > PI / 4.0 && grid < 1.06 * PI / 4.0, "{grid}");
        assert_eq!(cloud_area(&[[0.0; 3]; 8]), 0.0);
    }

    #[test]
    fn a_mesh_and_a_cloud_each_measure_their_own_way() {
        let (vertices, triangles) = tetrahedron(0.0);
        let mesh = shape(vertices, triangles);
        let cloud = shape(sphere_cloud(5000, 1.0, 13), Vec::new());
        let frame = Normalisation::joint(&[&mesh, &cloud]).expect("areas");
        let mean = (1.5 + 3f64.sqrt() / 2.0 + 4.0 * PI) / 2.0;
        // The cloud's area is good to three per cent, the scale to half of that.
        assert!(
            (frame.scale * mean.sqrt() - 1.0).abs() < 0.015,
            "{}",
            frame.scale
        );
    }
}
