//! One field through many key frames.
//!
//! The field is `V(x, t) = sum c[n, k] B_n(x) N_k(t)`: in time quadratic B-splines with breaks at the key frames,
//! so that V and its rate are continuous there. From one key frame to the next only three of them act. There the
//! field is a [`SplineField`] of its own, with the time from 0 to 1 and the same coefficients, and the terms are
//! those of two shapes.
//!
//! Weights are those of the mean interval as the unit of time, in which an interval is `h` long. Regularisers are
//! integrals over time, which in an interval's own time are
//!
//! ```text
//! strain / h    divergence    screw / h^3
//! ```
//!
//! Matching and on-surface are means of each hop, summed over the hops.
//!
//! | file | what |
//! |---|---|
//! | `mod.rs` | the problem and the solver |
//! | `field.rs` | the field and its parts |
//! | `system.rs` | the linear system of a step, hop by hop |
//! | `band.rs` | its preconditioner: a band matrix for each node |

mod band;
mod field;
mod system;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use rayon::prelude::*;

pub use self::field::{SequenceField, quadratics};
use self::system::SequenceSystem;
use crate::band::by_cell;
use crate::cell::{add_change, are_finite};
use crate::conjugate;
use crate::error::SplineError;
use crate::grid::Grid;
use crate::hop::{Hop, Pass};
use crate::levels::{before_step, grid_of};
use crate::options::{Options, Weights};
use crate::problem::{Cloud, Pairs, extent};
use crate::real::Real;
use crate::solver::{StepReport, Terms};
use crate::targets::Surface;

/// More steps than options may have: by so much the random numbers of hops are apart.
const MOST_STEPS: usize = 1 << 18;

/// The most key frames.
const MOST_KEYS: usize = 10_000;

/// Three or more shapes at their times, and what is known between neighbours.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SequenceProblem {
    /// The shapes, in the order of their times.
    pub shapes: Vec<Cloud>,
    /// The time of each, in any unit, ascending.
    pub times: Vec<f64>,
    /// Pairs from each shape to the next.
    pub pairs: Vec<Pairs>,
}

impl SequenceProblem {
    fn check(&self) -> Result<(), SplineError> {
        let keys = self.times.len();
        let allowed = "3 to 10000";
        if !(3..=MOST_KEYS).contains(&keys) {
            return Err(SplineError::Option {
                name: "key frames",
                value: keys as f64,
                allowed,
            });
        }
        let ascend = self.times.windows(2).all(|two| two[0] < two[1]);
        let finite = |time: &&f64| !time.is_finite();
        if let Some(time) = self.times.iter().find(finite) {
            return Err(SplineError::Option {
                name: "time",
                value: *time,
                allowed: "finite",
            });
        }
        if !ascend {
            return Err(SplineError::Option {
                name: "times",
                value: self.times[0],
                allowed: "ascending",
            });
        }
        for (what, found, wanted) in [
            ("shapes", self.shapes.len(), keys),
            ("pairs between neighbours", self.pairs.len(), keys - 1),
        ] {
            if found != wanted {
                return Err(SplineError::Lengths {
                    what,
                    found,
                    wanted,
                });
            }
        }
        Ok(())
    }
}

/// What belongs to key frame `s` and to the next.
fn two<T>(all: &[Arc<T>], s: usize) -> [Arc<T>; 2] {
    [Arc::clone(&all[s]), Arc::clone(&all[s + 1])]
}

/// The length of interval `s`, where the mean of all is 1.
fn length(times: &[f64], s: usize) -> f64 {
    let mean = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    (times[s + 1] - times[s]) / mean
}

/// Finds a field through many key frames by Gauss-Newton steps, as [`crate::Solver`] does between two.
pub struct SequenceSolver<R: Real = f32> {
    hops: Vec<Hop<R>>,
    lengths: Vec<f64>,
    weights: Weights,
    options: Options,
    grid: Grid<R>,
    field: SequenceField<R>,
}

impl<R: Real> SequenceSolver<R> {
    /// Checks and arranges everything; the field is zero. The options' functions of time are left aside.
    ///
    /// # Errors
    /// If the problem, a weight or an option is not valid.
    pub fn new(
        problem: SequenceProblem,
        weights: Weights,
        options: Options,
    ) -> Result<Self, SplineError> {
        problem.check()?;
        weights.check()?;
        options.check()?;
        let SequenceProblem {
            shapes,
            times,
            pairs,
        } = problem;
        shapes
            .iter()
            .try_for_each(|shape| shape.check("key frame"))?;
        pairs.iter().try_for_each(Pairs::check)?;
        let shapes: Vec<Arc<Cloud>> = shapes.into_iter().map(Arc::new).collect();
        let surfaces: Vec<Arc<Surface>> = shapes
            .par_iter()
            .map(|shape| Arc::new(Surface::new(shape)))
            .collect();
        let lengths: Vec<f64> = (0..pairs.len()).map(|s| length(&times, s)).collect();
        let [lower, upper] = extent(shapes.iter().map(Arc::as_ref), pairs.iter());
        let grid = Grid::around(lower, upper, options.spacing, options.margin)?;
        let finest = grid_of(grid, options.steps.len() - 1)?;
        let clouds: Vec<Arc<Vec<[R; 3]>>> = shapes
            .par_iter()
            .map(|shape| {
                let of = |x: f32| R::of(f64::from(x));
                let points = shape.points.iter().map(|point| point.map(of)).collect();
                Arc::new(by_cell(points, &finest))
            })
            .collect();
        let hops = pairs
            .into_iter()
            .zip(&lengths)
            .enumerate()
            .map(|(s, (pairs, length))| Hop {
                shapes: two(&shapes, s),
                pairs,
                clouds: two(&clouds, s),
                surfaces: two(&surfaces, s),
                weights: Weights {
                    strain: weights.strain / length,
                    screw: weights.screw / length.powi(3),
                    ..weights
                },
            });
        Ok(Self {
            hops: hops.collect(),
            field: SequenceField::zero(grid, times),
            lengths,
            weights,
            options,
            grid,
        })
    }

    /// How many steps there are.
    pub fn steps(&self) -> usize {
        self.options.steps.iter().sum()
    }

    /// The present field.
    pub fn field(&self) -> &SequenceField<R> {
        &self.field
    }

    /// The weights, for the mean interval as the unit of time.
    pub fn weights(&self) -> &Weights {
        &self.weights
    }

    /// Goes on from the field that the steps before `step` left: [`Self::advance`] of `step` is next.
    ///
    /// # Errors
    /// If the field's grid or key frames are not this solver's there.
    pub fn resume_from(&mut self, field: SequenceField<R>, step: usize) -> Result<(), SplineError> {
        let level = self.options.level(step.saturating_sub(1));
        let wanted = grid_of(self.grid, level)?;
        if *field.grid() != wanted || field.times() != self.field.times() {
            return Err(SplineError::Field {
                step,
                found: format!("{:?}, {} key frames", field.grid(), field.times().len()),
                wanted: format!("{wanted:?}, {} key frames", self.field.times().len()),
            });
        }
        self.field = field;
        Ok(())
    }

    /// The system at a field, and the terms as means over the hops.
    fn linearise(
        &self,
        field: &SequenceField<R>,
        level: usize,
        step: usize,
        merge: bool,
    ) -> Result<(SequenceSystem<R>, Terms), SplineError> {
        let options = &self.options;
        let each: Result<Vec<_>, SplineError> = self
            .hops
            .par_iter()
            .enumerate()
            .map(|(s, hop)| {
                let pass = Pass {
                    step,
                    draw: s * MOST_STEPS + step,
                    level,
                    merge,
                };
                hop.linearise(&field.part(s), options, pass)
            })
            .collect();
        let mut means = Terms::default();
        let share = 1.0 / self.hops.len() as f64;
        let mut terms = Vec::with_capacity(self.hops.len());
        for ((of_hop, found), length) in each?.into_iter().zip(&self.lengths) {
            means.matching += share * found.matching;
            means.on_surface += share * found.on_surface;
            means.strain += share * found.strain / length;
            means.divergence += share * found.divergence;
            means.screw += share * found.screw / length.powi(3);
            terms.push(of_hop);
        }
        let ridge = options.ridge * self.weights.strain * 100.0 / 150.0 * self.hops.len() as f64;
        Ok((SequenceSystem::new(field, terms, ridge), means))
    }

    /// Takes a step; the first of a level begins by halving the grid. Steps are taken in order, from 0 on.
    ///
    /// # Errors
    /// If there is no such step, the field is not on the grid of the step before, or a result is not
    /// finite; the field is then as before.
    pub fn advance(&mut self, step: usize) -> Result<StepReport, SplineError> {
        let (mut field, level) = before_step(&self.field, self.grid, &self.options, step)?;
        let (mut system, terms) = self.linearise(&field, level, step, true)?;
        let gradient = system.gradient(&field);
        let (change, iterations) = conjugate::step(&mut system, gradient, &self.options, step)?;
        let size = add_change(&mut field.nodes, &change);
        if !are_finite(&field.nodes) {
            let what = "the step";
            return Err(SplineError::NotFinite { step, what });
        }
        self.field = field;
        Ok(StepReport {
            step,
            level,
            spacing: self.field.grid().spacing.wide(),
            terms,
            iterations,
            size,
            band: system.places_of_band(),
        })
    }
}
