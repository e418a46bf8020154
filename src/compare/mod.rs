//! The comparison of methods on one sequence: what is run, what was measured and kept, and the table
//! and figure made of it. Training and evaluating are the caller's; nothing here knows burn.
//!
//! | file | what it holds |
//! |---|---|
//! | `plan.rs` | which pairs and which methods: `--pairs`, `--methods`, `--variant` |
//! | `entry.rs` | what is known of one method on one pair, and of the machine it ran on |
//! | `digest.rs` | the fingerprint of all that decides a result |
//! | `store.rs` | the folder of results: one file per pair and method, so that a comparison resumes |
//! | `comparison.rs` | all results side by side, with their means: `comparison.json` |
//! | `table.rs`, `columns.rs` | the same as Markdown: `table.md` |
//! | `figure.rs` | error over time: `error.svg` |
//! | `quality.rs` | error and time of training: `quality.svg` |
//!
//! Arrows run one way: `cli -> compare -> evaluate` (its result types only), `compare -> charts`,
//! `compare -> atomic`.

mod columns;
mod comparison;
mod digest;
mod entry;
mod figure;
mod plan;
mod quality;
mod store;
mod table;
#[cfg(test)]
mod testing;

use std::io;

use crate::atomic::write_atomically;
use crate::charts::ChartError;

pub use comparison::Comparison;
pub(crate) use digest::{DigestError, Inputs};
pub use entry::command_line;
pub(crate) use entry::{Entry, Machine, Network, Run, now};
pub(crate) use figure::error_figure;
pub(crate) use plan::{FramePair, MethodPlan, Plan, PlanError, Request, sequence_name};
pub(crate) use quality::quality_figure;
pub(crate) use store::{Lookup, Store, StoreError, file_stem};
pub use table::table;

/// File of the table in a sequence's folder.
pub(crate) const TABLE: &str = "table.md";
/// File of the comparison in a sequence's folder.
pub(crate) const COMPARISON: &str = "comparison.json";
/// File of the figure in a sequence's folder.
pub(crate) const FIGURE: &str = "error.svg";
/// File of the second figure in a sequence's folder.
pub(crate) const QUALITY: &str = "quality.svg";

/// Why the results could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file system refused; the message names the file.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// A figure cannot be drawn.
    #[error("{FIGURE} or {QUALITY}: {0}")]
    Chart(#[from] ChartError),
}

/// Writes `table.md`, `comparison.json`, `error.svg` and `quality.svg` of what is done so far into the
/// store's folder, each whole, and returns the comparison. With nothing done yet nothing is written.
///
/// # Errors
/// [`ReportError`].
pub(crate) fn write_report(
    store: &Store,
    plan: &Plan,
    entries: &[Entry],
) -> Result<Comparison, ReportError> {
    let comparison = Comparison::new(plan, entries);
    if comparison.pairs.is_empty() {
        return Ok(comparison);
    }
    let json = serde_json::to_string_pretty(&comparison).map_err(io::Error::from)? + "\n";
    let mut files = vec![
        (TABLE, table(&comparison)),
        (COMPARISON, json),
        (FIGURE, error_figure(plan, entries)?),
    ];
    files.extend(quality_figure(&comparison)?.map(|text| (QUALITY, text)));
    for (name, text) in files {
        write_atomically(&store.folder().join(name), |out| {
            out.write_all(text.as_bytes())
        })?;
    }
    Ok(comparison)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_four_files_and_the_json_reads_back_as_the_comparison() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let store = Store::open(folder.path(), "fox_survey").expect("a store");
        let (plan, entries) = testing::two_pairs_of_three_methods();
        let comparison = write_report(&store, &plan, &entries).expect("written");
        let read = |name: &str| std::fs::read_to_string(store.folder().join(name)).expect(name);
        let back: Comparison = serde_json::from_str(&read(COMPARISON)).expect("JSON");
        assert_eq!(back.pairs.len(), comparison.pairs.len());
        assert_eq!(back.mean.len(), 3);
        assert!(read(TABLE).starts_with("# fox_survey"));
        assert!(read(FIGURE).starts_with("<svg") && read(QUALITY).starts_with("<svg"));
    }

    #[test]
    fn nothing_is_written_of_nothing() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let store = Store::open(folder.path(), "fox_survey").expect("a store");
        let (plan, _) = testing::two_pairs_of_three_methods();
        let comparison = write_report(&store, &plan, &[]).expect("nothing to refuse");
        assert!(comparison.pairs.is_empty() && comparison.mean.is_empty());
        assert_eq!(comparison.missing.len(), 6, "three methods on two pairs");
        let left = std::fs::read_dir(store.folder()).expect("a folder").count();
        assert_eq!(left, 0);
    }
}
