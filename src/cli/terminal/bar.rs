//! The bar of a terminal: steps, phase, time passed and time left, and the largest terms. All that is
//! worth keeping scrolls by above it.
//!
//! ```text
//!  812/4000 [===>            ] joint, 1m10s, 4m35s left, total 1.23 (matching 0.810, …)
//! ```

use std::io::{Stderr, Write};
use std::path::PathBuf;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use isomorph::Event;
use isomorph::event::duration;

use super::pace::Pace;
use super::told;

/// The message takes what is left of the terminal's width and is cut there.
const TEMPLATE: &str = "{pos:>4}/{len} [{bar:16}] {wide_msg}";

/// Where lines can be written and a bar be drawn below them.
pub(super) trait Screen: Write {
    /// The same screen for a bar.
    fn target(&self) -> ProgressDrawTarget;
}

impl Screen for Stderr {
    fn target(&self) -> ProgressDrawTarget {
        ProgressDrawTarget::stderr()
    }
}

/// Draws one bar at a time, of matching, training, extraction or measuring, below the lines of its events.
#[derive(Debug)]
pub(super) struct Bar<S> {
    screen: S,
    bar: Option<ProgressBar>,
    run: PathBuf,
    pace: Pace,
    started: Instant,
    phase: String,
    objective: String,
}

impl<S: Screen> Bar<S> {
    pub(super) fn new(screen: S, run: PathBuf, now: Instant) -> Self {
        Self {
            screen,
            bar: None,
            run,
            pace: Pace::default(),
            started: now,
            phase: String::new(),
            objective: String::new(),
        }
    }

    /// Draws an event that happened now.
    pub(super) fn show(&mut self, event: &Event, now: Instant) {
        self.pace.observe(event, now);
        match event {
            Event::Tick { step } => self.advance(*step, now),
            Event::Measuring { done, total } => self.measure(*done, *total),
            Event::Step(report) => self.objective = format!(", {}", report.objective()),
            _ => self.tell(event, now),
        }
    }

    /// Prints the line of an event above the bar, which it may begin, move or end.
    fn tell(&mut self, event: &Event, now: Instant) {
        if matches!(event, Event::Interrupted { .. } | Event::Finished { .. }) {
            self.clear();
        }
        if let Some(text) = told(event, &self.run, None) {
            self.print(&text);
        }
        match event {
            Event::Started {
                steps, first_step, ..
            } => {
                self.started = now;
                self.begin(*steps, *first_step);
            }
            Event::PhaseEntered { phase, .. } => self.phase = phase.to_string(),
            Event::Matching { done, total, .. } => self.find(event, *done, *total),
            Event::Extracting { frames } => self.begin(*frames, 0),
            Event::Extracted { .. } => self.extracted(),
            _ => {}
        }
    }

    /// Prints a line above the bar. The terminal may be gone; that is no reason to stop training.
    fn print(&mut self, text: &str) {
        let text = format!("{text}\n");
        let _ = match &self.bar {
            // The bar's own way to print ends lines by filling them with spaces.
            Some(bar) => bar.suspend(|| self.screen.write_all(text.as_bytes())),
            None => self.screen.write_all(text.as_bytes()),
        };
    }

    fn begin(&mut self, length: usize, position: usize) {
        self.clear();
        let style = ProgressStyle::with_template(TEMPLATE).expect("the template is a constant");
        let bar = ProgressBar::with_draw_target(Some(length as u64), self.screen.target());
        // The position comes before the first draw, so that a resumed bar never shows 0.
        let bar = bar
            .with_position(position as u64)
            .with_style(style.progress_chars("=> "));
        self.bar = Some(bar);
    }

    fn advance(&self, step: usize, now: Instant) {
        let Some(bar) = &self.bar else { return };
        let passed = duration(now.duration_since(self.started).as_secs_f64());
        let left = match self.pace.left() {
            Some(left) => format!(", {} left", duration(left.as_secs_f64())),
            None => String::new(),
        };
        bar.set_position(step as u64);
        bar.set_message(format!("{}, {passed}{left}{}", self.phase, self.objective));
    }

    /// Frames that are measured: the bar begins with the first report and ends with the last.
    fn measure(&mut self, done: usize, total: usize) {
        if self.bar.is_none() {
            self.begin(total, 0);
        }
        let Some(bar) = &self.bar else { return };
        bar.set_position(done as u64);
        bar.set_message(match done {
            0 => "finding the best times",
            _ => "measuring",
        });
        if done >= total {
            self.clear();
        }
    }

    /// Pairs that are found: a bar for each stage, which ends with it.
    fn find(&mut self, event: &Event, done: usize, total: usize) {
        if done == 0 || self.bar.is_none() {
            self.begin(total, done);
        }
        let Some(bar) = &self.bar else { return };
        bar.set_position(done as u64);
        bar.set_message(event.to_string());
        if done >= total {
            self.clear();
        }
    }

    fn extracted(&mut self) {
        let Some(bar) = &self.bar else { return };
        bar.inc(1);
        if Some(bar.position()) >= bar.length() {
            self.clear();
        }
    }

    fn clear(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
#[path = "bar_tests.rs"]
mod tests;
