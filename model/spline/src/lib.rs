//! A velocity field of B-splines between two shapes, found by Gauss-Newton.
//!
//! The field is `V(x, t) = sum c[n, k] B_n(x) T_k(t)`: quadratic B-splines in space, Legendre polynomials in
//! time ([`SplineField`]). A [`Solver`] finds the coefficients for a [`Problem`]: two surfaces as samples,
//! and perhaps pairs of points.
//!
//! | module | what |
//! |---|---|
//! | `problem`, `options`, `error` | what is given, and what may be wrong with it |
//! | `basis`, `grid`, `cell` | B-splines, where a point lies, sums over the nodes of a cell |
//! | `field`, `trajectory` | the field, what it carries where, and the derivatives |
//! | `targets`, `ends` | terms on where trajectories end |
//! | `band`, `prior` | terms on the field itself, and the points at which they are taken |
//! | `scatter`, `system`, `preconditioner`, `conjugate` | the linear system of a step |
//! | `hop` | two neighbouring shapes, and all terms between them |
//! | `levels` | the grids of a solver |
//! | `solver`, `samples` | the steps, and what each takes its terms at |
//! | `sequence` | the same through many key frames |
//! | `real` | f32 or f64, and vector instructions chosen at run time |

#![expect(
    clippy::needless_range_loop,
    reason = "sums over axes and nodes read as their formulas, and have constant lengths"
)]

mod band;
mod basis;
mod cell;
mod conjugate;
mod ends;
mod error;
mod field;
#[cfg(test)]
mod field_tests;
#[cfg(test)]
mod frozen;
mod grid;
mod hop;
mod levels;
mod options;
mod preconditioner;
mod prior;
mod problem;
mod real;
mod samples;
mod scatter;
mod sequence;
mod solver;
#[cfg(test)]
mod solver_tests;
mod system;
mod targets;
mod trajectory;

pub use basis::TimeBasis;
pub use cell::Jet;
pub use error::SplineError;
pub use field::{Carried, SplineField};
pub use grid::Grid;
pub use options::{Options, Weights};
pub use problem::{Cloud, Pairs, Problem};
pub use real::Real;
pub use samples::{Arrival, BandPlace, Samples};
pub use sequence::{SequenceField, SequenceProblem, SequenceSolver, quadratics};
pub use solver::{Solver, StepReport, Terms};
