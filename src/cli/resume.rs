//! `isomorph resume`: goes on from the newest checkpoint of a run.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::paired;
use super::training::Training;
use super::{BackendArgs, Ending, QuietArgs, SetArgs};
use crate::atomic::write_atomically;
use crate::backend;
use crate::learner;
use crate::learner::checkpoint::{Checkpoint, CheckpointError};
use crate::learner::event::Event;
use crate::recipe::Recipe;
use crate::report::Reporter;
use crate::run_directory::RunDirectory;

/// Go on with a run that was interrupted, or train it for longer
///
/// The run goes on from its newest checkpoint, on any backend, and ends in the same networks as if it
/// had never stopped. Other keys than those of the networks may be changed with --set, or in the run's
/// recipe.toml: more steps, for one.
#[derive(Debug, Args)]
pub(super) struct ResumeArgs {
    /// Folder of the run
    run: PathBuf,

    #[command(flatten)]
    set: SetArgs,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    quiet: QuietArgs,
}

pub(super) fn run(args: ResumeArgs) -> Result<Ending> {
    let run = RunDirectory::open(&args.run)?;
    let recipe = Recipe::read(&run.recipe(), &args.set.overrides)?;
    let checkpoint = match Checkpoint::newest(&run.checkpoints()) {
        Ok(checkpoint) => Some(checkpoint),
        // Stopped before its first checkpoint: it starts again, with the same seed.
        Err(CheckpointError::None(_)) => None,
        Err(damaged) => return Err(damaged.into()),
    };
    let changes = match &checkpoint {
        Some(checkpoint) => checkpoint.recipe()?.changes(&recipe),
        None => Vec::new(),
    };
    backend::check(args.place.backend, args.place.device.as_deref())?;
    let prepared = paired::prepare(&recipe, Some(&run.pairs()), args.quiet.verbosity())?;
    let pair = &prepared.pair;
    if let Some(checkpoint) = &checkpoint {
        // Before anything is written: what is refused leaves the run as it was.
        learner::fits(checkpoint, &recipe, pair)?;
    }
    let step = checkpoint
        .as_ref()
        .map_or(0, |checkpoint| checkpoint.state.step);
    let mut reporter = Reporter::new(&run, Some(step), args.quiet.verbosity())?;
    if let Some(matched) = prepared.keep(&run)? {
        reporter.handle(&matched)?;
    }
    if checkpoint.is_none() {
        let note = "no checkpoint yet: the run starts again from its first step";
        reporter.handle(&Event::Note(note.to_owned()))?;
    }
    for change in changes {
        reporter.handle(&Event::Note(format!(
            "changed since the checkpoint: {change}"
        )))?;
    }
    if !args.set.overrides.is_empty() {
        let text = recipe.to_toml();
        write_atomically(&run.recipe(), |out| out.write_all(text.as_bytes()))?;
    }
    Training {
        recipe,
        pair: prepared.pair,
        run,
        checkpoint,
        reporter,
    }
    .start(&args.place)
}
