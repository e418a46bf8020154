//! How each event reads.

use super::*;
use crate::event::Phase;

fn report(terms: &[(&'static str, f64)]) -> StepReport {
    let terms: Vec<TermReport> = terms
        .iter()
        .map(|(name, weighted)| TermReport {
            name,
            raw: weighted / 2.0,
            weighted: *weighted,
        })
        .collect();
    StepReport {
        step: 500,
        steps: 4000,
        phase: Phase::Ramp,
        seconds: 125.0,
        total: terms.iter().map(|term| term.weighted).sum(),
        terms,
        learning_rate: 5e-3,
        velocity_learning_rate: 5e-3,
        peak_memory_bytes: Some(312 << 20),
    }
}

fn text(event: Event) -> String {
    line(&event, None).expect("a line")
}

#[test]
fn a_step_names_its_largest_terms_and_sums_the_others() {
    let terms = [
        ("eikonal", 0.204),
        ("data", 0.05),
        ("matching", 0.81),
        ("strain", 0.056),
    ];
    let report = report(&[&terms[..], &[("level-set", 0.11)]].concat());
    let left = Some(Duration::from_secs(870));
    assert_eq!(
        line(&Event::Step(report), left).expect("a line"),
        "step 500 of 4000, ramp, 2m05s, 14m30s left, peak 312 MiB: total 1.23 \
         (matching 0.810, eikonal 0.204, level-set 0.110, 2 more 0.106)"
    );
}

#[test]
fn a_term_that_is_no_number_comes_first() {
    let terms = [
        ("matching", 9.0),
        ("data", 8.0),
        ("eikonal", f64::NAN),
        ("strain", f64::INFINITY),
    ];
    assert_eq!(
        objective(&report(&terms)),
        "total NaN (eikonal NaN, strain inf, matching 9.00, 1 more 8.00)"
    );
    assert_eq!(objective(&report(&[])), "total 0");
}

#[test]
fn the_start_says_what_is_trained_on_what() {
    let started = |first_step| Event::Started {
        backend: "ndarray".into(),
        device: "Cpu".into(),
        steps: 4000,
        first_step,
        networks: vec![("f", 66_433), ("V", 28_035)],
        points: vec![20_000, 18_000],
        correspondences: 1,
    };
    assert_eq!(
        text(started(0)),
        "4,000 steps on ndarray (Cpu): f has 66,433 weights, V has 28,035 weights; key frames of \
         20,000 and 18,000 points, 1 correspondence"
    );
    assert!(text(started(500)).starts_with("going on after step 500 of 4000 on ndarray (Cpu): f"));
}

#[test]
fn an_extraction_says_what_is_wrong_with_the_surface() {
    let extracted = |triangles, left_out, consistency, touches_box| Event::Extracted {
        time: 0.25,
        path: "meshes/a.ply".into(),
        vertices: 1026,
        triangles,
        components: 1,
        left_out,
        consistency,
        touches_box,
    };
    assert_eq!(
        text(extracted(2048, 0, None, false)),
        "time 0.250: 1,026 vertices, 2,048 triangles, 1 component: meshes/a.ply"
    );
    assert_eq!(
        text(extracted(2048, 2, Some(0.00123), false)),
        "time 0.250: 1,026 vertices, 2,048 triangles, 1 component (2 small dropped), consistency 0.00123: meshes/a.ply"
    );
    assert!(
        text(extracted(0, 0, None, false)).ends_with("; f has no zero in the box at this time")
    );
    assert!(text(extracted(2048, 0, None, true)).ends_with("larger training.box-margin"));
}

#[test]
fn the_other_events_read_like_this() {
    assert_eq!(line(&Event::Tick { step: 3 }, None), None);
    assert_eq!(text(Event::Note("two\nlines".into())), "note: two lines");
    let matched = |interval| Event::Matched {
        interval,
        pairs: 3812,
        coverage: [0.974, 1.0],
        cycle: [0.00171, 0.0123],
        seconds: 18.4,
    };
    assert_eq!(
        text(matched([0, 1])),
        "matched 3,812 pairs in 18s: near 97 % of the source and 100 % of the target; \
         round-trip error 0.0017 (median) and 0.0123 (95 %), normalised"
    );
    let of_many = text(matched([2, 5]));
    assert!(
        of_many.starts_with("matched 3,812 pairs from key frame 2 to 3 in 18s: "),
        "{of_many}"
    );
    let entered = Event::PhaseEntered {
        phase: Phase::WarmUp,
        step: 0,
    };
    assert_eq!(text(entered), "velocity warm-up from step 1 on");
    let checkpoint = Event::Checkpoint {
        step: 500,
        path: "c/step-000500".into(),
    };
    assert_eq!(text(checkpoint), "checkpoint after step 500: c/step-000500");
    assert_eq!(
        text(Event::Extracting { frames: 1 }),
        "extracting 1 surface"
    );
    assert_eq!(
        text(Event::Interrupted { step: 812 }),
        "interrupted after step 812: the newest checkpoint holds all of it"
    );
    let finished = Event::Finished {
        step: 4000,
        seconds: 155.4,
    };
    assert_eq!(text(finished), "finished 4,000 steps in 2m35s");
}

#[test]
fn durations_keep_two_units() {
    let cases = [
        (0.0, "0.0s"),
        (4.24, "4.2s"),
        (9.96, "10s"),
        (59.4, "59s"),
        (59.6, "1m00s"),
        (125.0, "2m05s"),
        (3599.7, "1h00m"),
        (11_220.0, "3h07m"),
        (187_200.0, "2d04h"),
    ];
    for (seconds, expected) in cases {
        assert_eq!(duration(seconds), expected, "{seconds} s");
    }
}

#[test]
fn numbers_keep_three_digits() {
    let cases = [
        (0.0, "0"),
        (1.0, "1.00"),
        (9.999, "10.0"),
        (-12.34, "-12.3"),
        (123_456.0, "123456"),
        (1_234_567.0, "1.23e6"),
        (0.000_123_4, "0.000123"),
        (0.000_012_34, "1.23e-5"),
        (f64::NEG_INFINITY, "-inf"),
    ];
    for (value, expected) in cases {
        assert_eq!(significant(value), expected, "{value}");
    }
}
