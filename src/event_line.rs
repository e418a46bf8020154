//! Each event as one line of text, the same on a terminal and in `run.log`.
//!
//! ```text
//! step 500 of 4000, ramp, 2m05s, 14m30s left, peak 312 MiB: total 1.23 (matching 0.810, eikonal 0.204, level-set 0.110, 5 more 0.106)
//! ```
//!
//! Values of terms are weighted, so that they add up to the total.

use std::time::Duration;

use super::{Event, MatchStage, StepReport, TermReport, Trust, finding};

/// Terms that are named one by one; the others are summed.
const NAMED_TERMS: usize = 3;

/// An event as a line, without its end; `None` for what needs no line.
///
/// `left` is how long the remaining steps may take.
pub(super) fn line(event: &Event, left: Option<Duration>) -> Option<String> {
    Some(match event {
        // Of many only where one begins.
        Event::Matching {
            stage,
            done: 0,
            interval,
            ..
        } if interval[1] <= 1 || *stage == MatchStage::Surfaces => {
            format!("{}: {stage}", finding(*interval))
        }
        Event::Preparing(_)
        | Event::Tick { .. }
        | Event::Measuring { .. }
        | Event::Matching { .. }
        | Event::Drawing => {
            return None;
        }
        Event::Started { .. } => return started(event),
        Event::Note(text) => format!("note: {}", text.replace('\n', " ")),
        Event::Doubtful { finding, cure } => format!("doubtful: {finding}; {cure}"),
        Event::Matched { .. } => return matched(event),
        Event::PhaseEntered { phase, step } => format!("{phase} from step {} on", step + 1),
        Event::Step(report) => step(report, left),
        Event::Checkpoint { step, path } => {
            format!("checkpoint after step {step}: {}", path.display())
        }
        Event::Extracting { frames } => format!("extracting {}", counted(*frames, "surface")),
        Event::Extracted { .. } => return extracted(event),
        Event::Trusted { time, trust } => trusted(*time, trust),
        Event::Reported { path } => format!("report: {}", path.display()),
        Event::Interrupted { step } => {
            format!("interrupted after step {step}: the newest checkpoint holds all of it")
        }
        Event::Finished { step, seconds } => {
            format!(
                "finished {} in {}",
                counted(*step, "step"),
                duration(*seconds)
            )
        }
    })
}

/// The total of a step and its largest terms: `total 1.23 (matching 0.810, 2 more 0.420)`.
pub(super) fn objective(report: &StepReport) -> String {
    let mut terms: Vec<&TermReport> = report.terms.iter().collect();
    // In the total order NaN is above infinity: a term that is no number comes first.
    terms.sort_by(|a, b| b.weighted.abs().total_cmp(&a.weighted.abs()));
    let (named, others) = terms.split_at(terms.len().min(NAMED_TERMS));
    let mut parts: Vec<String> = named
        .iter()
        .map(|term| format!("{} {}", term.name, significant(term.weighted)))
        .collect();
    if !others.is_empty() {
        let rest: f64 = others.iter().map(|term| term.weighted).sum();
        parts.push(format!("{} more {}", others.len(), significant(rest)));
    }
    match parts.is_empty() {
        true => format!("total {}", significant(report.total)),
        false => format!("total {} ({})", significant(report.total), parts.join(", ")),
    }
}

/// Seconds as people read them: `4.2s`, `42s`, `2m05s`, `3h07m`, `2d04h`.
pub fn duration(seconds: f64) -> String {
    if seconds < 9.95 {
        return format!("{seconds:.1}s");
    }
    let whole = seconds.round() as u64;
    let (minutes, hours) = (whole / 60, whole / 3600);
    match whole {
        0..60 => format!("{whole}s"),
        60..3600 => format!("{minutes}m{:02}s", whole % 60),
        3600..86_400 => format!("{hours}h{:02}m", minutes % 60),
        _ => format!("{}d{:02}h", hours / 24, hours % 24),
    }
}

/// What is trained on what; `None` for any other event than the start.
fn started(event: &Event) -> Option<String> {
    let Event::Started {
        backend,
        device,
        steps,
        first_step,
        networks,
        points,
        correspondences,
    } = event
    else {
        return None;
    };
    let begun = match first_step {
        0 => format!("{} on", counted(*steps, "step")),
        _ => format!("going on after step {first_step} of {steps} on"),
    };
    let networks: Vec<String> = networks
        .iter()
        .map(|(name, weights)| format!("{name} has {}", counted(*weights, "weight")))
        .collect();
    let of_points = match points[..] {
        [source, target] => {
            format!("key frames of {} and {}", grouped(source), grouped(target))
        }
        _ => key_frames(points),
    };
    Some(format!(
        "{begun} {backend} ({device}): {}; {of_points} points, {}",
        networks.join(", "),
        counted(*correspondences, "correspondence"),
    ))
}

/// How many key frames there are, and of how many points.
fn key_frames(points: &[usize]) -> String {
    let least = points.iter().copied().min().unwrap_or(0);
    let most = points.iter().copied().max().unwrap_or(0);
    let count = points.len();
    if least == most {
        format!("{count} key frames of {}", grouped(most))
    } else {
        format!(
            "{count} key frames of {} to {}",
            grouped(least),
            grouped(most)
        )
    }
}

/// What matching has found; `None` for any other event.
fn matched(event: &Event) -> Option<String> {
    let Event::Matched {
        interval: [k, intervals],
        pairs,
        coverage: [source, target],
        cycle: [median, most],
        seconds,
    } = event
    else {
        return None;
    };
    let between = match intervals {
        0 | 1 => String::new(),
        _ => format!(" from key frame {k} to {}", k + 1),
    };
    Some(format!(
        "matched {}{between} in {}: near {:.0} % of the source and {:.0} % of the target; round-trip error \
         {median:.4} (median) and {most:.4} (95 %), normalised",
        counted(*pairs, "pair"),
        duration(*seconds),
        100.0 * source,
        100.0 * target,
    ))
}

fn step(report: &StepReport, left: Option<Duration>) -> String {
    let mut text = format!(
        "step {} of {}, {}, {}",
        report.step,
        report.steps,
        report.phase,
        duration(report.seconds)
    );
    if let Some(left) = left {
        text += &format!(", {} left", duration(left.as_secs_f64()));
    }
    if let Some(bytes) = report.peak_memory_bytes {
        text += &format!(", peak {} MiB", bytes.div_ceil(1 << 20));
    }
    format!("{text}: {}", objective(report))
}

/// A surface and what is wrong with it; `None` for any other event than an extraction.
fn extracted(event: &Event) -> Option<String> {
    let Event::Extracted {
        time,
        path,
        vertices,
        triangles,
        components,
        left_out,
        consistency,
        touches_box,
    } = event
    else {
        return None;
    };
    let mut text = format!(
        "time {time:.3}: {}, {}, {}",
        counted(*vertices, "vertex"),
        counted(*triangles, "triangle"),
        counted(*components, "component"),
    );
    if *left_out > 0 {
        text += &format!(" ({left_out} small dropped)");
    }
    if let Some(off) = consistency {
        text += &format!(", consistency {}", significant(*off));
    }
    text += &format!(": {}", path.display());
    if *triangles == 0 {
        text += "; f has no zero in the box at this time";
    }
    if *touches_box {
        text += "; the box cuts it off: train with a larger training.box-margin";
    }
    Some(text)
}

/// How far to believe a surface, in words.
fn trusted(time: f64, trust: &Trust) -> String {
    let [x, y, z] = trust.place.map(significant);
    format!(
        "time {time:.3}: surface and motion agree within {} at half of the vertices, {} at 95 %; the worst is {} \
         at ({x}, {y}, {z})",
        significant(trust.median),
        significant(trust.most),
        significant(trust.greatest)
    )
}

/// A number of things: `1 surface`, `20,000 points`, `8 vertices`.
fn counted(count: usize, thing: &str) -> String {
    let number = grouped(count);
    match (count, thing) {
        (1, _) => format!("1 {thing}"),
        (_, "vertex") => format!("{number} vertices"),
        _ => format!("{number} {thing}s"),
    }
}

/// Digits in threes: `20,000`.
fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let mut grouped = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// Three significant digits: `0.00123`, `1.23`, `12.3`, `123`, `1.23e-6`.
pub(crate) fn significant(value: f64) -> String {
    // Without its sign: the empty sum is -0.
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let scientific = format!("{value:.2e}");
    // The exponent after rounding: 9.999 is 10.0, not 10.00.
    let exponent = scientific
        .split_once('e')
        .and_then(|(_, text)| text.parse::<i32>().ok());
    match exponent {
        Some(exponent @ -4..=5) => {
            format!("{value:.*}", usize::try_from(2 - exponent).unwrap_or(0))
        }
        _ => scientific,
    }
}

#[cfg(test)]
#[path = "event_line_tests.rs"]
mod tests;
