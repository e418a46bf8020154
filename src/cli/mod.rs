//! The command line: one file per subcommand, and what they share.
//!
//! Results go to standard output, all else to standard error. Exit status: 0 done, 1 failed, 2 usage or
//! a bad recipe, 130 interrupted with a checkpoint written.

mod bench;
mod candidate;
mod compare;
mod compared;
mod evaluate;
mod extract;
mod info;
mod init;
mod match_shapes;
mod normals;
mod paired;
mod resume;
mod train;
mod trained;
mod training;

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Args, Parser, Subcommand};

use crate::backend::{BackendError, BackendName};
use crate::compare::PlanError;
use crate::cubes::GridError;
use crate::evaluate::TruthError;
use crate::matching::MatchError;
use crate::recipe::RecipeError;
use crate::report::Verbosity;
use crate::run_directory::RunError;

/// Learns a continuous, physically plausible deformation between two 3D shapes.
#[derive(Debug, Parser)]
#[command(
    name = "isomorph",
    version,
    after_help = "First steps:\n  \
        isomorph train data/fox/quick.toml       train on a sample and look at runs/fox-quick/meshes\n  \
        isomorph init a.ply b.ply > pair.toml    write a recipe for two shapes of your own\n  \
        isomorph extract runs/fox-quick --frames 25 --carry"
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Train(train::TrainArgs),
    Resume(resume::ResumeArgs),
    Extract(extract::ExtractArgs),
    Evaluate(evaluate::EvaluateArgs),
    Compare(compare::CompareArgs),
    Match(match_shapes::MatchArgs),
    Normals(normals::NormalsArgs),
    Init(init::InitArgs),
    Info(info::InfoArgs),
    Bench(bench::BenchArgs),
}

/// Where networks run.
#[derive(Clone, Debug, Args)]
struct BackendArgs {
    /// Where to compute
    #[arg(long, value_enum, default_value_t = DEFAULT_BACKEND)]
    backend: BackendName,

    /// Device of the backend: default, cpu, discrete[:N], integrated[:N] or virtual[:N]
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
}

/// The fastest backend that runs on every machine.
const DEFAULT_BACKEND: BackendName = BackendName::Flex;

/// Changes of the recipe from the command line.
#[derive(Clone, Debug, Args)]
struct SetArgs {
    /// Overrides one key of the recipe; may be given several times
    #[arg(long = "set", value_name = "SECTION.KEY=VALUE")]
    overrides: Vec<String>,
}

/// How much is told on the way.
#[derive(Clone, Copy, Debug, Args)]
struct QuietArgs {
    /// Print errors only
    #[arg(long, short)]
    quiet: bool,
}

impl QuietArgs {
    fn verbosity(self) -> Verbosity {
        if self.quiet {
            Verbosity::Quiet
        } else {
            Verbosity::Normal
        }
    }
}

/// How a command ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ending {
    Done,
    Interrupted,
}

/// Runs the command and says how it went.
pub fn run(cli: Cli) -> ExitCode {
    let ended = match cli.command {
        Command::Train(args) => train::run(args),
        Command::Resume(args) => resume::run(args),
        Command::Extract(args) => extract::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Match(args) => match_shapes::run(args),
        Command::Normals(args) => normals::run(args),
        Command::Init(args) => init::run(args),
        Command::Info(args) => info::run(args),
        Command::Bench(args) => bench::run(args),
    };
    match ended {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Interrupted) => ExitCode::from(130),
        Err(error) => {
            if is_closed_pipe(&error) {
                // Whoever read our output has seen enough.
                return ExitCode::SUCCESS;
            }
            eprintln!("error: {error:#}");
            ExitCode::from(if is_usage(&error) { 2 } else { 1 })
        }
    }
}

/// Whether the user can mend the command line or the recipe, rather than the files or the machine.
fn is_usage(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.is::<RecipeError>()
            || cause.is::<Usage>()
            || cause.is::<PlanError>()
            || cause.is::<GridError>()
            || matches!(
                cause.downcast_ref::<MatchError>(),
                Some(MatchError::Option { .. })
            )
            || matches!(
                cause.downcast_ref::<TruthError>(),
                Some(TruthError::Span { .. } | TruthError::Option { .. })
            )
            || matches!(
                cause.downcast_ref::<BackendError>(),
                Some(BackendError::Absent(_) | BackendError::Device { .. })
            )
            || matches!(
                cause.downcast_ref::<RunError>(),
                Some(RunError::Exists(_) | RunError::NotARun(_) | RunError::Missing(_))
            )
    })
}

fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<std::io::Error>()
            .is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
    })
}

/// A mistake on the command line that clap cannot see.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Usage(String);

/// A flag that Ctrl-C or a request to terminate sets; a second one ends the process at once.
fn stop_on_interrupt() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })?;
    Ok(stop)
}

/// Evenly spaced times from 0 to 1.
fn even_times(frames: usize) -> Vec<f64> {
    match frames {
        1 => vec![0.0],
        _ => (0..frames)
            .map(|k| k as f64 / (frames - 1) as f64)
            .collect(),
    }
}
