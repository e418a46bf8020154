//! One method on one pair of a comparison: trained, or its training gone on with, and measured.

use std::path::Path;
use std::time::Instant;

use isomorph_training::engine::Engine;

use super::checkpoint::{Checkpoint, CheckpointError};
use super::folder::RunFolder;
use super::learned::{self, Frame};
use super::learner::{Learner, Outcome};
use super::lock::RunLock;
use super::log::RunLog;
use super::measure::{Ruler, measure};
use super::prepare::Prepared;
use crate::compare::Network;
use crate::error::{Error, Result};
use crate::evaluate::Evaluation;
use crate::event::Event;
use crate::recipe::Recipe;

/// A run made with this recipe, if it is there to be gone on with.
pub(super) fn stored(path: &Path, recipe: &Recipe) -> Option<RunFolder> {
    let run = RunFolder::open(path).ok()?;
    is_of(&run, recipe).then_some(run)
}

fn is_of(run: &RunFolder, recipe: &Recipe) -> bool {
    run.stored_recipe()
        .is_ok_and(|(before, _)| before == *recipe)
}

/// The run in a folder if it was made with this recipe, with its newest checkpoint; else a new one. No other process
/// trains in it.
fn open_or_create(
    path: &Path,
    recipe: &Recipe,
) -> Result<(RunFolder, RunLock, Option<Checkpoint>)> {
    if let Ok(run) = RunFolder::open(path)
        && is_of(&run, recipe)
    {
        let lock = run.lock()?;
        match Checkpoint::newest(&run.checkpoints()) {
            Ok(checkpoint) => return Ok((run, lock, Some(checkpoint))),
            Err(CheckpointError::None(_)) => return Ok((run, lock, None)),
            // Damaged: the run starts again.
            Err(_) => {}
        }
    }
    let (run, lock) = RunFolder::create(path, &recipe.to_toml(), true)?;
    Ok((run, lock, None))
}

/// What came out of one method on one pair.
pub(super) struct Made {
    pub networks: Vec<Network>,
    pub training_seconds: f64,
    pub evaluation_seconds: f64,
    pub evaluation: Evaluation,
}

/// Trains a method, or goes on with its training, and measures it.
///
/// # Errors
/// Of kind [`Interruption`](crate::ErrorKind::Interruption) if it was stopped; else what keeps the method
/// from being trained or measured.
pub(super) fn make(
    path: &Path,
    recipe: &Recipe,
    prepared: &Prepared,
    engine: &dyn Engine,
    ruler: &Ruler,
    on_event: &mut dyn FnMut(&Event),
) -> Result<Made> {
    let (run, _lock, checkpoint) = open_or_create(path, recipe)?;
    let step = checkpoint.as_ref().map(|found| found.state.step);
    let mut log = RunLog::open(run.path(), step)?;
    let keyframes = &prepared.keyframes;
    for matched in prepared.keep(&run)? {
        on_event(&matched);
        log.record(&matched)?;
    }
    let mut learner = match &checkpoint {
        None => Learner::new(recipe.clone(), keyframes, engine)?,
        Some(checkpoint) => Learner::resume(recipe.clone(), keyframes, engine, checkpoint)?,
    };
    let mut emit = |event: Event| {
        on_event(&event);
        log.record(&event)
    };
    let outcome = learner.run(&run.checkpoints(), ruler.stop.flag(), &mut emit)?;
    if outcome == Outcome::Interrupted {
        return Err(Error::interruption("stopped while training"));
    }
    let clock = Instant::now();
    let frame = Frame {
        coordinates: keyframes.coordinates(),
        bounds: keyframes.bounds,
    };
    let learned = learned::learned(learner.trainer().deformation(), recipe, frame)?;
    let evaluation = measure(&learned, ruler, on_event)?;
    let networks = learner.trainer().networks().into_iter();
    Ok(Made {
        networks: networks
            .map(|(name, parameters)| Network {
                name: name.to_owned(),
                parameters,
            })
            .collect(),
        training_seconds: learner.seconds(),
        evaluation_seconds: clock.elapsed().as_secs_f64(),
        evaluation,
    })
}
