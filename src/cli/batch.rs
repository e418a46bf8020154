//! `isomorph batch`: many runs from one file of jobs.

use std::path::PathBuf;
use std::process::Command;

use clap::{Args, Subcommand};
use isomorph::Backend;
use isomorph::batch::{
    Batch, RunBatch, Share, Slurm, Told, at_a_time, collect, cores, estimate, run as work_through,
    run_one, slurm_script, statuses,
};
use isomorph::event::duration;
use isomorph::status::RunState;

use super::{BackendArgs, Failure, QuietArgs, Result, print, stop_on_interrupt};

/// Many runs from one file of jobs: on this machine, or as a Slurm job array
///
/// The file names pairs, sequences, all pairs of some files, or each file with the next. Every command may be
/// interrupted and repeated, and the file extended: what is done is not done again. The guide has a chapter on it.
#[derive(Debug, Args)]
pub(super) struct BatchArgs {
    #[command(subcommand)]
    command: BatchCommand,
}

#[derive(Debug, Subcommand)]
enum BatchCommand {
    Plan(PlanArgs),
    Run(RunArgs),
    Status(StatusArgs),
    Collect(CollectArgs),
    Submit(SubmitArgs),
    #[command(hide = true)]
    Job(JobArgs),
}

/// Show what would run, and what it will take
#[derive(Debug, Args)]
struct PlanArgs {
    /// The file of jobs, TOML
    jobs: PathBuf,
}

/// Work through all jobs on this machine, some at a time
///
/// Exit status 1 if a job failed; the others are done all the same.
#[derive(Debug, Args)]
struct RunArgs {
    /// The file of jobs, TOML
    jobs: PathBuf,

    /// Jobs at a time [default: one for each two cores, as far as memory lasts; one on a GPU]
    #[arg(long = "jobs", short = 'n', value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    at_a_time: Option<u32>,

    /// Only every N-th job, from job I (counted from 0) on: the share of one task of an array
    #[arg(long, value_name = "I/N", value_parser = share)]
    share: Option<Share>,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    quiet: QuietArgs,
}

/// Show where all jobs stand, and what failed with what
#[derive(Debug, Args)]
struct StatusArgs {
    /// The file of jobs, TOML
    jobs: PathBuf,

    /// Print one JSON object for each job
    #[arg(long)]
    json: bool,
}

/// Gather the figures of all runs: results.csv, .json and .parquet, and index.html with a picture of each
#[derive(Debug, Args)]
struct CollectArgs {
    /// The file of jobs, TOML
    jobs: PathBuf,
}

/// Submit all jobs as a Slurm job array
///
/// Task i takes the jobs i, i + N and so on. A task ends with a checkpoint before its time limit and puts itself into
/// the queue again. No accounting database is needed: folders alone say what is done.
#[derive(Debug, Args)]
struct SubmitArgs {
    /// The file of jobs, TOML
    jobs: PathBuf,

    /// The kind of cluster; there is this one
    #[arg(long, default_value_t = true)]
    slurm: bool,

    /// Print the script, and submit nothing
    #[arg(long)]
    dry_run: bool,

    /// Most tasks of the array; many sites allow 1000
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
    array_size: u32,

    /// Most tasks at a time
    #[arg(long, value_name = "N")]
    throttle: Option<usize>,

    /// Time limit of a task, as in 2:00:00
    #[arg(long)]
    time: Option<String>,

    /// Memory of a task, as in 2G
    #[arg(long)]
    mem: Option<String>,

    /// Cores of a task
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..))]
    cpus: u32,

    /// GPUs of a task; name --backend wgpu as well
    #[arg(long)]
    gpus: Option<usize>,

    /// Partition
    #[arg(long)]
    partition: Option<String>,

    /// Seconds before the time limit at which a task ends with a checkpoint
    #[arg(long, default_value_t = 120)]
    grace: u32,

    /// A further argument of sbatch, such as --account=lab; may be repeated
    #[arg(long, value_name = "ARGUMENT", allow_hyphen_values = true)]
    sbatch: Vec<String>,

    #[command(flatten)]
    place: BackendArgs,
}

/// Train one job
#[derive(Debug, Args)]
struct JobArgs {
    jobs: PathBuf,

    #[command(flatten)]
    place: BackendArgs,

    name: String,
}

/// `3/100`: job 3, 103, 203 and so on.
fn share(text: &str) -> std::result::Result<Share, String> {
    let parts = text.split_once('/');
    let numbers = parts.and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
    match numbers {
        Some((index, of)) if index < of => Ok(Share { index, of }),
        _ => Err("must be I/N with I from 0 to N - 1, as in 0/100".to_owned()),
    }
}

pub(super) fn run(args: BatchArgs) -> Result {
    match args.command {
        BatchCommand::Plan(args) => plan(&args),
        BatchCommand::Run(args) => work(&args),
        BatchCommand::Status(args) => status(&args),
        BatchCommand::Collect(args) => gather(&args),
        BatchCommand::Submit(args) => submit(&args),
        BatchCommand::Job(args) => {
            let batch = Batch::read(&args.jobs)?;
            let job = batch.job(&args.name)?;
            Ok(run_one(
                &batch,
                job,
                args.place.backend()?,
                stop_on_interrupt(),
                |_| {},
            )?)
        }
    }
}

/// The most jobs of which each is listed; of more the first ones are.
const LISTED: usize = 40;

fn plan(args: &PlanArgs) -> Result {
    let batch = Batch::read(&args.jobs)?;
    let mut text = format!(
        "{} jobs into {}\n",
        batch.jobs.len(),
        batch.folder.display()
    );
    for job in batch.jobs.iter().take(LISTED) {
        let [source, target] = job.files();
        text += &format!("{}  {source} to {target}\n", job.name);
    }
    if batch.jobs.len() > LISTED {
        text += &format!("and {} more\n", batch.jobs.len() - LISTED);
    }
    // What is wrong with a key is wrong with the first recipe already.
    let first = batch.recipe(&batch.jobs[0])?;
    let found = estimate(&batch);
    let at_a_time = at_a_time(found.memory_bytes, &Backend::default());
    let by = if found.is_measured {
        "by those that are done"
    } else {
        "as the preset usually takes; measured once a job is done"
    };
    text += &format!("{} left", found.left);
    if let Some(seconds) = found.seconds {
        let all = seconds * (found.left as f64 / at_a_time as f64).ceil();
        text += &format!(
            ": {} each, {} with {at_a_time} at a time here ({by})",
            duration(seconds),
            duration(all)
        );
    }
    if let Some(bytes) = found.memory_bytes {
        text += &format!("; {} MiB each", bytes.div_ceil(1 << 20));
    }
    text += &format!(
        "\npreset {}, {} surfaces each\n",
        first.preset, first.result.frames
    );
    print(&text)
}

/// This program with the arguments of one job, but for its name.
fn command_of_job(batch: &Batch, place: &BackendArgs, words: &[&str]) -> Result<Vec<String>> {
    let text = |path: PathBuf| path.to_string_lossy().into_owned();
    let program = std::env::current_exe().map_err(Failure::Output)?;
    let jobs = std::path::absolute(&batch.path).map_err(Failure::Output)?;
    let mut command = vec![text(program), "batch".to_owned()];
    command.extend(words.iter().map(|word| (*word).to_owned()));
    command.push(text(jobs));
    command.extend(["--backend".to_owned(), place.backend.clone()]);
    if let Some(device) = &place.device {
        command.extend(["--device".to_owned(), device.clone()]);
    }
    Ok(command)
}

fn work(args: &RunArgs) -> Result {
    let batch = Batch::read(&args.jobs)?;
    // A device that is not there is said once, not by each job.
    let backend = args.place.backend()?;
    batch.recipe(&batch.jobs[0])?;
    let options = RunBatch {
        command: command_of_job(&batch, &args.place, &["job"])?,
        at_a_time: match args.at_a_time {
            Some(wanted) => wanted as usize,
            None => at_a_time(estimate(&batch).memory_bytes, &backend),
        },
        cores: cores(),
        share: args.share.unwrap_or(Share::ALL),
    };
    let stop = stop_on_interrupt();
    let is_said = !args.quiet.quiet;
    let ended = work_through(&batch, &options, &stop, |told, ended| {
        let all = ended.done + ended.failed + ended.left;
        let counted = format!("[{} of {all}]", ended.done + ended.failed);
        match told {
            Told::Failed(job, reason) => eprintln!("{counted} {} failed: {reason}", job.name),
            Told::Done(job, seconds) if is_said => {
                eprintln!("{counted} {} done in {}", job.name, duration(seconds));
            }
            Told::Elsewhere(job, by) if is_said => {
                eprintln!(
                    "{counted} {}: {by} trains it; looked at again at the end",
                    job.name
                );
            }
            _ => {}
        }
    })?;
    if stop.is_set() {
        eprintln!(
            "stopped: {} done, {} failed, {} left; go on with the same command",
            ended.done, ended.failed, ended.left
        );
        return Err(Failure::Stopped);
    }
    if is_said {
        eprintln!("{} done, {} failed", ended.done, ended.failed);
    }
    match ended.failed {
        0 => Ok(()),
        failed => Err(Failure::Failed(format!(
            "{failed} of {} jobs failed; `isomorph batch status {}` lists them",
            ended.done + failed,
            args.jobs.display()
        ))),
    }
}

fn status(args: &StatusArgs) -> Result {
    let batch = Batch::read(&args.jobs)?;
    if args.json {
        for job in statuses(&batch) {
            print(&(serde_json::to_string(&job)? + "\n"))?;
        }
        return Ok(());
    }
    let width = batch
        .jobs
        .iter()
        .map(|job| job.name.len())
        .max()
        .unwrap_or(0);
    let mut counts = [0usize; 5];
    for job in statuses(&batch) {
        let run = &job.run;
        let steps = run.steps.map_or_else(String::new, |steps| {
            format!("{} of {steps} steps", run.step)
        });
        let (index, text) = match &run.state {
            RunState::Waiting => (0, "waiting".to_owned()),
            RunState::Running { by } => (1, format!("running       {steps}, {by}")),
            RunState::Interrupted => (2, format!("interrupted   {steps}")),
            RunState::Failed { reason } => (3, format!("failed        {reason}")),
            RunState::Done => {
                let seconds = run.wall_seconds.map_or_else(String::new, duration);
                let doubts = match run.doubts.len() {
                    0 => String::new(),
                    count => format!(", doubtful ({count})"),
                };
                (4, format!("done          {steps}, {seconds}{doubts}"))
            }
        };
        counts[index] += 1;
        print(&format!("{:width$}  {text}\n", job.name))?;
    }
    let [waiting, running, interrupted, failed, done] = counts;
    print(&format!(
        "{} jobs: {done} done, {running} running, {interrupted} interrupted, {failed} failed, {waiting} waiting\n",
        batch.jobs.len()
    ))
}

fn gather(args: &CollectArgs) -> Result {
    let batch = Batch::read(&args.jobs)?;
    let found = collect(&batch)?;
    let mut text = format!(
        "{} jobs, {} done, {} failed\n",
        found.jobs, found.done, found.failed
    );
    for file in &found.files {
        text += &format!("{}\n", file.display());
    }
    print(&text)
}

fn submit(args: &SubmitArgs) -> Result {
    let batch = Batch::read(&args.jobs)?;
    batch.recipe(&batch.jobs[0])?;
    let mut command = command_of_job(&batch, &args.place, &["run"])?;
    command.extend(["--jobs", "1", "--quiet"].map(str::to_owned));
    debug_assert!(args.slurm, "a flag that is set stays set");
    let slurm = Slurm {
        array_size: args.array_size as usize,
        throttle: args.throttle,
        time: args.time.clone(),
        mem: args.mem.clone(),
        cpus: args.cpus as usize,
        gpus: args.gpus,
        partition: args.partition.clone(),
        grace: args.grace as usize,
        sbatch: args.sbatch.clone(),
        command,
    };
    let (script, tasks) = slurm_script(&batch, &slurm)?;
    if args.dry_run {
        return print(&script);
    }
    std::fs::create_dir_all(batch.folder.join("slurm")).map_err(Failure::Output)?;
    let file = batch.folder.join("slurm.sh");
    std::fs::write(&file, script).map_err(Failure::Output)?;
    let ended = Command::new("sbatch").arg("--parsable").arg(&file).output();
    let ended = ended.map_err(|error| {
        Failure::Failed(format!(
            "sbatch: {error}; run this on a machine of the cluster, or submit {} there",
            file.display()
        ))
    })?;
    if !ended.status.success() {
        let said = String::from_utf8_lossy(&ended.stderr);
        return Err(Failure::Failed(said.trim().replace('\n', " ")));
    }
    let number = String::from_utf8_lossy(&ended.stdout).trim().to_owned();
    print(&format!(
        "job {number}: {} jobs in {tasks} tasks; script {}\n",
        batch.jobs.len(),
        file.display()
    ))
}
