//! What a run has learned as one file that programs of other languages read: safetensors, with a description of what
//! the arrays are. Networks, or splines and the shapes that they carry.
//!
//! The description is JSON under the key `isomorph` of the file's metadata. `scripts/read_run.py` evaluates
//! f and V from it, in Python with numpy alone.

use std::collections::HashMap;
use std::path::Path;

use isomorph_training::method::spline::is_solved;
use isomorph_training::method::{self, spec_of};
use isomorph_training::weights::{IntervalWeights, Weights};
use safetensors::tensor::{Dtype, TensorView, serialize};
use serde_json::{Value, json};

use super::checkpoint::Checkpoint;
use super::clock::Clock;
use super::folder::RunFolder;
use super::learned::restored;
use crate::atomic::write_atomically;
use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::recipe::{GeometryKind, Recipe};
use crate::solved::arrays;

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

/// Writes what a run's newest checkpoint has learned: the networks, or the splines and the shapes that they carry.
///
/// # Errors
/// A folder that is no run, a damaged checkpoint, a method without networks of `f` and `V`, a file that cannot be
/// written.
pub fn export(run: &Path, out: &Path, backend: Backend) -> Result<Exported> {
    let folder = RunFolder::open(run)?;
    let checkpoint = Checkpoint::newest(&folder.checkpoints())?;
    let recipe = checkpoint.recipe()?;
    let arrays = match is_solved(&recipe) {
        true => splines(&recipe, &checkpoint)?,
        false => networks(run, &recipe, &checkpoint, backend)?,
    };
    let views = arrays.parts.iter().map(|part| {
        let view = TensorView::new(part.kind, part.sides.clone(), &part.bytes);
        view.map(|view| (part.name.clone(), view))
    });
    let views = views.collect::<std::result::Result<Vec<_>, _>>();
    let metadata = HashMap::from([("isomorph".to_owned(), arrays.about.to_string())]);
    let file = views.and_then(|views| serialize(views, Some(metadata)));
    let file = file.map_err(Error::failure)?;
    write_atomically(out, |to| to.write_all(&file))?;
    let numbers = |part: &Part| part.sides.iter().product::<usize>();
    Ok(Exported {
        tensors: arrays.parts.len(),
        weights: arrays.parts.iter().map(numbers).sum(),
    })
}

/// An array of a file.
struct Part {
    name: String,
    kind: Dtype,
    sides: Vec<usize>,
    bytes: Vec<u8>,
}

impl Part {
    fn floats(name: String, sides: Vec<usize>, values: &[f32]) -> Self {
        Self {
            name,
            kind: Dtype::F32,
            sides,
            bytes: values.iter().flat_map(|x| x.to_le_bytes()).collect(),
        }
    }
}

/// All of a file.
struct Arrays {
    parts: Vec<Part>,
    about: Value,
}

/// The networks of `f` and `V`.
fn networks(
    run: &Path,
    recipe: &Recipe,
    checkpoint: &Checkpoint,
    backend: Backend,
) -> Result<Arrays> {
    let trainer = restored(checkpoint, recipe, &*backend.open()?)?;
    let weights = trainer.weights().ok_or_else(|| {
        Error::usage(format!(
            "{}: {} has no networks of f and V; train with the preset \"quick\" or \"default\"",
            run.display(),
            spec_of(recipe).described()
        ))
    })?;
    let about = described(recipe, checkpoint, &weights);
    let parts = weights.tensors.into_iter();
    Ok(Arrays {
        parts: parts
            .map(|tensor| Part::floats(tensor.name, tensor.shape, &tensor.values))
            .collect(),
        about,
    })
}

/// The splines of `V`, and the closed meshes whose signed distances `f` is made of.
fn splines(recipe: &Recipe, checkpoint: &Checkpoint) -> Result<Arrays> {
    let found = arrays(&checkpoint.records()?).map_err(|error| checkpoint.damaged(error))?;
    let floats = found.floats.into_iter();
    let mut parts: Vec<Part> = floats
        .map(|(name, sides, values)| Part::floats(name, sides, &values))
        .collect();
    parts.extend(found.indices.into_iter().map(|(name, sides, values)| Part {
        name,
        kind: Dtype::U32,
        sides,
        bytes: values.iter().flat_map(|x| x.to_le_bytes()).collect(),
    }));
    let mut about = frame(recipe, checkpoint);
    about["geometry"] = json!("splines");
    about["splines"] = found.about;
    Ok(Arrays { parts, about })
}

/// The frame of the shapes in space and time.
fn frame(recipe: &Recipe, checkpoint: &Checkpoint) -> Value {
    let state = &checkpoint.state;
    json!({
        "format": FORMAT,
        "normalisation": {"centre": state.normalisation.centre, "scale": state.normalisation.scale},
        "placements": state.placements,
        "clock": Clock::of(recipe).span(),
        "box": {"min": state.bounds.min, "max": state.bounds.max},
        "step": state.step,
    })
}

/// All that it takes to evaluate the networks.
fn described(recipe: &Recipe, checkpoint: &Checkpoint, weights: &Weights) -> Value {
    let f = &recipe.implicit;
    let v = &recipe.velocity;
    let field = json!({
        "depth": f.depth, "activation": f.activation.to_string(), "beta": f.beta,
        "frequencies": f.frequencies, "skip": f.skip, "sphere_radius": f.sphere_radius,
    });
    let velocity = match weights.grid {
        // `coefficients` are `[nodes, 3 K]`, of the polynomials 1 and 2 t - 1, K of them.
        Some(grid) => json!({
            "lower": grid.lower, "spacing": grid.spacing, "cells": grid.cells,
            "nodes": grid.nodes(),
        }),
        None => json!({
            "depth": v.depth, "activation": v.activation.to_string(), "beta": v.beta,
            "frequencies": v.frequencies, "skip": v.skip, "time_dependent": v.time_dependent,
        }),
    };
    let mut networks = json!({ "velocity": velocity });
    let of = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let geometry = match method::has_end_fields(recipe) {
        true => GeometryKind::Flow,
        false => GeometryKind::Network,
    };
    let names: Vec<String> = match (geometry, recipe.data.keyframes.len()) {
        (GeometryKind::Network, _) => of(&["implicit"]),
        (GeometryKind::Flow, 2) => of(&["source", "target"]),
        (GeometryKind::Flow, keys) => (0..keys).map(|k| format!("end.{k:04}")).collect(),
    };
    for name in names {
        networks[name] = field.clone();
    }
    let mut about = frame(recipe, checkpoint);
    about["geometry"] = json!(geometry.to_string());
    about["flow_steps"] = json!(weights.flow_steps);
    if !weights.intervals.is_empty() {
        let interval = |of: &IntervalWeights| {
            let [from, to] = of.ends;
            json!({"from": from, "to": to, "time_functions": of.functions, "steps": of.steps})
        };
        about["intervals"] = weights.intervals.iter().map(interval).collect();
    }
    about["networks"] = networks;
    about
}
