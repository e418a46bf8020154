//! How densely points lie: their spacing, and the area of the surface that they were sampled from.
//!
//! On a surface sampled at random with density `rho` the k-th neighbour of a point lies at `r_k` with
//! `E[pi r_k^2] = k / rho`, so every point stands for `pi r_k^2 / k` of the area. It assumes neither
//! triangles nor normals. Evenly spaced points are not at random: a square grid, the worst case, comes
//! out at pi / 4 of its area, a tenth off in length.
//!
//! There are two estimates by this formula, with two numbers of neighbours, because they serve two ends.
//! [`areas`] weighs single points ([`super::winding`]): few neighbours, so that the other side of a thin
//! part is seldom among them. [`cloud_area`] sums over all points and sets the common scale of two
//! shapes: more neighbours, so that it scatters less. It is never to change in its last digit, since a
//! run that is resumed compares its scale with the one it was begun with.

use std::f64::consts::PI;
use std::num::NonZeroUsize;

use super::neighbours::{Neighbour, NeighbourSearch};

/// Neighbours that the area of a cloud is estimated from: with fewer the estimate of one point
/// scatters, with more it reaches around edges.
const CLOUD_NEIGHBOURS: usize = 8;

/// Neighbours that a point's area is estimated from: few, so that the other side of a thin part is
/// not among them.
const AREA_NEIGHBOURS: usize = 6;

/// As many as that takes: every point finds itself first.
pub(crate) const NEIGHBOURS: NonZeroUsize =
    NonZeroUsize::new(AREA_NEIGHBOURS + 1).expect("more than 0");

/// The neighbour whose distance is the spacing of the points.
const SPACING: usize = 3;

/// The squared spacing about a point whose neighbours, itself first, are these.
pub(crate) fn squared_spacing(found: &[Neighbour]) -> f64 {
    found[SPACING.min(found.len() - 1)].squared_distance
}

/// The distance of a point from its third neighbour, in the median: about the spacing of the points.
///
/// # Panics
/// If there are no points.
pub(crate) fn usual_spacing(points: &[[f64; 3]]) -> f64 {
    let count = NonZeroUsize::MIN.saturating_add(SPACING);
    let found = NeighbourSearch::new(points).nearest_of_each(points, count);
    let mut spacings: Vec<f64> = found
        .iter()
        .map(|near| squared_spacing(near).sqrt())
        .collect();
    let middle = spacings.len() / 2;
    *spacings.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The area that each point stands for: `pi r_k^2 / k` with its k-th neighbour at `r_k`, k = 6.
///
/// `neighbours` are those of each point, itself first; fewer than k are taken as they are.
pub(crate) fn areas(neighbours: &[Vec<Neighbour>]) -> Vec<f64> {
    let area = |found: &Vec<Neighbour>| {
        let k = AREA_NEIGHBOURS.min(found.len() - 1);
        PI * found[k].squared_distance / k.max(1) as f64
    };
    neighbours.iter().map(area).collect()
}

/// The area of the surface that a point cloud was sampled from, estimated from its density:
/// the sum of `pi r_k^2 / k` over all points with their k-th neighbour at `r_k`, k = 8; zero if there are
/// no more points than that.
pub(crate) fn cloud_area(points: &[[f64; 3]]) -> f64 {
    if points.len() <= CLOUD_NEIGHBOURS {
        return 0.0;
    }
    // One more than k: every point finds itself first.
    let count = NonZeroUsize::new(CLOUD_NEIGHBOURS + 1).expect("one more than a count");
    let neighbours = NeighbourSearch::new(points).nearest_of_each(points, count);
    let last = neighbours
        .iter()
        .map(|found| found[CLOUD_NEIGHBOURS].squared_distance);
    last.sum::<f64>() * PI / CLOUD_NEIGHBOURS as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::testing::{sphere_cloud, torus_cloud};

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
    fn the_spacing_of_a_grid_is_that_of_its_lines_wherever_one_point_lies() {
        let grid = (0..10_000).map(|i| [f64::from(i % 100), f64::from(i / 100), 0.0]);
        let mut points: Vec<[f64; 3]> = grid.collect();
        points.push([1e6; 3]);
        assert_eq!(usual_spacing(&points), 1.0);
        assert_eq!(usual_spacing(&[[3.0; 3]]), 0.0);
    }
}
