//! Signed distances to a surface that is known by points with normals, negative inside.
//!
//! Far from the surface the distance to the nearest point is that to the surface but for the points'
//! spacing; close to it, where that error would count, the distance to the tangent planes of the nearest
//! points takes over. The sign is that of the planes' weighted sum, so that one odd normal decides nothing.

use std::num::NonZeroUsize;

use super::{NeighbourSearch, mesh};

/// Nearest points whose planes are averaged.
const PLANES: NonZeroUsize = NonZeroUsize::new(4).expect("4 is not 0");

/// Distances below this many spacings are measured to the planes.
const CLOSE: f64 = 2.0;

/// Points with normals, arranged for distance queries.
#[derive(Debug)]
pub struct SignedDistance {
    search: NeighbourSearch,
    points: Vec<[f64; 3]>,
    normals: Vec<[f32; 3]>,
    close: f64,
}

impl SignedDistance {
    /// Arranges the points of one surface; `normals` are unit, one per point, pointing outwards.
    ///
    /// # Panics
    /// If there are no points, or not as many normals.
    pub fn new(points: &[[f32; 3]], normals: &[[f32; 3]]) -> Self {
        assert_eq!(points.len(), normals.len(), "one normal per point");
        let points: Vec<[f64; 3]> = points.iter().map(|point| point.map(f64::from)).collect();
        let search = NeighbourSearch::new(&points);
        let second = |point: &[f64; 3]| {
            let found = search.nearest(*point, PLANES);
            found.last().map_or(0.0, |last| last.squared_distance)
        };
        // The distance to the third neighbour, in the mean over a hundred points.
        let step = points.len().div_ceil(100);
        let sampled = points.iter().step_by(step);
        let count = sampled.len() as f64;
        let spacing = (sampled.map(second).sum::<f64>() / count).sqrt();
        Self {
            search,
            points,
            normals: normals.to_vec(),
            close: CLOSE * spacing,
        }
    }

    /// The signed distance of `x` from the surface.
    pub fn at(&self, x: [f32; 3]) -> f32 {
        let x = x.map(f64::from);
        let nearest = self.search.nearest(x, PLANES);
        let reach = self.close * self.close;
        let (mut height, mut total) = (0.0, 0.0);
        for neighbour in &nearest {
            let k = neighbour.index as usize;
            let normal = self.normals[k].map(f64::from);
            let weight = 1.0 / (neighbour.squared_distance + 1e-3 * reach);
            height += weight * mesh::dot(mesh::difference(x, self.points[k]), normal);
            total += weight;
        }
        let plane = height / total;
        let distance = nearest[0].squared_distance.sqrt();
        // From the planes to the nearest point between one and two times `close`: no jump.
        let share = (distance / self.close - 1.0).clamp(0.0, 1.0);
        let magnitude = plane.abs().min(distance) * (1.0 - share) + distance * share;
        magnitude.copysign(plane) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::sphere_cloud;
    use super::*;

    #[test]
    fn it_is_the_distance_to_a_sphere_inside_and_out() {
        let points = sphere_cloud(20_000, 0.3, 1);
        let normals: Vec<[f32; 3]> = points.iter().map(|p| p.map(|c| (c / 0.3) as f32)).collect();
        let points: Vec<[f32; 3]> = points.iter().map(|p| p.map(|c| c as f32)).collect();
        let distance = SignedDistance::new(&points, &normals);
        for direction in [[1.0, 0.0, 0.0], [0.6, -0.8, 0.0], [0.48, 0.6, 0.64]] {
            for radius in [0.05, 0.2, 0.27, 0.29, 0.299, 0.3, 0.301, 0.31, 0.34, 0.6] {
                let found = distance.at(direction.map(|c: f32| c * radius));
                // The points lie 0.008 apart: a query at height h misses the nearest one sideways by up
                // to 0.006, which lengthens the distance by 0.006^2 / 2 h; on the planes the curvature
                // 1 / 0.3 costs 0.008^2 / 0.6. Both stay below 6e-4.
                assert!(
                    (found - (radius - 0.3)).abs() < 6e-4,
                    "at {radius} in {direction:?}: {found}"
                );
            }
        }
    }
}
