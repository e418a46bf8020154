//! `isomorph bench`: what a training step costs on this machine.

use std::fmt::Write;

use clap::{Args, ValueEnum};
use isomorph::benchmark::{self, BenchOptions, Measured, unused};

use super::{BackendArgs, Result, print};

/// Measure a training step: seconds, arithmetic, memory and efficiency
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

    #[command(flatten)]
    place: BackendArgs,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Size {
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

impl From<Size> for benchmark::Size {
    fn from(size: Size) -> Self {
        match size {
            Size::Quick => Self::Quick,
            Size::Default => Self::Default,
            Size::Small => Self::Small,
            Size::Shipped => Self::Shipped,
            Size::Paper => Self::Paper,
        }
    }
}

pub(super) fn run(args: BenchArgs) -> Result {
    let measured = benchmark::bench(&BenchOptions {
        size: args.size.into(),
        derivatives: match args.derivatives {
            Way::Nested => "nested",
            Way::Forward => "forward",
        },
        repeats: args.repeats as usize,
        changes: args.set,
        backend: args.place.backend()?,
    })?;
    if args.json {
        print(&(serde_json::to_string(&measured)? + "\n"))?;
    } else {
        print(&table(&measured))?;
    }
    for warning in unused() {
        eprintln!("isomorph: bench: {warning}");
    }
    Ok(())
}

/// What is printed for people.
fn table(measured: &Measured) -> String {
    let peak = measured.peak_bytes.map_or_else(
        || "unknown".to_owned(),
        |bytes| format!("{:.0} MB", bytes as f64 / 1e6),
    );
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
