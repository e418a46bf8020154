//! `isomorph evaluate`: how close a run comes to the true frames between its ends.

use std::path::PathBuf;

use clap::Args;
use isomorph::Trained;
use isomorph::evaluation::{EvaluateOptions, GroundTruth};

use super::{BackendArgs, QuietArgs, Result, print, stop_on_interrupt};

/// Measure a run against the true frames between its two shapes
///
/// The ground truth is a sequence of meshes with common vertices. The run was trained on two of them. The
/// table shows Chamfer and Hausdorff distances, normals, volume, pieces, and the error of carried vertices.
/// Each is measured at the frame's own time and at the best one. Two references stand beside them. `linear`
/// interpolates all true vertices on straight lines. `floor` compares two samplings of the truth. Lengths
/// are in normalised units, in which the mean surface area of the two shapes is 1. The numbers of every
/// frame are also written to evaluation.json in the run.
#[derive(Debug, Args)]
pub(super) struct EvaluateArgs {
    /// Folder of the run
    run: PathBuf,

    /// True frames: a .anime sequence, or a folder of meshes in the order of their names
    #[arg(long, value_name = "SEQUENCE")]
    ground_truth: PathBuf,

    /// Frame that is the run's source, counted from 0
    #[arg(
        long,
        value_name = "FRAME",
        required_unless_present = "keys",
        requires = "to"
    )]
    from: Option<usize>,

    /// Frame that is the run's target
    #[arg(long, value_name = "FRAME", requires = "from")]
    to: Option<usize>,

    /// Frames that are the run's key frames, such as 0,10,18, instead of --from and --to. `natural` then interpolates
    /// all true vertices by natural cubic splines
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', conflicts_with_all = ["from", "to"])]
    keys: Vec<usize>,

    #[command(flatten)]
    precision: PrecisionArgs,

    /// Print JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    quiet: QuietArgs,
}

/// Sampling of the measurement.
#[derive(Clone, Debug, Args)]
pub(super) struct PrecisionArgs {
    /// Points sampled on each surface
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(100..=10_000_000))]
    samples: u32,

    /// Measure only every N-th frame between the ends
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    every: u32,

    /// Grid cells along the longest side of the box [default: result.resolution]
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(8..=2048))]
    resolution: Option<u32>,
}

impl PrecisionArgs {
    /// The same in the library's words.
    pub(super) fn options(&self) -> EvaluateOptions {
        EvaluateOptions {
            samples: self.samples as usize,
            every: self.every as usize,
            resolution: self.resolution.map(|cells| cells as usize),
        }
    }
}

pub(super) fn run(args: EvaluateArgs) -> Result {
    let trained = Trained::open(&args.run, args.place.backend()?)?;
    let truth = GroundTruth::read(&args.ground_truth).map_err(isomorph::Error::from)?;
    let stop = stop_on_interrupt();
    let mut terminal = args.quiet.terminal(&args.run);
    let options = args.precision.options();
    let (Some(from), Some(to)) = (args.from, args.to) else {
        let evaluation = trained.evaluate_keys(&truth, &args.keys, &options, &stop, |event| {
            terminal.show(event);
        })?;
        return match args.json {
            true => print(&(serde_json::to_string(&evaluation)? + "\n")),
            false => print(&evaluation.table()),
        };
    };
    let frames = [from, to];
    let evaluation = trained.evaluate(&truth, frames, &options, &stop, |event| {
        terminal.show(event);
    })?;
    if args.json {
        print(&(serde_json::to_string(&evaluation)? + "\n"))
    } else {
        print(&evaluation.table(frames))
    }
}
