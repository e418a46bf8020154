//! What the bar draws, on a screen that only takes notes.

use super::*;
use indicatif::TermLike;
use isomorph::event::{MatchStage, Phase, StepReport, TermReport};
use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Everything that was drawn, one thing after the other: where the cursor was is not kept.
#[derive(Clone, Debug, Default)]
struct Notes(Arc<Mutex<String>>);

impl Notes {
    fn push(&self, text: &str) -> io::Result<()> {
        self.0
            .lock()
            .expect("no test thread panicked")
            .push_str(text);
        Ok(())
    }

    /// What was drawn since the last call.
    fn drawn(&self) -> String {
        std::mem::take(&mut self.0.lock().expect("no test thread panicked"))
    }
}

impl TermLike for Notes {
    fn width(&self) -> u16 {
        120
    }
    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn write_line(&self, text: &str) -> io::Result<()> {
        self.push(text)?;
        self.push("\n")
    }
    fn write_str(&self, text: &str) -> io::Result<()> {
        self.push(text)
    }
    fn clear_line(&self) -> io::Result<()> {
        self.push("\r")
    }
    fn flush(&self) -> io::Result<()> {
        Ok(())
    }
}

impl Write for Notes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.push(std::str::from_utf8(bytes).expect("whole lines are written"))?;
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Screen for Notes {
    fn target(&self) -> ProgressDrawTarget {
        ProgressDrawTarget::term_like(Box::new(self.clone()))
    }
}

fn screen_and_bar(now: Instant) -> (Notes, Bar<Notes>) {
    let screen = Notes::default();
    (
        screen.clone(),
        Bar::new(screen, PathBuf::from("runs/fox"), now),
    )
}

fn started(first_step: usize) -> Event {
    Event::Started {
        backend: "ndarray".into(),
        device: "Cpu".into(),
        steps: 4000,
        first_step,
        networks: vec![("f", 1), ("V", 1)],
        points: vec![1, 1],
        correspondences: 0,
    }
}

#[test]
fn a_resumed_bar_starts_where_the_run_was_and_counts_only_its_own_steps() {
    let now = Instant::now();
    let (screen, mut bar) = screen_and_bar(now);
    bar.show(&started(3000), now);
    bar.show(
        &Event::PhaseEntered {
            phase: Phase::Joint,
            step: 3000,
        },
        now,
    );
    for k in 1..=10 {
        bar.show(
            &Event::Tick { step: 3000 + k },
            now + Duration::from_secs(k as u64),
        );
    }
    let report = StepReport {
        step: 3010,
        steps: 4000,
        phase: Phase::Joint,
        seconds: 700.0,
        total: 1.5,
        terms: vec![TermReport {
            name: "matching",
            raw: 0.5,
            weighted: 1.5,
        }],
        learning_rate: 5e-3,
        velocity_learning_rate: 5e-3,
        peak_memory_bytes: None,
    };
    bar.show(&Event::Step(report), now + Duration::from_secs(10));
    let before = screen.drawn();
    assert!(!before.contains(" 0/4000"), "never at 0: {before}");
    assert!(
        before.contains("3010/4000 [============>   ] joint, 10s, 16m30s left"),
        "{before}"
    );
    bar.show(&Event::Tick { step: 3011 }, now + Duration::from_secs(11));
    let after = screen.drawn();
    assert!(after.contains("3011/4000"), "{after}");
    assert!(
        after.contains("joint, 11s, 16m29s left, total 1.50 (matching 1.50)"),
        "{after}"
    );
}

#[test]
fn lines_are_printed_above_the_bar_and_the_end_clears_it() {
    let now = Instant::now();
    let (screen, mut bar) = screen_and_bar(now);
    bar.show(&Event::Note("before the start".into()), now);
    assert_eq!(screen.drawn(), "note: before the start\n");
    bar.show(&started(0), now);
    bar.show(&Event::Tick { step: 1 }, now);
    screen.drawn();
    bar.show(
        &Event::Checkpoint {
            step: 1,
            path: "c/step-000001".into(),
        },
        now,
    );
    let drawn = screen.drawn();
    let (line, below) = drawn.split_once('\n').expect("a line and the bar");
    assert!(
        line.contains("checkpoint after step 1: c/step-000001"),
        "{drawn}"
    );
    assert!(below.contains("1/4000 ["), "{drawn}");
    bar.show(&Event::Interrupted { step: 1 }, now);
    let drawn = screen.drawn();
    let (_, below) = drawn
        .split_once("resume runs/fox`\n")
        .expect("the last line");
    assert!(!below.contains("/4000"), "the bar is gone: {drawn}");
    assert!(bar.bar.is_none());
}

#[test]
fn each_stage_of_matching_has_a_line_and_a_bar_of_its_own() {
    let now = Instant::now();
    let (screen, mut bar) = screen_and_bar(now);
    let matching = |stage, done, total| Event::Matching {
        stage,
        done,
        total,
        interval: [2, 13],
    };
    bar.show(&matching(MatchStage::Surfaces, 0, 1), now);
    assert!(
        screen
            .drawn()
            .contains("finding pairs, 3 of 13: surfaces\n")
    );
    bar.show(&matching(MatchStage::Surfaces, 1, 1), now);
    assert!(bar.bar.is_none(), "the stage is done");
    bar.show(&matching(MatchStage::Registration, 0, 80), now);
    bar.show(&matching(MatchStage::Registration, 60, 80), now);
    let drawn = screen.drawn();
    assert!(
        drawn.contains("60/80 [============>   ] finding pairs, 3 of 13: registration"),
        "{drawn}"
    );
    bar.show(&matching(MatchStage::Registration, 80, 80), now);
    assert!(bar.bar.is_none());
}

#[test]
fn surfaces_have_a_bar_of_their_own() {
    let now = Instant::now();
    let (screen, mut bar) = screen_and_bar(now);
    bar.show(&Event::Extracting { frames: 2 }, now);
    let extracted = Event::Extracted {
        time: 0.0,
        path: "a.ply".into(),
        vertices: 8,
        triangles: 12,
        components: 1,
        left_out: 0,
        consistency: None,
        touches_box: false,
    };
    bar.show(&extracted, now);
    let drawn = screen.drawn();
    assert!(
        drawn.contains("8 vertices, 12 triangles, 1 component: a.ply\n"),
        "{drawn}"
    );
    assert!(drawn.contains("1/2 ["), "{drawn}");
    bar.show(&extracted, now);
    assert!(bar.bar.is_none(), "the last surface ends it");
}
