//! The rigid motion that lays one surface roughly onto another.
//!
//! Candidates are no motion at all, the 24 rotations of a cube and the four proper rotations that
//! lay principal axes onto principal axes, each about the centroids; each but the first is improved
//! by iterated closest points with a fifth of the pairs left out (Chetverikov, Stepanov and Krsek,
//! "Robust Euclidean alignment of 3D point sets: the trimmed iterative closest point algorithm",
//! Image and Vision Computing 23, 2005), fewer and fewer of them. Mirrored candidates there are none. Scans mostly come in
//! one frame and animals look alike from several sides, so that no motion is kept unless another
//! comes clearly closer.
//!
//! Given pairs decide it where there are any. The motion that fits them best is a candidate too, as it is and improved.
//! Each candidate is judged by how close the surfaces come and by how far it misses the pairs, and none is preferred.

use rayon::prelude::*;

use super::anchors::Anchors;
use super::rotation::RigidMotion;
use super::surface::Surface;
use crate::geometry::linear::{
    Matrix, add_outer, cross, determinant, difference, dot, mean, product, symmetric_eigen, times,
    transposed,
};

/// Nodes of each surface that take part.
const NODES: usize = 400;

/// Rounds of closest points, each with how many of the candidates go on to it: the closest after the
/// rounds before, and always that which begins with no motion.
const ROUNDS: [(usize, usize); 3] = [(6, usize::MAX), (9, 8), (10, 3)];

/// The share of the pairs that counts: the rest may belong to what moved or is missing.
const KEPT: f64 = 0.8;

/// Another motion than none must come this much closer.
const CLEARLY: f64 = 0.6;

/// A candidate that another rotation must beat, beyond what chance decides.
const BARELY: f64 = 0.95;

/// What was tried and chosen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Alignment {
    pub motion: RigidMotion,
    /// Mean distance of the closest pairs, both ways, after it.
    pub distance: f64,
    /// The same without any motion.
    pub unmoved: f64,
}

/// The best of all candidates.
pub(super) fn align(source: &Surface, target: &Surface, anchors: &Anchors) -> Alignment {
    let sides = Sides::new(source, target, anchors);
    let unmoved = sides.distance(&RigidMotion::IDENTITY);
    let tried = sides.improved(sides.candidates());
    if !anchors.is_empty() {
        return sides.best_with_anchors(tried, unmoved);
    }
    best_of(tried, (RigidMotion::IDENTITY, unmoved), unmoved)
}

/// The best of all candidates, where the shapes need not stay as they are: the closest position near that one, unless
/// another is clearly closer.
pub(super) fn lay(source: &Surface, target: &Surface) -> Alignment {
    let none = Anchors::default();
    let sides = Sides::new(source, target, &none);
    let unmoved = sides.distance(&RigidMotion::IDENTITY);
    let tried = sides.improved(sides.candidates());
    // The first is that which began with no motion.
    let preferred = match tried[0].1 < unmoved {
        true => tried[0],
        false => (RigidMotion::IDENTITY, unmoved),
    };
    best_of(tried, preferred, unmoved)
}

/// The closest of all, where the preferred one gives way to what is clearly closer only.
fn best_of(
    tried: Vec<(RigidMotion, f64)>,
    preferred: (RigidMotion, f64),
    unmoved: f64,
) -> Alignment {
    let mut best = (preferred.0, preferred.1, CLEARLY);
    for (motion, distance) in tried {
        if distance < best.2 * best.1 {
            best = (motion, distance, BARELY);
        }
    }
    Alignment {
        motion: best.0,
        distance: best.1,
        unmoved,
    }
}

/// How well the surfaces lie as they are.
pub(super) fn as_given(source: &Surface, target: &Surface) -> Alignment {
    let none = Anchors::default();
    let unmoved = Sides::new(source, target, &none).distance(&RigidMotion::IDENTITY);
    Alignment {
        motion: RigidMotion::IDENTITY,
        distance: unmoved,
        unmoved,
    }
}

/// Both surfaces and some evenly spread points of each, with normals.
struct Sides<'a> {
    surfaces: [&'a Surface; 2],
    probes: [Vec<([f64; 3], [f64; 3])>; 2],
    anchors: &'a Anchors,
}

impl<'a> Sides<'a> {
    fn new(source: &'a Surface, target: &'a Surface, anchors: &'a Anchors) -> Self {
        let surfaces = [source, target];
        let probes = surfaces.map(|surface| {
            let nodes = surface
                .finest()
                .nodes
                .iter()
                .take(NODES)
                .map(|&node| node as usize);
            nodes
                .map(|node| (surface.points[node], surface.normals[node]))
                .collect()
        });
        Self {
            surfaces,
            probes,
            anchors,
        }
    }

    /// The closest pairs from one surface to the other, both at rest, with squared distances: those
    /// of the [`KEPT`] share that are closest.
    fn closest(&self, from: usize, motion: &RigidMotion) -> Vec<([f64; 3], [f64; 3], f64)> {
        let other = self.surfaces[1 - from];
        let pair = |&(x, normal): &([f64; 3], [f64; 3])| {
            let (place, facing) = (motion.apply(x), times(&motion.rotation, normal));
            let near = other.points[other.nearest_facing(place, facing) as usize];
            let apart = difference(near, place);
            (x, near, dot(apart, apart))
        };
        let mut pairs: Vec<_> = self.probes[from].iter().map(pair).collect();
        pairs.sort_by(|a, b| a.2.total_cmp(&b.2));
        pairs.truncate(((KEPT * pairs.len() as f64).ceil() as usize).max(1));
        pairs
    }

    /// Mean distance of the closest pairs, both ways.
    fn distance(&self, motion: &RigidMotion) -> f64 {
        let ways = [(0, *motion), (1, motion.inverse())];
        let means = ways.map(|(from, motion)| {
            let pairs = self.closest(from, &motion);
            pairs.iter().map(|pair| pair.2.sqrt()).sum::<f64>() / pairs.len() as f64
        });
        (means[0] + means[1]) / 2.0
    }

    /// What a candidate is judged by.
    fn score(&self, motion: &RigidMotion) -> f64 {
        self.distance(motion) + self.anchors.miss(motion)
    }

    /// The candidate with the best score, of which the given pairs have a part.
    fn best_with_anchors(&self, tried: Vec<(RigidMotion, f64)>, unmoved: f64) -> Alignment {
        let fitted = self.anchors.rigid();
        let rounds = ROUNDS.iter().map(|(rounds, _)| rounds).sum();
        let improved = (0..rounds).fold(fitted, |motion, _: usize| self.closer(&motion));
        let others = [RigidMotion::IDENTITY, fitted, improved];
        let others = others.map(|motion| (motion, self.score(&motion)));
        let all = others.into_iter().chain(tried);
        let best = all.min_by(|a, b| a.1.total_cmp(&b.1));
        let motion = best.expect("there are three and more").0;
        Alignment {
            motion,
            distance: self.distance(&motion),
            unmoved,
        }
    }

    /// The candidates that go on to the end, improved, and their scores, in their order.
    fn improved(&self, candidates: Vec<RigidMotion>) -> Vec<(RigidMotion, f64)> {
        let mut tried: Vec<(RigidMotion, f64)> = candidates
            .into_iter()
            .map(|motion| (motion, f64::NAN))
            .collect();
        for (rounds, count) in ROUNDS {
            let mut order: Vec<usize> = (1..tried.len()).collect();
            order.sort_by(|&a, &b| tried[a].1.total_cmp(&tried[b].1));
            order.truncate(count);
            order.sort_unstable();
            let going_on = std::iter::once(0).chain(order).map(|k| tried[k].0);
            let going_on: Vec<RigidMotion> = going_on.collect();
            let after = |&start: &RigidMotion| {
                let motion = (0..rounds).fold(start, |motion, _| self.closer(&motion));
                (motion, self.score(&motion))
            };
            tried = going_on.par_iter().map(after).collect();
        }
        tried
    }

    /// The motion after a round of closest pairs in both directions.
    fn closer(&self, motion: &RigidMotion) -> RigidMotion {
        let forth = self.closest(0, motion).into_iter();
        let forth = forth.map(|(x, near, _)| (x, near));
        let back = self.closest(1, &motion.inverse()).into_iter();
        let back = back.map(|(y, near, _)| (near, y));
        RigidMotion::between(&forth.chain(back).collect::<Vec<_>>())
    }

    /// The identity first, the cube's rotations, the principal axes'.
    fn candidates(&self) -> Vec<RigidMotion> {
        let places = |side: usize| self.probes[side].iter().map(|probe| probe.0);
        let centroids = [0, 1].map(|side| mean(places(side)));
        let axes = [0, 1].map(|side| principal_axes(places(side), centroids[side]));
        let mut rotations = cube_rotations();
        for signs in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let mut turned = axes[1];
            for row in 0..2 {
                turned[row] = turned[row].map(|part| signs[row] * part);
            }
            turned[2] = cross(turned[0], turned[1]);
            rotations.push(product(&transposed(&turned), &axes[0]));
        }
        let about = |rotation| RigidMotion::about(rotation, centroids[0], centroids[1]);
        let turned = rotations.into_iter().map(about);
        std::iter::once(RigidMotion::IDENTITY)
            .chain(turned)
            .collect()
    }
}

/// The rotations that take a cube onto itself, the identity first.
fn cube_rotations() -> Vec<Matrix> {
    let orders = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let signed = orders.into_iter().flat_map(|order| {
        (0..8).map(move |signs| {
            let mut matrix = [[0.0; 3]; 3];
            for (row, column) in order.into_iter().enumerate() {
                matrix[row][column] = if signs >> row & 1 == 0 { 1.0 } else { -1.0 };
            }
            matrix
        })
    });
    signed.filter(|matrix| determinant(matrix) > 0.0).collect()
}

/// Unit axes as rows, by falling spread, right-handed.
fn principal_axes(points: impl Iterator<Item = [f64; 3]>, centre: [f64; 3]) -> Matrix {
    let mut covariance = [[0.0; 3]; 3];
    for point in points {
        let x = difference(point, centre);
        add_outer(&mut covariance, 1.0, x, x);
    }
    let (values, vectors) = symmetric_eigen(covariance);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| values[j].total_cmp(&values[i]));
    let column = |k: usize| [vectors[0][k], vectors[1][k], vectors[2][k]];
    let (first, second) = (column(order[0]), column(order[1]));
    [first, second, cross(first, second)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::linear::IDENTITY;

    #[test]
    fn a_cube_has_24_rotations_all_different_the_first_none() {
        let rotations = cube_rotations();
        assert_eq!(rotations.len(), 24);
        assert_eq!(rotations[0], IDENTITY);
        for (k, rotation) in rotations.iter().enumerate() {
            assert_eq!(determinant(rotation), 1.0);
            assert!(!rotations[..k].contains(rotation));
        }
    }

    #[test]
    fn principal_axes_are_those_of_the_spread_right_handed() {
        let points = [
            [0.0, 3.0, 0.0],
            [0.0, -3.0, 0.0],
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 0.0, 2.0],
            [0.0, 0.0, -2.0],
        ];
        let axes = principal_axes(points.into_iter(), [0.0; 3]);
        assert_eq!(
            axes.map(|axis| axis.map(f64::abs)),
            [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
        );
        assert_eq!(determinant(&axes), 1.0);
    }
}
