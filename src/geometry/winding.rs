//! Sums over all points of a cloud that stand for its winding number, by a tree.
//!
//! The winding number of an oriented cloud about `x` is the solid angle under which its points are
//! seen as small discs, by Gauss's law 1 inside and 0 outside (Barill, Dickson, Schmidt, Levin and
//! Jacobson, "Fast winding numbers for soups and clouds", SIGGRAPH 2018):
//!
//! ```text
//! w(x) = sum_j  a_j n_j . (p_j - x) / (4 pi (|p_j - x|^2 + s_j^2)^(3/2))
//! ```
//!
//! A point far from the border between in and out cannot be put on the wrong side by a few wrong
//! normals or a hole, as it can by the normal of the nearest point.
//!
//! # Differs from the paper
//! A far group of points counts as one disc at its centre, without the paper's terms of first and
//! second order: its sums decide a sign. Each point has a softening length `s_j`, within which its
//! disc is no longer flat to the eye; the paper sums without.

use std::f64::consts::PI;

mod at_points;

use super::density::{NEIGHBOURS, areas};
use super::linear::{difference, dot, mean};
use super::neighbours::NeighbourSearch;

/// The most points in a leaf.
const LEAF: usize = 16;

/// How many of its radii away a group counts as one disc.
const FAR: f64 = 3.0;

/// Whether the normals of a cloud point into it on the whole: whether the volume that its points
/// enclose as small discs, `sum_j a_j n_j . (p_j - centre) / 3`, is negative.
///
/// # Panics
/// If there are no points.
pub(crate) fn is_inside_out(points: &[[f64; 3]], normals: &[[f32; 3]]) -> bool {
    let neighbours = NeighbourSearch::new(points).nearest_of_each(points, NEIGHBOURS);
    let centre = mean(points.iter().copied());
    let discs = areas(&neighbours)
        .into_iter()
        .zip(points.iter().zip(normals));
    let volume = discs.map(|(area, (&point, normal))| {
        area * dot(difference(point, centre), normal.map(f64::from))
    });
    volume.sum::<f64>() < 0.0
}

/// A group of points that lie together.
#[derive(Debug)]
struct Node {
    /// Its points are `begin..end` in the tree's order.
    begin: u32,
    end: u32,
    /// The next node that is not within this one.
    after: u32,
    centre: [f64; 3],
    /// Squared distance from which it counts as one disc.
    far: f64,
}

/// Points arranged for sums over all of them.
#[derive(Debug)]
pub(crate) struct SummationTree {
    /// The place of each point among those that were given.
    order: Vec<u32>,
    points: Vec<[f64; 3]>,
    softening: Vec<f64>,
    /// Depth first: a node's first child follows it.
    nodes: Vec<Node>,
}

/// A vector of `D` numbers at each point and their sums over each group of points.
#[derive(Debug)]
pub(crate) struct Charges<const D: usize> {
    points: Vec<[f64; D]>,
    nodes: Vec<[f64; D]>,
}

impl SummationTree {
    /// Arranges the points, O(n log^2 n); `softening` are the squares of their softening lengths.
    ///
    /// # Panics
    /// If there are no points, 2^32 or more, or not as many lengths.
    pub(crate) fn new(points: &[[f64; 3]], softening: &[f64]) -> Self {
        assert!(!points.is_empty(), "sums over no points");
        assert_eq!(points.len(), softening.len(), "one length per point");
        let count = u32::try_from(points.len()).expect("fewer than 2^32 points");
        let mut order: Vec<u32> = (0..count).collect();
        let mut nodes = Vec::new();
        split(points, &mut order, 0, &mut nodes);
        let at = |&k: &u32| k as usize;
        Self {
            points: order.iter().map(|k| points[at(k)]).collect(),
            softening: order.iter().map(|k| softening[at(k)]).collect(),
            order,
            nodes,
        }
    }

    /// Charges of the points, in the order in which the points were given, made ready for sums.
    pub(crate) fn charges<const D: usize>(&self, of_points: &[[f64; D]]) -> Charges<D> {
        let ordered = self.order.iter().map(|&k| of_points[k as usize]);
        let points: Vec<[f64; D]> = ordered.collect();
        let total = |node: &Node| {
            let within = &points[node.begin as usize..node.end as usize];
            within.iter().fold([0.0; D], |sum, charge| {
                std::array::from_fn(|d| sum[d] + charge[d])
            })
        };
        Charges {
            nodes: self.nodes.iter().map(total).collect(),
            points,
        }
    }

    /// The winding number about `x` of points with these dipoles, area times outward normal.
    pub(crate) fn winding(&self, dipoles: &Charges<3>, x: [f64; 3]) -> f64 {
        let sum = std::cell::Cell::new(0.0);
        let add = |dipole: [f64; 3], place: [f64; 3], softening: f64| {
            let away = difference(place, x);
            sum.set(sum.get() + dot(dipole, away) * fall_off(away, softening));
        };
        self.visit(
            x,
            |node| add(dipoles.nodes[node], self.nodes[node].centre, 0.0),
            |k| add(dipoles.points[k], self.points[k], self.softening[k]),
        );
        sum.get()
    }

    /// Calls `far` for groups that are seen as one and `near` for the points of all others.
    fn visit(&self, x: [f64; 3], far: impl Fn(usize), near: impl Fn(usize)) {
        let mut next = 0;
        while let Some(node) = self.nodes.get(next) {
            let away = difference(node.centre, x);
            if dot(away, away) > node.far {
                far(next);
                next = node.after as usize;
            } else if node.after as usize == next + 1 {
                (node.begin as usize..node.end as usize).for_each(&near);
                next += 1;
            } else {
                next += 1;
            }
        }
    }
}

/// What all sums are multiplied by.
const SCALE: f64 = 1.0 / (4.0 * PI);

/// `1 / (4 pi (r^2 + s^2)^(3/2))`, and nothing at the point itself.
fn fall_off(away: [f64; 3], softening: f64) -> f64 {
    let squared = dot(away, away) + softening;
    if squared > 0.0 {
        SCALE / (squared * squared.sqrt())
    } else {
        0.0
    }
}

/// Adds the nodes of the points in `order`, which begin at `begin` in the tree's order, halving
/// them along their longest side.
fn split(points: &[[f64; 3]], order: &mut [u32], begin: usize, nodes: &mut Vec<Node>) {
    let of = |&k: &u32| points[k as usize];
    let centre = mean(order.iter().map(of));
    let (mut radius, mut reach) = (0.0_f64, [0.0_f64; 3]);
    for point in order.iter().map(of) {
        let away = difference(point, centre);
        radius = radius.max(dot(away, away));
        reach = [0, 1, 2].map(|axis| reach[axis].max(away[axis].abs()));
    }
    let place = nodes.len();
    nodes.push(Node {
        begin: begin as u32,
        end: (begin + order.len()) as u32,
        after: 0,
        centre,
        far: FAR * FAR * radius,
    });
    if order.len() > LEAF {
        let axis = [0, 1, 2]
            .into_iter()
            .max_by(|&a, &b| reach[a].total_cmp(&reach[b]));
        let axis = axis.expect("three axes");
        let half = order.len() / 2;
        // Ties are broken by the indices, so that the tree is the same on every run.
        order.select_nth_unstable_by(half, |a, b| {
            of(a)[axis].total_cmp(&of(b)[axis]).then(a.cmp(b))
        });
        let (low, high) = order.split_at_mut(half);
        split(points, low, begin, nodes);
        split(points, high, begin + half, nodes);
    }
    nodes[place].after = nodes.len() as u32;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::density::squared_spacing;
    use crate::geometry::testing::{sphere_cloud, torus_cloud};

    /// Points with normals, arranged, with their areas and softening lengths.
    fn arranged(points: &[[f64; 3]]) -> (SummationTree, Vec<f64>, Vec<f64>) {
        let neighbours = NeighbourSearch::new(points).nearest_of_each(points, NEIGHBOURS);
        let softening: Vec<f64> = neighbours.iter().map(|n| squared_spacing(n)).collect();
        (
            SummationTree::new(points, &softening),
            areas(&neighbours),
            softening,
        )
    }

    #[test]
    fn it_is_one_inside_and_nothing_outside_a_torus_far_from_the_origin() {
        let cloud = torus_cloud(6000, 1.0, 0.35, 41);
        let points: Vec<[f64; 3]> = cloud
            .iter()
            .map(|(p, _)| [p[0] + 4e5, p[1], p[2]])
            .collect();
        let (tree, areas, _) = arranged(&points);
        let dipoles: Vec<[f64; 3]> = (cloud.iter().zip(&areas))
            .map(|((_, n), area)| n.map(|x| x * area))
            .collect();
        let charges = tree.charges(&dipoles);
        for (x, expected) in [
            ([1.0, 0.0, 0.0], 1.0),
            ([0.0, -1.1, 0.1], 1.0),
            ([0.0, 0.0, 0.0], 0.0),
            ([1.0, 0.0, 0.5], 0.0),
            ([-3.0, 1.0, 0.0], 0.0),
        ] {
            let found = tree.winding(&charges, [x[0] + 4e5, x[1], x[2]]);
            // The areas come out within 3 % in all, each scatters by 40 %. Measured within 0.035.
            assert!((found - expected).abs() < 0.08, "at {x:?}: {found}");
        }
    }

    #[test]
    fn the_tree_sums_what_all_points_sum_to() {
        let points = sphere_cloud(3000, 1.0, 42);
        let (tree, areas, softening) = arranged(&points);
        // Dipoles that turn about: nothing cancels as it does for a closed surface.
        let dipoles: Vec<[f64; 3]> = (points.iter().zip(&areas))
            .map(|(p, area)| [area * p[1], *area, area * p[2] * p[0]])
            .collect();
        let by_dipole = tree.charges(&dipoles);
        for x in [[0.2, 0.1, -0.3], [1.05, 0.0, 0.0], [0.0, 2.0, 2.0]] {
            let each = (0..points.len()).map(|k| {
                let away = difference(points[k], x);
                dot(dipoles[k], away) * fall_off(away, softening[k])
            });
            let (expected, found) = (each.sum::<f64>(), tree.winding(&by_dipole, x));
            assert!((found - expected).abs() < 0.01, "{found}, not {expected}");
        }
    }

    #[test]
    fn one_point_and_a_thousand_at_one_place_have_no_winding_number() {
        for count in [1, 1000] {
            let points = vec![[2.0; 3]; count];
            let tree = SummationTree::new(&points, &vec![0.0; count]);
            let dipoles = tree.charges(&vec![[1.0, 0.0, 0.0]; count]);
            assert_eq!(tree.winding(&dipoles, [2.0; 3]), 0.0);
        }
    }
}
