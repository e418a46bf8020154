//! Gauss-Newton steps on grids that are halved.
//!
//! ```text
//! minimise  matching + on-surface + strain + divergence + screw   over the coefficients
//! step      A d = -gradient,  A = sum J^T W J + ridge I,   coefficients += d
//! ```
//!
//! A step draws its samples by (seed, step) alone, so that a run resumed from any step goes on as it would
//! have. A zero field is where it starts. The sums are the same on any number of threads.

use std::sync::Arc;

use crate::band;
use crate::cell::{add_change, are_finite};
use crate::conjugate;
use crate::error::SplineError;
use crate::field::SplineField;
use crate::grid::Grid;
use crate::hop::{Hop, Pass};
use crate::levels::{before_step, grid_of};
use crate::options::{Options, Weights};
use crate::problem::Problem;
use crate::real::Real;
use crate::system::System;
use crate::targets::Surface;

/// The terms of the objective at the present field, without their weights.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Terms {
    /// Mean distance of pairs, both ways; 0 where there are none.
    pub matching: f64,
    /// Mean distance of carried samples from the other surface.
    pub on_surface: f64,
    /// Mean squared strain rate over the band.
    pub strain: f64,
    /// Mean absolute divergence over the band.
    pub divergence: f64,
    /// Mean squared deviation from a screw over the band.
    pub screw: f64,
}

impl Terms {
    /// The objective.
    pub fn weighted(&self, weights: &Weights) -> f64 {
        weights.matching * self.matching
            + weights.on_surface * self.on_surface
            + weights.strain * self.strain
            + weights.divergence * self.divergence
            + weights.screw * self.screw
    }
}

/// What a step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepReport {
    /// The step, from 0 on.
    pub step: usize,
    /// The level, from 0 on.
    pub level: usize,
    /// The edge of the level's cells.
    pub spacing: f64,
    /// The terms before the step.
    pub terms: Terms,
    /// Iterations of conjugate gradients.
    pub iterations: usize,
    /// The largest change of a coefficient.
    pub size: f64,
    /// Points of the band after gathering.
    pub band: usize,
}

/// Finds a field by Gauss-Newton steps.
pub struct Solver<R: Real = f32> {
    hop: Hop<R>,
    options: Options,
    grid: Grid<R>,
    field: SplineField<R>,
}

impl<R: Real> Solver<R> {
    /// Checks and arranges everything; the field is zero.
    ///
    /// # Errors
    /// If the problem, a weight or an option is not valid.
    pub fn new(problem: Problem, weights: Weights, options: Options) -> Result<Self, SplineError> {
        problem.check()?;
        weights.check()?;
        options.check()?;
        let [lower, upper] = problem.extent();
        let grid = Grid::around(lower, upper, options.spacing, options.margin)?;
        let finest = grid_of(grid, options.steps.len() - 1)?;
        let shapes = problem.shapes.map(Arc::new);
        let [first, second] = &shapes;
        let (first, second) = rayon::join(|| Surface::new(first), || Surface::new(second));
        let of = |x: f32| R::of(f64::from(x));
        let cloud = |which: usize| {
            let points = shapes[which].points.iter();
            let points = points.map(|point| point.map(of)).collect();
            Arc::new(band::by_cell(points, &finest))
        };
        Ok(Self {
            hop: Hop {
                clouds: [cloud(0), cloud(1)],
                surfaces: [Arc::new(first), Arc::new(second)],
                shapes,
                pairs: problem.pairs,
                weights,
            },
            field: SplineField::zero(grid, options.time),
            options,
            grid,
        })
    }

    /// How many steps there are.
    pub fn steps(&self) -> usize {
        self.options.steps.iter().sum()
    }

    /// The present field.
    pub fn field(&self) -> &SplineField<R> {
        &self.field
    }

    /// The options.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The weights.
    pub fn weights(&self) -> &Weights {
        &self.hop.weights
    }

    /// Goes on from the field that the steps before `step` left: [`Self::advance`] of `step` is next.
    ///
    /// # Errors
    /// If the field's grid or functions of time are not this solver's there.
    pub fn resume_from(&mut self, field: SplineField<R>, step: usize) -> Result<(), SplineError> {
        let level = self.options.level(step.saturating_sub(1));
        let wanted = grid_of(self.grid, level)?;
        if *field.grid() != wanted || field.time_basis() != self.options.time {
            return Err(SplineError::Field {
                step,
                found: format!("{:?}, {:?}", field.grid(), field.time_basis()),
                wanted: format!("{wanted:?}, {:?}", self.options.time),
            });
        }
        self.field = field;
        Ok(())
    }

    /// Takes a step; the first of a level begins by halving the grid. Steps are taken in order, from 0 on.
    ///
    /// # Errors
    /// If there is no such step, the field is not on the grid of the step before, or a result is not
    /// finite; the field is then as before.
    pub fn advance(&mut self, step: usize) -> Result<StepReport, SplineError> {
        let (mut field, level) = self.field_at(step)?;
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
            band: system.terms.priors.places.len(),
        })
    }

    /// The field before a step, on the grid of the step, and its level.
    ///
    /// # Errors
    /// If there is no such step, or the field is not on the grid of the step before.
    pub(crate) fn field_at(&self, step: usize) -> Result<(SplineField<R>, usize), SplineError> {
        before_step(&self.field, self.grid, &self.options, step)
    }

    /// What was given.
    pub(crate) fn hop(&self) -> &Hop<R> {
        &self.hop
    }

    /// The system at a field; `merge`: with places of trajectories merged.
    pub(crate) fn linearise(
        &self,
        field: &SplineField<R>,
        level: usize,
        step: usize,
        merge: bool,
    ) -> Result<(System<R>, Terms), SplineError> {
        let options = &self.options;
        let pass = Pass {
            step,
            draw: step,
            level,
            merge,
        };
        let (terms, means) = self.hop.linearise(field, options, pass)?;
        // A well-covered node has about 1/150 of the strain, over a squared spacing near 0.1 squared.
        let ridge = options.ridge * self.hop.weights.strain * 100.0 / 150.0;
        Ok((System::new(field, terms, ridge), means))
    }
}
