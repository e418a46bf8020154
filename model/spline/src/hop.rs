//! One hop: two neighbouring shapes, what is known between them, and the terms of a field that carries the
//! first to the second in a unit of time.

use std::sync::Arc;

use crate::band;
use crate::ends::{EndTerms, Ends};
use crate::error::SplineError;
use crate::field::SplineField;
use crate::options::{Options, Weights};
use crate::prior::PriorTerms;
use crate::problem::{Cloud, Pairs};
use crate::real::Real;
use crate::solver::Terms;
use crate::system::HopTerms;
use crate::targets::{Surface, Targets};

/// Points of each shape that decide how many steps a trajectory takes.
const PROBES: usize = 500;

/// How exactly the ends of trajectories are followed, in the unit of the shapes.
const EXACT: f64 = 1e-3;

/// The most steps of a trajectory that are chosen.
const MOST_STEPS: usize = 24;

/// Two neighbouring shapes.
pub(crate) struct Hop<R> {
    pub shapes: [Arc<Cloud>; 2],
    pub pairs: Pairs,
    /// For the band, in the order of cells.
    pub clouds: [Arc<Vec<[R; 3]>>; 2],
    pub surfaces: [Arc<Surface>; 2],
    pub weights: Weights,
}

/// A step of the solver.
#[derive(Clone, Copy)]
pub(crate) struct Pass {
    /// The step, which messages name.
    pub step: usize,
    /// What names its random numbers.
    pub draw: usize,
    /// The level of the grid.
    pub level: usize,
    /// Whether places of trajectories are merged.
    pub merge: bool,
}

impl<R: Real> Hop<R> {
    /// Steps of the trajectories through a field.
    pub(crate) fn trajectory_steps<const H: usize>(
        &self,
        field: &SplineField<R, H>,
        options: &Options,
    ) -> usize {
        let probes = [0, 1].map(|end: usize| {
            let cloud = &self.clouds[end];
            let apart = cloud.len().div_ceil(PROBES);
            cloud.iter().step_by(apart).copied().collect::<Vec<_>>()
        });
        let least = options.trajectory_steps;
        let range = [least, MOST_STEPS.max(least)];
        field.steps_within([&probes[0], &probes[1]], EXACT, range)
    }

    /// The terms at a field.
    ///
    /// # Errors
    /// If a result is not finite.
    pub(crate) fn linearise<const H: usize>(
        &self,
        field: &SplineField<R, H>,
        options: &Options,
        pass: Pass,
    ) -> Result<(HopTerms<R, H>, Terms), SplineError> {
        let Pass {
            step,
            draw,
            level,
            merge,
        } = pass;
        let not_finite = |what| SplineError::NotFinite { step, what };
        let share = options.share_of_pairs(&self.pairs, level);
        let weights = &Weights {
            matching: share * self.weights.matching,
            ..self.weights
        };
        let robust = options.robust_beside(&self.pairs, step);
        let targets = Targets::new(&self.shapes, &self.pairs, options, weights, draw);
        let steps = self.trajectory_steps(field, options);
        let ends = Ends::new(field, &targets.starts, &targets.times, steps, merge);
        let finite = |x: &R| x.wide().is_finite();
        if !ends.points.iter().flatten().all(finite) {
            return Err(not_finite("the end of a trajectory"));
        }
        let residuals = targets.residuals(&ends, &self.surfaces, weights, robust);
        let mut terms = Terms {
            matching: residuals.matching,
            on_surface: residuals.on_surface,
            ..Terms::default()
        };
        let end_terms = EndTerms::new(field, &ends, residuals.residuals, residuals.weights);

        let amount = [options.band_at(level), steps];
        let samples = band::samples(field, &self.clouds, options, amount, draw);
        if !samples.iter().flat_map(|sample| &sample.point).all(finite) {
            return Err(not_finite("a point of the band"));
        }
        let priors = PriorTerms::new(field, &samples, weights);
        terms.strain = priors.means.strain;
        terms.divergence = priors.means.divergence;
        terms.screw = priors.means.screw;
        let objective = terms.weighted(weights);
        if !objective.is_finite() {
            return Err(not_finite("the objective"));
        }
        let strides = field.grid().strides();
        Ok((HopTerms::new(end_terms, priors, strides), terms))
    }
}
