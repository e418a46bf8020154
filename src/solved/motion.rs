//! The field of a run between two shapes, or through more, and the solver that finds it.

use isomorph_spline::{
    SequenceField, SequenceSolver, Solver, SplineError, SplineField, StepReport, Terms, Weights,
};

/// A field between two shapes, or through more.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Field {
    /// Between two.
    Pair(SplineField),
    /// Through three or more.
    Sequence(SequenceField),
    /// From each of three or more to the next, with the times of the key frames.
    Pairs(Vec<SplineField>, Vec<f64>),
}

impl Field {
    /// How many numbers it is.
    pub(super) fn coefficients(&self) -> Vec<f32> {
        match self {
            Self::Pair(field) => field.coefficients(),
            Self::Sequence(field) => field.coefficients(),
            Self::Pairs(fields, _) => fields.iter().flat_map(SplineField::coefficients).collect(),
        }
    }
}

/// A solver for such a field.
pub(super) enum AnySolver {
    /// Between two shapes.
    Pair(Box<Solver>),
    /// Through three or more.
    Sequence(Box<SequenceSolver>),
    /// From each of three or more to the next, with the times of the key frames.
    Pairs(Vec<Solver>, Vec<f64>),
}

impl AnySolver {
    /// The present field.
    pub(super) fn field(&self) -> Field {
        match self {
            Self::Pair(solver) => Field::Pair(solver.field().clone()),
            Self::Sequence(solver) => Field::Sequence(solver.field().clone()),
            Self::Pairs(solvers, times) => {
                let fields = solvers.iter().map(|solver| solver.field().clone());
                Field::Pairs(fields.collect(), times.clone())
            }
        }
    }

    /// How many steps it takes.
    pub(super) fn steps(&self) -> usize {
        match self {
            Self::Pair(solver) => solver.steps(),
            Self::Sequence(solver) => solver.steps(),
            Self::Pairs(solvers, _) => solvers[0].steps(),
        }
    }

    /// The weights of the terms.
    pub(super) fn weights(&self) -> &Weights {
        match self {
            Self::Pair(solver) => solver.weights(),
            Self::Sequence(solver) => solver.weights(),
            Self::Pairs(solvers, _) => solvers[0].weights(),
        }
    }

    /// Takes a step.
    ///
    /// # Errors
    /// What the solver refuses.
    pub(super) fn advance(&mut self, step: usize) -> Result<StepReport, SplineError> {
        match self {
            Self::Pair(solver) => solver.advance(step),
            Self::Sequence(solver) => solver.advance(step),
            Self::Pairs(solvers, _) => {
                let reports: Result<Vec<StepReport>, SplineError> = solvers
                    .iter_mut()
                    .map(|solver| solver.advance(step))
                    .collect();
                Ok(mean(&reports?))
            }
        }
    }

    /// Goes on from a stored field; nothing if it is of the other kind.
    ///
    /// # Errors
    /// What the solver refuses.
    pub(super) fn resume_from(
        &mut self,
        field: Field,
        step: usize,
    ) -> Option<Result<(), SplineError>> {
        match (self, field) {
            (Self::Pair(solver), Field::Pair(field)) => Some(solver.resume_from(field, step)),
            (Self::Sequence(solver), Field::Sequence(field)) => {
                Some(solver.resume_from(field, step))
            }
            (Self::Pairs(solvers, times), Field::Pairs(fields, stored)) => {
                if solvers.len() != fields.len() || *times != stored {
                    return None;
                }
                let mut each = solvers.iter_mut().zip(fields);
                Some(each.try_for_each(|(solver, field)| solver.resume_from(field, step)))
            }
            _ => None,
        }
    }
}

/// The means of the terms of steps that were taken side by side.
fn mean(reports: &[StepReport]) -> StepReport {
    let share = 1.0 / reports.len() as f64;
    let mean = |of: fn(&Terms) -> f64| reports.iter().map(|report| share * of(&report.terms)).sum();
    StepReport {
        terms: Terms {
            matching: mean(|terms| terms.matching),
            on_surface: mean(|terms| terms.on_surface),
            strain: mean(|terms| terms.strain),
            divergence: mean(|terms| terms.divergence),
            screw: mean(|terms| terms.screw),
        },
        ..reports[0]
    }
}
