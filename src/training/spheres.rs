//! Two spheres of points: data for measuring and testing that needs no file.

use std::num::NonZeroUsize;

use crate::data::{KeyPoints, Surroundings, TrainingData};

/// The radius of both.
const RADIUS: f32 = 0.28;

/// What lies around the points of a sphere.
struct Sphere {
    centre: f32,
    points: usize,
}

impl Surroundings for Sphere {
    fn signed_distance(&self, [x, y, z]: [f32; 3]) -> Option<f32> {
        let x = x - self.centre;
        Some((x * x + y * y + z * z).sqrt() - RADIUS)
    }

    /// The lattice's own neighbours in number: near enough for a test.
    fn nearest(&self, point: usize, count: NonZeroUsize) -> Vec<usize> {
        let around = (0..count.get()).map(|k| (point + k) % self.points);
        around.collect()
    }
}

impl TrainingData {
    /// Two spheres of points of radius 0.28 with normals, the second 0.2 further along x, of which the
    /// first `known` points are known to correspond.
    pub fn spheres(points: usize, known: usize) -> Self {
        let normals: Vec<[f32; 3]> = (0..points)
            .map(|k| {
                // A Fibonacci lattice: even, and the same everywhere.
                let z = 1.0 - (2 * k + 1) as f64 / points as f64;
                let (ring, angle) = ((1.0 - z * z).sqrt(), 2.399_963 * k as f64);
                [ring * angle.cos(), ring * angle.sin(), z].map(|c| c as f32)
            })
            .collect();
        let key = |time: f32, centre: f32| KeyPoints {
            time,
            points: normals
                .iter()
                .map(|[x, y, z]| [RADIUS * x + centre, RADIUS * y, RADIUS * z])
                .collect(),
            normals: Some(normals.clone()),
            around: Box::new(Sphere { centre, points }),
        };
        let (source, target) = (key(0.0, -0.1), key(1.0, 0.1));
        let pairs = source.points.iter().copied();
        let pairs = pairs.zip(target.points.iter().copied()).take(known);
        let between = vec![pairs.collect()];
        Self::new(vec![source, target], between)
    }
}
