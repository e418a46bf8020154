//! Everything that happens, each with the seconds since the command began: `-v`.

use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use isomorph::event::{Event, StepReport};

use super::told;

/// Writes all events as lines, whatever their rate.
#[derive(Debug)]
pub(super) struct VerboseLines<W> {
    out: W,
    run: PathBuf,
    begun: Instant,
}

impl<W: Write> VerboseLines<W> {
    pub(super) fn new(out: W, run: PathBuf, begun: Instant) -> Self {
        Self { out, run, begun }
    }

    /// Writes the line of an event that happened now; steps whose terms were not read back have none.
    pub(super) fn show(&mut self, event: &Event, now: Instant) {
        let text = match event {
            Event::Tick { .. } => return,
            Event::Step(report) => step(event, report),
            Event::Drawing => "drawing pictures".to_owned(),
            _ => told(event, &self.run, None).unwrap_or_else(|| event.to_string()),
        };
        let seconds = now.duration_since(self.begun).as_secs_f64();
        // Nobody may be reading any more; that is no reason to stop training.
        let _ = self
            .out
            .write_all(format!("[{seconds:9.3}] {text}\n").as_bytes());
    }
}

/// A step with all of its terms, each before and after its weight, and the rates.
fn step(event: &Event, report: &StepReport) -> String {
    let line = event.line(None).unwrap_or_default();
    let head = line.split(": total").next().unwrap_or_default();
    let mut text = format!("{head}: total {:.6e}", report.total);
    for term in &report.terms {
        text += &format!(
            "; {} {:.4e} (without its weight {:.4e})",
            term.name, term.weighted, term.raw
        );
    }
    if report.learning_rate > 0.0 {
        text += &format!(
            "; learning rates {:.2e} and {:.2e}",
            report.learning_rate, report.velocity_learning_rate
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use isomorph::event::{Phase, Preparation, TermReport};
    use std::time::Duration;

    #[test]
    fn every_event_has_its_second_and_a_step_all_of_its_terms() {
        let term = |name, raw| TermReport {
            name,
            raw,
            weighted: 10.0 * raw,
        };
        let report = Event::Step(StepReport {
            step: 3,
            steps: 9,
            phase: Phase::Ramp,
            seconds: 1.0,
            total: 10.0,
            terms: ["a", "b", "c", "d"].map(|name| term(name, 0.25)).to_vec(),
            learning_rate: 1e-3,
            velocity_learning_rate: 2e-3,
            peak_memory_bytes: None,
        });
        let (mut out, begun) = (Vec::new(), Instant::now());
        let mut lines = VerboseLines::new(&mut out, PathBuf::new(), begun);
        let events = [
            Event::Preparing(Preparation::Points),
            Event::Tick { step: 3 },
            report,
            Event::Drawing,
        ];
        for (k, event) in events.iter().enumerate() {
            lines.show(event, begun + Duration::from_millis(1500 * k as u64));
        }
        let text = String::from_utf8(out).expect("text");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3, "{text}");
        assert_eq!(lines[0], "[    0.000] sampling points and normals");
        assert!(
            lines[1]
                .starts_with("[    3.000] step 3 of 9, ramp, 1.0s: total 1.000000e1; a 2.5000e0"),
            "{text}"
        );
        for part in [
            "d 2.5000e0 (without its weight 2.5000e-1)",
            "learning rates 1.00e-3 and 2.00e-3",
        ] {
            assert!(lines[1].contains(part), "{text}");
        }
        assert_eq!(lines[2], "[    4.500] drawing pictures");
    }
}
