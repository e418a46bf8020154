//! Pairs that are given: they choose the rigid motion to begin with, bend the nodes before the first step, and hold
//! them in every step.
//!
//! A given pair says where one place of the surface goes. At each level the node that carries this place most is held
//! there, in place of what its own assignment would pull it to. Its neighbours follow by their ties.

use super::elastic::{ElasticNodes, Pull, Stiffness};
use super::level::{Level, NodeMotion};
use super::rotation::RigidMotion;
use super::surface::Surface;
use crate::geometry::linear::{IDENTITY, add, difference, length, scaled, times};
use crate::shape::{Normalisation, Shape};

/// How strongly a held node is pulled, in resistances of a tie as long as the spacing. Eight ties pull against it with
/// 2 each: it stays within a fifth of what they stretch.
const HOLD: f64 = 100.0;

/// How strongly the other nodes stay where the rigid motion puts them while the nodes are bent, in the same unit: a
/// limb that is held elsewhere bends, and does not take the body with it.
const STAY: f64 = 0.01;

/// Rounds of bending before the first step. No joint forms.
const ROUNDS: usize = 40;
const NO_GIVE: f64 = 1e6;

/// Given pairs of places, normalised: on the surface that moves, and on the other.
#[derive(Debug, Clone, Default)]
pub(super) struct Anchors(Vec<[[f64; 3]; 2]>);

impl Anchors {
    /// Of pairs of vertices.
    pub(super) fn new(shapes: [&Shape; 2], pairs: &[[u32; 2]], frame: &Normalisation) -> Self {
        let place = |side: usize, vertex: u32| {
            let place = frame.apply(shapes[side].mesh.vertices[vertex as usize]);
            place.map(f64::from)
        };
        let both = |pair: &[u32; 2]| [place(0, pair[0]), place(1, pair[1])];
        Self(pairs.iter().map(both).collect())
    }

    /// The same for the way back.
    pub(super) fn reversed(&self) -> Self {
        Self(self.0.iter().map(|&[x, y]| [y, x]).collect())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The rigid motion that fits them best.
    pub(super) fn rigid(&self) -> RigidMotion {
        RigidMotion::between(&self.0.iter().map(|&[x, y]| (x, y)).collect::<Vec<_>>())
    }

    /// By how much a motion misses them in the mean; 0 of none.
    pub(super) fn miss(&self, motion: &RigidMotion) -> f64 {
        let misses = self.0.iter();
        let misses = misses.map(|&[x, y]| length(difference(motion.apply(x), y)));
        misses.sum::<f64>() / self.0.len().max(1) as f64
    }
}

/// A node, a place that it carries and where that place goes.
#[derive(Debug, Clone, Copy)]
struct Hold {
    node: u32,
    from: [f64; 3],
    to: [f64; 3],
}

/// What holds the nodes of each level, finest first, by node.
#[derive(Debug, Clone, Default)]
pub(super) struct Holds(Vec<Vec<Hold>>);

impl Holds {
    /// Of the surface that moves.
    pub(super) fn new(anchors: &Anchors, surface: &Surface) -> Self {
        let begin = |&[from, to]: &[[f64; 3]; 2]| Hold {
            node: surface.search.nearest_one(from).index,
            from,
            to,
        };
        let mut holds: Vec<Hold> = anchors.0.iter().map(begin).collect();
        let of_level = |level: &Level| {
            for hold in &mut holds {
                hold.node = level.carrier(hold.node);
            }
            let mut own = holds.clone();
            own.sort_by_key(|hold| hold.node);
            own
        };
        Self(surface.levels.iter().map(of_level).collect())
    }

    /// Nodes that lie where `start` takes them, bent so that those that are held are where they go.
    pub(super) fn bend(&self, k: usize, level: &Level, mut nodes: ElasticNodes) -> ElasticNodes {
        if self.0[k].is_empty() {
            return nodes;
        }
        let tie = resistance(level);
        let stay = |&to: &[f64; 3]| Pull {
            to,
            strength: IDENTITY.map(|row| scaled(row, STAY * tie)),
        };
        let mut pulls: Vec<Pull> = nodes.motion.places.iter().map(stay).collect();
        let resistance = Stiffness {
            stiffness: tie,
            give: NO_GIVE,
        };
        for _ in 0..ROUNDS {
            self.act(k, level, &nodes.motion, &mut pulls);
            nodes.relax(&pulls, resistance, 1);
        }
        nodes
    }

    /// Puts what holds a node in the place of what pulls it.
    pub(super) fn act(&self, k: usize, level: &Level, motion: &NodeMotion, pulls: &mut [Pull]) {
        for holds in self.0[k].chunk_by(|a, b| a.node == b.node) {
            let node = holds[0].node as usize;
            let goal = |hold: &Hold| {
                let beside = difference(hold.from, level.places[node]);
                difference(hold.to, times(&motion.rotations[node], beside))
            };
            let sum = holds.iter().map(goal).fold([0.0; 3], add);
            pulls[node] = Pull {
                to: scaled(sum, (holds.len() as f64).recip()),
                strength: IDENTITY.map(|row| scaled(row, HOLD * resistance(level))),
            };
        }
    }
}

/// The resistance of a tie as long as the spacing of the nodes.
fn resistance(level: &Level) -> f64 {
    super::register::STIFFNESS / (level.spacing() * level.spacing())
}
