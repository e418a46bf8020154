//! What standard error shows of a run: a bar, plain lines, or nothing.
//!
//! A bar needs a terminal that can redraw and somebody who looks at it: with `NO_COLOR` or `CI` set, with
//! `TERM=dumb`, or into a file or a pipe, plain lines come instead.

use std::ffi::OsString;
use std::io::{self, IsTerminal, Stderr};
use std::path::Path;
use std::time::Instant;

use super::Verbosity;
use super::bar::Bar;
use super::plain::PlainLines;
use crate::learner::event::Event;

/// Standard error, as far as the events of a run go.
#[derive(Debug)]
pub struct Terminal(View);

#[derive(Debug)]
enum View {
    Nothing,
    Lines(PlainLines<Stderr>),
    Bar(Box<Bar<Stderr>>),
}

impl Terminal {
    /// Looks at the environment and chooses how to show the run in this folder.
    pub fn new(run: &Path, verbosity: Verbosity) -> Self {
        let redraws = redraws(io::stderr().is_terminal(), |name| std::env::var_os(name));
        Self(match verbosity {
            Verbosity::Quiet => View::Nothing,
            Verbosity::Normal if redraws => View::Bar(Box::new(Bar::new(
                io::stderr(),
                run.to_path_buf(),
                Instant::now(),
            ))),
            Verbosity::Normal => View::Lines(PlainLines::new(io::stderr(), run.to_path_buf())),
        })
    }

    /// Shows an event. A terminal that has gone away is ignored.
    pub fn show(&mut self, event: &Event) {
        let now = Instant::now();
        match &mut self.0 {
            View::Nothing => {}
            View::Lines(lines) => lines.show(event, now),
            View::Bar(bar) => bar.show(event, now),
        }
    }
}

/// Whether a bar can be drawn, by the environment's variables.
fn redraws(is_terminal: bool, variable: impl Fn(&str) -> Option<OsString>) -> bool {
    let is_set = |name| variable(name).is_some_and(|value| !value.is_empty());
    let is_dumb = variable("TERM").is_some_and(|value| value == "dumb");
    is_terminal && !is_dumb && !is_set("NO_COLOR") && !is_set("CI")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_needs_a_terminal_that_redraws_and_somebody_who_looks() {
        let with = |set: &'static [(&str, &str)]| {
            move |name: &str| {
                let found = set.iter().find(|(key, _)| *key == name);
                found.map(|(_, value)| OsString::from(value))
            }
        };
        assert!(redraws(true, with(&[])));
        assert!(redraws(
            true,
            with(&[("TERM", "xterm"), ("NO_COLOR", ""), ("CI", "")])
        ));
        assert!(
            !redraws(false, with(&[("TERM", "xterm")])),
            "a file or a pipe"
        );
        assert!(!redraws(true, with(&[("TERM", "dumb")])));
        assert!(!redraws(true, with(&[("NO_COLOR", "1")])));
        assert!(!redraws(true, with(&[("CI", "true")])));
    }
}
