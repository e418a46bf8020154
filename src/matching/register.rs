//! The motion that lays one surface onto another: assignment and deformation in turn, first far and
//! stiff with few nodes, then near and yielding with all.

use std::num::NonZeroUsize;

use rayon::prelude::*;

use super::affinity::{Likeness, Marks};
use super::anchors::Holds;
use super::assignment::{pulls, sliding};
use super::elastic::{ElasticNodes, Pull, Stiffness};
use super::level::{Level, NodeMotion};
use super::rotation::RigidMotion;
use super::surface::Surface;
use crate::geometry::linear::{add, difference, dot, scaled, times};

/// Standard deviations of distances that registration begins with, in normalised units. A wide one
/// carries limbs far, a narrow one keeps what has hardly moved from being drawn away: each succeeds
/// where the other may fail.
pub(super) const WIDTHS: [f64; 2] = [0.1, 0.2];

/// The standard deviation that it ends with, half a spacing of 1,500 nodes.
const LAST_SIGMA: f64 = 0.012;

/// Steps from the first to the last, geometric.
const STEPS: usize = 60;

/// Relative stretch beyond which ties give way, at the first step and at the last: joints form
/// late.
const GIVE: [f64; 2] = [1.5, 0.15];

/// The share of a pull that acts along the surface, at the first step and at the last: in the end
/// surfaces slide.
const SLIDE: [f64; 2] = [0.3, 0.05];

/// Resistance of a tie as long as the spacing of the nodes.
pub(super) const STIFFNESS: f64 = 1.0;

/// Weight of the angle between normals: opposite ones count as `exp(-8)`.
const NORMALS: f64 = 4.0;

/// Tolerance in remoteness, and the share of the steps in which it counts.
const REMOTENESS: f64 = 0.1;
const REMOTENESS_UNTIL: f64 = 0.5;

/// What stays unassigned.
const SLACK: f64 = 0.05;

/// Steps towards the planes of all points of the target, in the end, and their standard deviation.
const FINE_STEPS: usize = 25;
const FINE_SIGMA: f64 = 0.01;

/// Standard deviation of how far the way back misses a node, in the fine steps, and the most that
/// it counts, as an exponent: where both ways disagree altogether, both go to the nearest planes.
const RETURN_SIGMA: f64 = 0.035;
const MOST_RETURN: f64 = 4.0;

/// Rounds of rotations and places at each step.
const ROUNDS: usize = 3;

/// Points of the target that pull at a node in the fine steps.
const PULLING: NonZeroUsize = NonZeroUsize::new(16).expect("16 is not 0");

/// A level serves while the standard deviation is at least this many of its spacings: finer nodes
/// would change sums over so many of them little.
const COARSE: f64 = 1.2;

/// One surface on its way onto another.
pub(super) struct Registration<'a> {
    source: &'a Surface,
    target: &'a Surface,
    width: f64,
    step: usize,
    /// How many of the source's levels are finer than that of the nodes.
    level: usize,
    nodes: ElasticNodes,
    /// Nodes of the source that given pairs hold.
    held: &'a Holds,
}

impl<'a> Registration<'a> {
    /// Steps before those of [`Self::settle`].
    pub(super) const STEPS: usize = STEPS;

    /// Steps of [`Self::settle`].
    pub(super) const FINE_STEPS: usize = FINE_STEPS;

    /// Will lay the first surface onto the second, from where `start` takes it, beginning with
    /// assignments of standard deviation `width`; `held` is of the first surface.
    pub(super) fn new(
        [source, target]: [&'a Surface; 2],
        start: &RigidMotion,
        width: f64,
        held: &'a Holds,
    ) -> Self {
        let level = source.levels.len().min(target.levels.len()) - 1;
        let rest = &source.levels[level].places;
        let motion = NodeMotion {
            places: rest.iter().map(|&x| start.apply(x)).collect(),
            rotations: vec![start.rotation; rest.len()],
        };
        Self {
            source,
            target,
            width,
            step: 0,
            level,
            nodes: held.bend(
                level,
                &source.levels[level],
                elastic(&source.levels[level], motion),
            ),
            held,
        }
    }

    /// Makes the next step.
    pub(super) fn advance(&mut self) {
        let stage = Stage::new(self.width, self.step);
        while self.level > 0
            && stage.likeness.sigma < COARSE * self.source.levels[self.level].spacing()
        {
            self.refine();
        }
        let level = &self.source.levels[self.level];
        let motion = &self.nodes.motion;
        let facing = turned(motion, &level.normals);
        let mut pulls = stage.pulls((self.source, motion, &facing), self.target, self.level);
        self.held.act(self.level, level, motion, &mut pulls);
        self.nodes.relax(&pulls, stage.resistance(level), ROUNDS);
        self.step += 1;
    }

    /// Makes a step towards the planes of all points of the target, which `back` lays onto the source.
    pub(super) fn settle(&mut self, back: &NodeMotion) {
        while self.level > 0 {
            self.refine();
        }
        let stage = Stage::new(self.width, STEPS - 1);
        let level = self.source.finest();
        let mut pulls = fine_pulls((level, &self.nodes.motion), (self.target, back));
        self.held.act(0, level, &self.nodes.motion, &mut pulls);
        self.nodes.relax(&pulls, stage.resistance(level), ROUNDS);
    }

    /// Goes on with the next finer nodes, which those of now carry.
    fn refine(&mut self) {
        let motion = self.finer(self.level, &self.nodes.motion);
        self.level -= 1;
        self.nodes = elastic(&self.source.levels[self.level], motion);
    }

    /// The motion of the nodes that those of a level carry.
    fn finer(&self, level: usize, motion: &NodeMotion) -> NodeMotion {
        let [level, finer] = [level, level - 1].map(|k| &self.source.levels[k]);
        level.carried(motion, &finer.places)
    }

    /// Where the finest nodes are.
    pub(super) fn motion(&self) -> NodeMotion {
        let levels = (1..=self.level).rev();
        levels.fold(self.nodes.motion.clone(), |motion, level| {
            self.finer(level, &motion)
        })
    }
}

/// Nodes of a level that have been moved.
fn elastic(level: &Level, motion: NodeMotion) -> ElasticNodes {
    ElasticNodes::new(&level.places, &level.ties, motion)
}

/// One step on the way from far and stiff to near and yielding.
#[derive(Debug, Clone, Copy)]
struct Stage {
    likeness: Likeness,
    give: f64,
    slide: f64,
}

impl Stage {
    /// Step `step` of a registration that begins with the standard deviation `width`.
    fn new(width: f64, step: usize) -> Self {
        let share = step as f64 / (STEPS - 1) as f64;
        let between = |[from, to]: [f64; 2]| from * (to / from).powf(share);
        Self {
            likeness: Likeness {
                sigma: between([width, LAST_SIGMA]),
                normals: NORMALS,
                remoteness: (share < REMOTENESS_UNTIL).then_some(REMOTENESS),
                slack: SLACK,
            },
            give: between(GIVE),
            slide: between(SLIDE),
        }
    }

    /// Where the target's nodes pull those of the source, which have moved and turned.
    fn pulls(
        &self,
        (source, motion, facing): (&Surface, &NodeMotion, &[[f64; 3]]),
        target: &Surface,
        level: usize,
    ) -> Vec<Pull> {
        let ours = Marks {
            points: &motion.places,
            normals: facing,
            remoteness: &source.remoteness,
        };
        let theirs = Marks {
            points: &target.levels[level].places,
            normals: &target.levels[level].normals,
            remoteness: &target.remoteness,
        };
        // Scalings of n nodes are about 1 / sqrt(n K): what stays unassigned is the same with fewer.
        let share = ours.points.len() as f64 / source.finest().places.len() as f64;
        let likeness = Likeness {
            slack: self.likeness.slack * share.sqrt(),
            ..self.likeness
        };
        pulls(&ours, &theirs, &likeness, self.slide)
    }

    fn resistance(&self, level: &Level) -> Stiffness {
        Stiffness {
            stiffness: STIFFNESS / (level.spacing() * level.spacing()),
            give: self.give,
        }
    }
}

/// The normals of the nodes after a motion.
fn turned(motion: &NodeMotion, normals: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let turns = motion.rotations.iter().zip(normals);
    turns.map(|(turn, normal)| times(turn, *normal)).collect()
}

/// Pulls onto the planes of the target's points next to each node, of which those count most that
/// the way back takes near to where the node comes from.
fn fine_pulls(
    (level, motion): (&Level, &NodeMotion),
    (target, back): (&Surface, &NodeMotion),
) -> Vec<Pull> {
    let sigma = FINE_SIGMA;
    let normals = turned(motion, &level.normals);
    let pull = |k: usize| {
        let (place, normal, rest) = (motion.places[k], normals[k], level.places[k]);
        let (mut sum, mut to, mut facing) = (0.0, [0.0; 3], [0.0; 3]);
        for near in target.search.nearest(place, PULLING) {
            let k = near.index as usize;
            let (y, theirs) = (target.points[k], target.normals[k]);
            let returned = target.finest().carry(back, near.index, (y, theirs)).0;
            let missed = difference(returned, rest);
            let missed = dot(missed, missed) / (2.0 * RETURN_SIGMA * RETURN_SIGMA);
            let exponent = near.squared_distance / (2.0 * sigma * sigma)
                + NORMALS * (1.0 - dot(normal, theirs))
                + missed.min(MOST_RETURN);
            let share = (-exponent).exp();
            sum += share;
            to = add(to, scaled(y, share));
            facing = add(facing, scaled(theirs, share));
        }
        let to = if sum > 0.0 {
            scaled(to, sum.recip())
        } else {
            place
        };
        let strength = sum / (sum + SLACK) / (sigma * sigma);
        Pull {
            to,
            strength: sliding(strength, facing, SLIDE[1]),
        }
    };
    (0..level.places.len()).into_par_iter().map(pull).collect()
}
