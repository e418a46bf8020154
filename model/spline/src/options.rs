//! Weights of the terms and options of the solver. The defaults are the measured recipe.

use crate::basis::TimeBasis;
use crate::error::SplineError;
use crate::problem::Pairs;

/// What each term counts in the objective. Each term is a mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Distance of a pair's carried source from its target, and the reverse.
    pub matching: f64,
    /// Distance of carried samples from the other surface.
    pub on_surface: f64,
    /// Squared strain rate.
    pub strain: f64,
    /// Absolute divergence.
    pub divergence: f64,
    /// Squared deviation from motion along a screw.
    pub screw: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            matching: 200.0,
            on_surface: 100.0,
            strain: 3.0,
            divergence: 2.0,
            screw: 15.0,
        }
    }
}

/// How the field is found.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The edge of a cell of the first level; each further level halves it.
    pub spacing: f64,
    /// Gauss-Newton steps of each level, the coarsest first.
    pub steps: Vec<usize>,
    /// The functions of time.
    pub time: TimeBasis,
    /// Cells around the box of both shapes.
    pub margin: usize,
    /// Least steps of a trajectory from one shape to the other; doubled where the field bends paths so much
    /// that their ends would be off by more than a thousandth.
    pub trajectory_steps: usize,
    /// Points of the band at the last level; half as many before.
    pub band: usize,
    /// Standard deviations by which points of the band lie off the surface, in equal parts.
    pub band_spread: Vec<f64>,
    /// Edge of the cubes in which points of the band are gathered, in cells.
    pub voxel: f64,
    /// Intervals of time in which they are gathered.
    pub time_bins: usize,
    /// Weight of the cells around the band, as a part of the band's.
    pub extension: f64,
    /// Samples of each surface for the on-surface term.
    pub surface_samples: usize,
    /// The same where the surfaces alone decide: there are no pairs, or they were found and count for less.
    pub surface_samples_alone: usize,
    /// Distance below which matching and on-surface count by their squares.
    pub robust_scale: f64,
    /// Factor of `robust_scale` at the first step where there are no pairs. It falls to 1 until the last level: parts
    /// that are far off count fully at first.
    pub robust_start: f64,
    /// The share of their weight that pairs keep at the last level if they were found, not given. Below 1 the surfaces
    /// have the last word: found pairs are off by half of the spacing of the points.
    pub found_share: f64,
    /// Most iterations of conjugate gradients in a step.
    pub iterations: usize,
    /// The part of the residual at which conjugate gradients end.
    pub tolerance: f64,
    /// A small weight on the squares of all coefficients, as a part of the strain's on a node.
    pub ridge: f64,
    /// The seed of all random draws.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            spacing: 0.2,
            steps: vec![8, 4, 6],
            time: TimeBasis::Linear,
            margin: 2,
            trajectory_steps: 3,
            band: 24_000,
            band_spread: vec![0.01, 0.05],
            voxel: 0.75,
            time_bins: 2,
            extension: 0.03,
            surface_samples: 300,
            surface_samples_alone: 1000,
            robust_scale: 0.003,
            robust_start: 1.0,
            found_share: 1.0,
            iterations: 80,
            tolerance: 0.03,
            ridge: 1e-4,
            seed: 0,
        }
    }
}

const NOT_NEGATIVE: &str = "finite and 0 or more";
const POSITIVE: &str = "finite and above 0";

impl Weights {
    /// # Errors
    /// If a weight is not finite or below 0, or strain is 0.
    pub(crate) fn check(&self) -> Result<(), SplineError> {
        for (name, value) in [
            ("matching", self.matching),
            ("on_surface", self.on_surface),
            ("divergence", self.divergence),
            ("screw", self.screw),
        ] {
            not_negative(name, value)?;
        }
        positive("strain", self.strain)
    }
}

impl Options {
    /// # Errors
    /// If an option is outside its range.
    pub(crate) fn check(&self) -> Result<(), SplineError> {
        positive("spacing", self.spacing)?;
        positive("voxel", self.voxel)?;
        positive("robust_scale", self.robust_scale)?;
        positive("robust_start", self.robust_start)?;
        not_negative("found_share", self.found_share)?;
        positive("ridge", self.ridge)?;
        not_negative("extension", self.extension)?;
        let widths = self.band_spread.len();
        check(
            widths > 0,
            "band_spread",
            widths as f64,
            "one number or more",
        )?;
        self.band_spread
            .iter()
            .try_for_each(|&width| not_negative("band_spread", width))?;
        let within = self.tolerance > 0.0 && self.tolerance < 1.0;
        check(within, "tolerance", self.tolerance, "between 0 and 1")?;
        let levels = self.steps.len();
        check((1..=8).contains(&levels), "levels", levels as f64, "1 to 8")?;
        for (name, value, most) in [
            ("steps", self.steps.iter().sum(), 100_000),
            ("trajectory_steps", self.trajectory_steps, 1000),
            ("band", self.band, 10_000_000),
            ("time_bins", self.time_bins, 64),
            ("surface_samples", self.surface_samples, 10_000_000),
            (
                "surface_samples_alone",
                self.surface_samples_alone,
                10_000_000,
            ),
            ("iterations", self.iterations, 100_000),
        ] {
            let within = (1..=most).contains(&value);
            check(within, name, value as f64, "at least 1, and not huge")?;
        }
        check(
            self.margin <= 100,
            "margin",
            self.margin as f64,
            "at most 100",
        )
    }

    /// Points of the band at a level.
    pub(crate) fn band_at(&self, level: usize) -> usize {
        if level + 1 == self.steps.len() {
            self.band
        } else {
            self.band.div_ceil(2)
        }
    }

    /// The samples of each surface between two shapes.
    pub(crate) fn surface_samples_beside(&self, pairs: &Pairs) -> usize {
        if pairs.source.is_empty() || pairs.found && self.found_share < 1.0 {
            self.surface_samples_alone
        } else {
            self.surface_samples
        }
    }

    /// The distance below which residuals count by their squares in a step.
    pub(crate) fn robust_beside(&self, pairs: &Pairs, step: usize) -> f64 {
        if !pairs.source.is_empty() {
            return self.robust_scale;
        }
        let before_last: usize = self.steps[..self.steps.len() - 1].iter().sum();
        let left = 1.0 - step as f64 / before_last.max(1) as f64;
        self.robust_scale * self.robust_start.powf(left.max(0.0))
    }

    /// The share of its weight that a pair has at a level. Found pairs lead at one level at least.
    pub(crate) fn share_of_pairs(&self, pairs: &Pairs, level: usize) -> f64 {
        if pairs.found && level > 0 && level + 1 == self.steps.len() {
            self.found_share
        } else {
            1.0
        }
    }

    /// The level of a step.
    pub(crate) fn level(&self, step: usize) -> usize {
        let mut end = 0;
        for (level, steps) in self.steps.iter().enumerate() {
            end += steps;
            if step < end {
                return level;
            }
        }
        self.steps.len() - 1
    }
}

fn check(
    within: bool,
    name: &'static str,
    value: f64,
    allowed: &'static str,
) -> Result<(), SplineError> {
    if within {
        Ok(())
    } else {
        Err(SplineError::Option {
            name,
            value,
            allowed,
        })
    }
}

fn not_negative(name: &'static str, value: f64) -> Result<(), SplineError> {
    check(value.is_finite() && value >= 0.0, name, value, NOT_NEGATIVE)
}

fn positive(name: &'static str, value: f64) -> Result<(), SplineError> {
    check(value.is_finite() && value > 0.0, name, value, POSITIVE)
}
