//! The samples of a step, for those who take the same terms elsewhere.
//!
//! The [`crate::Terms`] of a step are these means, where `phi` carries a start from its own time to the other
//! end in `steps` even steps:
//!
//! ```text
//! matching    mean |phi(x) - goal|                        over the arrivals of pairs, both ways
//! on-surface  mean |<phi(x) - place, normal>|             over the arrivals of surface samples
//! strain      sum count |D|^2 / sum count                 over the band, D = (J + J^T) / 2
//! divergence  sum count |tr J| / sum count
//! screw       sum count |V_t + D V|^2 / sum count
//! ```
//!
//! The learner of networks has the same terms with a mean over samples, so that a place of the band counts as
//! often as samples were gathered in it. What the steps minimise differs in three ways. Near zero, distances and
//! divergence are rounded: `sqrt(d^2 + c^2)` stands for `d`. Pairs have their confidence, and surface samples the
//! agreement of normals, as a factor. Cells around the band count a little.

use crate::band;
use crate::ends::Ends;
use crate::error::SplineError;
use crate::field::SplineField;
use crate::real::Real;
use crate::solver::Solver;
use crate::targets::Targets;

/// The start of a trajectory, and where it should end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrival<R: Real = f32> {
    /// Where it starts.
    pub start: [R; 3],
    /// When it starts and when it ends: 0 and 1, or 1 and 0.
    pub times: [R; 2],
    /// The other point of a pair; of a surface sample the nearest sample of the other surface.
    pub place: [f64; 3],
    /// The normal at that sample, where it is known; none for a pair.
    pub normal: Option<[f64; 3]>,
    /// Factor of its weight: the confidence of a pair, or how far normals agree; 0 to 1.
    pub factor: f64,
}

/// A place of the band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandPlace<R: Real = f32> {
    /// Where it is.
    pub point: [R; 3],
    /// When.
    pub time: R,
    /// Samples that were gathered in it.
    pub count: usize,
}

/// What the terms of a step are taken at.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples<R: Real = f32> {
    /// The field before the step, on the step's grid.
    pub field: SplineField<R>,
    /// Steps of each trajectory.
    pub steps: usize,
    /// The trajectories of pairs, both ways.
    pub pairs: Vec<Arrival<R>>,
    /// The trajectories of surface samples, from both surfaces.
    pub surface: Vec<Arrival<R>>,
    /// The places of the band, without the cells around it.
    pub band: Vec<BandPlace<R>>,
}

impl<R: Real> Solver<R> {
    /// What [`Solver::advance`] of `step` takes its terms at.
    ///
    /// # Errors
    /// If there is no such step, or the field is not on the grid of the step before.
    pub fn samples(&self, step: usize) -> Result<Samples<R>, SplineError> {
        let (field, level) = self.field_at(step)?;
        let (hop, options) = (self.hop(), self.options());
        let targets = Targets::new(&hop.shapes, &hop.pairs, options, &hop.weights, step);
        let steps = hop.trajectory_steps(&field, options);
        let ends = Ends::new(&field, &targets.starts, &targets.times, steps, false);
        let (pairs, surface) = targets.arrivals(&ends, &hop.surfaces);
        let amount = options.band_at(level);
        let drawn = 2 * amount.div_ceil(2);
        let samples = band::samples(&field, &hop.clouds, options, [amount, steps], step);
        let inside = samples.iter().filter(|sample| sample.inside);
        let band = inside.map(|sample| BandPlace {
            point: sample.point,
            time: sample.time,
            count: (sample.share * drawn as f64).round() as usize,
        });
        Ok(Samples {
            pairs,
            surface,
            band: band.collect(),
            steps,
            field,
        })
    }
}
