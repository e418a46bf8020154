//! `isomorph info`: what a shape, a sequence, a recipe or a run is.

use std::path::PathBuf;

use clap::Args;
use isomorph::status::run_status;

use super::{Result, print};

/// Describe a shape, a sequence (.anime), a recipe (.toml) or a run
#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    /// File, or folder of a run
    path: PathBuf,

    /// Print where a run stands as JSON: waiting, running, interrupted, failed or done, and its figures
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: InfoArgs) -> Result {
    if args.json {
        let status = run_status(&args.path)?;
        return print(&(serde_json::to_string_pretty(&status)? + "\n"));
    }
    print(&isomorph::describe(&args.path)?)
}
