//! The field of the preset `instant` as a guide: what the Velocity-Net of other presets learns first
//! (`training.guided-until`).

use isomorph_spline::{Solver, SplineError, SplineField};
use isomorph_training::data::Guide;
use isomorph_training::method::{self, spline};

use super::completed::completed;
use super::problem::{options, problem, weights};
use crate::recipe::{Recipe, RecipeError};
use crate::shape::{Keyframes, PointCloud};

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

/// What a field that is solved for gives to the training of networks.
pub(crate) struct Guidance {
    /// The field.
    pub guide: Box<dyn Guide>,
    /// For each shape that is known in part, its points and those that complete it.
    pub completed: [Option<PointCloud>; 2],
}

/// Keys of the steps, which the recipe's own say nothing of.
const OF_STEPS: [&str; 4] = [
    "preset=instant",
    "training.steps=18",
    "training.time-steps=3",
    "training.correspondence-batch=1000",
];

/// Why no splines can stand in for the motion that a recipe asks for, if so.
fn misfit(recipe: &Recipe, keyframes: &Keyframes) -> Option<&'static str> {
    if keyframes.keys.len() != 2 {
        Some("splines take two shapes")
    } else if !recipe.velocity.time_dependent {
        Some("splines depend on time, and velocity.time-dependent is false")
    } else if recipe.loss.smoothness > 0.0 {
        Some("splines have no term for loss.smoothness")
    } else if recipe.loss.strain_scale > 0.0 {
        Some("splines have no term for loss.strain-scale")
    } else {
        None
    }
}

/// The recipe with the preset `instant`.
fn as_solved(recipe: &Recipe) -> Result<Recipe, RecipeError> {
    let mut solved = recipe.clone();
    solved.with_all(&OF_STEPS.map(str::to_owned))?;
    Ok(solved)
}

/// How thick an open sheet is, normalised: as the recipe says, or with networks as the splines have it that they learn
/// first. `None` where a method closes it by a cushion.
pub(crate) fn sheet_thickness(recipe: &Recipe) -> Option<f64> {
    if spline::is_solved(recipe) {
        return Some(spline::keys(recipe).sheet_thickness);
    }
    if !method::has_end_fields(recipe) {
        return None;
    }
    let solved = as_solved(recipe).ok()?;
    Some(spline::keys(&solved).sheet_thickness)
}

/// Solves for the field that the recipe would have with the preset `instant`: its own weights and seed are kept.
///
/// # Errors
/// A motion that splines do not have, what the solver refuses, or a surface that is not found: the reason, as a part
/// of a sentence.
pub(crate) fn guide(recipe: &Recipe, keyframes: &Keyframes) -> Result<Guidance, String> {
    if let Some(reason) = misfit(recipe, keyframes) {
        return Err(reason.to_owned());
    }
    let solved = as_solved(recipe).map_err(|error| error.to_string())?;
    let options = options(&solved);
    let trajectory_steps = 2 * options.trajectory_steps;
    let found: Result<SplineField, SplineError> = (|| {
        let mut solver = Solver::new(problem(&solved, keyframes, 0), weights(&solved), options)?;
        for step in 0..solver.steps() {
            solver.advance(step)?;
        }
        Ok(solver.field().clone())
    })();
    let field = found.map_err(|error| error.to_string())?;
    Ok(Guidance {
        completed: completed(&field, recipe, keyframes)?,
        guide: Box::new(SplineGuide {
            field,
            trajectory_steps,
        }),
    })
}
