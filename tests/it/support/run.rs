//! The folder of a run, as a user finds it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::workplace::names;

/// The folder of a run.
#[derive(Clone, Debug)]
pub(crate) struct Run(pub(crate) PathBuf);

/// One line of `metrics.jsonl`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Logged {
    pub(crate) step: u64,
    pub(crate) phase: String,
    /// The terms before their weights, by name.
    pub(crate) terms: BTreeMap<String, f64>,
}

/// One entry of `frames.json`.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) time: f64,
    pub(crate) surface: PathBuf,
    pub(crate) carried: Option<PathBuf>,
    /// Mean over the surface's vertices of ||grad f| - 1|.
    pub(crate) slope_error: f64,
}

impl Run {
    /// A file or folder in it.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// The names of the checkpoints, oldest first.
    pub(crate) fn checkpoints(&self) -> Vec<String> {
        names(&self.path("checkpoints"))
    }

    /// The folder of the newest checkpoint.
    pub(crate) fn newest(&self) -> PathBuf {
        let all = self.checkpoints();
        self.path("checkpoints")
            .join(all.last().expect("at least one checkpoint"))
    }

    /// The steps done in the newest checkpoint.
    pub(crate) fn step(&self) -> u64 {
        self.state()["step"].as_u64().expect("a step")
    }

    /// `state.json` of the newest checkpoint.
    pub(crate) fn state(&self) -> Value {
        json(&self.newest().join("state.json"))
    }

    /// The networks of the newest checkpoint as bytes, by the names of their files: `ends.mpk` and
    /// `velocity.mpk` of the flow, `implicit.mpk` and `velocity.mpk` of the paper's geometry. (The records of
    /// the optimisers hold the same numbers in an order that differs from one process to the next.)
    pub(crate) fn networks(&self) -> BTreeMap<String, Vec<u8>> {
        let newest = self.newest();
        let is_network = |name: &String| name.ends_with(".mpk") && !name.contains("optimiser");
        let files = names(&newest).into_iter().filter(is_network);
        let networks: BTreeMap<_, _> = files
            .map(|name| {
                let record = fs::read(newest.join(&name)).expect("a record");
                (name, record)
            })
            .collect();
        assert!(!networks.is_empty(), "{}: no network", newest.display());
        networks
    }

    /// `metrics.jsonl`.
    pub(crate) fn metrics(&self) -> Vec<Logged> {
        let text = fs::read_to_string(self.path("metrics.jsonl")).expect("metrics");
        assert!(
            text.is_empty() || text.ends_with('\n'),
            "a torn last line: {text:?}"
        );
        let logged = text.lines().map(|line| {
            let value: Value = serde_json::from_str(line).expect("a line of JSON");
            let terms = value["terms"].as_object().expect("terms").iter();
            Logged {
                step: value["step"].as_u64().expect("a step"),
                phase: value["phase"].as_str().expect("a phase").to_owned(),
                terms: terms
                    .map(|(name, term)| (name.clone(), term["raw"].as_f64().expect("a number")))
                    .collect(),
            }
        });
        logged.collect()
    }

    /// The steps in `metrics.jsonl`.
    pub(crate) fn logged_steps(&self) -> Vec<u64> {
        self.metrics().iter().map(|logged| logged.step).collect()
    }

    /// A copy of it as it was when a checkpoint had just been written, except that `metrics.jsonl` knows
    /// the steps after it already, as after a kill.
    pub(crate) fn cut_at(&self, step: u64, copy: &Run) {
        copy_folder(&self.0, &copy.0);
        for name in copy.checkpoints() {
            let number: u64 = name.trim_start_matches("step-").parse().expect("a step");
            if number > step {
                fs::remove_dir_all(copy.path("checkpoints").join(name)).expect("a folder");
            }
        }
        assert_eq!(copy.step(), step, "the run kept a checkpoint there");
    }
}

/// Copies a folder with all that is in it.
pub(crate) fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for name in names(from) {
        let (from, to) = (from.join(&name), to.join(&name));
        if from.is_dir() {
            copy_folder(&from, &to);
        } else {
            fs::copy(&from, &to).expect("a copy");
        }
    }
}

/// Reads a JSON file.
pub(crate) fn json(path: &Path) -> Value {
    let text =
        fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Reads `frames.json` in a folder.
pub(crate) fn frames(folder: &Path) -> Vec<Frame> {
    let value = json(&folder.join("frames.json"));
    let frames = value.as_array().expect("a list").iter().map(|entry| Frame {
        time: entry["time"].as_f64().expect("a time"),
        surface: folder.join(entry["surface"].as_str().expect("a file")),
        carried: entry["carried"].as_str().map(|name| folder.join(name)),
        slope_error: entry["slope_error"]
            .as_f64()
            .expect("slope_error, a number"),
    });
    frames.collect()
}
