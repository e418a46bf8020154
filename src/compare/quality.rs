//! Quality over time: how far each method is from the truth, against how long its training took.

use super::comparison::{Comparison, MethodMean};
use crate::charts::{ChartError, Line, Mark, Panel, Scale, Stroke, line_chart};
use crate::evaluate::{Compared, FrameResult, Metrics};

/// How far the line of "linear" goes beyond the first and the last training, as a factor.
const BEYOND: f64 = 1.6;

/// What a panel shows of a method, and of straight lines.
struct Quantity {
    title: &'static str,
    label: &'static str,
    of_method: fn(&FrameResult) -> Option<f64>,
    of_lines: fn(&FrameResult) -> Option<f64>,
}

const QUANTITIES: [Quantity; 2] = [
    Quantity {
        title: "carried vertices",
        label: "RMS error ×10² (normalised units)",
        of_method: |mean| vertices(mean.carried.as_ref()?),
        of_lines: |mean| vertices(&mean.linear),
    },
    Quantity {
        title: "surface",
        label: "CD ×10³ (normalised units²)",
        of_method: |mean| {
            let shown = mean.surface.as_ref().or(mean.carried.as_ref());
            shown.map(|compared| chamfer(&compared.metrics))
        },
        of_lines: |mean| Some(chamfer(&mean.linear.metrics)),
    },
];

fn vertices(compared: &Compared) -> Option<f64> {
    compared.metrics.tracked_rmse.map(|error| 1e2 * error)
}

fn chamfer(metrics: &Metrics) -> f64 {
    1e3 * metrics.chamfer_squared
}

/// One point for each method that is done on all pairs, as SVG: the error of carried vertices and the squared
/// Chamfer distance, means over the pairs, against the seconds of training; all axes are logarithmic. A method that
/// moves no points is in the second panel alone. One without a surface is shown by the mesh that it carries.
/// `None` if no method is done on all pairs.
///
/// # Errors
/// [`ChartError`], if a panel cannot be drawn.
pub(crate) fn quality_figure(comparison: &Comparison) -> Result<Option<String>, ChartError> {
    let panels = QUANTITIES.iter();
    let panels: Vec<Panel> = panels
        .filter_map(|what| panel(&comparison.mean, what))
        .collect();
    if panels.is_empty() {
        return Ok(None);
    }
    let pairs = match comparison.pairs.len() {
        1 => "one pair".to_owned(),
        count => format!("mean over {count} pairs"),
    };
    let title = format!(
        "{}: error and time of training, {pairs}",
        comparison.sequence
    );
    line_chart(&title, &panels).map(Some)
}

/// The panel of a quantity; `None` if no method has it.
fn panel(means: &[MethodMean], what: &Quantity) -> Option<Panel> {
    let drawn = |value: f64| value.is_finite() && value > 0.0;
    let mark = |mean: &MethodMean| {
        let at = [mean.training_seconds, (what.of_method)(&mean.mean)?];
        at.into_iter().all(drawn).then(|| Mark {
            label: mean.method.clone(),
            at,
        })
    };
    let marks: Vec<Mark> = means.iter().filter_map(mark).collect();
    let times = || marks.iter().map(|mark| mark.at[0]);
    let first = times().reduce(f64::min)? / BEYOND;
    let last = times().reduce(f64::max)? * BEYOND;
    // Every method holds the same straight lines: they depend on the pairs alone.
    let lines = (what.of_lines)(&means.first()?.mean).filter(|value| drawn(*value));
    let line = |error: f64| Line {
        label: "linear (all vertices known)".to_owned(),
        stroke: Stroke::Dashed,
        points: vec![[first, error], [last, error]],
    };
    Some(Panel {
        title: what.title.to_owned(),
        x_label: "training (s)".to_owned(),
        y_label: what.label.to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        lines: lines.map(line).into_iter().collect(),
        marks,
        ..Panel::default()
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::two_pairs_of_three_methods;
    use super::*;
    use crate::charts::tests::texts;

    #[test]
    fn each_method_is_named_in_the_panels_in_which_it_has_a_value() {
        let (plan, entries) = two_pairs_of_three_methods();
        let comparison = Comparison::new(&plan, &entries);
        let svg = quality_figure(&comparison)
            .expect("drawn")
            .expect("a figure");
        let texts = texts(&svg);
        let count = |label: &str| texts.iter().filter(|text| *text == label).count();
        // "quick" moves no points, "eigenbasis" has no surface and is shown by its mesh.
        assert_eq!([count("quick"), count("eigenbasis")], [1, 2], "{texts:?}");
        assert_eq!(count("training (s)"), 2);
        assert!(texts.iter().any(|text| text.contains("mean over 2 pairs")));
    }

    #[test]
    fn a_method_lies_at_its_time_and_its_error() {
        let (plan, entries) = two_pairs_of_three_methods();
        let comparison = Comparison::new(&plan, &entries);
        let panel = panel(&comparison.mean, &QUANTITIES[0]).expect("two methods move points");
        let places: Vec<_> = panel.marks.iter().map(|mark| mark.at).collect();
        // The times and the tracked errors of the made-up results.
        assert_eq!(places, [[83.5, 0.3], [83.5, 0.5]]);
    }

    #[test]
    fn without_a_method_on_all_pairs_there_is_no_figure() {
        let (plan, _) = two_pairs_of_three_methods();
        assert_eq!(quality_figure(&Comparison::new(&plan, &[])), Ok(None));
    }
}
