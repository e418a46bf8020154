//! The files of a run, through kill and resume.

use super::*;
use crate::event::Phase;
use std::fs;
use std::time::{Duration, UNIX_EPOCH};

fn started(first_step: usize) -> Event {
    Event::Started {
        backend: "ndarray".into(),
        device: "Cpu".into(),
        steps: 100,
        first_step,
        networks: vec![("f", 1), ("V", 1)],
        points: vec![1, 1],
        correspondences: 0,
    }
}

fn step(step: usize, total: f64) -> Event {
    Event::Step(StepReport {
        step,
        steps: 100,
        phase: Phase::Joint,
        seconds: step as f64 / 8.0,
        total,
        terms: Vec::new(),
        learning_rate: 0.5,
        velocity_learning_rate: 0.25,
        peak_memory_bytes: Some(1),
    })
}

fn record(run: &Path, resumed_from: Option<usize>, events: &[Event]) {
    let mut log = RunLog::open(run, resumed_from).expect("opened");
    for event in events {
        log.record(event).expect("recorded");
    }
}

fn steps(run: &Path) -> Vec<(usize, Option<f64>)> {
    let metrics = Metrics::read(&run.join(metrics::FILE)).expect("whole lines");
    metrics.iter().map(|line| (line.step, line.total)).collect()
}

#[test]
fn a_resumed_run_goes_on_where_its_checkpoint_was() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = folder.path();
    record(
        run,
        None,
        &[started(0), step(10, 4.0), step(20, 2.0), step(30, f64::NAN)],
    );
    assert_eq!(steps(run), [(10, Some(4.0)), (20, Some(2.0)), (30, None)]);
    // Killed in the middle of a line, of a step at or before the checkpoint to make it harder.
    let path = run.join(metrics::FILE);
    let mut torn = fs::read(&path).expect("metrics");
    torn.extend_from_slice(br#"{"step":20,"phase":"joint","sec"#);
    fs::write(&path, torn).expect("written");
    record(run, Some(20), &[started(20), step(30, 1.0)]);
    assert_eq!(
        steps(run),
        [(10, Some(4.0)), (20, Some(2.0)), (30, Some(1.0))]
    );
    // Killed again, before anything was logged after the checkpoint.
    record(run, Some(30), &[started(30), step(40, 0.5)]);
    let expected = [
        (10, Some(4.0)),
        (20, Some(2.0)),
        (30, Some(1.0)),
        (40, Some(0.5)),
    ];
    assert_eq!(steps(run), expected);
}

#[test]
fn a_torn_line_goes_even_if_its_step_reads_well() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(metrics::FILE);
    fs::write(&path, "{\"step\":1}\n{\"step\":2}").expect("written");
    metrics::keep_until(&path, 2).expect("cut");
    assert_eq!(fs::read_to_string(&path).expect("kept"), "{\"step\":1}\n");
}

#[test]
fn a_run_without_checkpoint_starts_its_metrics_again() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    record(folder.path(), None, &[started(0), step(10, 4.0)]);
    record(folder.path(), Some(0), &[started(0)]);
    assert_eq!(steps(folder.path()), []);
}

#[test]
fn only_training_touches_the_metrics() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(metrics::FILE);
    fs::write(&path, "{\"step\":9}\n{\"st").expect("a run that is being trained");
    let extracting = Event::Extracting { frames: 2 };
    record(
        folder.path(),
        Some(usize::MAX),
        &[Event::Note("resume failed".into()), extracting],
    );
    assert_eq!(
        fs::read_to_string(&path).expect("there"),
        "{\"step\":9}\n{\"st"
    );
}

#[test]
fn every_event_but_a_tick_has_its_line_in_the_log() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("run.log");
    fs::write(&path, "torn by a kill").expect("written");
    let note = Event::Note("in two\nlines".into());
    record(
        folder.path(),
        None,
        &[note, Event::Tick { step: 1 }, step(1, 1.0)],
    );
    let text = fs::read_to_string(&path).expect("there");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert_eq!(lines[0], "torn by a kill");
    assert!(lines[1].ends_with("Z note: in two lines"), "{text}");
    assert!(
        lines[2].ends_with("Z step 1 of 100, joint, 0.1s, peak 1 MiB: total 1.00"),
        "{text}"
    );
}

#[test]
fn lines_open_with_the_time_in_utc() {
    let day = UNIX_EPOCH + Duration::from_secs(951_827_696);
    assert_eq!(stamped(day, "text"), "2000-02-29T12:34:56Z text\n");
}

#[test]
fn what_cannot_be_opened_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("run.log")).expect("a folder in the way");
    let refused = RunLog::open(folder.path(), None)
        .expect_err("not a file")
        .to_string();
    assert!(refused.contains("run.log: "), "{refused}");
    let mut log = RunLog::open(&folder.path().join("run.log"), None).expect("opened");
    fs::create_dir(folder.path().join("run.log").join(metrics::FILE)).expect("in the way");
    let refused = log.record(&started(0)).expect_err("not a file").to_string();
    assert!(refused.contains("metrics.jsonl: "), "{refused}");
}
