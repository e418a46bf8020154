//! Made-up results for the tests of this module.

use super::entry::{Entry, Machine, Network, Run};
use super::plan::{FramePair, MethodPlan, Plan};
use crate::evaluate::{Compared, Evaluation, FrameResult, Metrics};

/// A label with all that may trouble a file name, a table and an SVG.
pub(super) const ODD_LABEL: &str = "a|b/c <d> & \"e\"";

/// Three methods on two pairs of `fox_survey`, all done. The second is the better surface, the third
/// has none and carries a mesh; straight lines are better than either in everything but normals.
pub(super) fn two_pairs_of_three_methods() -> (Plan, Vec<Entry>) {
    let pairs = [
        FramePair { from: 0, to: 18 },
        FramePair { from: 20, to: 47 },
    ];
    let labels = ["quick", ODD_LABEL, "eigenbasis"];
    let methods = labels.map(|label| MethodPlan {
        label: label.to_owned(),
        method: "quick".to_owned(),
        overrides: Vec::new(),
    });
    let entries = pairs
        .iter()
        .flat_map(|pair| {
            [
                entry(*pair, "quick", Some(0.004), None),
                entry(*pair, ODD_LABEL, Some(0.002), Some(0.003)),
                entry(*pair, "eigenbasis", None, Some(0.005)),
            ]
        })
        .collect();
    let plan = Plan {
        sequence: "fox_survey".to_owned(),
        pairs: pairs.to_vec(),
        methods: methods.to_vec(),
    };
    (plan, entries)
}

/// A result whose error, half-way, is as large as given for the surface and for the carried mesh.
pub(super) fn entry(
    pair: FramePair,
    label: &str,
    surface: Option<f64>,
    carried: Option<f64>,
) -> Entry {
    let count = pair.to - pair.from;
    let frame = |step: usize| {
        let time = step as f64 / count as f64;
        // Nothing at the ends, all of it half-way.
        let share = 4.0 * time * (1.0 - time);
        FrameResult {
            frame: Some(pair.from + step),
            time: Some(time),
            ..result(share, surface, carried)
        }
    };
    Entry {
        sequence: "fox_survey".to_owned(),
        pair,
        recipe: "preset = \"quick\"\n".to_owned(),
        run: run(label),
        evaluation: Evaluation {
            frames: (1..count).map(frame).collect(),
            mean: result(0.5, surface, carried),
            ends: Vec::new(),
        },
    }
}

fn run(label: &str) -> Run {
    Run {
        method: label.to_owned(),
        digest: "0123".to_owned(),
        steps: 1000,
        batch: 2200,
        networks: vec![Network {
            name: "velocity".to_owned(),
            parameters: 28_515,
        }],
        training_seconds: 83.5,
        evaluation_seconds: 12.25,
        machine: Machine {
            cores: 2,
            cpu: "Some CPU".to_owned(),
        },
        date: "2026-03-01T12:00:00Z".to_owned(),
        command: "isomorph compare --sequence fox_survey.anime".to_owned(),
    }
}

fn result(share: f64, surface: Option<f64>, carried: Option<f64>) -> FrameResult {
    let at = |error: f64| compared(share * error);
    FrameResult {
        frame: None,
        time: None,
        surface: surface.map(at),
        carried: carried.map(|error| {
            let mut compared = at(error);
            compared.metrics.tracked_rmse = Some(error);
            compared.aligned.tracked_rmse = Some(0.5 * error);
            compared
        }),
        linear: compared(share * 0.001),
        natural: None,
        floor: Metrics {
            chamfer_squared: 0.000_01,
            normal_consistency: 0.99,
            ..Metrics::default()
        },
    }
}

fn compared(error: f64) -> Compared {
    let metrics = |error: f64| Metrics {
        chamfer_squared: error,
        hausdorff: 20.0 * error,
        hausdorff_squared: 400.0 * error * error,
        normal_consistency: if error < 0.000_6 { 0.5 } else { 1.0 - error },
        volume_ratio: 1.0 + error,
        components: 1.0,
        ..Metrics::default()
    };
    Compared {
        metrics: metrics(error),
        aligned: metrics(0.5 * error),
    }
}
