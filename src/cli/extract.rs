//! `isomorph extract`: surfaces of a trained run at any times and resolution.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use isomorph::{ExtractOptions, SurfaceFormat, Trained, even_times};

use super::{BackendArgs, QuietArgs, Result, print, stop_on_interrupt};

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

pub(super) fn run(args: ExtractArgs) -> Result {
    let trained = Trained::open(&args.run, args.place.backend()?)?;
    let defaults = ExtractOptions::of(trained.recipe());
    let options = ExtractOptions {
        times: if args.times.is_empty() {
            even_times(args.frames as usize)
        } else {
            args.times
        },
        resolution: args
            .resolution
            .map_or(defaults.resolution, |cells| cells as usize),
        format: match args.format {
            Format::Ply => SurfaceFormat::Ply,
            Format::Obj => SurfaceFormat::Obj,
        },
        carry: args.carry,
        smallest_component: args
            .smallest_component
            .unwrap_or(defaults.smallest_component),
        folder: args.output,
    };
    let mut terminal = args.quiet.terminal(&args.run);
    let stop = stop_on_interrupt();
    let listing = trained.extract(&options, &stop, |event| terminal.show(event))?;
    print(&format!("{}\n", listing.display()))
}
