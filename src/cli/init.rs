//! `isomorph init`: a recipe for two shapes, with every key explained.

use std::path::PathBuf;

use clap::Args;
use isomorph::recipe::{Correspondences, Preset};
use isomorph::{Recipe, Shape};

use super::{Failure, Result, print};

/// Print a commented recipe for two shapes
///
/// The shapes are read, so that a mistake shows at once. Save the recipe and give it to
/// `isomorph train`.
#[derive(Debug, Args)]
pub(super) struct InitArgs {
    /// The shape at time 0: PLY or OBJ, a mesh or a point cloud
    source: PathBuf,

    /// The shape at time 1
    target: PathBuf,

    /// Known pairs of vertices: a CSV file of source_index,target_index lines, same-vertices, match (found before training), or none
    #[arg(long, value_name = "FILE", default_value = "none")]
    correspondences: String,

    /// The values that keys left out fall back to: quick, default, quality or paper
    #[arg(long, default_value = "default")]
    preset: String,

    /// Print the keys of all methods, each with the methods in which it acts
    #[arg(long)]
    all: bool,
}

pub(super) fn run(args: InitArgs) -> Result {
    for path in [&args.source, &args.target] {
        Shape::read(path)?;
    }
    let preset = Preset::from_word(&args.preset).ok_or_else(|| {
        let allowed = Preset::WORDS.join(", ");
        Failure::Usage(format!(
            "--preset {}: must be one of {allowed}",
            args.preset
        ))
    })?;
    let correspondences = match args.correspondences.as_str() {
        "none" => Correspondences::None,
        "same-vertices" => Correspondences::SameVertices,
        "match" => Correspondences::Match,
        file => Correspondences::File(PathBuf::from(file)),
    };
    let text = Recipe::commented(&args.source, &args.target, &correspondences, preset, args.all);
    print(&text.map_err(isomorph::Error::from)?)
}
