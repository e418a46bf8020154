//! `isomorph evaluate`: how close a run comes to the true frames between its ends.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use isomorph_model::TrainBackend;

use super::candidate::{Ruler, measure};
use super::{BackendArgs, Ending, stop_on_interrupt, trained};
use crate::atomic::write_atomically;
use crate::backend::{self, Task};
use crate::evaluate::{Evaluation, GroundTruth, Metrics, Options, Reference, Span};
use crate::learner::checkpoint::Checkpoint;
use crate::learner::settings;
use crate::recipe::Recipe;
use crate::run_directory::RunDirectory;
use crate::shape::{self, Normalisation};

/// Measure a run against the true frames between its ends
///
/// The ground truth is a sequence of meshes with the same vertices, of which the run has seen two. Chamfer
/// and Hausdorff distances, normals, volume, area, pieces, the error of carried vertices, at each frame's
/// own time and at the best one, beside straight lines between all true vertices (linear) and two samplings
/// of the truth (floor). Lengths are in normalised units: the mean surface area of the ends is 1. The
/// numbers of every frame are also left in the run, in evaluation.json.
#[derive(Debug, Args)]
pub(super) struct EvaluateArgs {
    /// Folder of the run
    run: PathBuf,

    /// The true frames: a .anime sequence, or a folder of meshes in the order of their names
    #[arg(long, value_name = "SEQUENCE")]
    ground_truth: PathBuf,

    /// The frame that is the run's source, counted from 0
    #[arg(long, value_name = "FRAME")]
    from: usize,

    /// The frame that is the run's target
    #[arg(long, value_name = "FRAME")]
    to: usize,

    #[command(flatten)]
    precision: PrecisionArgs,

    /// Print JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    place: BackendArgs,
}

/// How closely to look.
#[derive(Clone, Debug, Args)]
pub(super) struct PrecisionArgs {
    /// Points sampled on each surface
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(100..=10_000_000))]
    samples: u32,

    /// Evaluate each N-th frame between the ends only
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    every: u32,

    /// Cells along the longest side of the box in which a surface is found [default: as in the recipe]
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(8..=2048))]
    resolution: Option<u32>,
}

impl PrecisionArgs {
    /// What the evaluation is told.
    pub(super) fn options(&self) -> Options {
        Options {
            samples: self.samples as usize,
            every: self.every as usize,
            ..Options::default()
        }
    }

    /// The resolution of surfaces.
    pub(super) fn resolution(&self, recipe: &Recipe) -> usize {
        self.resolution
            .map_or(recipe.result.resolution, |cells| cells as usize)
    }
}

pub(super) fn run(args: EvaluateArgs) -> Result<Ending> {
    let run = RunDirectory::open(&args.run)?;
    let checkpoint = Checkpoint::newest(&run.checkpoints())?;
    let recipe = checkpoint.recipe()?;
    let truth = GroundTruth::read(&args.ground_truth)?;
    let span = truth.span(args.from, args.to)?;
    // Only the points are looked at: what corresponds to what plays no part.
    let pair = shape::prepare(&settings::data(&recipe, None))?;
    let (source, target) = (&pair.source.points, &pair.target.points);
    truth.check_ends(span, &pair.normalisation, source, target)?;
    let normalisation = true_frame(&truth, span)?;
    let reference = Reference::new(&truth, span, &normalisation, args.precision.options())?;
    let task = Evaluate {
        normalisation,
        resolution: args.precision.resolution(&recipe),
        checkpoint,
        recipe,
        reference,
    };
    let place = &args.place;
    let Some(evaluation) = backend::run(place.backend, place.device.as_deref(), task)?? else {
        return Ok(Ending::Interrupted);
    };
    let text = serde_json::to_string(&evaluation)? + "\n";
    let file = run.path().join("evaluation.json");
    write_atomically(&file, |out| out.write_all(text.as_bytes()))?;
    if args.json {
        print!("{text}");
    } else {
        print_table(&evaluation, span);
    }
    Ok(Ending::Done)
}

/// The coordinates in which everything is measured: those of the true ends.
pub(super) fn true_frame(truth: &GroundTruth, span: Span) -> Result<Normalisation> {
    let (source, target) = (truth.shape(span.from()), truth.shape(span.to()));
    Ok(Normalisation::joint(&[&source, &target])?)
}

struct Evaluate {
    normalisation: Normalisation,
    checkpoint: Checkpoint,
    recipe: Recipe,
    reference: Reference,
    resolution: usize,
}

impl Task for Evaluate {
    type Output = Result<Option<Evaluation>>;

    fn run<B: TrainBackend>(self, device: B::Device) -> Self::Output {
        let trained = trained::load::<B>(&self.checkpoint, &self.recipe, device)?;
        let stop = stop_on_interrupt()?;
        let ruler = Ruler {
            reference: &self.reference,
            normalisation: self.normalisation,
            resolution: self.resolution,
            stop: &stop,
        };
        measure(&trained, &ruler)
    }
}

/// The means, one line per thing measured.
fn print_table(evaluation: &Evaluation, span: Span) {
    let mean = &evaluation.mean;
    println!(
        "mean over {} frames between {} and {}; lengths in normalised units",
        evaluation.frames.len(),
        span.from(),
        span.to()
    );
    println!(
        "{:18} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8} {:>6} {:>9}",
        "", "CD x10^3", "CD", "HD", "HD95", "normals", "volume", "pieces", "tracked"
    );
    let line = |name: &str, metrics: &Metrics| {
        let tracked = metrics
            .tracked_rmse
            .map_or_else(|| "-".to_owned(), |rmse| format!("{rmse:.5}"));
        println!(
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
    println!(
        "CD x10^3 is the squared Chamfer distance of the paper; CD and HD are not squared; aligned: at the \
         best times; source, target: the ends that the run has seen"
    );
}
