//! `isomorph bench`: what a training step costs on this machine.

use std::time::Instant;

use anyhow::Result;
use burn::tensor::backend::Backend;
use burn::tensor::{Distribution, Tensor};
use clap::{Args, ValueEnum};
use isomorph_model::{ModelBackend, TrainBackend, product};
use serde::Serialize;

use super::{BackendArgs, Ending};
use crate::backend::{self, Task};
use crate::learner::Learner;
use crate::learner::batch::BatchSizes;
use crate::learner::event::Phase;
use crate::learner::settings::Settings;
use crate::learner::{flop, memory};
use crate::recipe::{GeometryKind, Recipe};
use crate::shape::Pair;

/// Measure a training step: seconds, arithmetic, memory, and the share of the machine that it uses
///
/// The step is made on two spheres of points: that of the preset quick or default as it is, or that of the
/// paper preset (smoothness with its Laplacian, divergence, level set, Euler's method) at one of three
/// sizes. Efficiency is the rate of the step's matrix products over the rate of one large matrix product on
/// the same backend.
#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    /// Networks and points
    #[arg(long, value_enum, default_value_t = Size::Small)]
    size: Size,

    /// How derivatives by the input are taken
    #[arg(long, value_enum, default_value_t = Way::Nested)]
    derivatives: Way,

    /// Steps timed in each phase; the median counts
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,

    /// Change a value of the recipe that the step is made from, such as training.batch=8000
    #[arg(long, value_name = "SECTION.KEY=VALUE")]
    set: Vec<String>,

    /// Print JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    place: BackendArgs,
}

/// Points on each of the spheres that the step is made on.
const POINTS: usize = 20_000;

/// Correspondences between them.
const CORRESPONDENCES: usize = 1000;

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Size {
    /// The preset quick: its networks, points and terms
    Quick,
    /// The preset default
    Default,
    /// The preset paper with f and V 6x128, 1000 points, 5 time steps
    Small,
    /// The preset paper with f and V 8x256, 4086 points, 10 time steps
    Shipped,
    /// The preset paper with f 8x512, V 8x256, 4000 points, 10 time steps
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
    /// The preset whose step it is.
    const fn preset(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Default => "default",
            Self::Small | Self::Shipped | Self::Paper => "paper",
        }
    }

    /// What it changes of the preset.
    fn keys(self) -> Vec<String> {
        // Depth of both, width of f, width of V, points, time steps.
        let (depth, width_f, width_v, points, time_steps) = match self {
            Self::Quick | Self::Default => return Vec::new(),
            Self::Small => (6, 128, 128, 1000, 5),
            Self::Shipped => (8, 256, 256, 4086, 10),
            Self::Paper => (8, 512, 256, 4000, 10),
        };
        vec![
            format!("implicit.depth={depth}"),
            format!("implicit.width={width_f}"),
            format!("velocity.depth={depth}"),
            format!("velocity.width={width_v}"),
            format!("training.batch={points}"),
            format!("training.time-steps={time_steps}"),
        ]
    }

    fn name(self) -> String {
        self.to_possible_value()
            .map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

#[derive(Debug, Serialize)]
pub(super) struct Measured {
    backend: String,
    size: String,
    derivatives: &'static str,
    threads: usize,
    set: Vec<String>,
    phases: Phases,
    peak_bytes: Option<u64>,
    matmul_gflops: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct Phases {
    /// Of what has a phase in which V trains alone: not of the flow's geometry.
    #[serde(skip_serializing_if = "Option::is_none")]
    warm_up: Option<PhaseCost>,
    joint: PhaseCost,
}

#[derive(Debug, Serialize)]
pub(super) struct PhaseCost {
    seconds_per_step: f64,
    first_step_seconds: f64,
    gflop_per_step: f64,
    efficiency: f64,
}

pub(super) fn run(args: BenchArgs) -> Result<Ending> {
    let json = args.json;
    let place = args.place.clone();
    let measured = backend::run(place.backend, place.device.as_deref(), args)??;
    if json {
        println!("{}", serde_json::to_string(&measured)?);
    } else {
        print_table(&measured);
    }
    for warning in unused() {
        eprintln!("isomorph: bench: {warning}");
    }
    Ok(Ending::Done)
}

impl Task for BenchArgs {
    type Output = Result<Measured>;

    fn run<B: TrainBackend>(self, device: B::Device) -> Self::Output {
        let matmul_gflops = product_rate::<B::InnerBackend>(&device);
        let derivatives = match self.derivatives {
            Way::Nested => "nested",
            Way::Forward => "forward",
        };
        let recipe = |warm_up| recipe(self.size, derivatives, warm_up, &self.set);
        let cost = |phase, recipe| {
            let repeats = self.repeats as usize;
            measure::<B>(recipe, phase, repeats, matmul_gflops, &device)
        };
        let alone = recipe("1")?;
        let warms_up = alone.implicit.geometry == GeometryKind::Network;
        let warm_up = warms_up.then(|| cost(Phase::WarmUp, alone));
        let phases = Phases {
            warm_up: warm_up.transpose()?,
            joint: cost(Phase::Joint, recipe("0")?)?,
        };
        Ok(Measured {
            backend: B::InnerBackend::name(&device),
            size: self.size.name(),
            derivatives,
            threads: rayon::current_num_threads(),
            set: self.set,
            phases,
            peak_bytes: memory::peak_memory_bytes(),
            matmul_gflops,
        })
    }
}

/// The preset at a size, all of its steps in one phase, with the changes asked for.
fn recipe(size: Size, derivatives: &str, warm_up: &str, changes: &[String]) -> Result<Recipe> {
    let preset = size.preset();
    let text =
        format!("preset = \"{preset}\"\n[data]\nsource = \"spheres\"\ntarget = \"spheres\"\n");
    let mut set = size.keys();
    set.extend([
        format!("training.derivatives={derivatives}"),
        format!("training.warm-up={warm_up}"),
        format!("training.ramp-until={warm_up}"),
        "training.velocity-until=1".to_owned(),
    ]);
    set.extend_from_slice(changes);
    Ok(Recipe::parse(&text, std::path::Path::new("bench"), &set)?)
}

/// The median time of a step after a first one that is reported apart: it compiles kernels on a GPU.
fn measure<B: TrainBackend>(
    recipe: Recipe,
    phase: Phase,
    repeats: usize,
    matmul_gflops: f64,
    device: &B::Device,
) -> Result<PhaseCost> {
    let settings = Settings::new(&recipe);
    let pair = Pair::spheres(POINTS, CORRESPONDENCES);
    let sizes = BatchSizes::new(&settings.training, pair.correspondences.len(), 1);
    let gflop_per_step = flop::per_step(&settings, sizes, phase) / 1e9;
    let mut learner = Learner::<B>::new(recipe, pair, device.clone())?;
    let mut step = || {
        let clock = Instant::now();
        learner.advance(false);
        // A device that fails shows in the next value read from it.
        let _ = B::sync(device);
        clock.elapsed().as_secs_f64()
    };
    let first_step_seconds = step();
    let seconds_per_step = median((0..repeats).map(|_| step()).collect());
    let efficiency = gflop_per_step / seconds_per_step / matmul_gflops;
    Ok(PhaseCost {
        seconds_per_step,
        first_step_seconds,
        gflop_per_step,
        efficiency,
    })
}

/// GFLOP per second of a product of `4000 x 512` by `512 x 512`, the median of seven.
fn product_rate<B: ModelBackend>(device: &B::Device) -> f64 {
    let matrix = |rows| Tensor::<B, 2>::random([rows, 512], Distribution::Default, device);
    let (a, b) = (matrix(4000), matrix(512));
    let multiply = || {
        let clock = Instant::now();
        let c = product(a.clone(), b.clone());
        let _ = B::sync(device);
        drop(c);
        clock.elapsed().as_secs_f64()
    };
    multiply();
    2.0 * 4000.0 * 512.0 * 512.0 / 1e9 / median((0..7).map(|_| multiply()).collect())
}

/// What the machine has and this run did not use.
fn unused() -> Vec<String> {
    let mut warnings = Vec::new();
    if cfg!(debug_assertions) {
        warnings.push("a build without optimisation: build with --release".to_owned());
    }
    let (threads, cores) = (
        rayon::current_num_threads(),
        std::thread::available_parallelism().map_or(1, usize::from),
    );
    if threads < cores {
        warnings.push(format!(
            "{threads} of {cores} cores used: unset RAYON_NUM_THREADS, or raise it"
        ));
    }
    #[cfg(target_arch = "x86_64")]
    if !std::arch::is_x86_feature_detected!("avx2") || !std::arch::is_x86_feature_detected!("fma") {
        warnings
            .push("this processor has no AVX2 and FMA: kernels run on narrow vectors".to_owned());
    }
    warnings
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn print_table(measured: &Measured) {
    let peak = measured.peak_bytes.map_or_else(
        || "unknown".to_owned(),
        |bytes| format!("{:.0} MB", bytes as f64 / 1e6),
    );
    println!(
        "{}, {}, {} derivatives; matrix product {:.0} GFLOP/s; peak memory {peak}",
        measured.backend, measured.size, measured.derivatives, measured.matmul_gflops
    );
    println!("phase      s/step   first step   GFLOP/step   efficiency");
    let warm_up = measured.phases.warm_up.as_ref();
    let phases = warm_up.map(|cost| ("warm-up", cost)).into_iter();
    for (name, cost) in phases.chain([("joint", &measured.phases.joint)]) {
        println!(
            "{name:9} {:8.4} {:12.3} {:12.2} {:12.2}",
            cost.seconds_per_step, cost.first_step_seconds, cost.gflop_per_step, cost.efficiency
        );
    }
}
