//! `isomorph init`: a recipe for two shapes, with every key explained.

use std::path::PathBuf;

use clap::Args;
use isomorph::correspondence::known_pairs;
use isomorph::recipe::{Correspondences, Preset};
use isomorph::{Recipe, Shape};

use super::{Failure, Result, print};

/// Print a commented recipe for two shapes
///
/// The shapes and the pairs are read, so that what is wrong with a file is reported at once. The ten keys that people change stand
/// first. The other keys of the chosen method follow. Save the recipe as a file and train with
/// `isomorph train FILE`.
#[derive(Debug, Args)]
pub(super) struct InitArgs {
    /// Shape at time 0, a mesh or point cloud: PLY, OBJ, STL, OFF, glTF, NPY or text
    source: PathBuf,

    /// Shape at time 1
    target: PathBuf,

    /// Corresponding vertices: a file with source_index,target_index on each line, same-vertices, match
    /// (found before training), or none
    #[arg(long, value_name = "FILE", default_value = "none")]
    correspondences: String,

    /// Values of all other keys: instant, quick, default, quality or paper
    #[arg(long, default_value = "default")]
    preset: String,

    /// Print the keys of all methods, each with the methods in which it acts
    #[arg(long)]
    all: bool,
}

pub(super) fn run(args: InitArgs) -> Result {
    let (source, target) = (Shape::read(&args.source)?, Shape::read(&args.target)?);
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
        file => {
            let file = PathBuf::from(file);
            known_pairs(&file, &source, &target)?;
            Correspondences::File(file)
        }
    };
    let text = Recipe::commented(
        &args.source,
        &args.target,
        &correspondences,
        preset,
        args.all,
    );
    print(&text.map_err(isomorph::Error::from)?)
}
