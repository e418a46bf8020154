//! `isomorph info`: what a shape, a sequence, a recipe or a run is.

use std::path::PathBuf;

use clap::Args;

use super::{Result, print};

/// Describe a shape, a sequence (.anime), a recipe (.toml) or a run
#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    /// File, or folder of a run
    path: PathBuf,
}

pub(super) fn run(args: InfoArgs) -> Result {
    print(&isomorph::describe(&args.path)?)
}
