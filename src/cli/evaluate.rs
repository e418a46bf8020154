//! `isomorph evaluate`: how close a run comes to the true frames between its ends.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use isomorph::Trained;
use isomorph::evaluation::{EvaluateOptions, Evaluation, GroundTruth, Metrics};

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
    #[arg(long, value_name = "FRAME")]
    from: usize,

    /// Frame that is the run's target
    #[arg(long, value_name = "FRAME")]
    to: usize,

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
    let (frames, stop) = ([args.from, args.to], stop_on_interrupt());
    let mut terminal = args.quiet.terminal(&args.run);
    let options = args.precision.options();
    let evaluation = trained.evaluate(&truth, frames, &options, &stop, |event| {
        terminal.show(event);
    })?;
    if args.json {
        print(&(serde_json::to_string(&evaluation)? + "\n"))
    } else {
        print(&table(&evaluation, frames))
    }
}

/// The means, one line per thing measured.
fn table(evaluation: &Evaluation, [from, to]: [usize; 2]) -> String {
    let mean = &evaluation.mean;
    let mut table = format!(
        "mean over {} frames between {from} and {to}; lengths in normalised units\n",
        evaluation.frames.len(),
    );
    // Writing to a string does not fail.
    let _ = writeln!(
        table,
        "{:18} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8} {:>6} {:>9}",
        "", "CD x10^3", "CD", "HD", "HD95", "normals", "volume", "pieces", "tracked"
    );
    let mut line = |name: &str, metrics: &Metrics| {
        let tracked = metrics
            .tracked_rmse
            .map_or_else(|| "-".to_owned(), |rmse| format!("{rmse:.5}"));
        let _ = writeln!(
            table,
            "{name:18} {:9.4} {:9.5} {:9.4} {:9.5} {:8.4} {:8.4} {:6.2} {tracked:>9}",
            1e3 * metrics.chamfer_squared,
            metrics.chamfer,
            metrics.hausdorff,
            metrics.hausdorff95,
            metrics.normal_consistency,
            metrics.volume_ratio,
            metrics.components,
        );
    };
    let kinds = [
        ("surface", mean.surface.as_ref()),
        ("carried", mean.carried.as_ref()),
        ("linear", Some(&mean.linear)),
    ];
    for (name, compared) in kinds {
        let Some(compared) = compared else { continue };
        line(name, &compared.metrics);
        line(&format!("{name}, aligned"), &compared.aligned);
    }
    line("floor", &mean.floor);
    for (end, result) in ["source", "target"].into_iter().zip(&evaluation.ends) {
        if let Some(surface) = &result.surface {
            line(&format!("surface, {end}"), &surface.metrics);
        }
    }
    // The source's vertices start where they are.
    if let Some(carried) = evaluation.ends.last().and_then(|end| end.carried.as_ref()) {
        line("carried to target", &carried.metrics);
    }
    table.push_str(
        "CD x10^3 is the squared Chamfer distance of the paper; CD and HD are not squared; aligned: at the \
         best times; source, target: the ends that the run was trained on\n",
    );
    table
}
