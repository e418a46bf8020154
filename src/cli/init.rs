//! `isomorph init`: a recipe for two shapes or more, with every key explained.

use std::path::PathBuf;

use clap::Args;
use isomorph::correspondence::known_pairs;
use isomorph::recipe::{Correspondences, Preset};
use isomorph::{Recipe, Shape};

use super::{Failure, Result, print};

/// Print a commented recipe for two shapes, or for three and more key frames
///
/// The shapes and the pairs are read, so that what is wrong with a file is reported at once. The ten keys that people change stand
/// first. The other keys of the chosen method follow. Save the recipe as a file and train with
/// `isomorph train FILE`.
#[derive(Debug, Args)]
pub(super) struct InitArgs {
    /// Shape at time 0, a mesh or point cloud: PLY, OBJ, STL, OFF, glTF, NPY or text
    source: PathBuf,

    /// Shape at time 1; and further shapes, at the times 2, 3 and so on, which the recipe can change
    #[arg(required = true)]
    target: Vec<PathBuf>,

    /// Corresponding vertices: a file with source_index,target_index on each line, same-vertices, match
    /// (found before training), or none
    #[arg(long, value_name = "FILE", default_value = "none")]
    correspondences: String,

    /// Values of all other keys: instant, quick, default, quality or paper [default: default; instant for three shapes
    /// and more]
    #[arg(long)]
    preset: Option<String>,

    /// Print the keys of all methods, each with the methods in which it acts
    #[arg(long)]
    all: bool,
}

pub(super) fn run(args: InitArgs) -> Result {
    let files: Vec<PathBuf> = [args.source].into_iter().chain(args.target).collect();
    let shapes: Vec<Shape> = files
        .iter()
        .map(Shape::read)
        .collect::<isomorph::Result<_>>()?;
    let is_pair = files.len() == 2;
    let usual = if is_pair { "default" } else { "instant" };
    let word = args.preset.as_deref().unwrap_or(usual);
    let preset = Preset::from_word(word).ok_or_else(|| {
        let allowed = Preset::WORDS.join(", ");
        Failure::Usage(format!("--preset {word}: must be one of {allowed}"))
    })?;
    if !is_pair && preset == Preset::Paper {
        let count = files.len();
        return Err(Failure::Usage(format!(
            "--preset {word}: it takes two shapes, not {count}; give --preset instant, quick or default"
        )));
    }
    let correspondences = match args.correspondences.as_str() {
        "none" => Correspondences::None,
        "same-vertices" => Correspondences::SameVertices,
        "match" => Correspondences::Match,
        file => {
            let file = PathBuf::from(file);
            known_pairs(&file, &shapes)?;
            Correspondences::File(file)
        }
    };
    let text = Recipe::commented(&files, &correspondences, preset, args.all);
    print(&text.map_err(isomorph::Error::from)?)
}
