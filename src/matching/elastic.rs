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
//! "As-rigid-as-possible surface modeling", SGP 2007), places by conjugate gradients.
//!
//! The weights `w_ij = 1 / (1 + (s_ij / rho)^2)^2`, with `s_ij` the relative stretch of a tie, let
//! a few ties stretch much instead of many a little: bodies bend at joints. They are those of the
//! robust function `rho^2 s^2 / (rho^2 + s^2)` of Geman and McClure (1985), minimised by
//! reweighting.

use isomorph_model::linear::{Until, conjugate_gradient};

use super::rotation::nearest_rotation;
use super::surface::NodeMotion;
use crate::geometry::linear::{Matrix, add, add_outer, difference, dot, length, scaled, times};

/// The least weight of a tie: even a joint holds together.
const LEAST_WEIGHT: f64 = 1e-3;

/// Of the ties' moments this share of the present rotation is added, so that a node whose ties lie
/// on a line keeps its turn about that line.
const KEPT_TURN: f64 = 1e-3;

/// Where conjugate gradients end; the next round starts from there.
const UNTIL: Until = Until {
    steps: 60,
    tolerance: 1e-5,
};

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

/// Nodes, their ties and where they are.
#[derive(Debug, Clone)]
pub(super) struct ElasticNodes {
    rest: Vec<[f64; 3]>,
    ties: Vec<[u32; 2]>,
    weights: Vec<f64>,
    /// Where the nodes are now.
    pub motion: NodeMotion,
}

impl ElasticNodes {
    /// Nodes at `rest` that have been moved to `motion`.
    pub(super) fn new(rest: Vec<[f64; 3]>, ties: Vec<[u32; 2]>, motion: NodeMotion) -> Self {
        let weights = vec![1.0; ties.len()];
        Self {
            rest,
            ties,
            weights,
            motion,
        }
    }

    /// Moves the nodes towards what pulls them: `rounds` times rotations, weights and places in
    /// turn.
    pub(super) fn relax(&mut self, pulls: &[Pull], resistance: Stiffness, rounds: usize) {
        assert_eq!(pulls.len(), self.rest.len(), "one pull per node");
        for _ in 0..rounds {
            // Each of the three lowers the same energy while the other two are held.
            self.renew_weights(resistance.give);
            self.renew_rotations();
            self.renew_places(pulls, resistance.stiffness);
        }
        // Points between the nodes are carried by the rotations, which have to match the last places.
        self.renew_rotations();
    }

    /// `y_i - y_j` turned as the ends of the tie are.
    fn turned(&self, [i, j]: [u32; 2]) -> [f64; 3] {
        let (i, j) = (i as usize, j as usize);
        let along = difference(self.rest[i], self.rest[j]);
        let turns = &self.motion.rotations;
        scaled(add(times(&turns[i], along), times(&turns[j], along)), 0.5)
    }

    fn renew_weights(&mut self, give: f64) {
        let weight = |&tie: &[u32; 2]| {
            let [i, j] = tie.map(|node| self.motion.places[node as usize]);
            let turned = self.turned(tie);
            let stretch = difference(difference(i, j), turned);
            let [from, to] = tie.map(|node| self.rest[node as usize]);
            let length = difference(from, to);
            // Relative to the tie's length: the same limit holds for short and long ties.
            let square = dot(stretch, stretch) / dot(length, length);
            (1.0 + square / (give * give)).powi(-2).max(LEAST_WEIGHT)
        };
        self.weights = self.ties.iter().map(weight).collect();
    }

    fn renew_rotations(&mut self) {
        let mut moments = vec![[[0.0; 3]; 3]; self.rest.len()];
        let places = &self.motion.places;
        for (&[i, j], &weight) in self.ties.iter().zip(&self.weights) {
            let (i, j) = (i as usize, j as usize);
            let now = difference(places[i], places[j]);
            let then = difference(self.rest[i], self.rest[j]);
            // Seen from the other end both vectors change sign, and their product does not.
            add_outer(&mut moments[i], weight, now, then);
            add_outer(&mut moments[j], weight, now, then);
        }
        for (turn, mut moment) in self.motion.rotations.iter_mut().zip(moments) {
            // The bias is relative to the moment's size, so that it acts alike at any scale.
            let size = length(moment.map(length));
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
        let mut wanted: Vec<[f64; 3]> = pulls
            .iter()
            .map(|pull| times(&pull.strength, pull.to))
            .collect();
        let mut diagonal: Vec<[f64; 3]> = pulls
            .iter()
            .map(|pull| [0, 1, 2].map(|k| pull.strength[k][k]))
            .collect();
        for (&tie, &weight) in self.ties.iter().zip(&self.weights) {
            let turned = scaled(self.turned(tie), stiffness * weight);
            let [i, j] = tie.map(|node| node as usize);
            wanted[i] = add(wanted[i], turned);
            wanted[j] = difference(wanted[j], turned);
            for node in [i, j] {
                diagonal[node] = diagonal[node].map(|part| part + stiffness * weight);
            }
        }
        // From where the nodes are: they move little from one round to the next, so the start is good.
        let mut places = std::mem::take(&mut self.motion.places);
        let apply = |z: &[f64], forces: &mut [f64]| {
            let (z, _) = z.as_chunks::<3>();
            let (forces, _) = forces.as_chunks_mut::<3>();
            self.forces(pulls, stiffness, z, forces);
        };
        // Divided by the diagonal: pulls differ by orders of magnitude between the nodes that have a
        // counterpart and those that have none.
        conjugate_gradient(
            apply,
            wanted.as_flattened(),
            Some(diagonal.as_flattened()),
            places.as_flattened_mut(),
            UNTIL,
        );
        self.motion.places = places;
    }

    /// The matrix of the normal equations times `z`, tie by tie: it is never stored.
    fn forces(&self, pulls: &[Pull], stiffness: f64, z: &[[f64; 3]], forces: &mut [[f64; 3]]) {
        for ((force, pull), z) in forces.iter_mut().zip(pulls).zip(z) {
            *force = times(&pull.strength, *z);
        }
        for (&[i, j], &weight) in self.ties.iter().zip(&self.weights) {
            let (i, j) = (i as usize, j as usize);
            let force = scaled(difference(z[i], z[j]), stiffness * weight);
            forces[i] = add(forces[i], force);
            forces[j] = difference(forces[j], force);
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
        ElasticNodes::new(places.to_vec(), ties.to_vec(), motion)
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
