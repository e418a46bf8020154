//! The field of a run between two shapes, or through more, and the solver that finds it.

use isomorph_spline::{
    SequenceField, SequenceSolver, Solver, SplineError, SplineField, StepReport, Weights,
};

/// A field between two shapes, or through more.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Field {
    /// Between two.
    Pair(SplineField),
    /// Through three or more.
    Sequence(SequenceField),
}

impl Field {
    /// How many numbers it is.
    pub(super) fn coefficients(&self) -> Vec<f32> {
        match self {
            Self::Pair(field) => field.coefficients(),
            Self::Sequence(field) => field.coefficients(),
        }
    }
}

/// A solver for such a field.
pub(super) enum AnySolver {
    /// Between two shapes.
    Pair(Box<Solver>),
    /// Through three or more.
    Sequence(Box<SequenceSolver>),
}

impl AnySolver {
    /// The present field.
    pub(super) fn field(&self) -> Field {
        match self {
            Self::Pair(solver) => Field::Pair(solver.field().clone()),
            Self::Sequence(solver) => Field::Sequence(solver.field().clone()),
        }
    }

    /// The weights of the terms.
    pub(super) fn weights(&self) -> &Weights {
        match self {
            Self::Pair(solver) => solver.weights(),
            Self::Sequence(solver) => solver.weights(),
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
            _ => None,
        }
    }
}
