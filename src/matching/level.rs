//! The nodes of a surface at one fineness.
//!
//! Nodes are chosen among the elements of what is finer: points of the surface, or the nodes of the
//! next finer level. Those elements are carried by the nodes next to them along the surface.

use rayon::prelude::*;

use super::graph::Graph;
use super::rotation::nearest_rotation;
use crate::geometry::linear::{Matrix, add, difference, length, scaled, times};
use crate::shape::NeighbourSearch;

/// Nodes that an element is carried by.
const CARRIERS: usize = 6;

/// Nodes that a node is tied to.
pub(super) const TIES: usize = 8;

/// Distances along the surface up to which carriers and ties are looked for, in spacings of the
/// nodes.
pub(super) const REACH: f64 = 4.5;

/// Points with unit normals, and the distances between them along the surface.
pub(super) struct Elements<'a> {
    pub places: &'a [[f64; 3]],
    pub normals: &'a [[f64; 3]],
    pub graph: &'a Graph,
}

/// Nodes and what they carry.
#[derive(Debug)]
pub(super) struct Level {
    /// Which elements are nodes: each the one farthest from those before it, so that any first few
    /// are spread evenly too.
    pub nodes: Vec<u32>,
    /// Where they are.
    pub places: Vec<[f64; 3]>,
    /// Unit normals there.
    pub normals: Vec<[f64; 3]>,
    /// Pairs of nodes near each other along the surface, each once, the smaller first.
    pub ties: Vec<[u32; 2]>,
    /// For each element the nodes that carry it, with weights that sum to 1.
    carriers: Carriers,
}

impl Level {
    /// The level of these nodes, and the distances between them along the surface.
    pub(super) fn new(elements: &Elements<'_>, nodes: Vec<u32>) -> (Self, Graph) {
        let reach = REACH * spacing(nodes.len());
        let near: Vec<Vec<(u32, f32)>> = nodes
            .par_iter()
            .map_init(
                || elements.graph.paths(),
                |paths, &node| paths.within(node, reach as f32),
            )
            .collect();
        let of = |all: &[[f64; 3]]| -> Vec<[f64; 3]> {
            nodes.iter().map(|&node| all[node as usize]).collect()
        };
        let places = of(elements.places);
        let links = between_nodes(&nodes, &near);
        let level = Self {
            ties: ties(&links),
            carriers: Carriers::new(elements.places, &places, &near),
            normals: of(elements.normals),
            places,
            nodes,
        };
        let graph = Graph::of_links(level.nodes.len(), &links.concat());
        (level, graph)
    }

    /// The mean distance between nodes that are next to each other, where the area is 1.
    pub(super) fn spacing(&self) -> f64 {
        spacing(self.nodes.len())
    }

    /// The node that carries an element most.
    pub(super) fn carrier(&self, element: u32) -> u32 {
        let carriers = self.carriers.of(element).iter();
        let most = carriers.max_by(|a, b| a.1.total_cmp(&b.1));
        most.expect("each element is carried").0
    }

    /// Where `x`, beside element `anchor`, goes with the nodes: the mean of the motions of those
    /// that carry the anchor; and the mean of their rotations, of the normal.
    pub(super) fn carry(
        &self,
        motion: &NodeMotion,
        anchor: u32,
        (x, normal): ([f64; 3], [f64; 3]),
    ) -> ([f64; 3], [f64; 3]) {
        let (mut place, mut facing) = ([0.0; 3], [0.0; 3]);
        for &(node, weight) in self.carriers.of(anchor) {
            let node = node as usize;
            let turn = &motion.rotations[node];
            let turned = times(turn, difference(x, self.places[node]));
            place = add(place, scaled(add(motion.places[node], turned), weight));
            facing = add(facing, scaled(times(turn, normal), weight));
        }
        let length = length(facing).max(f64::MIN_POSITIVE);
        (place, scaled(facing, length.recip()))
    }

    /// The motion of the elements, at `places`, that follows from that of the nodes.
    pub(super) fn carried(&self, motion: &NodeMotion, places: &[[f64; 3]]) -> NodeMotion {
        let rotation = |element: u32| {
            let mut sum = [[0.0; 3]; 3];
            for &(node, weight) in self.carriers.of(element) {
                for (sum, row) in sum.iter_mut().zip(motion.rotations[node as usize]) {
                    *sum = add(*sum, scaled(row, weight));
                }
            }
            nearest_rotation(&sum)
        };
        let elements = 0..places.len() as u32;
        let place = |(element, &x): (u32, &[f64; 3])| self.carry(motion, element, (x, x)).0;
        NodeMotion {
            places: elements.clone().zip(places).map(place).collect(),
            rotations: elements.map(rotation).collect(),
        }
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

/// From each node the links to the nodes it reaches, nearest first.
fn between_nodes(nodes: &[u32], near: &[Vec<(u32, f32)>]) -> Vec<Vec<(u32, u32, f32)>> {
    let number: rustc_hash::FxHashMap<u32, u32> = nodes.iter().copied().zip(0..).collect();
    let links = |(node, reached): (u32, &Vec<(u32, f32)>)| {
        let others = reached.iter().filter_map(|&(element, distance)| {
            let other = *number.get(&element)?;
            (other != node).then_some((node, other, distance))
        });
        others.collect()
    };
    (0..).zip(near).map(links).collect()
}

/// Each node with the [`TIES`] nodes nearest to it along the surface.
fn ties(links: &[Vec<(u32, u32, f32)>]) -> Vec<[u32; 2]> {
    let nearest = links.iter().flat_map(|links| links.iter().take(TIES));
    let mut ties: Vec<[u32; 2]> = nearest
        .map(|&(node, other, _)| [node.min(other), node.max(other)])
        .collect();
    ties.sort_unstable();
    ties.dedup();
    ties
}

/// For each element the nodes that carry it, with weights.
#[derive(Debug)]
struct Carriers {
    /// Where those of each element begin; one more than elements.
    starts: Vec<u32>,
    weights: Vec<(u32, f64)>,
}

impl Carriers {
    /// The nodes nearest to each element along the surface, with weights that fall with the
    /// distance `d` as `exp(-(1.5 d / d_last)^2)`; the nearest in space where none is near along
    /// the surface.
    fn new(elements: &[[f64; 3]], nodes: &[[f64; 3]], near: &[Vec<(u32, f32)>]) -> Self {
        let mut nearest = vec![Nearest::default(); elements.len()];
        for (node, reached) in (0..).zip(near) {
            for &(element, distance) in reached {
                nearest[element as usize].insert(node, distance);
            }
        }
        let search = NeighbourSearch::new(nodes);
        let mut carriers = Self {
            starts: vec![0],
            weights: Vec::with_capacity(CARRIERS * elements.len()),
        };
        for (own, &element) in nearest.iter_mut().zip(elements) {
            if own.count == 0 {
                own.insert(search.nearest_one(element).index, 1.0);
            }
            carriers.push(&own.found[..own.count]);
        }
        carriers
    }

    fn push(&mut self, found: &[(u32, f32)]) {
        let last = found.last().map_or(1.0, |last| f64::from(last.1));
        let last = last.max(f64::MIN_POSITIVE);
        let weight = |distance: f32| (-(1.5 * f64::from(distance) / last).powi(2)).exp();
        let total: f64 = found.iter().map(|found| weight(found.1)).sum();
        let weights = found.iter().map(|found| (found.0, weight(found.1) / total));
        self.weights.extend(weights);
        self.starts.push(self.weights.len() as u32);
    }

    fn of(&self, element: u32) -> &[(u32, f64)] {
        let [from, to] = [0, 1].map(|next| self.starts[element as usize + next] as usize);
        &self.weights[from..to]
    }
}

/// The first few by distance, then by node, of those that are inserted by rising node.
#[derive(Debug, Clone, Copy, Default)]
struct Nearest {
    count: usize,
    found: [(u32, f32); CARRIERS],
}

impl Nearest {
    fn insert(&mut self, node: u32, distance: f32) {
        let place = self.found[..self.count].partition_point(|known| known.1 <= distance);
        if place < CARRIERS {
            self.count = (self.count + 1).min(CARRIERS);
            self.found[place..self.count].rotate_right(1);
            self.found[place] = (node, distance);
        }
    }
}
