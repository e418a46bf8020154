//! `isomorph train`: from a recipe to a trained run with surfaces in it.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;

use super::paired;
use super::trained;
use super::training::Training;
use super::{BackendArgs, Ending, QuietArgs, SetArgs};
use crate::backend;
use crate::learner::event::Event;
use crate::recipe::Recipe;
use crate::report::Reporter;
use crate::run_directory::RunDirectory;

/// Train on the two shapes of a recipe, and write a few surfaces in between
///
/// The run's folder receives the resolved recipe, metrics, checkpoints, and at the end surfaces as PLY
/// files (meshes/) with a picture of them (meshes/preview.png). Ctrl-C stops after the present step and
/// leaves a checkpoint; `isomorph resume` goes on from it.
#[derive(Debug, Args)]
pub(super) struct TrainArgs {
    /// The recipe, a TOML file; `isomorph init` writes one
    recipe: PathBuf,

    /// Folder of the run [default: runs/ and the recipe's folder and name, as in runs/fox-quick]
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,

    /// Replace the run if there is one already
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    set: SetArgs,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    quiet: QuietArgs,
}

pub(super) fn run(args: TrainArgs) -> Result<Ending> {
    let recipe = Recipe::read(&args.recipe, &args.set.overrides)?;
    // Before the run's folder exists: what cannot be read or opened leaves nothing behind.
    backend::check(args.place.backend, args.place.device.as_deref())?;
    let prepared = paired::prepare(&recipe, None, args.quiet.verbosity())?;
    trained::check(&recipe, &prepared.pair)?;
    let path = args.run.unwrap_or_else(|| default_run(&args.recipe));
    let run = RunDirectory::create(&path, &recipe.to_toml(), args.force)?;
    let mut reporter = Reporter::new(&run, None, args.quiet.verbosity())?;
    if let Some(matched) = prepared.keep(&run)? {
        reporter.handle(&matched)?;
    }
    let pair = prepared.pair;
    for note in &pair.notes {
        reporter.handle(&Event::Note(note.clone()))?;
    }
    let training = Training {
        recipe,
        pair,
        run,
        checkpoint: None,
        reporter,
    };
    training.start(&args.place)
}

/// `runs/` and the names of the recipe's folder and of the recipe: `data/fox/quick.toml` trains into
/// `runs/fox-quick`.
fn default_run(recipe: &Path) -> PathBuf {
    let name =
        |part: Option<&std::ffi::OsStr>| part.map(|text| text.to_string_lossy().into_owned());
    let whole = std::path::absolute(recipe).unwrap_or_else(|_| recipe.to_path_buf());
    let parts = [
        name(whole.parent().and_then(Path::file_name)),
        name(whole.file_stem()),
    ];
    Path::new("runs").join(parts.into_iter().flatten().collect::<Vec<_>>().join("-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_named_after_its_recipe() {
        assert_eq!(
            default_run(Path::new("data/fox/quick.toml")),
            Path::new("runs/fox-quick")
        );
    }
}
