//! What may be wrong with a problem, its options or a step.

use thiserror::Error;

/// Why a field or a solver cannot be made, or a step not be taken.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SplineError {
    /// A weight or an option outside its range.
    #[error("{name} = {value}: must be {allowed}")]
    Option {
        /// Its name.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// Lists that belong together differ in length.
    #[error("{what}: {found} entries for {wanted}; give one for each")]
    Lengths {
        /// Which list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length of the list that it belongs to.
        wanted: usize,
    },
    /// A shape without points.
    #[error("the {which} has no points; give samples of its surface")]
    Empty {
        /// Which shape.
        which: &'static str,
    },
    /// A number of the input that is not finite, or a confidence below 0.
    #[error("{what} {index} is {found}; it must be finite{also}")]
    Input {
        /// What it is.
        what: &'static str,
        /// Its place in its list.
        index: usize,
        /// What it is, in words.
        found: String,
        /// What else it must be.
        also: &'static str,
    },
    /// A grid that is none.
    #[error("{found}: corner and spacing must be finite, spacing and cells above 0")]
    Grid {
        /// The grid, in words.
        found: String,
    },
    /// A grid beyond what the solver holds.
    #[error("the grid has {nodes:.0} nodes, at most {most}; take a larger spacing or fewer levels")]
    TooManyNodes {
        /// How many there would be.
        nodes: f64,
        /// How many there may be.
        most: usize,
    },
    /// A field that the step cannot go on from.
    #[error("step {step} cannot go on from a field on {found}; the step before it leaves {wanted}")]
    Field {
        /// The step.
        step: usize,
        /// The field's grid, in words.
        found: String,
        /// The grid that the solver has there, in words.
        wanted: String,
    },
    /// A step beyond the last.
    #[error("step {step}: the solver has {steps} steps, from 0 on")]
    Step {
        /// The step.
        step: usize,
        /// How many there are.
        steps: usize,
    },
    /// A result that is no number.
    #[error(
        "step {step}: {what} is not finite; the field is left as before the step; try smaller weights"
    )]
    NotFinite {
        /// The step.
        step: usize,
        /// What is not finite.
        what: &'static str,
    },
}
