//! One method on one pair of a comparison: trained, or its training gone on with, and measured.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use anyhow::Result;
use isomorph_model::TrainBackend;

use super::candidate::{Ruler, measure};
use super::trained;
use crate::backend::Task;
use crate::compare::Network;
use crate::evaluate::{Evaluation, Reference};
use crate::learner::checkpoint::{Checkpoint, CheckpointError};
use crate::learner::{Learner, Outcome};
use crate::recipe::Recipe;
use crate::report::Reporter;
use crate::run_directory::RunDirectory;
use crate::shape::{Normalisation, Pair};

/// The pairs that a run made with this recipe has found, if it is there to be gone on with.
pub(super) fn stored_pairs(path: &Path, recipe: &Recipe) -> Option<PathBuf> {
    let run = RunDirectory::open(path).ok()?;
    let same = Recipe::read(&run.recipe(), &[]).is_ok_and(|before| before == *recipe);
    same.then(|| run.pairs())
}

/// The run in a folder if it was made with this recipe, with its newest checkpoint; else a new one.
pub(super) fn open_or_create(
    path: &Path,
    recipe: &Recipe,
) -> Result<(RunDirectory, Option<Checkpoint>)> {
    if let Ok(run) = RunDirectory::open(path)
        && Recipe::read(&run.recipe(), &[]).is_ok_and(|before| before == *recipe)
    {
        match Checkpoint::newest(&run.checkpoints()) {
            Ok(checkpoint) => return Ok((run, Some(checkpoint))),
            Err(CheckpointError::None(_)) => return Ok((run, None)),
            // Damaged: the run starts again.
            Err(_) => {}
        }
    }
    Ok((RunDirectory::create(path, &recipe.to_toml(), true)?, None))
}

/// What came out of one method on one pair.
pub(super) struct Made {
    pub recipe: Recipe,
    pub networks: Vec<Network>,
    pub training_seconds: f64,
    pub evaluation_seconds: f64,
    pub evaluation: Evaluation,
}

/// One method on one pair, on whichever backend.
pub(super) struct Compared {
    pub recipe: Recipe,
    pub shapes: Pair,
    pub run: RunDirectory,
    pub checkpoint: Option<Checkpoint>,
    pub reporter: Reporter,
    pub reference: Arc<Reference>,
    pub normalisation: Normalisation,
    pub resolution: usize,
    pub stop: Arc<AtomicBool>,
}

impl Task for Compared {
    type Output = Result<Option<Made>>;

    fn run<B: TrainBackend>(mut self, device: B::Device) -> Self::Output {
        let frame = trained::Frame {
            normalisation: self.shapes.normalisation,
            bounds: self.shapes.bounds,
        };
        let (recipe, shapes) = (self.recipe.clone(), self.shapes);
        let mut learner = match &self.checkpoint {
            None => Learner::<B>::new(recipe, shapes, device.clone())?,
            Some(checkpoint) => Learner::resume(recipe, shapes, device.clone(), checkpoint)?,
        };
        let mut emit = |event| self.reporter.handle(&event);
        let outcome = learner.run(&self.run.checkpoints(), &self.stop, &mut emit)?;
        if outcome == Outcome::Interrupted {
            return Ok(None);
        }
        let clock = Instant::now();
        let trained = trained::trained(learner.method(), &self.recipe, frame, device)?;
        let ruler = Ruler {
            reference: &self.reference,
            normalisation: self.normalisation,
            resolution: self.resolution,
            stop: &self.stop,
        };
        let found = measure(&trained, &ruler)?;
        let networks = learner.method().networks().into_iter();
        Ok(found.map(|evaluation| Made {
            networks: networks
                .map(|(name, parameters)| Network {
                    name: name.to_owned(),
                    parameters,
                })
                .collect(),
            training_seconds: learner.seconds(),
            evaluation_seconds: clock.elapsed().as_secs_f64(),
            recipe: self.recipe,
            evaluation,
        }))
    }
}
