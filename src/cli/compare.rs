//! `isomorph compare`: methods side by side on the pairs of a sequence, under one budget.

use std::path::PathBuf;

use clap::Args;
use isomorph::comparison::{CompareOptions, command_line, compare, table};

use super::evaluate::PrecisionArgs;
use super::{BackendArgs, QuietArgs, Result, SetArgs, print, stop_on_interrupt};

/// Compare methods on pairs of frames of a sequence, in one table and two figures
///
/// Each method is given the two frames of a pair and 1000 correspondences. It is measured on the frames
/// between. Methods of isomorph are the presets instant, quick, default, quality and paper. Other methods are mlp,
/// sdf-blend, lipmlp, nise, nise-velocity, eigenbasis, nfgp and efis, with the networks and steps of quick. They
/// run on the backend flex. Finished runs are reused, so the command can be interrupted and repeated. Every
/// table has two more rows. `linear` interpolates all true vertices on straight lines. `floor` is the noise
/// of the samples.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// Sequence of frames: a .anime file, or a folder of meshes in the order of their names
    #[arg(long, value_name = "SEQUENCE")]
    sequence: PathBuf,

    /// Pairs of frames, such as 0-18,20-47: the first and the last frame of each, counted from 0
    #[arg(long, value_name = "FROM-TO,...")]
    pairs: Option<String>,

    /// Methods, such as quick,lipmlp
    #[arg(long, value_name = "METHOD,...")]
    methods: Option<String>,

    /// A method with changed keys under its own label, such as 'no divergence=quick,loss.divergence=0'
    #[arg(long = "variant", value_name = "LABEL=METHOD,KEY=VALUE,...")]
    variants: Vec<String>,

    #[command(flatten)]
    set: SetArgs,

    #[command(flatten)]
    precision: PrecisionArgs,

    /// Output folder for tables, figures and numbers
    #[arg(long, short, value_name = "DIR", default_value = "results")]
    output: PathBuf,

    /// Folder of the runs
    #[arg(long, value_name = "DIR", default_value = "runs/compare")]
    work: PathBuf,

    /// Print JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    quiet: QuietArgs,
}

pub(super) fn run(args: CompareArgs) -> Result {
    let options = CompareOptions {
        sequence: args.sequence,
        pairs: args.pairs,
        methods: args.methods,
        variants: args.variants,
        changes: args.set.overrides,
        precision: args.precision.options(),
        output: args.output,
        work: args.work,
        backend: args.place.backend()?,
        command: command_line(std::env::args()),
    };
    let mut terminal = args.quiet.terminal(&options.work);
    let stop = stop_on_interrupt();
    let comparison = compare(&options, &stop, |event| terminal.show(event))?;
    if args.json {
        print(&(serde_json::to_string(&comparison)? + "\n"))
    } else {
        print(&table(&comparison))
    }
}
