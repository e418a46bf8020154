//! A shape as the registration sees it: many points, and a few nodes among them that carry the
//! rest.

use std::num::NonZeroUsize;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::graph::Graph;
use crate::geometry::linear::{Matrix, add, difference, dot, length, scaled, times};
use crate::shape::{NeighbourSearch, NormalSource, Normalisation, Shape, ShapeError, points_of};

/// Nodes that a point is carried by.
const CARRIERS: usize = 6;

/// Nodes that a node is tied to.
const TIES: usize = 8;

/// Distances along the surface up to which carriers and ties are looked for, in spacings of the
/// nodes.
const REACH: f64 = 4.5;

/// Nodes from which distances are measured for [`Surface::remoteness`].
const LANDMARKS: usize = 150;

/// Nearest points among which one that faces the same way is looked for.
const FACING: NonZeroUsize = NonZeroUsize::new(6).expect("6 is not 0");

/// Points of one shape in normalised coordinates, float64, and the nodes among them.
#[derive(Debug)]
pub(super) struct Surface {
    /// Points spread over the surface at random.
    pub points: Vec<[f64; 3]>,
    /// Unit normals there.
    pub normals: Vec<[f64; 3]>,
    /// The points, arranged.
    pub search: NeighbourSearch,
    /// Which points are nodes: each the one farthest from those before it, so that any first few
    /// are spread evenly too.
    pub nodes: Vec<u32>,
    /// Pairs of nodes near each other along the surface, each once, the smaller first.
    pub ties: Vec<[u32; 2]>,
    /// For each node the mean distance along the surface to all of it: large at the tips of limbs,
    /// small in the middle of the body, and the same in every pose.
    pub remoteness: Vec<f64>,
    /// For each point the nodes that carry it, with weights that sum to 1.
    carriers: Vec<Vec<(u32, f64)>>,
}

impl Surface {
    /// Spreads up to `points` points over the shape and chooses up to `nodes` nodes among them.
    ///
    /// # Errors
    /// [`ShapeError`] if the shape has no points for it.
    pub(super) fn new(
        shape: &Shape,
        normalisation: &Normalisation,
        [points, nodes]: [usize; 2],
        seed: u64,
    ) -> Result<Self, ShapeError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (positions, normals) =
            points_of(shape, points, NormalSource::Auto, &mut rng, &mut Vec::new())?;
        let normals = normals.expect("normals are asked for");
        // Of a cloud every vertex is taken: enough of them will do.
        let mut chosen: Vec<usize> = (0..positions.len()).collect();
        if chosen.len() > points {
            chosen = rand::seq::index::sample(&mut rng, positions.len(), points).into_vec();
            chosen.sort_unstable();
        }
        let place = |&k: &usize| normalisation.apply(positions[k]).map(f64::from);
        let facing = |&k: &usize| normals[k].map(f64::from);
        let points = chosen.iter().map(place).collect();
        Ok(Self::of(points, chosen.iter().map(facing).collect(), nodes))
    }

    /// The surface of these points and unit normals.
    pub(super) fn of(points: Vec<[f64; 3]>, normals: Vec<[f64; 3]>, nodes: usize) -> Self {
        let search = NeighbourSearch::new(&points);
        let graph = Graph::of_surface(&points, &normals, &search);
        let nodes = farthest_points(&points, nodes);
        let reach = REACH * spacing(nodes.len());
        let near: Vec<Vec<(u32, f64)>> = nodes
            .par_iter()
            .map(|&node| graph.within(node, reach))
            .collect();
        let remoteness = remoteness(&graph, &nodes);
        Self {
            ties: ties(&nodes, &near),
            carriers: carriers(&points, &nodes, &near),
            points,
            normals,
            search,
            nodes,
            remoteness,
        }
    }

    /// The mean distance between nodes that are next to each other, where the area is 1.
    pub(super) fn spacing(&self) -> f64 {
        spacing(self.nodes.len())
    }

    /// Positions of the nodes.
    pub(super) fn node_points(&self) -> Vec<[f64; 3]> {
        self.nodes
            .iter()
            .map(|&node| self.points[node as usize])
            .collect()
    }

    /// Normals at the nodes.
    pub(super) fn node_normals(&self) -> Vec<[f64; 3]> {
        self.nodes
            .iter()
            .map(|&node| self.normals[node as usize])
            .collect()
    }

    /// The point nearest to `x` that faces like `normal`; the nearest of all if none does.
    pub(super) fn nearest_facing(&self, x: [f64; 3], normal: [f64; 3]) -> u32 {
        let found = self.search.nearest(x, FACING);
        let facing = |index: u32| dot(self.normals[index as usize], normal) > 0.0;
        let first = found
            .iter()
            .find(|near| facing(near.index))
            .unwrap_or(&found[0]);
        first.index
    }

    /// Where `x`, beside point `anchor`, goes with the nodes: the mean of the motions of those that
    /// carry the anchor; and the mean of their rotations, of the normal.
    pub(super) fn carry(
        &self,
        motion: &NodeMotion,
        anchor: u32,
        (x, normal): ([f64; 3], [f64; 3]),
    ) -> ([f64; 3], [f64; 3]) {
        let (mut place, mut facing) = ([0.0; 3], [0.0; 3]);
        for &(node, weight) in &self.carriers[anchor as usize] {
            let start = self.points[self.nodes[node as usize] as usize];
            let turn = &motion.rotations[node as usize];
            let turned = times(turn, difference(x, start));
            place = add(
                place,
                scaled(add(motion.places[node as usize], turned), weight),
            );
            facing = add(facing, scaled(times(turn, normal), weight));
        }
        let length = length(facing).max(f64::MIN_POSITIVE);
        (place, scaled(facing, length.recip()))
    }
}

/// Where each node goes, and how it turns on the way.
#[derive(Debug, Clone)]
pub(super) struct NodeMotion {
    pub places: Vec<[f64; 3]>,
    pub rotations: Vec<Matrix>,
}

/// The spacing of so many nodes that share an area of 1.
fn spacing(nodes: usize) -> f64 {
    (nodes as f64).sqrt().recip()
}

/// Up to `count` points, each the one farthest from all before it; the first is point 0.
pub(super) fn farthest_points(points: &[[f64; 3]], count: usize) -> Vec<u32> {
    let mut chosen = Vec::with_capacity(count);
    let mut distances = vec![f64::INFINITY; points.len()];
    let mut next = 0;
    while chosen.len() < count.min(points.len()) {
        chosen.push(next as u32);
        let from = points[next];
        let mut farthest = (0, 0.0);
        for (k, (point, distance)) in points.iter().zip(&mut distances).enumerate() {
            let apart = difference(*point, from);
            *distance = distance.min(dot(apart, apart));
            if *distance > farthest.1 {
                farthest = (k, *distance);
            }
        }
        if farthest.1 == 0.0 {
            break;
        }
        next = farthest.0;
    }
    chosen
}

/// Each node with the [`TIES`] nodes nearest to it along the surface.
fn ties(nodes: &[u32], near: &[Vec<(u32, f64)>]) -> Vec<[u32; 2]> {
    let number: rustc_hash::FxHashMap<u32, u32> = nodes.iter().copied().zip(0..).collect();
    let mut ties = Vec::with_capacity(TIES * nodes.len());
    for (node, reached) in (0..).zip(near) {
        let others = reached
            .iter()
            .filter_map(|(point, _)| number.get(point).copied());
        let nearest = others.filter(|&other| other != node).take(TIES);
        ties.extend(nearest.map(|other| [node.min(other), node.max(other)]));
    }
    ties.sort_unstable();
    ties.dedup();
    ties
}

/// The nodes nearest to each point along the surface, with weights that fall with the distance `d`
/// as `exp(-(1.5 d / d_last)^2)`; the nearest in space where none is near along the surface.
fn carriers(points: &[[f64; 3]], nodes: &[u32], near: &[Vec<(u32, f64)>]) -> Vec<Vec<(u32, f64)>> {
    let mut carriers = vec![Vec::new(); points.len()];
    for (node, reached) in (0..).zip(near) {
        for &(point, distance) in reached {
            carriers[point as usize].push((node, distance));
        }
    }
    let places: Vec<[f64; 3]> = nodes.iter().map(|&node| points[node as usize]).collect();
    let search = NeighbourSearch::new(&places);
    for (own, point) in carriers.iter_mut().zip(points) {
        own.sort_by(|a: &(u32, f64), b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        own.truncate(CARRIERS);
        if own.is_empty() {
            own.push((search.nearest_one(*point).index, 1.0));
        }
        let last = own.last().map_or(1.0, |last| last.1).max(f64::MIN_POSITIVE);
        let weight = |distance: f64| (-(1.5 * distance / last).powi(2)).exp();
        let total: f64 = own.iter().map(|carrier| weight(carrier.1)).sum();
        own.iter_mut()
            .for_each(|carrier| carrier.1 = weight(carrier.1) / total);
    }
    carriers
}

/// The mean distance along the surface from each node to the [`LANDMARKS`] that it is connected
/// with.
fn remoteness(graph: &Graph, nodes: &[u32]) -> Vec<f64> {
    let number: rustc_hash::FxHashMap<u32, usize> = nodes.iter().copied().zip(0..).collect();
    let landmarks = &nodes[..nodes.len().min(LANDMARKS)];
    let distances: Vec<Vec<(usize, f64)>> = landmarks
        .par_iter()
        .map(|&landmark| {
            let reached = graph.within(landmark, f64::INFINITY).into_iter();
            reached
                .filter_map(|(point, distance)| Some((*number.get(&point)?, distance)))
                .collect()
        })
        .collect();
    let mut sums = vec![(0.0, 0.0); nodes.len()];
    for &(node, distance) in distances.iter().flatten() {
        sums[node].0 += distance;
        sums[node].1 += 1.0;
    }
    sums.into_iter()
        .map(|(sum, count)| sum / f64::max(count, 1.0))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::rotation::{RigidMotion, tests::turn};
    use super::*;
    use crate::geometry::testing::cuboid;
    use crate::shape::sample_surface;

    /// Points on the cube of this edge around the origin.
    fn cube(edge: f64, count: usize) -> Surface {
        let cube = cuboid([edge; 3]).moved(|x| x.map(|part| part - 0.5 * edge));
        let samples = sample_surface(&cube, count, &mut ChaCha8Rng::seed_from_u64(1));
        let normals = samples.normals.iter().map(|normal| normal.map(f64::from));
        Surface::of(samples.points, normals.collect(), 100)
    }

    #[test]
    fn a_rigid_motion_of_the_nodes_carries_every_point_rigidly() {
        let surface = cube(0.4, 2000);
        let motion = RigidMotion {
            rotation: turn(1.2),
            translation: [0.1, 0.2, 0.3],
        };
        let nodes = NodeMotion {
            places: surface
                .node_points()
                .into_iter()
                .map(|x| motion.apply(x))
                .collect(),
            rotations: vec![motion.rotation; surface.nodes.len()],
        };
        for (k, &point) in surface.points.iter().enumerate() {
            let (place, normal) = surface.carry(&nodes, k as u32, (point, surface.normals[k]));
            // Weights that sum to 1 within a few roundings, of lengths below 1.
            assert!(length(difference(place, motion.apply(point))) < 1e-14);
            let turned = times(&motion.rotation, surface.normals[k]);
            assert!(length(difference(normal, turned)) < 1e-14);
        }
    }

    #[test]
    fn nodes_are_spread_and_tied_to_their_neighbours() {
        // The area is 6 * .41^2 = 1: nodes at a spacing of a tenth.
        let surface = cube(0.408, 4000);
        let nodes = surface.node_points();
        assert_eq!(nodes.len(), 100);
        let apart = |i: usize, j: usize| length(difference(nodes[i], nodes[j]));
        for i in 0..100 {
            let nearest = (0..100)
                .filter(|&j| j != i)
                .map(|j| apart(i, j))
                .fold(1.0, f64::min);
            assert!(
                nearest > 0.06,
                "the farthest point from all others: {nearest}"
            );
        }
        let mut degree = [0; 100];
        for &[i, j] in &surface.ties {
            assert!(apart(i as usize, j as usize) < REACH * surface.spacing());
            degree[i as usize] += 1;
            degree[j as usize] += 1;
        }
        assert!(
            degree.iter().all(|&ties| ties >= TIES),
            "each has its own, and those of others"
        );
        // Every corner of a cube is as remote as the others, and more so than the middles of the
        // faces.
        let remotest = surface.remoteness.iter().copied().fold(0.0, f64::max);
        let least = surface.remoteness.iter().copied().fold(1.0, f64::min);
        assert!(
            least > 0.3 && remotest < 0.6 && remotest > 1.02 * least,
            "{least} to {remotest}"
        );
    }
}
