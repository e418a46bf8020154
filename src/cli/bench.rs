//! `isomorph bench`: what a training step, or a whole run of the preset instant, costs on this machine.

use std::fmt::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use isomorph::benchmark::{
    self, BenchOptions, BenchRun, Job, Measured, MeasuredRun, StageCost, unused,
};

use super::{BackendArgs, Result, print};

/// Measure a training step, or a whole run of the preset instant: seconds, memory and efficiency
///
/// `--size instant` measures a whole run stage by stage: files, points and normals, exact distances, steps,
/// surfaces, picture and page. The shapes are a rod and the same rod bent; `--recipe` takes those of a recipe, with its
/// preset. All other sizes measure a step.
///
/// The shapes are two spheres of points. The step is that of the preset quick or default, or that of the
/// preset paper at one of three sizes. The step of paper has smoothness with its Laplacian, divergence,
/// level set, and Euler's method. Efficiency is the rate of the step's matrix products, divided by the rate
/// of one large matrix product on the same backend.
#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    /// Preset, or size of the preset paper
    #[arg(long, value_enum, default_value_t = Size::Small)]
    size: Size,

    /// How derivatives by position and time are computed
    #[arg(long, value_enum, default_value_t = Way::Nested)]
    derivatives: Way,

    /// Steps timed in each phase; the median is printed
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,

    /// Override a key of the recipe of the step, such as training.batch=8000
    #[arg(long, value_name = "SECTION.KEY=VALUE")]
    set: Vec<String>,

    /// Print JSON
    #[arg(long)]
    json: bool,

    /// Measure the whole run of this recipe, stage by stage
    #[arg(long, value_name = "FILE", conflicts_with_all = ["size", "derivatives", "vertices", "bend"])]
    recipe: Option<PathBuf>,

    /// Vertices of the rod of `--size instant`
    #[arg(long, value_name = "N", default_value_t = 5000, value_parser = clap::value_parser!(u32).range(100..=10_000_000))]
    vertices: u32,

    /// How far the rod of `--size instant` is bent
    #[arg(long, value_name = "DEGREES", default_value_t = 60.0)]
    bend: f64,

    #[command(flatten)]
    place: BackendArgs,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Size {
    /// A whole run of the preset instant
    Instant,
    /// Preset quick, with its networks, points and terms
    Quick,
    /// Preset default
    Default,
    /// Preset paper with f and V 6x128, 1000 points, 5 time steps
    Small,
    /// Preset paper with f and V 8x256, 4086 points, 10 time steps
    Shipped,
    /// Preset paper with f 8x512, V 8x256, 4000 points, 10 time steps
    Paper,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Way {
    /// Repeated automatic differentiation
    Nested,
    /// One forward sweep
    Forward,
}

impl Size {
    /// The step that is measured; none of a whole run.
    const fn step(self) -> Option<benchmark::Size> {
        Some(match self {
            Self::Instant => return None,
            Self::Quick => benchmark::Size::Quick,
            Self::Default => benchmark::Size::Default,
            Self::Small => benchmark::Size::Small,
            Self::Shipped => benchmark::Size::Shipped,
            Self::Paper => benchmark::Size::Paper,
        })
    }
}

pub(super) fn run(args: BenchArgs) -> Result {
    let (json, text) = match (&args.recipe, args.size.step()) {
        (None, Some(size)) => of_step(&args, size)?,
        _ => of_run(&args)?,
    };
    print(if args.json { &json } else { &text })?;
    for warning in unused() {
        eprintln!("isomorph: bench: {warning}");
    }
    Ok(())
}

/// What a step costs, as JSON and for people.
fn of_step(args: &BenchArgs, size: benchmark::Size) -> Result<(String, String)> {
    let measured = benchmark::bench(&BenchOptions {
        size,
        derivatives: match args.derivatives {
            Way::Nested => "nested",
            Way::Forward => "forward",
        },
        repeats: args.repeats as usize,
        changes: args.set.clone(),
        backend: args.place.backend()?,
    })?;
    Ok((serde_json::to_string(&measured)? + "\n", table(&measured)))
}

/// What a whole run costs, as JSON and for people.
fn of_run(args: &BenchArgs) -> Result<(String, String)> {
    let rod = Job::Rod {
        vertices: args.vertices as usize,
        bend: args.bend,
    };
    let measured = benchmark::bench_run(&BenchRun {
        job: args.recipe.clone().map_or(rod, Job::Recipe),
        repeats: args.repeats as usize,
        changes: args.set.clone(),
        backend: args.place.backend()?,
    })?;
    Ok((serde_json::to_string(&measured)? + "\n", stages(&measured)))
}

/// Peak memory for people.
fn megabytes(bytes: Option<u64>) -> String {
    bytes.map_or_else(
        || "unknown".to_owned(),
        |bytes| format!("{:.0} MB", bytes as f64 / 1e6),
    )
}

/// The stages of a run for people.
fn stages(measured: &MeasuredRun) -> String {
    let vertices: Vec<String> = measured.vertices.iter().map(usize::to_string).collect();
    let mut table = format!(
        "{}, {} threads; shapes of {} vertices; peak memory {}\n\
         stage                 seconds   processor seconds   share\n",
        measured.backend,
        measured.threads,
        vertices.join(" and "),
        megabytes(measured.peak_bytes),
    );
    let whole = StageCost {
        name: "whole run",
        cost: measured.whole,
    };
    for StageCost { name, cost } in measured.stages.iter().chain([&whole]) {
        let worked = cost.cpu_seconds;
        let worked = worked.map_or_else(|| "unknown".to_owned(), |seconds| format!("{seconds:.2}"));
        // Writing to a string does not fail.
        let _ = writeln!(
            table,
            "{name:20} {:8.2} {worked:>19} {:6.0} %",
            cost.seconds,
            100.0 * cost.share
        );
    }
    table
}

/// What is printed for people.
fn table(measured: &Measured) -> String {
    let peak = megabytes(measured.peak_bytes);
    let mut table = format!(
        "{}, {}, {} derivatives; matrix product {:.0} GFLOP/s; peak memory {peak}\n\
         phase      s/step   first step   GFLOP/step   efficiency\n",
        measured.backend, measured.size, measured.derivatives, measured.matmul_gflops
    );
    let warm_up = measured.phases.warm_up.as_ref();
    let phases = warm_up.map(|cost| ("warm-up", cost)).into_iter();
    for (name, cost) in phases.chain([("joint", &measured.phases.joint)]) {
        // Writing to a string does not fail.
        let _ = writeln!(
            table,
            "{name:9} {:8.4} {:12.3} {:12.2} {:12.2}",
            cost.seconds_per_step, cost.first_step_seconds, cost.gflop_per_step, cost.efficiency
        );
    }
    table
}
