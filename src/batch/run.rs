//! Works through jobs, each in a process of its own.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::jobs::{Batch, Job};
use crate::atomic::write_atomically;
use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::event::Event;
use crate::session::Session;
use crate::session::state::{RunState, run_status};
use crate::session::stop::StopFlag;

/// How often processes are looked at.
const LOOKED: Duration = Duration::from_millis(50);

/// How often runs of other machines are looked at, once nothing else is left.
const WAITED: Duration = Duration::from_secs(5);

/// Which of the jobs: every `of`-th from `index` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// From 0 on.
    pub index: usize,
    /// At least 1.
    pub of: usize,
}

impl Share {
    /// All of them.
    pub const ALL: Self = Self { index: 0, of: 1 };
}

/// How to work through a batch.
#[derive(Clone, Debug)]
pub struct RunBatch {
    /// The program, with the arguments that come before a job's name; it is called with `NAME` at the end.
    pub command: Vec<String>,
    /// Jobs at a time.
    pub at_a_time: usize,
    /// Cores that all of them share.
    pub cores: usize,
    /// Which of the jobs.
    pub share: Share,
}

/// What happened to a job.
#[derive(Clone, Debug, PartialEq)]
pub enum Told<'a> {
    /// It begins, or goes on.
    Started(&'a Job),
    /// It is done, after so many seconds.
    Done(&'a Job, f64),
    /// It failed.
    Failed(&'a Job, String),
    /// Another process works on it; it is looked at again at the end.
    Elsewhere(&'a Job, String),
    /// Nothing new: said many times a second while jobs are worked on, for whoever has other things to look at.
    Nothing,
}

/// How many jobs are in which state after the work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ended {
    /// Done, now or before.
    pub done: usize,
    /// Failed now.
    pub failed: usize,
    /// Not begun or stopped, where the work was stopped.
    pub left: usize,
}

/// Trains the run of one job, or goes on with it; nothing is done if it is finished.
///
/// # Errors
/// Those of [`Session`]; a run of another recipe in its folder.
pub fn run_one(
    batch: &Batch,
    job: &Job,
    backend: Backend,
    stop: StopFlag,
    on_event: impl FnMut(&Event),
) -> Result<()> {
    let session = Session::begin_or_go_on(batch.recipe(job)?, batch.run(job), backend)?;
    if let Some(session) = session {
        session.stopped_by(stop).train(on_event)?;
    }
    Ok(())
}

/// A job in its process.
struct Working<'a> {
    job: &'a Job,
    child: Child,
    begun: Instant,
    /// What it says goes here.
    said: PathBuf,
}

/// Works through the jobs of a share until all are done or have failed, or the flag is set. What is done is not done
/// again, and a failure stops nothing else.
///
/// # Errors
/// The folder cannot be written, or no process begun.
pub fn run(
    batch: &Batch,
    options: &RunBatch,
    stop: &StopFlag,
    mut tell: impl FnMut(Told<'_>, Ended),
) -> Result<Ended> {
    fs::create_dir_all(batch.folder.join("errors"))
        .map_err(|error| Error::failure(error).within(&batch.folder.display().to_string()))?;
    let own = batch.jobs.iter().skip(options.share.index);
    let mut waiting: Vec<&Job> = own.step_by(options.share.of.max(1)).collect();
    let mut ended = Ended {
        left: waiting.len(),
        ..Ended::default()
    };
    waiting.reverse();
    let mut working: Vec<Working<'_>> = Vec::new();
    let mut elsewhere: Vec<&Job> = Vec::new();
    let mut told_to_stop = false;
    loop {
        while !stop.is_set() && working.len() < options.at_a_time.max(1) {
            let Some(job) = waiting.pop() else { break };
            match run_status(batch.run(job)).map(|status| status.state) {
                Ok(RunState::Done) => {
                    count(&mut ended, true);
                    let _ = fs::remove_file(batch.error_file(job));
                }
                Ok(RunState::Running { by }) => {
                    tell(Told::Elsewhere(job, by), ended);
                    elsewhere.push(job);
                }
                _ => {
                    tell(Told::Started(job), ended);
                    working.push(begin(batch, job, options)?);
                }
            }
        }
        if stop.is_set() && !told_to_stop {
            told_to_stop = true;
            working.iter().for_each(|one| interrupt(&one.child));
        }
        let mut k = 0;
        while k < working.len() {
            let Some(status) = working[k].child.try_wait()? else {
                k += 1;
                continue;
            };
            let one = working.swap_remove(k);
            let said = fs::read_to_string(&one.said).unwrap_or_default();
            let reason = reason(&said, status.to_string());
            let file = batch.error_file(one.job);
            let _ = fs::remove_file(&one.said);
            match run_status(batch.run(one.job)).map(|status| status.state) {
                Ok(RunState::Done) => {
                    let _ = fs::remove_file(file);
                    count(&mut ended, true);
                    tell(
                        Told::Done(one.job, one.begun.elapsed().as_secs_f64()),
                        ended,
                    );
                }
                // It was taken by another between two looks.
                Ok(RunState::Running { .. }) => elsewhere.push(one.job),
                _ if stop.is_set() => {}
                _ => {
                    write_atomically(&file, |out| out.write_all(reason.as_bytes()))?;
                    count(&mut ended, false);
                    tell(Told::Failed(one.job, reason), ended);
                }
            }
        }
        let nothing_more = waiting.is_empty() || stop.is_set();
        if working.is_empty() && nothing_more {
            if elsewhere.is_empty() || stop.is_set() {
                return Ok(ended);
            }
            // Whoever has them may be killed: then they are this one's.
            let begun = Instant::now();
            while begun.elapsed() < WAITED && !stop.is_set() {
                std::thread::sleep(LOOKED);
                tell(Told::Nothing, ended);
            }
            waiting.append(&mut elsewhere);
            waiting.retain(|job| {
                let state = run_status(batch.run(job)).map(|status| status.state);
                let is_busy = matches!(state, Ok(RunState::Running { .. }));
                if is_busy {
                    elsewhere.push(job);
                }
                !is_busy
            });
            continue;
        }
        std::thread::sleep(LOOKED);
        tell(Told::Nothing, ended);
    }
}

fn count(ended: &mut Ended, is_done: bool) {
    ended.left -= 1;
    if is_done {
        ended.done += 1;
    } else {
        ended.failed += 1;
    }
}

/// The last line of what a process said, without the word that begins it.
fn reason(said: &str, status: String) -> String {
    let line = said.lines().rev().find(|line| !line.trim().is_empty());
    line.map_or(status, |line| {
        line.strip_prefix("error: ").unwrap_or(line).to_owned()
    })
}

fn begin<'a>(batch: &Batch, job: &'a Job, options: &RunBatch) -> Result<Working<'a>> {
    let said = batch.error_file(job).with_extension("log");
    let threads = (options.cores / options.at_a_time.max(1)).max(1);
    let child = Command::new(Path::new(&options.command[0]))
        .args(&options.command[1..])
        .arg(&job.name)
        .env("RAYON_NUM_THREADS", threads.to_string())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(fs::File::create(&said)?)
        .spawn()
        .map_err(|error| Error::failure(error).within(&options.command[0]))?;
    Ok(Working {
        job,
        child,
        begun: Instant::now(),
        said,
    })
}

/// Asks a process to end with a checkpoint.
#[cfg(unix)]
fn interrupt(child: &Child) {
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;
    // One that has ended meanwhile needs none.
    let _ = kill(Pid::from_raw(child.id() as i32), Signal::SIGTERM);
}

#[cfg(not(unix))]
fn interrupt(_: &Child) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_is_the_last_line() {
        let said = "doubtful: x\nerror: a.ply: it is empty\n\n";
        assert_eq!(reason(said, "exit status: 1".into()), "a.ply: it is empty");
        assert_eq!(reason("", "signal: 9".into()), "signal: 9");
    }
}
