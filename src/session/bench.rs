//! What a training step costs on this machine.

use std::path::Path;
use std::time::Instant;

use isomorph_training::data::TrainingData;
use isomorph_training::engine::Engine;
use isomorph_training::flop;
use isomorph_training::samples::BatchSizes;
use isomorph_training::settings::Settings;
use serde::Serialize;

use crate::backend::Backend;
use crate::error::Result;
use crate::event::Phase;
use crate::memory;
use crate::recipe::{GeometryKind, Recipe};

/// Points on each of the spheres that the step is made on.
const POINTS: usize = 20_000;

/// Correspondences between them.
const CORRESPONDENCES: usize = 1000;

/// Networks and points of the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// The preset quick: its networks, points and terms.
    Quick,
    /// The preset default.
    Default,
    /// The preset paper with f and V 6x128, 1000 points, 5 time steps.
    Small,
    /// The preset paper with f and V 8x256, 4086 points, 10 time steps.
    Shipped,
    /// The preset paper with f 8x512, V 8x256, 4000 points, 10 time steps.
    Paper,
}

impl Size {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Default => "default",
            Self::Small => "small",
            Self::Shipped => "shipped",
            Self::Paper => "paper",
        }
    }

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
}

/// What to measure.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    /// Networks and points.
    pub size: Size,
    /// How derivatives by the input are taken: `nested` or `forward`.
    pub derivatives: &'static str,
    /// Steps timed in each phase; the median counts.
    pub repeats: usize,
    /// Changes of the recipe that the step is made from, as in `training.batch=8000`.
    pub changes: Vec<String>,
    /// Where it is made.
    pub backend: Backend,
}

/// What a step costs.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// The backend's own name.
    pub backend: String,
    /// The device's own name.
    pub device: String,
    /// See [`Size::name`].
    pub size: String,
    /// How derivatives by the input are taken.
    pub derivatives: &'static str,
    /// Threads that work.
    pub threads: usize,
    /// Changes of the recipe.
    pub set: Vec<String>,
    /// The cost by phase.
    pub phases: Phases,
    /// Peak resident memory of the process, where the system says.
    pub peak_bytes: Option<u64>,
    /// The rate of one large matrix product.
    pub matmul_gflops: f64,
}

/// The cost of a step by phase.
#[derive(Clone, Debug, Serialize)]
pub struct Phases {
    /// Of what has a phase in which V trains alone: not of the flow's geometry.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warm_up: Option<PhaseCost>,
    /// Of steps that train all networks.
    pub joint: PhaseCost,
}

/// The cost of a step of one phase.
#[derive(Clone, Debug, Serialize)]
pub struct PhaseCost {
    /// The median.
    pub seconds_per_step: f64,
    /// The first one, which compiles kernels on a GPU.
    pub first_step_seconds: f64,
    /// Operations of its matrix products.
    pub gflop_per_step: f64,
    /// Their rate over that of one large matrix product.
    pub efficiency: f64,
}

/// Measures a training step on two spheres of points.
///
/// # Errors
/// A backend that cannot be opened, a change that no recipe takes.
pub fn bench(options: &BenchOptions) -> Result<Measured> {
    let engine = options.backend.open()?;
    let matmul_gflops = engine.product_rate();
    let cost = |phase, recipe| measure(&recipe, phase, options.repeats, matmul_gflops, &*engine);
    let alone = recipe(options, "1")?;
    let warms_up = alone.implicit.geometry == GeometryKind::Network;
    let warm_up = warms_up.then(|| cost(Phase::WarmUp, alone));
    let phases = Phases {
        warm_up: warm_up.transpose()?,
        joint: cost(Phase::Joint, recipe(options, "0")?)?,
    };
    Ok(Measured {
        backend: engine.backend(),
        device: engine.device(),
        size: options.size.name().to_owned(),
        derivatives: options.derivatives,
        threads: rayon::current_num_threads(),
        set: options.changes.clone(),
        phases,
        peak_bytes: memory::peak_memory_bytes(),
        matmul_gflops,
    })
}

/// The preset at a size, all of its steps in one phase, with the changes asked for.
fn recipe(options: &BenchOptions, warm_up: &str) -> Result<Recipe> {
    let preset = options.size.preset();
    let text =
        format!("preset = \"{preset}\"\n[data]\nsource = \"spheres\"\ntarget = \"spheres\"\n");
    let mut set = options.size.keys();
    set.extend([
        format!("training.derivatives={}", options.derivatives),
        format!("training.warm-up={warm_up}"),
        format!("training.ramp-until={warm_up}"),
        "training.velocity-until=1".to_owned(),
    ]);
    set.extend_from_slice(&options.changes);
    let mut recipe = Recipe::parse(&text, Path::new("bench"), &set)?;
    // Spheres have no splines: the steps are those that follow paths.
    recipe.training.guided_until = 0.0;
    Ok(recipe)
}

/// The median time of a step after a first one that is reported apart: it compiles kernels on a GPU.
fn measure(
    recipe: &Recipe,
    phase: Phase,
    repeats: usize,
    matmul_gflops: f64,
    engine: &dyn Engine,
) -> Result<PhaseCost> {
    let settings = Settings::new(recipe);
    let data = TrainingData::spheres(POINTS, CORRESPONDENCES);
    let sizes = BatchSizes::new(&settings.training, &data);
    let gflop_per_step = flop::per_step(&settings, sizes, data.keys.len(), phase) / 1e9;
    let mut trainer = engine.method(recipe, &data.bounds)?;
    let mut done = 0;
    let mut step = || {
        let clock = Instant::now();
        trainer.advance(&data, done, false);
        trainer.wait();
        done += 1;
        clock.elapsed().as_secs_f64()
    };
    let first_step_seconds = step();
    let mut seconds: Vec<f64> = (0..repeats.max(1)).map(|_| step()).collect();
    seconds.sort_by(f64::total_cmp);
    let seconds_per_step = seconds[seconds.len() / 2];
    Ok(PhaseCost {
        seconds_per_step,
        first_step_seconds,
        gflop_per_step,
        efficiency: gflop_per_step / seconds_per_step / matmul_gflops,
    })
}

/// What the machine has and this run did not use.
pub fn unused() -> Vec<String> {
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
