//! `isomorph resume`: goes on from the newest checkpoint of a run.

use std::path::PathBuf;

use clap::Args;
use isomorph::Session;

use super::{BackendArgs, QuietArgs, Result, SetArgs, stop_on_interrupt};

/// Go on with a run that was interrupted, or train it for longer
///
/// The run goes on from its newest checkpoint, on any backend, and ends in the same networks as if it
/// had never stopped. Other keys than those of the networks may be changed with --set, or in the run's
/// recipe.toml: more steps, for one.
#[derive(Debug, Args)]
pub(super) struct ResumeArgs {
    /// Folder of the run
    run: PathBuf,

    #[command(flatten)]
    set: SetArgs,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    quiet: QuietArgs,
}

pub(super) fn run(args: ResumeArgs) -> Result {
    let session = Session::resume(&args.run, &args.set.overrides, args.place.backend()?)?;
    let mut session = session.stopped_by(stop_on_interrupt());
    let mut terminal = args.quiet.terminal(&args.run);
    session.train(|event| terminal.show(event))?;
    Ok(())
}
