//! Whether a run can go on from a checkpoint.

use isomorph_training::method;

use super::LearnerError;
use crate::recipe::Recipe;
use crate::session::checkpoint::Checkpoint;
use crate::shape::Keyframes;

/// Whether training can go on from a checkpoint with this recipe and these shapes.
///
/// # Errors
/// [`LearnerError::OtherNetworks`], [`LearnerError::OtherShapes`], and [`LearnerError::Checkpoint`] if the
/// checkpoint's recipe no longer parses.
pub(super) fn fits(
    checkpoint: &Checkpoint,
    recipe: &Recipe,
    keyframes: &Keyframes,
) -> Result<(), LearnerError> {
    let before = checkpoint.recipe()?;
    let grows = recipe.data.continues(&before.data);
    // What learns anew has another grid, other levels and other shapes.
    let fixed = match grows && method::spline::is_solved(recipe) {
        true => method::changed_method(&before, recipe),
        false => method::fixed_change(&before, recipe),
    };
    if let Some((change, why)) = fixed {
        let path = checkpoint.path.clone();
        return Err(LearnerError::OtherNetworks { path, change, why });
    }
    let (own, stored) = (keyframes.coordinates(), checkpoint.state.coordinates());
    let are_same = match grows {
        true => own.begin_as(&stored, before.data.keyframes.len()),
        false => own == stored,
    };
    if !are_same {
        return Err(LearnerError::OtherShapes(checkpoint.path.clone()));
    }
    Ok(())
}
