//! `isomorph self-test`: whether a GPU computes what a processor does.

use std::path::PathBuf;

use clap::Args;
use clap::builder::PossibleValuesParser;
use isomorph::benchmark::self_test;
use isomorph::recipe::RecipeError;
use isomorph::{Backend, Recipe};

use super::{BackendArgs, Failure, Result, SetArgs, print};

/// Compare a GPU with a processor: products, activations, sums and gradients in the shapes of a run
///
/// Some drivers give wrong matrix products. Training on wgpu starts with the same test. Exit status 1 if the
/// device computes wrong numbers.
#[derive(Debug, Args)]
pub(super) struct SelfTestArgs {
    /// The recipe whose networks and points are taken
    recipe: Option<PathBuf>,

    /// Take those of a preset
    #[arg(
        long,
        value_name = "NAME",
        default_value = "quick",
        conflicts_with = "recipe"
    )]
    preset: String,

    #[command(flatten)]
    set: SetArgs,

    /// Print JSON
    #[arg(long)]
    json: bool,

    /// Backend that is compared
    #[arg(long, default_value = "wgpu", value_parser = PossibleValuesParser::new(Backend::NAMES))]
    backend: String,

    /// Device of the backend wgpu: default, cpu, discrete[:N], integrated[:N] or virtual[:N]
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
}

pub(super) fn run(args: SelfTestArgs) -> Result {
    let recipe = recipe(&args).map_err(isomorph::Error::from)?;
    let place = BackendArgs {
        backend: args.backend,
        device: args.device,
    };
    let backend = place.backend()?;
    let test = self_test(&backend, &recipe)?;
    match args.json {
        true => print(&(serde_json::to_string(&test)? + "\n"))?,
        false => print(&test.to_string())?,
    }
    match test.wrong() {
        Some(_) => Err(Failure::WrongNumbers(test.device)),
        None => Ok(()),
    }
}

/// The recipe, or the preset with two shapes that are never read.
fn recipe(args: &SelfTestArgs) -> std::result::Result<Recipe, RecipeError> {
    let overrides = &args.set.overrides;
    if let Some(path) = &args.recipe {
        return Recipe::read(path, overrides);
    }
    let mut recipe = Recipe::between("source", "target")?;
    recipe.with(&format!("preset={}", args.preset))?;
    recipe.with_all(overrides)?;
    Ok(recipe)
}
