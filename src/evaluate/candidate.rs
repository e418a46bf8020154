//! What a method must answer to be measured.

use std::fmt::{Debug, Display};

use crate::geometry::Mesh;

/// Positions of the same vertices at several times: one list per time, all of the same length.
pub(crate) type Carried = Vec<Vec<[f32; 3]>>;

/// What a surface is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// To find the best times, up to 129 of them: a coarser surface will do, a quick one is better.
    Aligning,
    /// To be measured: as fine as the method's own output.
    Measured,
}

/// A method that says where the shape is at any time from 0 to 1, in normalised coordinates.
pub(crate) trait Candidate {
    /// Why it could not answer.
    type Error: Debug + Display;

    /// Its surface at `time`; none if the method has no surface, or it vanishes at this time.
    ///
    /// # Errors
    /// Whatever keeps the method from giving one.
    fn surface(&mut self, time: f64, purpose: Purpose) -> Result<Option<Mesh<f64>>, Self::Error>;

    /// The vertices `start`, given where they are at time 0, at each of `times`; none if the method
    /// carries no points.
    ///
    /// `times` ascend strictly from 0 to 1. The result holds, for each of them, one position per
    /// vertex in the order of `start`.
    ///
    /// # Errors
    /// Whatever keeps the method from carrying them.
    fn carried(
        &mut self,
        start: &[[f32; 3]],
        times: &[f64],
    ) -> Result<Option<Carried>, Self::Error>;

    /// Mean of `||grad f| - 1|` over the points at `time`; none if the method has no `f`.
    ///
    /// # Errors
    /// Whatever keeps the method from evaluating its `f` there.
    fn slope_error(&mut self, points: &[[f32; 3]], time: f64) -> Result<Option<f64>, Self::Error>;
}
