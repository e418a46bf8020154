//! `isomorph evaluate`: how close a run comes to the true frames between its ends.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use isomorph::Trained;
use isomorph::evaluation::{
    Compared, EvaluateOptions, Evaluation, FrameResult, GroundTruth, KeysEvaluation, Metrics,
};

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
            false => print(&table_of_keys(&evaluation)),
        };
    };
    let frames = [from, to];
    let evaluation = trained.evaluate(&truth, frames, &options, &stop, |event| {
        terminal.show(event);
    })?;
    if args.json {
        print(&(serde_json::to_string(&evaluation)? + "\n"))
    } else {
        print(&table(&evaluation, frames))
    }
}

/// The names of the columns.
fn header() -> String {
    format!(
        "{:18} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8} {:>6} {:>9}\n",
        "", "CD x10^3", "CD", "HD", "HD95", "normals", "volume", "pieces", "tracked"
    )
}

/// One line of numbers.
fn line(name: &str, metrics: &Metrics) -> String {
    let tracked = metrics
        .tracked_rmse
        .map_or_else(|| "-".to_owned(), |rmse| format!("{rmse:.5}"));
    format!(
        "{name:18} {:9.4} {:9.5} {:9.4} {:9.5} {:8.4} {:8.4} {:6.2} {tracked:>9}\n",
        1e3 * metrics.chamfer_squared,
        metrics.chamfer,
        metrics.hausdorff,
        metrics.hausdorff95,
        metrics.normal_consistency,
        metrics.volume_ratio,
        metrics.components,
    )
}

/// The lines of what was compared with the truth, at the best times too where these were sought.
fn lines(mean: &FrameResult, aligned: bool) -> String {
    let kinds = [
        ("surface", mean.surface.as_ref()),
        ("carried", mean.carried.as_ref()),
        ("linear", Some(&mean.linear)),
        ("natural", mean.natural.as_ref()),
    ];
    let both = |(name, compared): (&str, Option<&Compared>)| {
        let compared = compared?;
        let best = aligned.then(|| line(&format!("{name}, aligned"), &compared.aligned));
        Some(line(name, &compared.metrics) + &best.unwrap_or_default())
    };
    kinds.into_iter().filter_map(both).collect::<String>() + &line("floor", &mean.floor)
}

const LEGEND: &str =
    "CD x10^3 is the squared Chamfer distance of the paper; CD and HD are not squared";

/// The means, one line per thing measured.
fn table(evaluation: &Evaluation, [from, to]: [usize; 2]) -> String {
    let mut table = format!(
        "mean over {} frames between {from} and {to}; lengths in normalised units\n",
        evaluation.frames.len(),
    );
    table += &header();
    table += &lines(&evaluation.mean, true);
    for (end, result) in ["source", "target"].into_iter().zip(&evaluation.ends) {
        if let Some(surface) = &result.surface {
            table += &line(&format!("surface, {end}"), &surface.metrics);
        }
    }
    // The source's vertices start where they are.
    if let Some(carried) = evaluation.ends.last().and_then(|end| end.carried.as_ref()) {
        table += &line("carried to target", &carried.metrics);
    }
    table
        + LEGEND
        + "; aligned: at the best times; source, target: the ends that the run was trained on\n"
}

/// The means over all frames between key frames, then those of each interval, then the drift.
fn table_of_keys(evaluation: &KeysEvaluation) -> String {
    let keys = &evaluation.keys;
    let segments = || evaluation.segments.iter();
    let count: usize = segments().map(|segment| segment.frames.len()).sum();
    let mut table = format!(
        "mean over {count} frames between the key frames {keys:?}; lengths in normalised units\n"
    );
    table += &header();
    table += &lines(&evaluation.mean, false);
    for (segment, two) in segments().zip(keys.windows(2)) {
        let kinds = [
            ("surface", segment.mean.surface.as_ref()),
            ("carried", segment.mean.carried.as_ref()),
        ];
        for (name, compared) in kinds {
            if let Some(compared) = compared {
                let name = format!("{name} {}-{}", two[0], two[1]);
                table += &line(&name, &compared.metrics);
            }
        }
    }
    if let Some(drift) = &evaluation.drift {
        // Writing to a string does not fail.
        let _ = writeln!(
            table,
            "drift of vertices carried from the first key frame: {:.5} in the mean, {:.5} at the last one, {:.5} there and back",
            drift.mean, drift.last, drift.there_and_back
        );
    }
    table + LEGEND + "; natural: cubic splines through all true vertices of the key frames\n"
}
