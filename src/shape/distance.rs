//! Signed distances to a surface that is known by points with normals, negative inside.
//!
//! Far from the surface the distance to the nearest point is that to the surface but for the points'
//! spacing, and the sign is that of the winding number, so that no few wrong normals decide about all the
//! space that they are nearest to. Close to it, where the spacing would count, the distance to the tangent
//! planes of the nearest points takes over, with the sign of their weighted sum.
//!
//! Inside is where the winding number is above a level half-way between 1/2 and that on the surface itself,
//! the mean of its two sides: 1/2 for a closed surface, less for a scan from one side, 0 for a flat sheet. At
//! 1/2 a scan from one side would be closed flat from rim to rim and a sheet have no inside, at the surface's
//! own level they would not be closed at all; half-way a round sheet is closed by a bulge of 0.58 of its radius.

use std::f64::consts::PI;
use std::num::NonZeroUsize;

use rayon::prelude::*;

use crate::geometry::NeighbourSearch;
use crate::geometry::density::{self, areas, squared_spacing};
use crate::geometry::linear::{difference, dot};
use crate::geometry::winding::{Charges, SummationTree};

/// Nearest points whose planes are averaged.
const PLANES: NonZeroUsize = NonZeroUsize::new(4).expect("4 is not 0");

/// Distances below this many spacings are measured to the planes.
const CLOSE: f64 = 2.0;

/// Points, at most, whose winding numbers tell that on the surface, and whose heights tell the noise.
const LOOKED_AT: usize = 1000;

/// The curvature at which a smoothed surface is as far off by the smoothing as by the noise that is left:
/// features of this radius or more are kept. In normalised units.
const CURVATURE: f64 = 30.0;

/// The most planes that are averaged.
const MOST_PLANES: usize = 80;

/// Standard deviations of a normal distribution to the median of its absolute values.
const TO_DEVIATION: f64 = 1.4826;

/// Points with normals, arranged for distance queries.
#[derive(Debug)]
pub(super) struct SignedDistance {
    search: NeighbourSearch,
    points: Vec<[f64; 3]>,
    normals: Vec<[f32; 3]>,
    tree: SummationTree,
    dipoles: Charges<3>,
    /// The winding number that divides inside from outside.
    level: f64,
    /// Mean distance of neighbouring points.
    spacing: f64,
    close: f64,
    planes: Planes,
}

/// How the planes of the nearest points are averaged.
#[derive(Clone, Copy, Debug)]
struct Planes {
    count: NonZeroUsize,
    /// The width of the Gaussian weights; none: by the inverse of the squared distance.
    width: Option<f64>,
}

impl SignedDistance {
    /// Arranges the points of one surface; `normals` are unit, one per point, pointing outwards.
    ///
    /// # Panics
    /// If there are no points, or not as many normals.
    pub(super) fn new(points: &[[f32; 3]], normals: &[[f32; 3]]) -> Self {
        assert_eq!(points.len(), normals.len(), "one normal per point");
        let points: Vec<[f64; 3]> = points.iter().map(|point| point.map(f64::from)).collect();
        let search = NeighbourSearch::new(&points);
        let neighbours = search.nearest_of_each(&points, density::NEIGHBOURS);
        let spacings = neighbours.par_iter().map(|found| squared_spacing(found));
        let softening: Vec<f64> = spacings.collect();
        let spacing = (softening.iter().sum::<f64>() / points.len() as f64).sqrt();
        let tree = SummationTree::new(&points, &softening);
        let dipoles = normals
            .iter()
            .zip(areas(&neighbours))
            .map(|(normal, area)| normal.map(|n| f64::from(n) * area));
        let dipoles = tree.charges(&dipoles.collect::<Vec<_>>());
        let some = points.par_iter().step_by(points.len().div_ceil(LOOKED_AT));
        let mut levels: Vec<f64> = some.map(|&point| tree.winding(&dipoles, point)).collect();
        // The median: those at wrong normals are far off.
        levels.sort_by(f64::total_cmp);
        Self {
            level: f64::midpoint(0.5, levels[levels.len() / 2]),
            search,
            points,
            normals: normals.to_vec(),
            tree,
            dipoles,
            spacing,
            close: CLOSE * spacing,
            planes: Planes {
                count: PLANES,
                width: None,
            },
        }
    }

    /// The same with a surface that is smoothed where the points are noisy: planes are averaged with Gaussian
    /// weights of a width that grows with the noise, see [`CURVATURE`] (implicit moving least squares; Kolluri,
    /// "Provably good moving least squares", 2005). Where that takes no more planes it is [`Self::new`].
    ///
    /// # Panics
    /// As [`Self::new`].
    pub(super) fn smoothed(points: &[[f32; 3]], normals: &[[f32; 3]]) -> Self {
        let mut out = Self::new(points, normals);
        let spacing = out.spacing;
        // Noise falls to sigma spacing / (sqrt(pi) width), the surface moves by curvature width^2 / 4: the sum of
        // their squares is least at this width.
        let balance = 8.0 * (out.noise() * spacing / CURVATURE).powi(2) / PI;
        let width = balance.cbrt().sqrt();
        // The points within twice the width.
        let count = (4.0 * PI * (width / spacing).powi(2)).ceil() as usize;
        if count > PLANES.get() {
            out.planes = Planes {
                count: NonZeroUsize::new(count.min(MOST_PLANES)).unwrap_or(PLANES),
                width: Some(width),
            };
            out.close = CLOSE * width.max(spacing);
        }
        out
    }

    /// The standard deviation of the points' heights over the planes of their neighbours.
    fn noise(&self) -> f64 {
        let apart = self.points.len().div_ceil(LOOKED_AT);
        let height = |&point: &[f64; 3]| {
            let around = self.search.nearest(point, density::NEIGHBOURS);
            let others = around.iter().skip(1).map(|neighbour| {
                let k = neighbour.index as usize;
                dot(
                    difference(point, self.points[k]),
                    self.normals[k].map(f64::from),
                )
            });
            others.sum::<f64>().abs() / (around.len() - 1).max(1) as f64
        };
        let mut heights: Vec<f64> = self.points.par_iter().step_by(apart).map(height).collect();
        heights.sort_by(f64::total_cmp);
        TO_DEVIATION * heights[heights.len() / 2]
    }

    /// The mean distance of neighbouring points.
    pub(super) fn spacing(&self) -> f64 {
        self.spacing
    }

    /// The signed distance of `x` from the surface.
    pub(super) fn at(&self, x: [f32; 3]) -> f32 {
        let x = x.map(f64::from);
        let nearest = self.search.nearest(x, self.planes.count);
        let closest = nearest[0].squared_distance;
        let reach = self.close * self.close;
        let (mut height, mut total) = (0.0, 0.0);
        for neighbour in &nearest {
            let k = neighbour.index as usize;
            let normal = self.normals[k].map(f64::from);
            let weight = match self.planes.width {
                // Over that of the closest point, so that not all of them round to 0.
                Some(width) => (-(neighbour.squared_distance - closest) / (width * width)).exp(),
                None => 1.0 / (neighbour.squared_distance + 1e-3 * reach),
            };
            height += weight * dot(difference(x, self.points[k]), normal);
            total += weight;
        }
        let plane = height / total;
        let distance = closest.sqrt();
        // From the planes to the nearest point between one and two times `close`: no jump.
        let share = (distance / self.close - 1.0).clamp(0.0, 1.0);
        let near = match self.planes.width {
            Some(_) => plane.abs(),
            None => plane.abs().min(distance),
        };
        let magnitude = near * (1.0 - share) + distance * share;
        let side = if share > 0.0 {
            self.level - self.tree.winding(&self.dipoles, x)
        } else {
            plane
        };
        magnitude.copysign(side) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::testing::sphere_cloud;

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

    #[test]
    fn no_few_wrong_normals_decide_about_the_space_beyond_them() {
        let points = sphere_cloud(5000, 0.3, 2);
        // A cap of 1.5 % of the sphere is turned over.
        let turned = |p: &[f64; 3]| if p[0] > 0.97 * 0.3 { -1.0 } else { 1.0 };
        let normal = |p: &[f64; 3]| p.map(|c| (turned(p) * c / 0.3) as f32);
        let normals: Vec<[f32; 3]> = points.iter().map(normal).collect();
        let points: Vec<[f32; 3]> = points.iter().map(|p| p.map(|c| c as f32)).collect();
        let distance = SignedDistance::new(&points, &normals);
        for beyond in [0.45, 0.6, 1.0] {
            assert!(distance.at([beyond, 0.0, 0.0]) > 0.0, "at {beyond}");
        }
        for within in [0.0, 0.1, 0.2] {
            assert!(distance.at([within, 0.0, 0.0]) < 0.0, "at {within}");
        }
    }

    #[test]
    fn a_scan_from_one_side_has_two_sides_and_an_end() {
        // The cap of a sphere that is seen from above: flat enough for winding numbers below 1/2.
        let cap = sphere_cloud(20_000, 1.0, 3);
        let cap: Vec<[f64; 3]> = cap.into_iter().filter(|p| p[2] > 0.8).collect();
        let points: Vec<[f32; 3]> = cap.iter().map(|p| p.map(|c| c as f32)).collect();
        let distance = SignedDistance::new(&points, &points);
        for height in [0.05, 0.1, 0.3, 1.0] {
            assert!(
                distance.at([0.05, 0.0, 1.0 + height]) > 0.0,
                "{height} above"
            );
        }
        for depth in [0.05, 0.1, 0.2] {
            assert!(distance.at([0.05, 0.0, 1.0 - depth]) < 0.0, "{depth} below");
        }
        assert!(distance.at([0.05, 0.0, -0.5]) > 0.0, "far below");
    }
}
