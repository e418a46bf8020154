//! All results of a sequence side by side: what `compare --json` prints and `comparison.json` holds.
//!
//! ```text
//! {"sequence": …, "isomorph": …,
//!  "pairs": [{"from": …, "to": …,
//!             "methods": [{"method": …, "mean": {as of evaluate}, "file": …, …}…]}…],
//!  "mean": [{"method": …, "mean": {as of evaluate}, "training_seconds": …, …}…],
//!  "missing": [{"from": …, "to": …, "method": …}…]}
//! ```
//!
//! The numbers frame by frame are in the file of each method and pair, which `file` names.

use serde::{Deserialize, Serialize};

use super::entry::{Entry, Run};
use super::plan::{FramePair, Plan};
use super::store::file_name;
use crate::evaluate::{Evaluation, FrameResult};

/// The methods of a plan on the pairs of a sequence, as far as they are done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The name of the sequence.
    pub sequence: String,
    /// The version of the program.
    pub isomorph: String,
    /// The pairs on which anything is done, in the plan's order.
    pub pairs: Vec<PairComparison>,
    /// The means over these pairs, each with the same weight, of the methods that are done on all of
    /// them: a mean over other pairs would compare with nothing.
    pub mean: Vec<MethodMean>,
    /// What the plan holds and is not done.
    pub missing: Vec<Absent>,
}

/// The methods on one pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairComparison {
    /// The frames that the methods saw.
    #[serde(flatten)]
    pub pair: FramePair,
    /// Those that are done, in the plan's order.
    pub methods: Vec<MethodResult>,
}

/// One method on one pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodResult {
    /// How the method was run.
    #[serde(flatten)]
    pub run: Run,
    /// The means over the frames between the two.
    pub mean: FrameResult,
    /// How many frames that is.
    pub frames: usize,
    /// At how many of them the method had no surface: at all of them if it never has one, at some if it
    /// vanished there, and then the mean has none either.
    pub without_surface: usize,
    /// The file beside this one that holds the recipe and the numbers of every frame.
    pub file: String,
}

/// One method, averaged over the pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodMean {
    /// Its label.
    pub method: String,
    /// The mean of the pairs' means.
    pub mean: FrameResult,
    /// Wall time of the training, mean over the pairs.
    pub training_seconds: f64,
    /// Wall time of the evaluation, mean over the pairs.
    pub evaluation_seconds: f64,
}

/// A method that is not done on a pair.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Absent {
    /// The pair.
    #[serde(flatten)]
    pub pair: FramePair,
    /// The label of the method.
    pub method: String,
}

impl Comparison {
    /// Puts the entries of a plan side by side; of entries that are not in the plan nothing is said.
    #[must_use]
    pub fn new(plan: &Plan, entries: &[Entry]) -> Self {
        let mut pairs = Vec::new();
        let mut missing = Vec::new();
        for pair in &plan.pairs {
            let mut methods = Vec::new();
            for method in &plan.methods {
                match find(entries, *pair, &method.label) {
                    Some(entry) => methods.push(MethodResult::new(entry)),
                    None => missing.push(Absent {
                        pair: *pair,
                        method: method.label.clone(),
                    }),
                }
            }
            if !methods.is_empty() {
                pairs.push(PairComparison {
                    pair: *pair,
                    methods,
                });
            }
        }
        let mean = plan
            .methods
            .iter()
            .filter_map(|method| MethodMean::new(&method.label, &pairs))
            .collect();
        Self {
            sequence: plan.sequence.clone(),
            isomorph: env!("CARGO_PKG_VERSION").to_owned(),
            pairs,
            mean,
            missing,
        }
    }
}

/// The entry of a method on a pair.
pub(super) fn find<'a>(entries: &'a [Entry], pair: FramePair, label: &str) -> Option<&'a Entry> {
    entries
        .iter()
        .find(|entry| entry.pair == pair && entry.run.method == label)
}

impl MethodResult {
    fn new(entry: &Entry) -> Self {
        let frames = &entry.evaluation.frames;
        Self {
            run: entry.run.clone(),
            mean: entry.evaluation.mean.clone(),
            frames: frames.len(),
            without_surface: frames
                .iter()
                .filter(|frame| frame.surface.is_none())
                .count(),
            file: file_name(entry.pair, &entry.run.method),
        }
    }
}

impl MethodMean {
    /// The mean over all pairs, if the method is done on all and there are any.
    fn new(label: &str, pairs: &[PairComparison]) -> Option<Self> {
        let of = |pair: &PairComparison| {
            let found = pair
                .methods
                .iter()
                .find(|result| result.run.method == label);
            found.cloned()
        };
        let results: Vec<MethodResult> = pairs.iter().map(of).collect::<Option<_>>()?;
        if results.is_empty() {
            return None;
        }
        let means = results.iter().map(|result| result.mean.clone()).collect();
        let seconds = |read: fn(&MethodResult) -> f64| {
            results.iter().map(read).sum::<f64>() / results.len() as f64
        };
        Some(Self {
            method: label.to_owned(),
            // Averaged over pairs as an evaluation averages over frames.
            mean: Evaluation::of(means).mean,
            training_seconds: seconds(|result| result.run.training_seconds),
            evaluation_seconds: seconds(|result| result.run.evaluation_seconds),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::two_pairs_of_three_methods;
    use super::*;

    #[test]
    fn methods_stand_in_the_plans_order_whatever_the_order_of_the_entries() {
        let (plan, mut entries) = two_pairs_of_three_methods();
        let straight = Comparison::new(&plan, &entries);
        entries.reverse();
        assert_eq!(Comparison::new(&plan, &entries), straight);
        let labels: Vec<&str> = straight
            .mean
            .iter()
            .map(|mean| mean.method.as_str())
            .collect();
        let planned: Vec<&str> = plan.methods.iter().map(|m| m.label.as_str()).collect();
        assert_eq!(labels, planned);
    }

    #[test]
    fn the_mean_weighs_pairs_and_not_frames() {
        let (plan, mut entries) = two_pairs_of_three_methods();
        // Ten times the frames of one pair, with its mean as it was, change nothing.
        let before = Comparison::new(&plan, &entries).mean;
        let frames = entries[0].evaluation.frames.clone();
        for _ in 0..9 {
            entries[0].evaluation.frames.extend(frames.clone());
        }
        assert_eq!(Comparison::new(&plan, &entries).mean, before);
    }

    #[test]
    fn a_result_is_one_flat_object() {
        let (plan, entries) = two_pairs_of_three_methods();
        let result = &Comparison::new(&plan, &entries).pairs[0].methods[0];
        let json = serde_json::to_value(result).expect("JSON");
        let mut keys: Vec<&str> = json
            .as_object()
            .expect("an object")
            .keys()
            .map(String::as_str)
            .collect();
        keys.sort_unstable();
        let expected = [
            "batch",
            "command",
            "date",
            "digest",
            "evaluation_seconds",
            "file",
            "frames",
            "machine",
            "mean",
            "method",
            "networks",
            "steps",
            "training_seconds",
            "without_surface",
        ];
        assert_eq!(keys, expected);
    }

    #[test]
    fn a_method_that_lacks_a_pair_has_no_mean_and_is_listed_as_missing() {
        let (plan, mut entries) = two_pairs_of_three_methods();
        let gone = entries.pop().expect("entries");
        let comparison = Comparison::new(&plan, &entries);
        assert_eq!(comparison.pairs.len(), 2);
        assert!(
            comparison
                .mean
                .iter()
                .all(|mean| mean.method != gone.run.method)
        );
        assert_eq!(comparison.mean.len(), 2);
        let missing = Absent {
            pair: gone.pair,
            method: gone.run.method,
        };
        assert_eq!(comparison.missing, [missing]);
    }
}
