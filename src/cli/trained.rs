//! From a method that was trained to surfaces and motion, whatever the method.

use anyhow::Result;
use isomorph_model::TrainBackend;

use super::Usage;
use crate::geometry::Mesh;
use crate::learner::checkpoint::Checkpoint;
use crate::learner::method::{self, Method};
use crate::recipe::{MethodName, Recipe};
use crate::shape::{self, Bounds, Normalisation, Pair};
use crate::surface::trained::{Surface, Trained};

/// The frame of a pair of shapes: where the user's coordinates lie in the networks'.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub normalisation: Normalisation,
    pub bounds: Bounds,
}

/// What a method has learnt so far.
///
/// # Errors
/// If the method has no surface of its own and the source is not a mesh that could be carried.
pub(super) fn trained<B: TrainBackend>(
    method: &dyn Method<B>,
    recipe: &Recipe,
    frame: Frame,
    device: B::Device,
) -> Result<Trained<B::InnerBackend>> {
    let shape = match method.geometry() {
        Some(geometry) => Surface::Field(geometry),
        None => Surface::Template(template(recipe, &frame.normalisation)?),
    };
    Ok(Trained {
        shape,
        motion: method.motion(),
        normalisation: frame.normalisation,
        bounds: frame.bounds.padded(recipe.training.box_margin as f32),
        smallest_component: recipe.result.smallest_component,
        device,
    })
}

/// Whether a pair has what the recipe's method needs, to be asked before there is a run.
///
/// # Errors
/// A [`Usage`] that says what is missing and what to do.
pub(super) fn check(recipe: &Recipe, pair: &Pair) -> Result<()> {
    method::check(recipe, pair).map_err(Usage)?;
    if matches!(
        recipe.method.name,
        MethodName::Eigenbasis | MethodName::Nfgp
    ) {
        template(recipe, &pair.normalisation)?;
    }
    Ok(())
}

/// The source's own mesh, normalised.
fn template(recipe: &Recipe, normalisation: &Normalisation) -> Result<Mesh<f32>> {
    let source = shape::read(&recipe.data.source)?;
    if !source.is_mesh() {
        let text = format!(
            "{}: a point cloud: the method {} gives no surface of its own and carries the source's \
             mesh; give a mesh, or choose another method.name",
            source.path.display(),
            recipe.method.name
        );
        return Err(Usage(text).into());
    }
    Ok(source.mesh.moved(|vertex| normalisation.apply(vertex)))
}

/// What a checkpoint holds.
///
/// # Errors
/// If it is damaged, and what [`trained`] refuses.
pub(super) fn load<B: TrainBackend>(
    checkpoint: &Checkpoint,
    recipe: &Recipe,
    device: B::Device,
) -> Result<Trained<B::InnerBackend>> {
    let state = &checkpoint.state;
    let mut method = method::build::<B>(recipe, &state.bounds, &device);
    method.restore(checkpoint)?;
    let frame = Frame {
        normalisation: state.normalisation,
        bounds: state.bounds,
    };
    trained(&*method, recipe, frame, device)
}
