//! The joint frame in which the networks work, and the way back to the user's coordinates.
//!
//! `normalised = (x - centre) * scale`, the same for both shapes: the union of their bounding boxes
//! is centred at the origin and the mean of their surface areas is 1. Positions are float64 until
//! they are in this frame, float32 from then on, so that georeferenced coordinates (5e5 m and more)
//! lose nothing.

use serde::{Deserialize, Serialize};

use crate::formats::{Shape, ShapeError};
use crate::geometry::Extent;

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
    /// triangle. A mesh contributes the area of its triangles, a cloud that of [`cloud_area`](crate::geometry::cloud_area).
    ///
    /// # Errors
    /// [`ShapeError::Area`] if the area of a shape is zero or overflows.
    ///
    /// # Panics
    /// If there are no shapes.
    pub fn joint(shapes: &[&Shape]) -> Result<Self, ShapeError> {
        let areas: Result<Vec<f64>, ShapeError> = shapes.iter().map(|shape| shape.area()).collect();
        Ok(Self::of_areas(shapes, &areas?))
    }

    /// The same where the area of each shape is known.
    ///
    /// # Panics
    /// If there are no shapes.
    pub(crate) fn of_areas(shapes: &[&Shape], areas: &[f64]) -> Self {
        let boxes = shapes.iter().map(|shape| Extent::of_surface(&shape.mesh));
        let Extent { low, high } = boxes
            .reduce(|all, own| all.joined(&own))
            .expect("a shape or more");
        let area: f64 = areas.iter().map(|own| own / shapes.len() as f64).sum();
        let centre = [0, 1, 2].map(|axis| low[axis] + (high[axis] - low[axis]) / 2.0);
        Self {
            centre,
            scale: area.sqrt().recip(),
        }
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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::path::Path;

    use super::*;
    use crate::geometry::Mesh;
    use crate::geometry::linear::{difference, length};
    use crate::geometry::testing::{sphere_cloud, tetrahedron};

    fn shape(mesh: Mesh<f64>) -> Shape {
        Shape::at(Path::new("shape.ply"), mesh)
    }

    #[test]
    fn two_meshes_are_centred_and_their_mean_area_is_one() {
        let small = tetrahedron(0.0);
        let large = small.moved(|v| v.map(|x| 3.0 * x + 10.0));
        let shapes = [shape(small), shape(large)];
        let frame = Normalisation::joint(&[&shapes[0], &shapes[1]]).expect("areas");
        assert_eq!(frame.centre, [6.5; 3]);
        let normalised = |shape: &Shape| shape.mesh.moved(|vertex| frame.apply(vertex)).area();
        let mean = (normalised(&shapes[0]) + normalised(&shapes[1])) / 2.0;
        // Positions are float32 here: 1e-6 is a few of its roundings.
        assert!((mean - 1.0).abs() < 1e-6, "{mean}");
    }

    #[test]
    fn a_vertex_in_no_triangle_does_not_move_the_frame() {
        let mut mesh = tetrahedron(0.0);
        let without = Normalisation::joint(&[&shape(mesh.clone())]);
        mesh.vertices.push([1e6; 3]);
        let with = Normalisation::joint(&[&shape(mesh)]);
        assert_eq!(without.expect("area"), with.expect("area"));
    }

    #[test]
    fn georeferenced_coordinates_survive_there_and_back() {
        // A shape of 2 m in UTM coordinates, where float32 would keep 3 to 50 cm.
        let metres = |[x, y, z]: [f64; 3]| [5.0e5 + 2.0 * x, 5.2e6 + 2.0 * y, z];
        let utm = shape(tetrahedron(0.0).moved(metres));
        let frame = Normalisation::joint(&[&utm]).expect("area");
        for &vertex in &utm.mesh.vertices {
            let error = difference(frame.invert(frame.apply(vertex)), vertex);
            // Half a float32 step of a normalised coordinate below 1 is 3e-8, times 2 m.
            assert!(length(error) < 2e-7, "{error:?}");
        }
        assert!(
            (frame.invert_length(frame.scale) - 1.0).abs() < 1e-15,
            "one rounding each way"
        );
    }

    #[test]
    fn a_mesh_and_a_cloud_each_measure_their_own_way() {
        let mesh = shape(tetrahedron(0.0));
        let cloud = shape(Mesh::new(sphere_cloud(5000, 1.0, 13), Vec::new()));
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
