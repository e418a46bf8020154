//! `metrics.jsonl`: one JSON object per logged step, in the order of the steps.
//!
//! ```text
//! {"step":500,"phase":"joint","seconds":41.5,"total":1.25,
//!  "terms":{"eikonal":{"raw":0.5,"weighted":0.25},"matching":{"raw":0.005,"weighted":1.0}},
//!  "learning_rate":0.005,"velocity_learning_rate":0.005,"peak_memory_bytes":327155712}
//! ```
//!
//! (on one line). JSON has no NaN and no infinity: such values are null.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::atomic::write_atomically;
use crate::event::{Phase, StepReport};

/// The file's name in the folder of a run.
pub(crate) const FILE: &str = "metrics.jsonl";

/// One logged step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Steps done, this one included.
    pub step: usize,
    /// The phase of this step.
    pub phase: Phase,
    /// Seconds of training since the run began, over all resumes.
    pub seconds: f64,
    /// The weighted sum of the terms; `None` if it was not finite.
    pub total: Option<f64>,
    /// The terms that took part, by name.
    pub terms: BTreeMap<String, TermMetrics>,
    /// Learning rate of the Implicit-Net.
    pub learning_rate: f64,
    /// Learning rate of the Velocity-Net.
    pub velocity_learning_rate: f64,
    /// Peak resident memory of the process so far, where the system says.
    pub peak_memory_bytes: Option<u64>,
}

/// One term at one logged step; values that were not finite are `None`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TermMetrics {
    /// Its value before the weight.
    pub raw: Option<f64>,
    /// What it adds to the total.
    pub weighted: Option<f64>,
}

/// Metrics that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum MetricsError {
    /// The file system refused.
    #[error("{path}: {reason}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What it said.
        reason: io::Error,
    },
    /// A line is something else.
    #[error(
        "{path}:{line}: not the metrics of a step ({reason}); delete the line; nothing else needs it"
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it.
        reason: serde_json::Error,
    },
}

impl Metrics {
    /// Reads a file of metrics. A last line without its end, which a running or killed process
    /// leaves, is passed over.
    ///
    /// # Errors
    /// [`MetricsError`].
    pub(crate) fn read(path: &Path) -> Result<Vec<Self>, MetricsError> {
        let bytes = std::fs::read(path).map_err(|reason| MetricsError::Io {
            path: path.to_path_buf(),
            reason,
        })?;
        let parsed = whole_lines(&bytes).enumerate().map(|(index, text)| {
            serde_json::from_slice(text).map_err(|reason| MetricsError::Line {
                path: path.to_path_buf(),
                line: index + 1,
                reason,
            })
        });
        parsed.collect()
    }
}

impl From<&StepReport> for Metrics {
    fn from(report: &StepReport) -> Self {
        let finite = |value: f64| value.is_finite().then_some(value);
        let terms = report.terms.iter().map(|term| {
            let values = TermMetrics {
                raw: finite(term.raw),
                weighted: finite(term.weighted),
            };
            (term.name.to_owned(), values)
        });
        Self {
            step: report.step,
            phase: report.phase,
            seconds: report.seconds,
            total: finite(report.total),
            terms: terms.collect(),
            learning_rate: report.learning_rate,
            velocity_learning_rate: report.velocity_learning_rate,
            peak_memory_bytes: report.peak_memory_bytes,
        }
    }
}

/// Removes every line but those of the first `steps` steps, and a torn last line; a file with nothing to
/// remove is not touched.
pub(crate) fn keep_until(path: &Path, steps: usize) -> io::Result<()> {
    #[derive(Deserialize)]
    struct Step {
        step: usize,
    }
    let bytes = match std::fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        read => read.map_err(|error| {
            io::Error::new(error.kind(), format!("{}: {error}", path.display()))
        })?,
    };
    let kept: Vec<u8> = whole_lines(&bytes)
        .filter(|line| serde_json::from_slice::<Step>(line).is_ok_and(|line| line.step <= steps))
        .flatten()
        .copied()
        .collect();
    if kept.len() == bytes.len() {
        return Ok(());
    }
    write_atomically(path, |out| out.write_all(&kept))
}

/// The lines that have an end, with it.
fn whole_lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes
        .split_inclusive(|byte| *byte == b'\n')
        .filter(|line| line.ends_with(b"\n"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::TermReport;

    fn report() -> StepReport {
        StepReport {
            step: 500,
            steps: 4000,
            phase: Phase::WarmUp,
            seconds: 41.5,
            total: f64::NAN,
            terms: vec![
                TermReport {
                    name: "matching",
                    raw: 0.5,
                    weighted: 100.0,
                },
                TermReport {
                    name: "divergence",
                    raw: f64::INFINITY,
                    weighted: f64::NAN,
                },
            ],
            learning_rate: 0.005,
            velocity_learning_rate: 0.0025,
            peak_memory_bytes: None,
        }
    }

    const LINE: &str = concat!(
        r#"{"step":500,"phase":"warm_up","seconds":41.5,"total":null,"#,
        r#""terms":{"divergence":{"raw":null,"weighted":null},"#,
        r#""matching":{"raw":0.5,"weighted":100.0}},"#,
        r#""learning_rate":0.005,"velocity_learning_rate":0.0025,"peak_memory_bytes":null}"#,
    );

    #[test]
    fn a_line_looks_like_this_and_reads_back() {
        let metrics = Metrics::from(&report());
        assert_eq!(serde_json::to_string(&metrics).expect("plain data"), LINE);
        assert_eq!(
            serde_json::from_str::<Metrics>(LINE).expect("its own line"),
            metrics
        );
    }

    #[test]
    fn reading_passes_over_a_torn_last_line_and_names_a_wrong_one() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join(FILE);
        std::fs::write(&path, format!("{LINE}\n{LINE}\n{{\"step\":52")).expect("a file");
        let read = Metrics::read(&path).expect("two whole lines");
        assert_eq!(read, vec![Metrics::from(&report()); 2]);
        std::fs::write(&path, format!("{LINE}\n{{\"step\":52\n{LINE}\n")).expect("a file");
        let refused = Metrics::read(&path).expect_err("a wrong line").to_string();
        assert!(
            refused.contains("metrics.jsonl:2: not the metrics of a step"),
            "{refused}"
        );
        let absent = Metrics::read(&folder.path().join("none"))
            .expect_err("no file")
            .to_string();
        assert!(absent.contains("none: "), "{absent}");
    }
}
