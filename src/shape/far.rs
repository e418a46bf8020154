//! The signed distance of a shape far from its surface, interpolated on a lattice that is filled once.
//!
//! Whoever looks for a surface takes most values far from it, and far from it an exact distance costs most:
//! many parts of the shape are nearly as close as the closest. There the distance is smooth, so the values at
//! the corners of a cell give it with an error of a few per cent.

use crate::geometry::Bounds;

/// The edge of a cell, in normalised units.
const CELL: f32 = 0.03;

/// How far around the shape the lattice reaches, in normalised units.
const AROUND: f32 = 0.25;

/// Distances at all corners of a cell above which none is near: more than the diagonal of a cell, so that the
/// surface does not reach into it.
const FAR: f32 = 0.06;

/// The most nodes along an axis, for shapes that are much longer than wide.
const MOST: usize = 200;

/// The most nodes in all: a shape of far parts that would need more has no lattice, and exact distances everywhere.
const MOST_IN_ALL: usize = 4_000_000;

/// Signed distances at the nodes of a lattice around a shape.
pub(super) struct FarField {
    low: [f32; 3],
    nodes: [usize; 3],
    values: Vec<f32>,
}

impl FarField {
    /// Around a shape with these points, of these distances: one for each place, negative inside.
    pub(super) fn new(points: &[[f32; 3]], distances: impl Fn(&[[f32; 3]]) -> Vec<f32>) -> Self {
        let Bounds { min, max } = Bounds::of(points);
        let low = min.map(|x| x - AROUND);
        let nodes = [0, 1, 2].map(|axis| {
            let cells = (max[axis] + AROUND - low[axis]) / CELL;
            // A conversion that saturates.
            (cells.ceil() as usize).min(MOST - 1) + 1
        });
        let [nx, ny, nz] = nodes;
        if nx * ny * nz > MOST_IN_ALL {
            return Self {
                low,
                nodes: [1; 3],
                values: Vec::new(),
            };
        }
        let mut places = Vec::with_capacity(nx * ny * nz);
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let at = |axis: usize, k: usize| low[axis] + CELL * k as f32;
                    places.push([at(0, x), at(1, y), at(2, z)]);
                }
            }
        }
        let values = distances(&places);
        Self { low, nodes, values }
    }

    /// The signed distance at a place that is far from the surface; `None` near it, and off the lattice.
    #[inline]
    pub(super) fn at(&self, x: [f32; 3]) -> Option<f32> {
        let (mut cell, mut beyond) = ([0; 3], [0.0; 3]);
        for axis in 0..3 {
            let along = (x[axis] - self.low[axis]) / CELL;
            // Written so that what is no number is off the lattice.
            let within = along >= 0.0 && along < (self.nodes[axis] - 1) as f32;
            if !within {
                return None;
            }
            cell[axis] = along as usize;
            beyond[axis] = along - cell[axis] as f32;
        }
        let [nx, ny, _] = self.nodes;
        let first = cell[0] + nx * (cell[1] + ny * cell[2]);
        let (mut sum, mut inside, mut near) = (0.0, 0, false);
        for corner in 0..8 {
            let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
            let value = self.values[first + i + nx * (j + ny * k)];
            let share = |axis: usize, upper: usize| {
                if upper == 1 {
                    beyond[axis]
                } else {
                    1.0 - beyond[axis]
                }
            };
            near |= value.abs() < FAR;
            inside += usize::from(value < 0.0);
            sum += share(0, i) * share(1, j) * share(2, k) * value;
        }
        (!near && inside % 8 == 0).then_some(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::testing::random_places;

    fn ball(x: [f32; 3]) -> f32 {
        x.iter().map(|part| part * part).sum::<f32>().sqrt() - 0.4
    }

    #[test]
    fn it_is_the_distance_within_a_few_per_cent_and_silent_near_the_surface() {
        let points = [[-0.4; 3], [0.4; 3]];
        let field = FarField::new(&points, |places| places.iter().map(|x| ball(*x)).collect());
        let mut seen = 0;
        for x in random_places(2000, 0.6, 3) {
            let (true_one, found) = (ball(x), field.at(x));
            if true_one.abs() < FAR - 2.0 * CELL * 3.0_f32.sqrt() / 2.0 {
                assert_eq!(found, None, "at {x:?}");
            }
            if let Some(found) = found {
                seen += 1;
                assert!((found - true_one).abs() < 0.06 * true_one.abs(), "at {x:?}");
            }
        }
        assert!(seen > 1000, "{seen}");
        assert_eq!(field.at([0.9, 0.0, 0.0]), None);
        assert_eq!(field.at([f32::NAN, 0.0, 0.0]), None);
    }

    #[test]
    fn a_shape_without_bounds_to_speak_of_has_no_lattice() {
        let none = |_: &[[f32; 3]]| -> Vec<f32> { panic!("no distance is measured") };
        for far in [10.0, 1e30, f32::MAX] {
            let field = FarField::new(&[[-far; 3], [far; 3]], none);
            for x in [0.0, far, -far, f32::NAN] {
                assert_eq!(field.at([x; 3]), None, "{x} of {far}");
            }
        }
    }
}
