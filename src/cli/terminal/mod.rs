//! What standard error shows of a run: a bar, plain lines, or nothing.
//!
//! A bar needs a terminal that can redraw and somebody who looks at it: with `NO_COLOR` or `CI` set, with
//! `TERM=dumb`, or into a file or a pipe, plain lines come instead.

mod bar;
mod pace;
mod plain;

use std::ffi::OsString;
use std::io::{self, IsTerminal, Stderr};
use std::path::Path;
use std::time::{Duration, Instant};

use isomorph::Event;

use bar::Bar;
use plain::PlainLines;

/// Standard error, as far as the events of a run go.
#[derive(Debug)]
pub(super) struct Terminal(View);

#[derive(Debug)]
enum View {
    Nothing,
    Lines(PlainLines<Stderr>),
    Bar(Box<Bar<Stderr>>),
}

impl Terminal {
    /// Looks at the environment and chooses how to show the run in this folder.
    pub(super) fn new(run: &Path, quiet: bool) -> Self {
        let redraws = redraws(io::stderr().is_terminal(), |name| std::env::var_os(name));
        Self(match quiet {
            true => View::Nothing,
            false if redraws => View::Bar(Box::new(Bar::new(
                io::stderr(),
                run.to_path_buf(),
                Instant::now(),
            ))),
            false => View::Lines(PlainLines::new(io::stderr(), run.to_path_buf())),
        })
    }

    /// Shows an event. A terminal that has gone away is ignored.
    pub(super) fn show(&mut self, event: &Event) {
        let now = Instant::now();
        match &mut self.0 {
            View::Nothing => {}
            View::Lines(lines) => lines.show(event, now),
            View::Bar(bar) => bar.show(event, now),
        }
    }
}

/// An event as a line for somebody at a terminal, who can type a command.
fn told(event: &Event, run: &Path, left: Option<Duration>) -> Option<String> {
    let text = event.line(left)?;
    Some(match event {
        Event::Interrupted { .. } => {
            format!("{text}; go on with `isomorph resume {}`", run.display())
        }
        _ => text,
    })
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
