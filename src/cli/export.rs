//! `isomorph export`: what a run has learned, for programs of other languages.

use std::path::PathBuf;

use clap::Args;
use isomorph::export;

use super::{BackendArgs, Result, print};

/// Write what a run has learned as safetensors, for PyTorch, JAX or numpy: networks, or splines and shapes
///
/// The metadata of the file describe the arrays, the frame of the shapes and how f is made of them.
/// scripts/read_run.py evaluates f and V from it with numpy alone.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// Folder of the run
    run: PathBuf,

    /// Output file
    #[arg(
        long,
        short,
        value_name = "FILE",
        default_value = "networks.safetensors"
    )]
    output: PathBuf,

    #[command(flatten)]
    place: BackendArgs,
}

pub(super) fn run(args: ExportArgs) -> Result {
    let found = export(&args.run, &args.output, args.place.backend()?)?;
    print(&format!(
        "{}: {} arrays of {} numbers\n",
        args.output.display(),
        found.tensors,
        found.weights
    ))
}
