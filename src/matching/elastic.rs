//! How nodes move when some are pulled: as rigidly as possible, but for joints.
//!
//! With nodes at `y_i` tied in pairs, the places `z_i` that minimise
//!
//! ```text
//! sum_i (z_i - x_i)^T B_i (z_i - x_i)  +  lambda sum_(i,j) w_ij |(z_i - z_j) - (R_i + R_j)/2 (y_i - y_j)|^2
//! ```
//!
//! where `x_i` is where node `i` is pulled to and the symmetric 3 x 3 matrix `B_i` how strongly and
//! in which directions; the second sum goes over both directions of each tie. `R_i` is the rotation
//! nearest to what the ties of `i` do. Rotations and places are renewed in turn (Sorkine and Alexa,
//! "As-rigid-as-possible surface modeling", SGP 2007), places by conjugate gradients preconditioned
//! by the 3 x 3 blocks of the nodes.
//!
//! The weights `w_ij = 1 / (1 + (s_ij / rho)^2)^2`, with `s_ij` the relative stretch of a tie, let
//! a few ties stretch much instead of many a little: bodies bend at joints. They are those of the
//! robust function `rho^2 s^2 / (rho^2 + s^2)` of Geman and McClure (1985), minimised by
//! reweighting.

use super::level::NodeMotion;
use super::rotation::nearest_rotation;
use super::system::{InverseFactor, Neighbours, System};
use crate::geometry::linear::{Matrix, add, add_outer, difference, dot, length, scaled, times};

/// The least weight of a tie: even a joint holds together.
const LEAST_WEIGHT: f64 = 1e-3;

/// Of the ties' moments this share of the present rotation is added, so that a node whose ties lie
/// on a line keeps its turn about that line.
const KEPT_TURN: f64 = 1e-3;

/// What pulls a node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pull {
    /// Where to.
    pub to: [f64; 3],
    /// How strongly, by direction: symmetric and positive semidefinite.
    pub strength: Matrix,
}

/// How the nodes resist.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stiffness {
    /// `lambda` above.
    pub stiffness: f64,
    /// `rho` above: the relative stretch beyond which a tie gives way.
    pub give: f64,
}

/// Two nodes that are tied.
#[derive(Debug, Clone, Copy)]
struct Tie {
    ends: [u32; 2],
    /// `y_i - y_j`.
    along: [f64; 3],
}

impl Tie {
    /// `y_i - y_j` turned as the ends are.
    fn turned(&self, turns: &[Matrix]) -> [f64; 3] {
        let [i, j] = self.ends;
        let (i, j) = (&turns[i as usize], &turns[j as usize]);
        scaled(add(times(i, self.along), times(j, self.along)), 0.5)
    }

    /// `z_i - z_j`.
    fn now(&self, places: &[[f64; 3]]) -> [f64; 3] {
        let [i, j] = self.ends;
        difference(places[i as usize], places[j as usize])
    }
}

/// Nodes, their ties and where they are.
#[derive(Debug, Clone)]
pub(super) struct ElasticNodes {
    ties: Vec<Tie>,
    weights: Vec<f64>,
    neighbours: Neighbours,
    /// Where the nodes are now.
    pub motion: NodeMotion,
}

impl ElasticNodes {
    /// Nodes at `rest` that have been moved to `motion`.
    pub(super) fn new(rest: &[[f64; 3]], ties: &[[u32; 2]], motion: NodeMotion) -> Self {
        let tie = |&ends: &[u32; 2]| {
            let [i, j] = ends.map(|node| rest[node as usize]);
            let along = difference(i, j);
            Tie { ends, along }
        };
        Self {
            neighbours: Neighbours::new(rest.len(), ties),
            weights: vec![1.0; ties.len()],
            ties: ties.iter().map(tie).collect(),
            motion,
        }
    }

    /// Moves the nodes towards what pulls them: `rounds` times rotations, weights and places in
    /// turn.
    pub(super) fn relax(&mut self, pulls: &[Pull], resistance: Stiffness, rounds: usize) {
        assert_eq!(pulls.len(), self.motion.places.len(), "one pull per node");
        for _ in 0..rounds {
            // Each of the three lowers the same energy while the other two are held.
            self.renew_weights(resistance.give);
            self.renew_rotations();
            self.renew_places(pulls, resistance.stiffness);
        }
        // Points between the nodes are carried by the rotations, which have to match the last places.
        self.renew_rotations();
    }

    fn renew_weights(&mut self, give: f64) {
        let NodeMotion { places, rotations } = &self.motion;
        let weight = |tie: &Tie| {
            let stretch = difference(tie.now(places), tie.turned(rotations));
            // Relative to the tie's length: the same limit holds for short and long ties.
            let square = dot(stretch, stretch) / dot(tie.along, tie.along);
            let relative = 1.0 + square / (give * give);
            (relative * relative).recip().max(LEAST_WEIGHT)
        };
        self.weights = self.ties.iter().map(weight).collect();
    }

    fn renew_rotations(&mut self) {
        let mut moments = vec![[[0.0; 3]; 3]; self.motion.places.len()];
        for (tie, &weight) in self.ties.iter().zip(&self.weights) {
            // Seen from the other end both vectors change sign, and their product does not.
            let mut moment = [[0.0; 3]; 3];
            add_outer(&mut moment, weight, tie.now(&self.motion.places), tie.along);
            for node in tie.ends {
                let sum = &mut moments[node as usize];
                *sum = [
                    add(sum[0], moment[0]),
                    add(sum[1], moment[1]),
                    add(sum[2], moment[2]),
                ];
            }
        }
        for (turn, mut moment) in self.motion.rotations.iter_mut().zip(moments) {
            // The bias is relative to the moment's size, so that it acts alike at any scale.
            let size = length([length(moment[0]), length(moment[1]), length(moment[2])]);
            for row in 0..3 {
                moment[row] = add(moment[row], scaled(turn[row], KEPT_TURN * size));
            }
            // A node without ties keeps its rotation.
            if size > 0.0 {
                *turn = nearest_rotation(&moment);
            }
        }
    }

    /// Solves the normal equations for the places by conjugate gradients, from where the nodes are.
    fn renew_places(&mut self, pulls: &[Pull], stiffness: f64) {
        // Each tie counts in both directions, and its derivative by each end has another factor of
        // 2, of which one is shared with the pulls.
        let stiffness = 2.0 * stiffness;
        let places = &mut self.motion.places;
        // What is left of the forces at the present places.
        let pulled = pulls.iter().zip(places.iter());
        let mut forces: Vec<[f64; 3]> = pulled
            .map(|(pull, &place)| times(&pull.strength, difference(pull.to, place)))
            .collect();
        let mut blocks: Vec<Matrix> = pulls.iter().map(|pull| pull.strength).collect();
        let turns = &self.motion.rotations;
        for (tie, weight) in self.ties.iter().zip(&self.weights) {
            let (i, j) = (tie.ends[0] as usize, tie.ends[1] as usize);
            let stretch = difference(difference(places[i], places[j]), tie.turned(turns));
            let force = scaled(stretch, stiffness * weight);
            forces[i] = difference(forces[i], force);
            forces[j] = add(forces[j], force);
            for node in [i, j] {
                for (k, row) in blocks[node].iter_mut().enumerate() {
                    row[k] += stiffness * weight;
                }
            }
        }
        let system = System {
            factors: blocks.iter().map(InverseFactor::of).collect(),
            neighbours: &self.neighbours,
            couplings: self
                .weights
                .iter()
                .map(|weight| stiffness * weight)
                .collect(),
        };
        for (place, change) in places.iter_mut().zip(system.solve(&forces)) {
            *place = add(*place, change);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::rotation::tests::turn;
    use super::*;
    use crate::geometry::linear::IDENTITY;

    const STIFF: Stiffness = Stiffness {
        stiffness: 1.0,
        give: 1e6,
    };

    fn at_rest(places: &[[f64; 3]], ties: &[[u32; 2]]) -> ElasticNodes {
        let motion = NodeMotion {
            places: places.to_vec(),
            rotations: vec![IDENTITY; places.len()],
        };
        ElasticNodes::new(places, ties, motion)
    }

    #[test]
    fn nodes_that_are_pulled_rigidly_move_rigidly() {
        let places: Vec<[f64; 3]> = (0..20)
            .map(|k| [f64::from(k % 5), f64::from(k / 5), f64::from(k * k % 7)])
            .collect();
        let ties: Vec<[u32; 2]> = (0..20)
            .flat_map(|i| {
                (i + 1..20)
                    .filter(move |j| (i + j) % 3 == 0)
                    .map(move |j| [i, j])
            })
            .collect();
        let rotation = turn(0.8);
        let goal = |x: &[f64; 3]| add(times(&rotation, *x), [1.0, 2.0, 3.0]);
        let pulls: Vec<Pull> = places
            .iter()
            .map(|place| Pull {
                to: goal(place),
                strength: IDENTITY,
            })
            .collect();
        let mut nodes = at_rest(&places, &ties);
        nodes.relax(&pulls, STIFF, 200);
        for ((place, moved), found) in places
            .iter()
            .zip(&nodes.motion.places)
            .zip(&nodes.motion.rotations)
        {
            // Where all ties are at rest and all pulls followed nothing is left to gain; gradients
            // stop at 1e-5 of forces of about 100.
            assert!(length(difference(goal(place), *moved)) < 1e-3);
            for (found, wanted) in found.as_flattened().iter().zip(rotation.as_flattened()) {
                assert!((found - wanted).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn a_chain_pulled_at_its_ends_stretches_as_springs_in_a_row() {
        // Ten ties of length 1. Energy 2 lambda e^2 for each stretched by e and k d^2 for each end
        // that stays d short of its goal: 2 lambda e = k d, and 10 e + 2 d is the whole stretch, 1.
        let places: Vec<[f64; 3]> = (0..11).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        let ties: Vec<[u32; 2]> = (0..10).map(|k| [k, k + 1]).collect();
        let strong = IDENTITY.map(|row| row.map(|part| 4.0 * part));
        let pull = |k: usize| Pull {
            to: [if k == 10 { 10.5 } else { -0.5 }, 0.0, 0.0],
            strength: if k == 0 || k == 10 {
                strong
            } else {
                [[0.0; 3]; 3]
            },
        };
        let pulls: Vec<Pull> = (0..11).map(pull).collect();
        let mut nodes = at_rest(&places, &ties);
        nodes.relax(&pulls, STIFF, 5);
        let short = 1.0 / (2.0 + 10.0 * 4.0 / 2.0);
        let found = &nodes.motion.places;
        // Eleven unknowns in a row: gradients end within 11 steps, at 1e-5.
        assert!(
            (found[0][0] - (-0.5 + short)).abs() < 1e-4,
            "{:?}",
            found[0]
        );
        assert!((found[6][0] - found[5][0] - (1.0 + 2.0 * short)).abs() < 1e-4);
    }

    #[test]
    fn a_weak_tie_takes_the_stretch_of_all() {
        let places: Vec<[f64; 3]> = (0..11).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        let ties: Vec<[u32; 2]> = (0..10).map(|k| [k, k + 1]).collect();
        // Two halves, the second a whole tie further on.
        let pull = |k: usize| Pull {
            to: [k as f64 + if k > 5 { 1.0 } else { 0.0 }, 0.0, 0.0],
            strength: IDENTITY,
        };
        let pulls: Vec<Pull> = (0..11).map(pull).collect();
        let gap = |give: f64| {
            let mut nodes = at_rest(&places, &ties);
            nodes.relax(
                &pulls,
                Stiffness {
                    stiffness: 1.0,
                    give,
                },
                50,
            );
            nodes.motion.places[6][0] - nodes.motion.places[5][0]
        };
        assert!(gap(1e6) < 1.5, "springs share the stretch: {}", gap(1e6));
        assert!(gap(0.2) > 1.9, "a joint takes it: {}", gap(0.2));
    }
}
