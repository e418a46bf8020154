//! The files that a run leaves about itself: `run.log`, a line per event with its UTC time, and
//! `metrics.jsonl`, an object per logged step.
//!
//! ```text
//! 2026-03-01T12:00:00Z checkpoint after step 500: runs/fox/checkpoints/step-000500
//! ```
//!
//! Lines are appended whole, each in one write, so that a killed run has lost at most its last one.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::metrics::{self, Metrics};
use crate::event::{Event, StepReport};

/// `run.log` and `metrics.jsonl` of one run.
#[derive(Debug)]
pub(super) struct RunLog {
    run: PathBuf,
    log: File,
    /// Opened by the first event of training: extraction leaves the metrics alone.
    metrics: Option<File>,
    resumed_from: Option<usize>,
}

impl RunLog {
    /// Opens `run.log` in the folder of a run, to go on at its end.
    ///
    /// When training starts, the metrics of steps after `resumed_from`, or all of them with `None`, are
    /// removed: these steps are done again. A run that is not trained any further may pass anything.
    ///
    /// # Errors
    /// What the file system says; the message names the file.
    pub(super) fn open(run: &Path, resumed_from: Option<usize>) -> io::Result<Self> {
        let path = run.join("run.log");
        let log = append(&path)
            .and_then(end_torn_line)
            .map_err(|error| at(&path, error))?;
        Ok(Self {
            run: run.to_path_buf(),
            log,
            metrics: None,
            resumed_from,
        })
    }

    /// Appends an event to the files that it belongs in.
    ///
    /// # Errors
    /// What the file system says; the message names the file.
    pub(super) fn record(&mut self, event: &Event) -> io::Result<()> {
        if let Some(text) = event.line(None) {
            let stamped = stamped(SystemTime::now(), &text);
            let written = self.log.write_all(stamped.as_bytes());
            written.map_err(|error| at(&self.run.join("run.log"), error))?;
        }
        match event {
            Event::Started { .. } => self.metrics().map(|_| ()),
            Event::Step(report) => self.record_step(report),
            _ => Ok(()),
        }
    }

    fn record_step(&mut self, report: &StepReport) -> io::Result<()> {
        let mut text = serde_json::to_string(&Metrics::from(report))?;
        text.push('\n');
        let written = self.metrics()?.write_all(text.as_bytes());
        written.map_err(|error| at(&self.run.join(metrics::FILE), error))
    }

    /// The metrics, without the steps that are done again.
    fn metrics(&mut self) -> io::Result<&mut File> {
        let file = match self.metrics.take() {
            Some(file) => file,
            None => {
                let path = self.run.join(metrics::FILE);
                metrics::keep_until(&path, self.resumed_from.unwrap_or(0))?;
                append(&path).map_err(|error| at(&path, error))?
            }
        };
        Ok(self.metrics.insert(file))
    }
}

fn append(path: &Path) -> io::Result<File> {
    OpenOptions::new()
        .read(true)
        .append(true)
        .create(true)
        .open(path)
}

/// Ends a line that a killed run left without its end, so that the next one stands alone.
fn end_torn_line(mut file: File) -> io::Result<File> {
    if file.metadata()?.len() > 0 {
        let mut last = [0];
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)?;
        if last != *b"\n" {
            file.write_all(b"\n")?;
        }
    }
    Ok(file)
}

/// A line of `run.log`, with its end.
fn stamped(now: SystemTime, text: &str) -> String {
    format!("{} {text}\n", humantime::format_rfc3339_seconds(now))
}

fn at(path: &Path, error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

#[cfg(test)]
#[path = "log_tests.rs"]
mod tests;
