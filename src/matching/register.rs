//! The motion that lays one surface onto another: assignment and deformation in turn, first far and
//! stiff, then near and yielding.

use std::num::NonZeroUsize;

use rayon::prelude::*;

use super::assignment::{Likeness, Marks, pulls, sliding};
use super::elastic::{ElasticNodes, Pull, Stiffness};
use super::rotation::RigidMotion;
use super::surface::{NodeMotion, Surface};
use crate::geometry::linear::{add, dot, scaled, times};

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
const STIFFNESS: f64 = 1.0;

/// Weight of the angle between normals: opposite ones count as `exp(-8)`.
const NORMALS: f64 = 4.0;

/// Tolerance in remoteness, and the share of the steps in which it counts.
const REMOTENESS: f64 = 0.1;
const REMOTENESS_UNTIL: f64 = 0.5;

/// What stays unassigned.
const SLACK: f64 = 0.05;

/// Steps towards the planes of all points of the target, in the end, and their standard deviation.
const FINE_STEPS: usize = 15;
const FINE_SIGMA: f64 = 0.01;

/// Rounds of rotations and places at each step.
const ROUNDS: usize = 3;

/// Points of the target that pull at a node in the fine steps.
const PULLING: NonZeroUsize = NonZeroUsize::new(16).expect("16 is not 0");

/// Lays `source` onto `target`, from where `start` takes it, beginning with assignments of standard
/// deviation `width`.
pub(super) fn register(
    source: &Surface,
    target: &Surface,
    start: &RigidMotion,
    width: f64,
) -> NodeMotion {
    let rest = source.node_points();
    let motion = NodeMotion {
        places: rest.iter().map(|&x| start.apply(x)).collect(),
        rotations: vec![start.rotation; rest.len()],
    };
    let mut nodes = ElasticNodes::new(rest, source.ties.clone(), motion);
    let normals = source.node_normals();
    for step in 0..STEPS {
        let stage = Stage::new(width, step);
        let facing = turned(&nodes.motion, &normals);
        let pulls = stage.pulls((source, &nodes.motion, &facing), target);
        nodes.relax(&pulls, stage.resistance(source), ROUNDS);
    }
    let last = Stage::new(width, STEPS - 1);
    for _ in 0..FINE_STEPS {
        let facing = turned(&nodes.motion, &normals);
        let pulls = fine_pulls(target, &nodes.motion.places, &facing);
        nodes.relax(&pulls, last.resistance(source), ROUNDS);
    }
    nodes.motion
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
    ) -> Vec<Pull> {
        let ours = Marks {
            points: &motion.places,
            normals: facing,
            remoteness: &source.remoteness,
        };
        let theirs = Marks {
            points: &target.node_points(),
            normals: &target.node_normals(),
            remoteness: &target.remoteness,
        };
        pulls(&ours, &theirs, &self.likeness, self.slide)
    }

    fn resistance(&self, source: &Surface) -> Stiffness {
        Stiffness {
            stiffness: STIFFNESS / (source.spacing() * source.spacing()),
            give: self.give,
        }
    }
}

/// The normals of the nodes after a motion.
fn turned(motion: &NodeMotion, normals: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let turns = motion.rotations.iter().zip(normals);
    turns.map(|(turn, normal)| times(turn, *normal)).collect()
}

/// Pulls onto the planes of the target's points next to each node.
fn fine_pulls(target: &Surface, places: &[[f64; 3]], normals: &[[f64; 3]]) -> Vec<Pull> {
    let sigma = FINE_SIGMA;
    let pull = |(&place, &normal): (&[f64; 3], &[f64; 3])| {
        let (mut sum, mut to, mut facing) = (0.0, [0.0; 3], [0.0; 3]);
        for near in target.search.nearest(place, PULLING) {
            let k = near.index as usize;
            let agreement = dot(normal, target.normals[k]);
            let exponent =
                near.squared_distance / (2.0 * sigma * sigma) + NORMALS * (1.0 - agreement);
            let share = (-exponent).exp();
            sum += share;
            to = add(to, scaled(target.points[k], share));
            facing = add(facing, scaled(target.normals[k], share));
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
    places.par_iter().zip(normals).map(pull).collect()
}
