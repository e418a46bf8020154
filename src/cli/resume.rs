//! `isomorph resume`: goes on from the newest checkpoint of a run.

use std::path::PathBuf;

use clap::Args;
use isomorph::{Appended, Session};

use super::{BackendArgs, MemoryArgs, ProgressArgs, Result, SetArgs, stop_on_interrupt};

/// Go on with an interrupted run, train a finished one for longer, or append shapes to it
///
/// The run goes on from its newest checkpoint, on any backend that has its method. It ends in the same
/// networks as if it had never stopped. You may change any key except those of the method and of the
/// networks. Use --set or the run's recipe.toml, for example for more steps.
#[derive(Debug, Args)]
pub(super) struct ResumeArgs {
    /// Folder of the run
    run: PathBuf,

    /// Further shapes, which the motion goes on to after the run's last one. What is there is kept
    #[arg(long, value_name = "FILE", num_args = 1..)]
    append: Vec<PathBuf>,

    /// Times of the appended shapes, in the run's own unit [default: as far apart as the run's last two]
    #[arg(
        long,
        value_name = "A,B,C",
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires = "append"
    )]
    times: Option<Vec<f64>>,

    /// Pairs of points to the appended shapes: a file, same-vertices, match or none [default: as between the run's last
    /// two]
    #[arg(long, value_name = "FILE", requires = "append")]
    pairs: Option<String>,

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
    let appended = Appended {
        shapes: args.append,
        times: args.times,
        known: args.pairs,
    };
    let (backend, changes) = (args.place.backend()?, &args.set.overrides);
    let session = Session::append(&args.run, &appended, changes, backend)?;
    let session = session.stopped_by(stop_on_interrupt());
    let mut session = args.memory.limited(session);
    let mut terminal = args.progress.terminal(&args.run);
    session.train(|event| terminal.show(event))?;
    Ok(())
}
