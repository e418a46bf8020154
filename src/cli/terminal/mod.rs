//! What is shown of a run: a bar, plain lines or nothing on standard error, or JSON on standard output.
//!
//! A bar needs a terminal that can redraw and somebody who looks at it: with `NO_COLOR` or `CI` set, with
//! `TERM=dumb`, or into a file or a pipe, plain lines come instead.

mod bar;
mod pace;
mod plain;
mod verbose;

use std::ffi::OsString;
use std::io::{self, IsTerminal, Stderr, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use isomorph::Event;

use bar::Bar;
use pace::Pace;
use plain::PlainLines;
use verbose::VerboseLines;

/// Where the events of a run go.
#[derive(Debug)]
pub(super) struct Terminal(View);

#[derive(Debug)]
enum View {
    Nothing,
    Json(Pace),
    Lines(PlainLines<Stderr>),
    All(VerboseLines<Stderr>),
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

    /// All events of the run in this folder, as lines.
    pub(super) fn verbose(run: &Path) -> Self {
        Self(View::All(VerboseLines::new(
            io::stderr(),
            run.to_path_buf(),
            Instant::now(),
        )))
    }

    /// Events as JSON on standard output.
    pub(super) fn json() -> Self {
        Self(View::Json(Pace::default()))
    }

    /// Shows an event. A terminal that has gone away is ignored.
    pub(super) fn show(&mut self, event: &Event) {
        let now = Instant::now();
        match &mut self.0 {
            View::Nothing => {}
            View::Json(pace) => {
                pace.observe(event, now);
                let mut value = event.json();
                if matches!(event, Event::Step(_)) {
                    value["seconds_left"] = pace.left().map(|left| left.as_secs_f64()).into();
                }
                // In one write, so that lines of other processes do not get into it.
                let _ = io::stdout().write_all(format!("{value}\n").as_bytes());
            }
            View::Lines(lines) => lines.show(event, now),
            View::All(lines) => lines.show(event, now),
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
