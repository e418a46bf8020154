//! From a method that was trained, or a checkpoint of it, to surfaces and motion.

use isomorph_training::deformation::Deformation;
use isomorph_training::engine::{Engine, Trainer};
use isomorph_training::method::spec_of;
use isomorph_training::method::spline::is_solved;

use super::checkpoint::Checkpoint;
use crate::error::{Error, Result};
use crate::formats;
use crate::geometry::{Bounds, Mesh};
use crate::recipe::Recipe;
use crate::shape::{Coordinates, Normalisation};
use crate::solved::Solved;
use crate::surface::learned::Learned;

/// The frame of the key frames: where the user's coordinates lie in the networks'.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub coordinates: Coordinates,
    pub bounds: Bounds,
}

/// What a method has learned so far.
///
/// # Errors
/// If the method has no surface of its own and the source is not a mesh that could be carried.
pub(super) fn learned(
    deformation: Box<dyn Deformation>,
    recipe: &Recipe,
    frame: Frame,
) -> Result<Learned> {
    let template = match deformation.field() {
        Some(_) => None,
        None => Some(template(recipe, &frame.coordinates.normalisation)?),
    };
    Ok(Learned {
        deformation,
        template,
        coordinates: frame.coordinates,
        bounds: frame.bounds.padded(recipe.training.box_margin as f32),
    })
}

/// Whether the source is what the method needs it to be, to be asked before there is a run.
///
/// # Errors
/// If the method carries the source's mesh and it is a cloud.
pub(super) fn check(recipe: &Recipe, normalisation: &Normalisation) -> Result<()> {
    if spec_of(recipe).needs.mesh {
        template(recipe, normalisation)?;
    }
    Ok(())
}

/// The source's own mesh, normalised.
fn template(recipe: &Recipe, normalisation: &Normalisation) -> Result<Mesh<f32>> {
    let source = formats::read(recipe.data.source())?;
    if !source.is_mesh() {
        return Err(Error::usage(format!(
            "{}: a point cloud: the method {} gives no surface of its own and carries the source's \
             mesh; give a mesh, or choose another method.name",
            source.path.display(),
            recipe.method.name
        )));
    }
    Ok(source.mesh.moved(|x| normalisation.apply(x)))
}

/// What a checkpoint holds.
///
/// # Errors
/// If it is damaged, and what [`learned`] refuses.
pub(super) fn load(
    checkpoint: &Checkpoint,
    recipe: &Recipe,
    engine: &dyn Engine,
) -> Result<Learned> {
    let state = &checkpoint.state;
    let trainer = restored(checkpoint, recipe, engine)?;
    let frame = Frame {
        coordinates: state.coordinates(),
        bounds: state.bounds,
    };
    learned(trainer.deformation(), recipe, frame)
}

/// A method as a checkpoint holds it.
///
/// # Errors
/// If it is damaged, or the method is not compiled for the backend.
pub(super) fn restored(
    checkpoint: &Checkpoint,
    recipe: &Recipe,
    engine: &dyn Engine,
) -> Result<Box<dyn Trainer>> {
    let mut trainer: Box<dyn Trainer> = if is_solved(recipe) {
        Box::new(Solved::unset())
    } else {
        engine.method(recipe, &checkpoint.state.bounds)?
    };
    let restored = trainer.restore(&checkpoint.records()?);
    restored.map_err(|error| checkpoint.damaged(error))?;
    Ok(trainer)
}
