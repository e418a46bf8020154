//! The script of a Slurm job array that works through a batch.
//!
//! Task `i` of `N` takes the jobs `i, i + N, ...`, so that any number of jobs fits into an array of any size. Shortly
//! before its time limit a task receives a signal of its own, ends with a checkpoint and puts itself into the queue
//! again. A task that is cancelled (TERM) ends with a checkpoint too, and stays cancelled. After the loss of a node Slurm
//! starts its tasks again, which go on from what the folders hold; nothing else is kept.

use std::fmt::Write;

use super::jobs::Batch;
use crate::error::{Error, Result};

/// What is asked of Slurm.
#[derive(Clone, Debug, PartialEq)]
pub struct Slurm {
    /// The most tasks of the array; Slurm's own limit is 1001 unless the site has another (`MaxArraySize`).
    pub array_size: usize,
    /// The most tasks at a time.
    pub throttle: Option<usize>,
    /// The time limit of a task, as in `2:00:00`.
    pub time: Option<String>,
    /// Memory of a task, as in `2G`.
    pub mem: Option<String>,
    /// Cores of a task.
    pub cpus: usize,
    /// GPUs of a task.
    pub gpus: Option<usize>,
    /// The partition.
    pub partition: Option<String>,
    /// Seconds before the time limit at which a task ends with a checkpoint.
    pub grace: usize,
    /// Further arguments of sbatch, each a line of the script.
    pub sbatch: Vec<String>,
    /// The program, with the arguments that stand before the share of a task.
    pub command: Vec<String>,
}

/// The script, to be given to `sbatch`, and the number of its tasks.
///
/// # Errors
/// A value that would break the script.
pub fn slurm_script(batch: &Batch, slurm: &Slurm) -> Result<(String, usize)> {
    let given = [&slurm.time, &slurm.mem, &slurm.partition];
    let given = given.into_iter().flatten().chain(&slurm.sbatch);
    if let Some(value) = given.clone().find(|value| value.contains(['\n', '\r'])) {
        return Err(Error::usage(format!("{value:?}: has a line break")));
    }
    let tasks = batch.jobs.len().min(slurm.array_size.max(1));
    let folder = std::path::absolute(&batch.folder)?;
    let folder = folder.display();
    let stem = batch.path.file_stem().unwrap_or_default().to_string_lossy();
    let throttle = slurm
        .throttle
        .map_or_else(String::new, |most| format!("%{most}"));
    let mut text = String::from("#!/bin/bash\n");
    let mut line = |word: &str| writeln!(text, "#SBATCH {word}");
    line(&format!("--job-name=isomorph-{stem}"))?;
    line(&format!("--array=0-{}{throttle}", tasks - 1))?;
    line(&format!("--cpus-per-task={}", slurm.cpus))?;
    for (name, value) in [
        ("time", &slurm.time),
        ("mem", &slurm.mem),
        ("partition", &slurm.partition),
    ] {
        if let Some(value) = value {
            line(&format!("--{name}={value}"))?;
        }
    }
    if let Some(gpus) = slurm.gpus {
        line(&format!("--gres=gpu:{gpus}"))?;
    }
    line("--requeue")?;
    line("--open-mode=append")?;
    line(&format!("--signal=B:USR1@{}", slurm.grace))?;
    line(&format!("--output={folder}/slurm/%A_%a.log"))?;
    for extra in &slurm.sbatch {
        line(extra)?;
    }
    let command: Vec<String> = slurm.command.iter().map(|word| shell(word)).collect();
    write!(
        text,
        r#"
# {} jobs in {tasks} tasks: task i takes the jobs i, i + {tasks}, ... What is done is not done again.
{} --share "$SLURM_ARRAY_TASK_ID/{tasks}" &
work=$!

# Shortly before the time limit: a checkpoint, and into the queue again.
again=
trap 'again=yes; kill -TERM "$work"' USR1
# scancel: a checkpoint, and the end.
trap 'kill -TERM "$work"' TERM

# A signal ends `wait` before the work does.
while kill -0 "$work" 2>/dev/null; do
    wait "$work"
    code=$?
done
if [[ $again ]]; then
    scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID"
    exit 0
fi
exit "${{code:-0}}"
"#,
        batch.jobs.len(),
        command.join(" ")
    )?;
    Ok((text, tasks))
}

/// A word as the shell takes it for one.
fn shell(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-=,:+".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stay_words() {
        assert_eq!(shell("/a/b.toml"), "/a/b.toml");
        assert_eq!(shell("my jobs"), "'my jobs'");
        assert_eq!(shell("it's"), "'it'\\''s'");
    }
}
