//! Two spheres of points: shapes for measuring and testing that need no file.

use std::num::NonZeroUsize;
use std::sync::Arc;

use crate::data::{KeyPoints, Surroundings, TrainingData};

/// The radius of both.
const RADIUS: f32 = 0.28;

/// Half the distance between their centres.
const OFFSET: f32 = 0.1;

impl TrainingData {
    /// Two spheres of `points` points each, of radius 0.28 and with normals, at times 0 and 1. The second
    /// is 0.2 further along x. Of the first `known` points it is known that they correspond.
    ///
    /// Signed distances are those of the spheres themselves, and the nearest points are found by comparing
    /// all of them.
    pub fn spheres(points: usize, known: usize) -> Self {
        let normals: Vec<[f32; 3]> = (0..points)
            .map(|k| {
                // A Fibonacci lattice: even, and the same everywhere.
                let z = 1.0 - (2 * k + 1) as f64 / points as f64;
                let (ring, angle) = ((1.0 - z * z).sqrt(), 2.399_963 * k as f64);
                [ring * angle.cos(), ring * angle.sin(), z].map(|c| c as f32)
            })
            .collect();
        let key = |time: f32, offset: f32| {
            let at = |[x, y, z]: &[f32; 3]| [RADIUS * x + offset, RADIUS * y, RADIUS * z];
            let points: Vec<[f32; 3]> = normals.iter().map(at).collect();
            let around = Sphere {
                centre: [offset, 0.0, 0.0],
                points: points.clone(),
            };
            KeyPoints::new(
                time,
                points,
                Some(normals.as_slice().into()),
                Arc::new(around),
            )
        };
        let (source, target) = (key(0.0, -OFFSET), key(1.0, OFFSET));
        let pairs = source.points.iter().copied();
        let pairs = pairs.zip(target.points.iter().copied()).take(known);
        let pairs = pairs.collect();
        Self::new(vec![source, target], vec![pairs])
    }
}

/// What lies around the points of one sphere.
struct Sphere {
    centre: [f32; 3],
    points: Vec<[f32; 3]>,
}

impl Surroundings for Sphere {
    fn signed_distance(&self, x: [f32; 3]) -> Option<f32> {
        Some(squared(x, self.centre).sqrt() - RADIUS)
    }

    fn nearest(&self, point: usize, count: NonZeroUsize) -> Vec<usize> {
        let near = |index: &usize| squared(self.points[*index], self.points[point]);
        let mut order: Vec<usize> = (0..self.points.len()).collect();
        order.sort_by(|a, b| near(a).total_cmp(&near(b)));
        order.truncate(count.get());
        order
    }
}

fn squared(a: [f32; 3], b: [f32; 3]) -> f32 {
    let differences = [0, 1, 2].map(|axis| a[axis] - b[axis]);
    differences.iter().map(|d| d * d).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spheres_are_apart_by_their_offset_and_correspond_point_by_point() {
        let data = TrainingData::spheres(100, 7);
        assert_eq!((data.keys.len(), data.pair_count()), (2, 7));
        for (source, target) in &data.between[0] {
            // f32 rounding of numbers below 1.
            assert!((target[0] - source[0] - 0.2).abs() < 1e-6);
            assert_eq!(source[1..], target[1..]);
        }
        for key in &data.keys {
            for x in key.points.iter() {
                let off = key.around.signed_distance(*x).expect("it is known");
                assert!(off.abs() < 1e-6, "{off}");
            }
        }
        let nearest = data.keys[0]
            .around
            .nearest(5, NonZeroUsize::new(9).expect("9"));
        assert_eq!((nearest.len(), nearest[0]), (9, 5));
    }
}
