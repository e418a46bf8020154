//! The field of the preset `instant` as a guide: what the Velocity-Net of other presets learns first
//! (`training.guided-until`).

use isomorph_spline::{Solver, SplineError, SplineField};
use isomorph_training::data::Guide;
use isomorph_training::schedule::Schedule;

use super::{options, problem, weights};
use crate::recipe::{Recipe, RecipeError};
use crate::shape::Keyframes;

/// A solved field, and in how many steps its paths are followed.
struct SplineGuide {
    field: SplineField,
    trajectory_steps: usize,
}

impl Guide for SplineGuide {
    fn velocities(&self, places: &[[f32; 3]], times: &[f32]) -> Vec<[f32; 3]> {
        let jets = self.field.jets(places, times);
        jets.into_iter().map(|jet| jet.value).collect()
    }

    fn carried(&self, places: &[[f32; 3]], from: &[f32], to: &[f32]) -> Vec<[f32; 3]> {
        self.field
            .carry_each(places, from, to, self.trajectory_steps)
    }
}

/// Whether step `step` of the recipe needs a guide, or one after it.
pub(crate) fn is_guided(recipe: &Recipe, step: usize) -> bool {
    Schedule::new(&recipe.training).is_guided(step)
}

/// Keys of the steps, which the recipe's own say nothing of.
const OF_STEPS: [&str; 4] = [
    "preset=instant",
    "training.steps=18",
    "training.time-steps=3",
    "training.correspondence-batch=1000",
];

/// Solves for the field that the recipe would have with the preset `instant`: its own weights and seed are kept.
///
/// # Errors
/// More than two key frames, or what the solver refuses.
pub(crate) fn guide(recipe: &Recipe, keyframes: &Keyframes) -> Result<Box<dyn Guide>, String> {
    let failed = |reason: &dyn std::fmt::Display| {
        format!("training.guided-until: no splines were found ({reason}); set it to 0")
    };
    if keyframes.keys.len() != 2 {
        return Err(failed(&"it takes two shapes"));
    }
    let mut solved = recipe.clone();
    let keys = OF_STEPS.map(str::to_owned);
    let changed: Result<(), RecipeError> = solved.with_all(&keys);
    changed.map_err(|error| failed(&error))?;
    let options = options(&solved);
    let trajectory_steps = 2 * options.trajectory_steps;
    let found: Result<SplineField, SplineError> = (|| {
        let mut solver = Solver::new(problem(&solved, keyframes), weights(&solved), options)?;
        for step in 0..solver.steps() {
            solver.advance(step)?;
        }
        Ok(solver.field().clone())
    })();
    Ok(Box::new(SplineGuide {
        field: found.map_err(|error| failed(&error))?,
        trajectory_steps,
    }))
}
