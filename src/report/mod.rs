//! What people and programs see of a run: the events of the learner as text and numbers.
//!
//! | file | what it holds |
//! |---|---|
//! | `terminal.rs` | what standard error shows: a bar, plain lines, or nothing |
//! | `bar.rs` | the bar of a terminal |
//! | `plain.rs` | lines at a sensible rate where there is no terminal |
//! | `line.rs` | each event as one line of text |
//! | `pace.rs` | how long the remaining steps will take |
//! | `log.rs` | `run.log`, with UTC times |
//! | `metrics.rs` | `metrics.jsonl`: one object per logged step, written and read |
//!
//! Nothing here prints to standard output, which is for results.

mod bar;
mod line;
pub mod log;
pub mod metrics;
mod pace;
mod plain;
pub mod terminal;

use std::io;

use crate::learner::event::Event;
use crate::run_directory::RunDirectory;
use log::RunLog;
use terminal::Terminal;

pub use metrics::Metrics;

/// How much is told on standard error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// Errors only, which are not events.
    Quiet,
    /// What happens, as it happens.
    Normal,
}

/// Shows events on standard error and records them in the run's files.
#[derive(Debug)]
pub struct Reporter {
    terminal: Terminal,
    log: RunLog,
}

impl Reporter {
    /// A reporter for the run in this folder; `resumed_from` is the step of the checkpoint that
    /// training goes on from.
    ///
    /// # Errors
    /// If `run.log` cannot be opened; the message names it.
    pub fn new(
        run: &RunDirectory,
        resumed_from: Option<usize>,
        verbosity: Verbosity,
    ) -> io::Result<Self> {
        let terminal = Terminal::new(run.path(), verbosity);
        Ok(Self {
            terminal,
            log: RunLog::open(run.path(), resumed_from)?,
        })
    }

    /// Shows and records one event.
    ///
    /// # Errors
    /// If a file of the run cannot be written; the message names it. A terminal that has gone away
    /// is no error: hours of training should not end with it.
    pub fn handle(&mut self, event: &Event) -> io::Result<()> {
        self.terminal.show(event);
        self.log.record(event)
    }
}
