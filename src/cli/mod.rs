//! The command line: one file per subcommand, and what they share. It holds words for people and uses nothing
//! but the library's public API.
//!
//! Results go to standard output, all else to standard error. Exit status: 0 done, 1 failed, 2 usage or
//! a bad recipe, 130 interrupted with a checkpoint written.

#![allow(
    clippy::print_stderr,
    clippy::exit,
    reason = "what talks to people and ends the process is here"
)]

mod batch;
mod bench;
mod clean;
mod compare;
mod completions;
mod evaluate;
mod export;
mod extract;
mod field;
mod info;
mod init;
mod map;
mod match_shapes;
mod morph;
mod new_run;
mod normals;
mod pick;
mod resume;
mod self_test;
mod terminal;
mod times;
mod train;
mod view;
mod warp;

use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::OnceLock;

use bytesize::ByteSize;
use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand};
use isomorph::{Backend, ErrorKind, Session, StopFlag};

use terminal::Terminal;

/// Computes the motion between two 3D shapes, and every shape in between
#[derive(Debug, Parser)]
#[command(
    name = "isomorph",
    version,
    after_help = "First steps:\n  \
        isomorph train data/fox/quick.toml       train on a sample\n  \
        isomorph view runs/fox-quick             look at it in the browser\n  \
        isomorph init a.ply b.ply > pair.toml    write a recipe for two shapes of your own\n  \
        isomorph extract runs/fox-quick --frames 25 --carry"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Morph(morph::MorphArgs),
    Train(train::TrainArgs),
    Resume(resume::ResumeArgs),
    View(view::ViewArgs),
    Extract(extract::ExtractArgs),
    Warp(warp::WarpArgs),
    Map(map::MapArgs),
    Field(field::FieldArgs),
    Export(export::ExportArgs),
    Evaluate(evaluate::EvaluateArgs),
    Compare(compare::CompareArgs),
    Batch(batch::BatchArgs),
    Match(match_shapes::MatchArgs),
    Pick(pick::PickArgs),
    Clean(clean::CleanArgs),
    Normals(normals::NormalsArgs),
    Init(init::InitArgs),
    Info(info::InfoArgs),
    Bench(bench::BenchArgs),
    SelfTest(self_test::SelfTestArgs),
    Completions(completions::CompletionsArgs),
    Man(completions::ManArgs),
}

/// Where networks run.
#[derive(Clone, Debug, Args)]
struct BackendArgs {
    /// Part of burn that does the arithmetic: flex and ndarray run on CPUs, wgpu on GPUs
    #[arg(long, default_value = DEFAULT_BACKEND, value_parser = PossibleValuesParser::new(Backend::NAMES))]
    backend: String,

    /// Device of the backend wgpu: default, cpu, discrete[:N], integrated[:N] or virtual[:N]
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
}

/// The fastest backend that runs on every machine.
const DEFAULT_BACKEND: &str = "flex";

impl BackendArgs {
    /// The backend that was chosen.
    fn backend(&self) -> Result<Backend> {
        Ok(Backend::named(&self.backend, self.device.as_deref())?)
    }
}

/// How much a run may take.
#[derive(Clone, Copy, Debug, Args)]
struct MemoryArgs {
    /// Refuse a run that would take more memory, and end one that does with a checkpoint; such as 2GiB or 800MiB
    #[arg(long, value_name = "SIZE")]
    memory_limit: Option<ByteSize>,
}

impl MemoryArgs {
    /// A session that takes no more.
    fn limited(self, session: Session) -> Session {
        match self.memory_limit {
            Some(limit) => session.within_memory(limit.as_u64()),
            None => session,
        }
    }
}

/// Changes of the recipe from the command line.
#[derive(Clone, Debug, Args)]
struct SetArgs {
    /// Override one key of the recipe; may be repeated
    #[arg(long = "set", value_name = "SECTION.KEY=VALUE")]
    overrides: Vec<String>,
}

/// How much is printed while work goes on.
#[derive(Clone, Copy, Debug, Args)]
struct QuietArgs {
    /// Print errors only
    #[arg(long, short)]
    quiet: bool,
}

impl QuietArgs {
    /// What shows the events of the run in this folder.
    fn terminal(self, run: &Path) -> Terminal {
        Terminal::new(run, self.quiet)
    }
}

/// How progress is reported.
#[derive(Clone, Copy, Debug, Args)]
struct ProgressArgs {
    #[command(flatten)]
    quiet: QuietArgs,

    /// Print events as JSON on standard output, one object per line, and no lines for people
    #[arg(long, conflicts_with = "quiet")]
    json: bool,

    /// Print every event with its second, and every logged step with all of its terms
    #[arg(long, short, conflicts_with_all = ["quiet", "json"])]
    verbose: bool,
}

impl ProgressArgs {
    /// What shows the events of the run in this folder.
    fn terminal(self, run: &Path) -> Terminal {
        match (self.json, self.verbose) {
            (true, _) => Terminal::json(),
            (_, true) => Terminal::verbose(run),
            _ => self.quiet.terminal(run),
        }
    }

    /// Whether lines for people are printed.
    fn is_for_people(self) -> bool {
        !self.json && !self.quiet.quiet
    }
}

/// Why a command failed.
#[derive(Debug)]
enum Failure {
    /// What the library says.
    Library(isomorph::Error),
    /// A mistake on the command line that clap cannot find.
    Usage(String),
    /// What went wrong, in a sentence.
    Failed(String),
    /// It was stopped, which was said.
    Stopped,
    /// Standard output cannot be written.
    Output(io::Error),
    /// This device does not compute what a processor does, which was printed.
    WrongNumbers(String),
    /// The result contradicts its input, which was said line by line.
    Contradicted,
}

/// How a command ended.
type Result<T = ()> = std::result::Result<T, Failure>;

impl From<isomorph::Error> for Failure {
    fn from(error: isomorph::Error) -> Self {
        Self::Library(error)
    }
}

impl From<serde_json::Error> for Failure {
    fn from(error: serde_json::Error) -> Self {
        Self::Output(error.into())
    }
}

impl Failure {
    /// The exit status, after one line for people.
    fn end(self) -> ExitCode {
        let (kind, text) = match self {
            // Whoever read the output has enough of it.
            Self::Output(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                return ExitCode::SUCCESS;
            }
            Self::Output(error) => (ErrorKind::Failure, format!("standard output: {error}")),
            Self::Usage(text) => (ErrorKind::Usage, text),
            Self::Failed(text) => (ErrorKind::Failure, text),
            Self::Stopped => (ErrorKind::Interruption, String::new()),
            Self::Contradicted => (
                ErrorKind::Failure,
                "the result contradicts the shapes that were given (--strict); all files were written".to_owned(),
            ),
            Self::WrongNumbers(device) => (
                ErrorKind::Failure,
                format!("{device}: computes wrong numbers; update its driver, or choose another with --device"),
            ),
            Self::Library(error) => (error.kind(), error.to_string()),
        };
        // The events have said so already, and what to do next.
        if kind != ErrorKind::Interruption {
            eprintln!("error: {text}");
        }
        ExitCode::from(kind.exit_status())
    }
}

/// Runs the command and says how it went.
pub(crate) fn run(cli: Cli) -> ExitCode {
    let ended = match cli.command {
        Command::Morph(args) => morph::run(args),
        Command::Train(args) => train::run(args),
        Command::Resume(args) => resume::run(args),
        Command::View(args) => view::run(args),
        Command::Extract(args) => extract::run(args),
        Command::Warp(args) => warp::run(args),
        Command::Map(args) => map::run(args),
        Command::Field(args) => field::run(args),
        Command::Export(args) => export::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Batch(args) => batch::run(args),
        Command::Match(args) => match_shapes::run(args),
        Command::Pick(args) => pick::run(args),
        Command::Clean(args) => clean::run(args),
        Command::Normals(args) => normals::run(args),
        Command::Init(args) => init::run(args),
        Command::Info(args) => info::run(args),
        Command::Bench(args) => bench::run(args),
        Command::SelfTest(args) => self_test::run(args),
        Command::Completions(args) => completions::completions(&args),
        Command::Man(args) => completions::man(&args),
    };
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.end(),
    }
}

/// Writes a result to standard output.
fn print(text: &str) -> Result {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(Failure::Output)
}

/// Whether two paths lead to one file that is there.
fn is_same_file(one: &Path, other: &Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

/// A flag that Ctrl-C or a request to terminate sets; a second one ends the process at once.
fn stop_on_interrupt() -> StopFlag {
    static STOP: OnceLock<StopFlag> = OnceLock::new();
    let stop = STOP.get_or_init(|| {
        let stop = StopFlag::default();
        let flag = stop.clone();
        let handled = ctrlc::set_handler(move || {
            if flag.set() {
                std::process::exit(i32::from(ErrorKind::Interruption.exit_status()));
            }
        });
        handled.expect("one handler for this process");
        stop
    });
    stop.clone()
}
