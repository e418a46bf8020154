//! What a run has logged, for the page of the run: its terms over the steps, and what somebody should read.

use std::collections::{BTreeMap, BTreeSet};

use super::metrics::Metrics;
use super::trained::Trained;
use crate::viewer::thinned_cloud;

/// Logged steps that are shown.
const STEPS: usize = 400;

/// Each term of the objective over the logged steps, and their sum.
pub(super) fn series(metrics: &[Metrics]) -> (Vec<usize>, BTreeMap<String, Vec<Option<f64>>>) {
    let chosen = thinned_cloud(metrics.len(), STEPS);
    let some: Vec<&Metrics> = chosen.iter().map(|k| &metrics[*k as usize]).collect();
    let names: BTreeSet<&String> = some.iter().flat_map(|step| step.terms.keys()).collect();
    let mut series = BTreeMap::new();
    for name in names {
        let value = |step: &&Metrics| step.terms.get(name).and_then(|term| term.weighted);
        series.insert(name.clone(), some.iter().map(value).collect());
    }
    series.insert(
        "total".to_owned(),
        some.iter().map(|step| step.total).collect(),
    );
    (some.iter().map(|step| step.step).collect(), series)
}

/// What `run.log` says that somebody should read, each once.
pub(super) fn notes_of(trained: &Trained) -> Vec<String> {
    let text = std::fs::read_to_string(trained.folder().path().join("run.log"));
    let mut notes: Vec<String> = Vec::new();
    for line in text.unwrap_or_default().lines() {
        let Some((_, text)) = line.split_once(' ') else {
            continue;
        };
        let warns = ["the box cuts it off", "no zero in the box", "doubtful: "];
        let is_warning = warns.iter().any(|known| text.contains(known));
        let note = match text.strip_prefix("note: ") {
            Some(note) => note,
            None if is_warning => text,
            None => continue,
        };
        if !notes.iter().any(|known| known == note) {
            notes.push(note.to_owned());
        }
    }
    notes
}
