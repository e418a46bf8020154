//! How long the remaining steps will take, from the pace of the latest ones.
//!
//! A step of one phase may cost ten times that of another, a resumed run did its first steps in another
//! process, and a laptop may sleep in between: only what this process did in this phase in the last
//! half minute counts.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use isomorph::event::Event;

/// Older marks are forgotten.
const WINDOW: Duration = Duration::from_secs(30);
/// Marks lie at least this far apart, so that a fast run keeps few of them.
const SPACING: Duration = Duration::from_millis(250);

/// Steps done at the end of the window, and where it began.
#[derive(Debug, Default)]
pub(super) struct Pace {
    steps: usize,
    marks: VecDeque<(usize, Instant)>,
    latest: Option<(usize, Instant)>,
}

impl Pace {
    /// Takes note of an event that happened now.
    pub(super) fn observe(&mut self, event: &Event, now: Instant) {
        match event {
            Event::Started {
                steps, first_step, ..
            } => {
                self.steps = *steps;
                self.restart(*first_step, now);
            }
            Event::PhaseEntered { step, .. } => self.restart(*step, now),
            Event::Tick { step } => self.mark(*step, now),
            _ => {}
        }
    }

    /// The time that the remaining steps take at this pace; `None` before the first step of a phase.
    pub(super) fn left(&self) -> Option<Duration> {
        let (first, since) = *self.marks.front()?;
        let (step, now) = self.latest?;
        let done = step.checked_sub(first).filter(|done| *done > 0)?;
        let per_step = now.duration_since(since).as_secs_f64() / done as f64;
        Some(Duration::from_secs_f64(
            per_step * self.steps.saturating_sub(step) as f64,
        ))
    }

    fn restart(&mut self, step: usize, now: Instant) {
        self.marks.clear();
        self.marks.push_back((step, now));
        self.latest = Some((step, now));
    }

    fn mark(&mut self, step: usize, now: Instant) {
        // The mark before this one stays, however old: a step may take longer than the window.
        while self.marks.len() > 1 && now.duration_since(self.marks[0].1) > WINDOW {
            self.marks.pop_front();
        }
        self.latest = Some((step, now));
        if self
            .marks
            .back()
            .is_none_or(|(_, at)| now.duration_since(*at) >= SPACING)
        {
            self.marks.push_back((step, now));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isomorph::event::Phase;

    /// Exact up to the rounding of a division in f64 and to whole nanoseconds.
    fn assert_left(pace: &Pace, seconds: f64) {
        let left = pace.left().expect("a pace is known").as_secs_f64();
        assert!(
            (left - seconds).abs() < 1e-6,
            "{left} s left, {seconds} expected"
        );
    }

    fn started(steps: usize, first_step: usize) -> Event {
        Event::Started {
            backend: "ndarray".into(),
            device: "Cpu".into(),
            steps,
            first_step,
            networks: vec![("f", 1), ("V", 1)],
            points: vec![1, 1],
            correspondences: 0,
        }
    }

    #[test]
    fn steps_of_an_earlier_process_do_not_count() {
        let (mut pace, begun) = (Pace::default(), Instant::now());
        pace.observe(&started(1000, 900), begun);
        assert_eq!(pace.left(), None, "no step was done here yet");
        for k in 1..=10 {
            pace.observe(
                &Event::Tick { step: 900 + k },
                begun + Duration::from_secs(k as u64),
            );
        }
        assert_left(&pace, 90.0);
    }

    #[test]
    fn a_new_phase_starts_its_own_pace() {
        let (mut pace, begun) = (Pace::default(), Instant::now());
        pace.observe(&started(1000, 0), begun);
        for k in 1..=100 {
            let now = begun + Duration::from_millis(10 * k as u64);
            pace.observe(&Event::Tick { step: k }, now);
        }
        assert_left(&pace, 9.0);
        let now = begun + Duration::from_secs(1);
        pace.observe(
            &Event::PhaseEntered {
                phase: Phase::Joint,
                step: 100,
            },
            now,
        );
        assert_eq!(
            pace.left(),
            None,
            "the old pace says nothing about the new phase"
        );
        pace.observe(&Event::Tick { step: 101 }, now + Duration::from_millis(100));
        assert_left(&pace, 89.9);
    }

    #[test]
    fn a_pause_is_soon_forgotten() {
        let (mut pace, begun) = (Pace::default(), Instant::now());
        pace.observe(&started(1000, 0), begun);
        pace.observe(&Event::Tick { step: 1 }, begun + Duration::from_secs(1));
        let woken = begun + Duration::from_secs(3600);
        for k in 2..=40 {
            let now = woken + Duration::from_secs(k as u64 - 2);
            pace.observe(&Event::Tick { step: k }, now);
        }
        assert_left(&pace, 960.0);
    }

    #[test]
    fn steps_longer_than_the_window_still_give_a_pace() {
        let (mut pace, begun) = (Pace::default(), Instant::now());
        pace.observe(&started(5, 0), begun);
        pace.observe(&Event::Tick { step: 1 }, begun + Duration::from_secs(100));
        assert_left(&pace, 400.0);
        pace.observe(&Event::Tick { step: 2 }, begun + Duration::from_secs(180));
        assert_left(&pace, 240.0);
    }

    #[test]
    fn a_fast_run_keeps_few_marks() {
        let (mut pace, begun) = (Pace::default(), Instant::now());
        pace.observe(&started(1_000_000, 0), begun);
        for k in 1..=100_000 {
            pace.observe(
                &Event::Tick { step: k },
                begun + Duration::from_millis(k as u64),
            );
        }
        // 30 s of window at 0.25 s, one mark that the window cuts, and the one that stays.
        assert!(pace.marks.len() <= 122, "{} marks", pace.marks.len());
        assert_left(&pace, 900.0);
    }
}
