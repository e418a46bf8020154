//! `isomorph resume`: goes on from the newest checkpoint of a run.

use std::path::PathBuf;

use clap::Args;
use isomorph::Session;

use super::{BackendArgs, MemoryArgs, ProgressArgs, Result, SetArgs, stop_on_interrupt};

/// Go on with an interrupted run, or train a finished one for longer
///
/// The run goes on from its newest checkpoint, on any backend that has its method. It ends in the same
/// networks as if it had never stopped. You may change any key except those of the method and of the
/// networks. Use --set or the run's recipe.toml, for example for more steps.
#[derive(Debug, Args)]
pub(super) struct ResumeArgs {
    /// Folder of the run
    run: PathBuf,

    #[command(flatten)]
    set: SetArgs,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    memory: MemoryArgs,

    #[command(flatten)]
    progress: ProgressArgs,
}

pub(super) fn run(args: ResumeArgs) -> Result {
    let session = Session::resume(&args.run, &args.set.overrides, args.place.backend()?)?;
    let session = session.stopped_by(stop_on_interrupt());
    let mut session = args.memory.limited(session);
    let mut terminal = args.progress.terminal(&args.run);
    session.train(|event| terminal.show(event))?;
    Ok(())
}
