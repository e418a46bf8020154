//! The networks of a run as one file that programs of other languages read: safetensors, with a description of what
//! the arrays are.
//!
//! The description is JSON under the key `isomorph` of the file's metadata. `scripts/read_run.py` evaluates the
//! networks from it, in Python with numpy alone.

use std::collections::HashMap;
use std::path::Path;

use isomorph_training::method::spec_of;
use safetensors::tensor::{Dtype, TensorView, serialize};
use serde_json::{Value, json};

use super::checkpoint::Checkpoint;
use super::folder::RunFolder;
use super::learned::restored;
use crate::atomic::write_atomically;
use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::recipe::{GeometryKind, Recipe};

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exported {
    /// Arrays.
    pub tensors: usize,
    /// Weights in all of them.
    pub weights: usize,
}

/// The form of the description.
const FORMAT: u32 = 1;

/// Writes the networks of a run's newest checkpoint.
///
/// # Errors
/// A folder that is no run, a damaged checkpoint, a method without networks of `f` and `V`, a file that cannot be
/// written.
pub fn export(run: &Path, out: &Path, backend: Backend) -> Result<Exported> {
    let folder = RunFolder::open(run)?;
    let checkpoint = Checkpoint::newest(&folder.checkpoints())?;
    let recipe = checkpoint.recipe()?;
    let trainer = restored(&checkpoint, &recipe, &*backend.open()?)?;
    let weights = trainer.weights().ok_or_else(|| {
        Error::usage(format!(
            "{}: {} has no networks of f and V; train with the preset \"quick\" or \"default\"",
            run.display(),
            spec_of(&recipe).described()
        ))
    })?;
    let bytes: Vec<Vec<u8>> = (weights.tensors.iter())
        .map(|tensor| tensor.values.iter().flat_map(|x| x.to_le_bytes()).collect())
        .collect();
    let views = weights.tensors.iter().zip(&bytes).map(|(tensor, bytes)| {
        let view = TensorView::new(Dtype::F32, tensor.shape.clone(), bytes);
        view.map(|view| (tensor.name.clone(), view))
    });
    let views = views.collect::<std::result::Result<Vec<_>, _>>();
    let description = described(&recipe, &checkpoint, weights.flow_steps).to_string();
    let metadata = HashMap::from([("isomorph".to_owned(), description)]);
    let file = views.and_then(|views| serialize(views, Some(metadata)));
    let file = file.map_err(Error::failure)?;
    write_atomically(out, |to| to.write_all(&file))?;
    Ok(Exported {
        tensors: weights.tensors.len(),
        weights: weights
            .tensors
            .iter()
            .map(|tensor| tensor.values.len())
            .sum(),
    })
}

/// All that it takes to evaluate the networks.
fn described(recipe: &Recipe, checkpoint: &Checkpoint, flow_steps: Option<usize>) -> Value {
    let f = &recipe.implicit;
    let v = &recipe.velocity;
    let state = &checkpoint.state;
    let field = json!({
        "depth": f.depth, "activation": f.activation.to_string(), "beta": f.beta,
        "frequencies": f.frequencies, "skip": f.skip, "sphere_radius": f.sphere_radius,
    });
    let mut networks = json!({"velocity": {
        "depth": v.depth, "activation": v.activation.to_string(), "beta": v.beta,
        "frequencies": v.frequencies, "skip": v.skip, "time_dependent": v.time_dependent,
    }});
    let names: &[&str] = match recipe.implicit.geometry {
        GeometryKind::Flow => &["source", "target"],
        GeometryKind::Network => &["implicit"],
    };
    for name in names {
        networks[*name] = field.clone();
    }
    json!({
        "format": FORMAT,
        "geometry": recipe.implicit.geometry.to_string(),
        "flow_steps": flow_steps,
        "networks": networks,
        "normalisation": {"centre": state.normalisation.centre, "scale": state.normalisation.scale},
        "placements": state.placements,
        "box": {"min": state.bounds.min, "max": state.bounds.max},
        "step": state.step,
    })
}
