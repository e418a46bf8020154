//! Error over time: how far each method is from the truth at every frame between the two that it saw.

use super::comparison::find;
use super::entry::Entry;
use super::plan::{FramePair, Plan};
use crate::charts::{ChartError, Line, Panel, Scale, Stroke, line_chart};
use crate::evaluate::{FrameResult, Metrics};

const Y_LABEL: &str = "CD ×10³ (normalised units²)";

/// One panel per pair that is done, one line per method, with straight lines dashed and the floor
/// dotted, as SVG: `chamfer_squared` times 1000 on a logarithmic axis, at each frame's own time.
///
/// A method without a surface of its own is shown by the mesh that it carries; its label says so.
///
/// # Errors
/// [`ChartError::Empty`] if a pair that is done has no frame to show, [`ChartError::NoPanels`] if none
/// is done.
pub(crate) fn error_figure(plan: &Plan, entries: &[Entry]) -> Result<String, ChartError> {
    let panels: Vec<Panel> = plan
        .pairs
        .iter()
        .filter_map(|pair| panel(plan, *pair, entries))
        .collect();
    let title = format!(
        "{}: distance from the true surface over time",
        plan.sequence
    );
    line_chart(&title, &panels)
}

/// The panel of a pair; `None` if nothing is done on it.
fn panel(plan: &Plan, pair: FramePair, entries: &[Entry]) -> Option<Panel> {
    let done: Vec<&Entry> = plan
        .methods
        .iter()
        .filter_map(|method| find(entries, pair, &method.label))
        .collect();
    // Every entry holds the same straight lines and floor: they depend on the pair alone.
    let first = done.first()?;
    let mut lines = vec![
        line(first, "linear", Stroke::Dashed, |frame| {
            Some(&frame.linear.metrics)
        }),
        line(first, "floor", Stroke::Dotted, |frame| Some(&frame.floor)),
    ];
    lines.extend(done.iter().map(|entry| method_line(entry)));
    Some(Panel {
        title: format!("frames {} to {}", pair.from, pair.to),
        x_label: format!("time t (0: frame {}, 1: frame {})", pair.from, pair.to),
        y_label: Y_LABEL.to_owned(),
        x_range: Some([0.0, 1.0]),
        y_scale: Scale::Log,
        lines,
        ..Panel::default()
    })
}

fn method_line(entry: &Entry) -> Line {
    let frames = &entry.evaluation.frames;
    if frames.iter().any(|frame| frame.surface.is_some()) {
        line(entry, &entry.run.method, Stroke::Solid, |frame| {
            frame.surface.as_ref().map(|surface| &surface.metrics)
        })
    } else {
        let label = format!("{} (carried mesh)", entry.run.method);
        line(entry, &label, Stroke::Solid, |frame| {
            frame.carried.as_ref().map(|carried| &carried.metrics)
        })
    }
}

/// A line through the frames; where a frame has nothing to measure, it is broken.
fn line(
    entry: &Entry,
    label: &str,
    stroke: Stroke,
    read: impl Fn(&FrameResult) -> Option<&Metrics>,
) -> Line {
    let point = |frame: &FrameResult| {
        let error = read(frame).map_or(f64::NAN, |metrics| 1e3 * metrics.chamfer_squared);
        Some([frame.time?, error])
    };
    Line {
        label: label.to_owned(),
        stroke,
        points: entry.evaluation.frames.iter().filter_map(point).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::two_pairs_of_three_methods;
    use super::*;
    use crate::charts::tests::{legend, texts};

    #[test]
    fn there_is_a_panel_for_each_pair_and_each_method_is_in_the_legend_once() {
        let (plan, entries) = two_pairs_of_three_methods();
        let svg = error_figure(&plan, &entries).expect("a figure");
        let texts = texts(&svg);
        for title in ["frames 0 to 18", "frames 20 to 47"] {
            assert!(texts.iter().any(|text| text == title), "{title}: {texts:?}");
        }
        let labels = [
            "quick",
            "a|b/c <d> & \"e\"",
            "eigenbasis (carried mesh)",
            "linear",
            "floor",
        ];
        assert_eq!(legend(&svg), labels);
    }

    #[test]
    fn a_pair_without_results_has_no_panel() {
        let (plan, mut entries) = two_pairs_of_three_methods();
        entries.retain(|entry| entry.pair == plan.pairs[0]);
        let texts = texts(&error_figure(&plan, &entries).expect("a figure"));
        assert!(!texts.iter().any(|text| text == "frames 20 to 47"));
        assert_eq!(error_figure(&plan, &[]), Err(ChartError::NoPanels));
    }
}
