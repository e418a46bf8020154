//! What the solver takes, of a recipe and its key frames.

use isomorph_spline::{
    Cloud, Options, Pairs, Problem, SequenceProblem, SequenceSolver, Solver, SplineError,
    TimeBasis, Weights,
};
use isomorph_training::method::spline;

use super::motion::AnySolver;
use crate::recipe::{Correspondences, Motion, Recipe};
use crate::shape::Keyframes;

/// Least weight of the strain: without any the field would be free between the samples.
const LEAST_STRAIN: f64 = 1e-3;

/// Where the surfaces alone decide through many key frames: samples of each, over `spline.surface-samples`. The error of
/// carried points falls with their number, as does the noise of the samples.
const SAMPLES_ALONE: usize = 12;

/// The least of these samples, and the most over all intervals: each takes memory.
const LEAST_ALONE: usize = 1000;
const MOST_ALONE: usize = 180_000;

/// The same for the samples of the band, over `spline.band`.
const BAND_ALONE: usize = 3;

/// Through many key frames, [`Options::robust_start`].
const ROBUST_START: f64 = 30.0;

/// Through many key frames, [`Options::found_share`].
const FOUND_SHARE: f64 = 0.0;

/// The solver of a recipe, before its first step.
///
/// # Errors
/// What the solver refuses.
pub(super) fn solver(recipe: &Recipe, keyframes: &Keyframes) -> Result<AnySolver, SplineError> {
    let (weights, options) = (weights(recipe), options(recipe));
    if keyframes.keys.len() == 2 {
        let solver = Solver::new(problem(recipe, keyframes, 0), weights, options)?;
        return Ok(AnySolver::Pair(Box::new(solver)));
    }
    let times: Vec<f64> = keyframes.keys.iter().map(|key| key.time).collect();
    if spline::keys(recipe).motion == Motion::Pairs {
        let pair = |k: usize| {
            let problem = problem(recipe, keyframes, k);
            Solver::new(problem, weights, options.clone())
        };
        let solvers: Result<Vec<_>, SplineError> = (0..times.len() - 1).map(pair).collect();
        return Ok(AnySolver::Pairs(solvers?, times));
    }
    let problem = SequenceProblem {
        shapes: (0..keyframes.keys.len())
            .map(|k| cloud(keyframes, k))
            .collect(),
        times,
        pairs: (0..keyframes.between.len())
            .map(|k| pairs(recipe, keyframes, k))
            .collect(),
    };
    let options = alone(options, &weights, &problem.pairs);
    let solver = SequenceSolver::new(problem, weights, options)?;
    Ok(AnySolver::Sequence(Box::new(solver)))
}

/// The options of one field through many key frames: what differs where pairs are found, or there are none.
fn alone(options: Options, weights: &Weights, between: &[Pairs]) -> Options {
    let is_alone = |pairs: &Pairs| pairs.found || pairs.source.is_empty();
    let band = match between.iter().all(is_alone) {
        true => BAND_ALONE * options.band,
        false => options.band,
    };
    let most = (MOST_ALONE / between.len()).max(LEAST_ALONE);
    Options {
        band,
        surface_samples_alone: most.min(SAMPLES_ALONE * options.surface_samples),
        robust_start: ROBUST_START,
        // Without the term of surfaces nothing but pairs says where they go.
        found_share: if weights.on_surface > 0.0 {
            FOUND_SHARE
        } else {
            1.0
        },
        ..options
    }
}

/// The problem of key frame `k` and the next.
pub(super) fn problem(recipe: &Recipe, keyframes: &Keyframes, k: usize) -> Problem {
    Problem {
        shapes: [cloud(keyframes, k), cloud(keyframes, k + 1)],
        pairs: pairs(recipe, keyframes, k),
    }
}

fn cloud(keyframes: &Keyframes, k: usize) -> Cloud {
    let key = &keyframes.keys[k];
    Cloud {
        points: key.cloud.points.clone(),
        normals: key.cloud.normals.clone(),
        border: key.border.clone(),
    }
}

/// The pairs from key frame `k` to the next.
fn pairs(recipe: &Recipe, keyframes: &Keyframes, k: usize) -> Pairs {
    // At most so many, evenly chosen: they come in no order that means anything.
    let known = &keyframes.between[k];
    let apart = known
        .len()
        .div_ceil(recipe.training.correspondence_batch)
        .max(1);
    let (source, target) = known.iter().step_by(apart).copied().unzip();
    let confidence = &keyframes.confidence[k];
    Pairs {
        source,
        target,
        confidence: confidence.iter().step_by(apart).copied().collect(),
        found: recipe.data.between[k] == Correspondences::Match,
    }
}

pub(super) fn weights(recipe: &Recipe) -> Weights {
    let loss = &recipe.loss;
    Weights {
        matching: loss.matching,
        on_surface: loss.on_surface,
        strain: loss.strain.max(LEAST_STRAIN),
        divergence: loss.divergence,
        screw: loss.screw,
    }
}

pub(super) fn options(recipe: &Recipe) -> Options {
    let (keys, training) = (spline::keys(recipe), &recipe.training);
    let steps = steps_of_levels(training.steps, &keys.coarse_shares);
    Options {
        // Of the first level; each further one halves it.
        spacing: keys.spacing * 2.0_f64.powi(steps.len() as i32 - 1),
        steps,
        time: match recipe.velocity.time_dependent {
            true => TimeBasis::Linear,
            false => TimeBasis::Constant,
        },
        trajectory_steps: training.time_steps,
        band: keys.band,
        band_spread: training.band_widths.clone(),
        surface_samples: keys.surface_samples,
        robust_scale: keys.robust,
        iterations: keys.iterations,
        tolerance: keys.tolerance,
        seed: training.seed,
        ..Options::default()
    }
}

/// Steps of each level of the grid, the coarsest first; levels without any are left out.
fn steps_of_levels(steps: usize, coarse_shares: &[f64]) -> Vec<usize> {
    let mut left = steps;
    let mut levels: Vec<usize> = coarse_shares
        .iter()
        .map(|share| {
            // The last level has a step at least.
            let taken = (left as f64 * share).round().min(left as f64 - 1.0) as usize;
            left -= taken;
            taken
        })
        .collect();
    levels.push(left);
    levels.retain(|steps| *steps > 0);
    levels
}
