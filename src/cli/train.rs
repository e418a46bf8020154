//! `isomorph train`: from a recipe to a trained run with surfaces in it.

use std::path::{Path, PathBuf};

use clap::Args;
use isomorph::{Recipe, is_run};

use super::new_run::NewRunArgs;
use super::{Failure, Result};

/// Train on the two shapes of a recipe, and write surfaces in between
///
/// The run's folder receives the resolved recipe, metrics and checkpoints. At the end it receives surfaces
/// as PLY files in meshes/, a picture of them, meshes/preview.png, and a page that plays them, report.html. Ctrl-C finishes the present step and
/// writes a checkpoint. `isomorph resume` goes on from it.
#[derive(Debug, Args)]
pub(super) struct TrainArgs {
    /// The recipe, a TOML file; `isomorph init` prints one
    recipe: PathBuf,

    /// Folder of the run [default: runs/FOLDER-NAME of the recipe, such as runs/fox-quick]
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,

    /// Go on with the run if it is there, and do nothing if it is finished; for jobs that may be started again
    #[arg(long, conflicts_with = "force")]
    resume_if_exists: bool,

    #[command(flatten)]
    new: NewRunArgs,
}

pub(super) fn run(args: TrainArgs) -> Result {
    let recipe =
        Recipe::read(&args.recipe, &args.new.set.overrides).map_err(isomorph::Error::from)?;
    let folder = args.run.unwrap_or_else(|| default_run(&args.recipe));
    if args.resume_if_exists {
        let page = args.new.go_on(recipe, &folder)?;
        args.new.open(page.as_deref());
        return Ok(());
    }
    if !args.new.force && is_run(&folder) {
        let folder = folder.display();
        return Err(Failure::Usage(format!(
            "{folder}: exists already; resume it with `isomorph resume {folder}`, choose another with \
             --run, or replace it with --force"
        )));
    }
    let page = args.new.train(recipe, &folder, |session| session, |_| {})?;
    args.new.open(page.as_deref());
    Ok(())
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
