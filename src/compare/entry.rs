//! What is known of one method on one pair, and where and how it was made.

use std::fmt;
use std::fs;
use std::time::SystemTime;

use serde::{Deserialize, Serialize};

use super::plan::FramePair;
use crate::evaluate::Evaluation;

/// One method on one pair of frames: what was run, and what came out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The name of the sequence.
    pub sequence: String,
    /// The frames that the method saw.
    #[serde(flatten)]
    pub pair: FramePair,
    /// How the method was run.
    #[serde(flatten)]
    pub run: Run,
    /// The resolved recipe, TOML.
    pub recipe: String,
    /// What was measured.
    pub evaluation: Evaluation,
}

/// How a method was run on a pair: what its file and the comparison both hold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The label of the method, see [`super::MethodPlan::label`].
    pub method: String,
    /// The fingerprint of all that decides the result, see [`super::Inputs::digest`].
    pub digest: String,
    /// Training steps.
    pub steps: usize,
    /// Points per step.
    pub batch: usize,
    /// The networks that were trained.
    pub networks: Vec<Network>,
    /// Wall time of the training.
    pub training_seconds: f64,
    /// Wall time of the evaluation.
    pub evaluation_seconds: f64,
    /// Where it ran.
    pub machine: Machine,
    /// When it was done, RFC 3339 in UTC, see [`now`].
    pub date: String,
    /// How the program was called, see [`command_line`].
    pub command: String,
}

/// A network and its size.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Network {
    /// What it represents, such as "implicit".
    pub name: String,
    /// How many weights it has.
    pub parameters: usize,
}

/// A machine, as far as it explains a training time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Logical cores that this process may use.
    pub cores: usize,
    /// The processor's model.
    pub cpu: String,
}

impl Machine {
    /// This one.
    #[must_use]
    pub fn this() -> Self {
        Self {
            cores: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            cpu: fs::read_to_string("/proc/cpuinfo")
                .ok()
                .and_then(|text| model(&text))
                .unwrap_or_else(|| format!("{} processor", std::env::consts::ARCH)),
        }
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cores = if self.cores == 1 { "core" } else { "cores" };
        write!(out, "{} {cores} of {}", self.cores, self.cpu)
    }
}

/// The model that Linux names in `/proc/cpuinfo`, if it names one.
fn model(cpuinfo: &str) -> Option<String> {
    cpuinfo
        .lines()
        .filter_map(|line| line.split_once(':'))
        .find(|(key, _)| key.trim() == "model name")
        .map(|(_, name)| name.split_whitespace().collect::<Vec<_>>().join(" "))
        .filter(|name| !name.is_empty())
}

/// The time, RFC 3339 in UTC, to the second.
#[must_use]
pub(crate) fn now() -> String {
    humantime::format_rfc3339_seconds(SystemTime::now()).to_string()
}

/// A command as a shell would take it: arguments with anything but plain letters are quoted.
#[must_use]
pub fn command_line(arguments: impl IntoIterator<Item = String>) -> String {
    let quoted: Vec<String> = arguments.into_iter().map(quoted).collect();
    quoted.join(" ")
}

fn quoted(argument: String) -> String {
    let is_plain = |letter: char| letter.is_alphanumeric() || "-_./,=:+@%".contains(letter);
    if !argument.is_empty() && argument.chars().all(is_plain) {
        argument
    } else {
        format!("'{}'", argument.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_the_first_that_linux_names() {
        let text = "processor\t: 0\nmodel name\t: Some  CPU @ 2.0GHz\nmodel name\t: Other\n";
        assert_eq!(model(text).as_deref(), Some("Some CPU @ 2.0GHz"));
        // Several ARM kernels name none.
        assert_eq!(model("processor\t: 0\nBogoMIPS\t: 50\n"), None);
    }

    #[test]
    fn a_command_can_be_pasted_into_a_shell() {
        let arguments = [
            "isomorph",
            "--set",
            "a.b=1",
            "--variant",
            "it's=quick,a.b=1",
            "",
        ];
        let command = command_line(arguments.map(str::to_owned));
        assert_eq!(
            command,
            r"isomorph --set a.b=1 --variant 'it'\''s=quick,a.b=1' ''"
        );
    }

    #[test]
    fn the_date_is_utc_to_the_second() {
        let date = now();
        assert_eq!(date.len(), "2026-03-01T12:00:00Z".len(), "{date}");
        assert!(date.ends_with('Z'), "{date}");
        assert!(humantime::parse_rfc3339(&date).is_ok(), "{date}");
    }
}
