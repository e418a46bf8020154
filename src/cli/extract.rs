//! `isomorph extract`: surfaces of a trained run at any times and resolution.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use isomorph_model::TrainBackend;

use super::trained;
use super::training::write_and_show;
use super::{BackendArgs, Ending, QuietArgs, Usage, even_times, stop_on_interrupt};
use crate::backend::{self, Task};
use crate::formats::SurfaceFormat;
use crate::learner::checkpoint::Checkpoint;
use crate::recipe::Recipe;
use crate::report::Reporter;
use crate::run_directory::RunDirectory;
use crate::surface::frames::FrameOptions;

/// Write the surfaces of a trained run at any times, in any resolution
///
/// The surfaces are in the coordinates of the input, with normals, and open in MeshLab, Blender and most
/// viewers; frames.json lists them and preview.png shows them side by side.
#[derive(Debug, Args)]
pub(super) struct ExtractArgs {
    /// Folder of the run
    run: PathBuf,

    /// How many surfaces, at even times from 0 to 1
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,

    /// The times themselves, 0 to 1, as in 0.25,0.5
    #[arg(
        long,
        value_name = "A,B,C",
        value_delimiter = ',',
        conflicts_with = "frames"
    )]
    times: Vec<f64>,

    /// Cells along the longest side of the box, 8 to 2048 [default: as in the recipe]
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(8..=2048))]
    resolution: Option<u32>,

    /// Kind of the files
    #[arg(long, value_enum, default_value_t = Format::Ply)]
    format: Format,

    /// Also carry the source's own vertices along the velocity field (faces, colours and texture
    /// coordinates kept)
    #[arg(long)]
    carry: bool,

    /// Leave out pieces with less than this share of a surface's area; 0 keeps every piece [default: as
    /// in the recipe]
    #[arg(long, value_name = "SHARE")]
    smallest_component: Option<f64>,

    /// Folder for the files [default: meshes/ in the run]
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    quiet: QuietArgs,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// Binary PLY with normals
    Ply,
    /// Wavefront OBJ with normals
    Obj,
}

pub(super) fn run(args: ExtractArgs) -> Result<Ending> {
    let run = RunDirectory::open(&args.run)?;
    let checkpoint = Checkpoint::newest(&run.checkpoints())?;
    let times = if args.times.is_empty() {
        even_times(args.frames as usize)
    } else {
        args.times.clone()
    };
    if let Some(time) = times.iter().find(|time| !(0.0..=1.0).contains(*time)) {
        return Err(Usage(format!("--times: {time}: must be 0 to 1 (0 is the source)")).into());
    }
    let mut recipe = checkpoint.recipe()?;
    if let Some(share) = args.smallest_component {
        if !(0.0..=1.0).contains(&share) {
            return Err(Usage(format!("--smallest-component: {share}: must be 0 to 1")).into());
        }
        recipe.result.smallest_component = share;
    }
    let options = FrameOptions {
        times,
        resolution: args
            .resolution
            .map_or(recipe.result.resolution, |cells| cells as usize),
        format: match args.format {
            Format::Ply => SurfaceFormat::Ply,
            Format::Obj => SurfaceFormat::Obj,
        },
        carry: args.carry.then(|| recipe.data.source.clone()),
        folder: args.output.clone().unwrap_or_else(|| run.meshes()),
    };
    let reporter = Reporter::new(&run, Some(usize::MAX), args.quiet.verbosity())?;
    let place = args.place.clone();
    let task = Extract {
        checkpoint,
        recipe,
        options,
        reporter,
    };
    backend::run(place.backend, place.device.as_deref(), task)?
}

struct Extract {
    checkpoint: Checkpoint,
    recipe: Recipe,
    options: FrameOptions,
    reporter: Reporter,
}

impl Task for Extract {
    type Output = Result<Ending>;

    fn run<B: TrainBackend>(mut self, device: B::Device) -> Self::Output {
        let trained = trained::load::<B>(&self.checkpoint, &self.recipe, device)?;
        let stop = stop_on_interrupt()?;
        let ending = write_and_show(&trained, &self.options, &stop, &mut self.reporter)?;
        if ending == Ending::Done {
            println!("{}", self.options.folder.join("frames.json").display());
        }
        Ok(ending)
    }
}
