//! `isomorph extract`: surfaces of a trained run at any times and resolution.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use isomorph::{Ease, ExtractOptions, OutputFormat, Precision, SurfaceFormat, Trained};

use super::times::times_of;
use super::{BackendArgs, Failure, ProgressArgs, Result, print, stop_on_interrupt};

/// Write surfaces of a trained run, at any times and in any resolution
///
/// The surfaces have normals and are in the coordinates of the input. They open in MeshLab, Blender and most
/// viewers. With --format glb they are one animation that Blender and browsers play. frames.json lists them with their quality measures. preview.png shows them side by side.
#[derive(Debug, Args)]
pub(super) struct ExtractArgs {
    /// Folder of the run
    run: PathBuf,

    /// Number of surfaces, at even times from the first shape to the last
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,

    /// Times instead of --frames, such as 0.25,0.5: from 0 to 1, or in the unit of the recipe's key frames.
    /// keys: those of all key frames
    #[arg(
        long,
        value_name = "A,B,C",
        value_delimiter = ',',
        allow_hyphen_values = true,
        conflicts_with = "frames"
    )]
    times: Vec<String>,

    /// Instead of --frames: surfaces for each second of the animation
    #[arg(long, value_name = "F", conflicts_with_all = ["frames", "times"], value_parser = clap::value_parser!(u32).range(1..=1000))]
    fps: Option<u32>,

    /// How long the animation is [default: 2 seconds, or a second from each of more shapes to the next]
    #[arg(long, value_name = "S", conflicts_with = "times")]
    seconds: Option<f64>,

    /// How the animation runs through the motion: linear, smooth (from rest to rest), or a file of moments and the
    /// time of the motion at each, two numbers on each line
    #[arg(
        long,
        value_name = "EASE",
        default_value = "linear",
        conflicts_with = "times"
    )]
    ease: String,

    /// Grid cells along the longest side of the box, 8 to 2048 [default: result.resolution]
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(8..=2048))]
    resolution: Option<u32>,

    /// File format
    #[arg(long, value_enum, default_value_t = Format::Ply)]
    format: Format,

    /// With --format glb: positions as 16-bit integers. Half of the size, but fewer programs read it
    #[arg(long)]
    compact: bool,

    /// Also write the source file with its vertices moved to each time; faces, colours and texture
    /// coordinates are kept. Formats other than PLY and OBJ are written as PLY, geometry alone
    #[arg(long)]
    carry: bool,

    /// With --carry: the key frame whose vertices are moved, counted from 0 (the source)
    #[arg(long, value_name = "KEY", default_value_t = 0, requires = "carry")]
    carry_from: usize,

    /// Also write animation.png, a moving picture of the surfaces (an animated PNG, which browsers play)
    #[arg(long)]
    film: bool,

    /// Also say how far to believe each vertex: numbers in the PLY or glTF files, which MeshLab shows in colours,
    /// and a line for each time
    #[arg(long)]
    trust: bool,

    /// Also write layers at these distances from the surface, such as -0.01,0.02, in the unit of the shapes;
    /// negative is inside
    #[arg(
        long,
        value_name = "A,B,C",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    layers: Vec<f64>,

    /// Drop pieces smaller than this share of the surface area; 0 keeps all
    /// [default: result.smallest-component]
    #[arg(long, value_name = "SHARE")]
    smallest_component: Option<f64>,

    /// Output folder [default: meshes/ in the run]
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    progress: ProgressArgs,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// Binary PLY with normals
    Ply,
    /// Wavefront OBJ with normals
    Obj,
    /// One animated file for all times, binary glTF: surface.glb, and carried.glb with --carry
    Glb,
}

/// The files that were asked for.
fn output_format(format: Format, compact: bool) -> Result<OutputFormat> {
    let precision = match (format, compact) {
        (_, false) => Precision::Full,
        (Format::Glb, true) => Precision::Compact,
        _ => {
            let text = "--compact: only --format glb can be compact";
            return Err(Failure::Usage(text.to_owned()));
        }
    };
    Ok(match format {
        Format::Ply => OutputFormat::Frames(SurfaceFormat::Ply),
        Format::Obj => OutputFormat::Frames(SurfaceFormat::Obj),
        Format::Glb => OutputFormat::Animation(precision),
    })
}

/// The most seconds of an animation, and the most surfaces of one.
const MOST_SECONDS: f64 = 86_400.0;
const MOST_FRAMES: f64 = 10_000.0;

/// The times of the surfaces, and when each is shown.
fn moments(args: &ExtractArgs, trained: &Trained) -> Result<(Vec<f64>, Option<Vec<f64>>)> {
    let is_plain = args.fps.is_none() && args.seconds.is_none() && args.ease == "linear";
    if is_plain || !args.times.is_empty() {
        let times = times_of(trained, &args.times, args.frames as usize)?;
        return Ok((times, None));
    }
    let intervals = trained.key_times().len() - 1;
    let seconds = args.seconds.unwrap_or((intervals as f64).max(2.0));
    if !(seconds > 0.0 && seconds <= MOST_SECONDS) {
        return Err(Failure::Usage(format!(
            "--seconds {seconds}: must be above 0 and at most {MOST_SECONDS}"
        )));
    }
    let count = match args.fps {
        None => args.frames as usize,
        Some(fps) => {
            let count = (seconds * f64::from(fps)).round() + 1.0;
            if count > MOST_FRAMES {
                return Err(Failure::Usage(format!(
                    "--fps {fps}: {count} surfaces in {seconds} seconds; at most {MOST_FRAMES}"
                )));
            }
            count as usize
        }
    };
    let ease = match args.ease.as_str() {
        "linear" => Ease::Linear,
        "smooth" => Ease::Smooth,
        file => Ease::read(Path::new(file))?,
    };
    let last = count.max(2) - 1;
    let shown = (0..count).map(|k| seconds * k as f64 / last as f64);
    Ok((ease.times(count, trained.span()), Some(shown.collect())))
}

pub(super) fn run(args: ExtractArgs) -> Result {
    let format = output_format(args.format, args.compact)?;
    let trained = Trained::open(&args.run, args.place.backend()?)?;
    let defaults = ExtractOptions::of(trained.recipe());
    let (times, seconds) = moments(&args, &trained)?;
    let options = ExtractOptions {
        times,
        seconds,
        resolution: args
            .resolution
            .map_or(defaults.resolution, |cells| cells as usize),
        format,
        film: args.film,
        trust: args.trust,
        layers: args.layers,
        carry: args.carry,
        carry_from: args.carry_from,
        smallest_component: args
            .smallest_component
            .unwrap_or(defaults.smallest_component),
        folder: args.output,
    };
    let mut terminal = args.progress.terminal(&args.run);
    let stop = stop_on_interrupt();
    let listing = trained.extract(&options, &stop, |event| terminal.show(event))?;
    match args.progress.json {
        true => Ok(()),
        false => print(&format!("{}\n", listing.display())),
    }
}
