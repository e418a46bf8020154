//! Plain lines for a file, a pipe or a terminal that cannot redraw: at a rate that people can read.

use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::pace::Pace;
use super::told;
use isomorph::event::{Event, StepReport};

/// Steps are shown at most this often.
const INTERVAL: Duration = Duration::from_secs(5);

/// Writes events as lines.
#[derive(Debug)]
pub(super) struct PlainLines<W> {
    out: W,
    run: PathBuf,
    pace: Pace,
    shown: Option<Instant>,
}

impl<W: Write> PlainLines<W> {
    pub(super) fn new(out: W, run: PathBuf) -> Self {
        Self {
            out,
            run,
            pace: Pace::default(),
            shown: None,
        }
    }

    /// Writes the line of an event that happened now, if it has one and it is due.
    pub(super) fn show(&mut self, event: &Event, now: Instant) {
        self.pace.observe(event, now);
        if let Event::Step(report) = event {
            if !self.is_due(report, now) {
                return;
            }
            self.shown = Some(now);
        }
        let mut text = told(event, &self.run, self.pace.left());
        match event {
            // Each stage as it begins, and how far it has come only where it takes long.
            Event::Matching { done, .. } => {
                if *done > 0 && self.is_late(now) {
                    text = Some(event.to_string());
                }
                if text.is_some() {
                    self.shown = Some(now);
                }
            }
            Event::Started { .. } => self.shown = None,
            _ => {}
        }
        if let Some(text) = text {
            // In one write, so that lines of other processes do not get into it. Nobody may be
            // reading any more; that is no reason to stop training.
            let _ = self.out.write_all(format!("{text}\n").as_bytes());
        }
    }

    /// The first and the last step are always due, and one that stops the run.
    fn is_due(&self, report: &StepReport, now: Instant) -> bool {
        report.step >= report.steps || !report.total.is_finite() || self.is_late(now)
    }

    /// Whether no step was shown for a while.
    fn is_late(&self, now: Instant) -> bool {
        self.shown
            .is_none_or(|shown| now.duration_since(shown) >= INTERVAL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isomorph::event::{MatchStage, Phase, TermReport};
    use std::path::Path;

    fn report(step: usize, total: f64) -> Event {
        Event::Step(StepReport {
            step,
            steps: 400,
            phase: Phase::Ramp,
            seconds: step as f64,
            total,
            terms: vec![TermReport {
                name: "matching",
                raw: total / 200.0,
                weighted: total,
            }],
            learning_rate: 5e-3,
            velocity_learning_rate: 5e-3,
            peak_memory_bytes: Some(300 << 20),
        })
    }

    /// What is written when these events come at these seconds.
    fn written(events: &[(f64, Event)]) -> String {
        let (mut out, begun) = (Vec::new(), Instant::now());
        let mut lines = PlainLines::new(&mut out, Path::new("runs/fox").to_path_buf());
        for (seconds, event) in events {
            lines.show(event, begun + Duration::from_secs_f64(*seconds));
        }
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn steps_come_every_five_seconds_and_the_last_one_always() {
        let events: Vec<_> = (0..=8)
            .map(|k| (1.5 * k as f64, report(50 * k, 1.0)))
            .collect();
        let text = written(&events);
        let steps: Vec<&str> = text
            .lines()
            .map(|line| line.split(' ').nth(1).expect("a number"))
            .collect();
        assert_eq!(
            steps,
            ["0", "200", "400"],
            "at 0 s, 6 s and 12 s, of one every 1.5 s"
        );
        let last_is_early = written(&[(0.0, report(399, 1.0)), (0.1, report(400, 1.0))]);
        assert_eq!(last_is_early.lines().count(), 2, "{last_is_early}");
    }

    #[test]
    fn stages_of_matching_are_written_and_their_share_where_they_take_long() {
        let matching = |stage, done| Event::Matching {
            stage,
            done,
            total: 4,
            interval: [0, 1],
        };
        let text = written(&[
            (0.0, matching(MatchStage::Surfaces, 0)),
            (1.0, matching(MatchStage::Surfaces, 4)),
            (1.0, matching(MatchStage::Registration, 0)),
            (3.0, matching(MatchStage::Registration, 1)),
            (7.0, matching(MatchStage::Registration, 2)),
            (9.0, matching(MatchStage::Registration, 3)),
        ]);
        let registration = "finding pairs: registration in both directions";
        assert_eq!(
            text,
            format!("finding pairs: surfaces\n{registration}\n{registration}, 50 %\n")
        );
    }

    #[test]
    fn of_pairs_between_many_key_frames_one_line_is_written_for_each_two() {
        let matching = |k, stage| Event::Matching {
            stage,
            done: 0,
            total: 4,
            interval: [k, 3],
        };
        let text = written(&[
            (0.0, matching(0, MatchStage::Surfaces)),
            (0.1, matching(0, MatchStage::Registration)),
            (0.2, matching(0, MatchStage::Pairs)),
            (0.3, matching(1, MatchStage::Surfaces)),
        ]);
        let lines = "finding pairs, 1 of 3: surfaces\nfinding pairs, 2 of 3: surfaces\n";
        assert_eq!(text, lines);
    }

    #[test]
    fn a_step_that_stops_the_run_is_never_left_out() {
        let text = written(&[(0.0, report(1, 1.0)), (0.1, report(2, f64::NAN))]);
        assert!(text.ends_with("total NaN (matching NaN)\n"), "{text}");
    }

    #[test]
    fn a_step_looks_like_this() {
        let started = Event::Started {
            backend: "ndarray".into(),
            device: "Cpu".into(),
            steps: 400,
            first_step: 99,
            networks: vec![("f", 2), ("V", 2)],
            points: vec![2, 2],
            correspondences: 0,
        };
        let entered = Event::PhaseEntered {
            phase: Phase::Ramp,
            step: 99,
        };
        let tick = Event::Tick { step: 100 };
        let text = written(&[
            (0.0, started),
            (0.0, entered),
            (0.5, tick),
            (0.5, report(100, 1.5)),
        ]);
        assert_eq!(
            text,
            "going on after step 99 of 400 on ndarray (Cpu): f has 2 weights, V has 2 weights; key \
             frames of 2 and 2 points, 0 correspondences\n\
             ramp from step 100 on\n\
             step 100 of 400, ramp, 1m40s, 2m30s left, peak 300 MiB: total 1.50 (matching 1.50)\n",
            "300 steps of half a second are left"
        );
    }

    #[test]
    fn a_reader_that_went_away_does_not_stop_the_run() {
        /// Counts what it refuses.
        struct Closed(usize);
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                self.0 += 1;
                Err(std::io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let mut lines = PlainLines::new(Closed(0), PathBuf::new());
        for _ in 0..2 {
            lines.show(&Event::Note("anyone there?".into()), Instant::now());
        }
        assert_eq!(lines.out.0, 2, "refused twice, and no panic");
    }
}
