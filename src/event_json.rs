//! Each event as one JSON object, for programs that start isomorph.
//!
//! ```text
//! {"event":"step","step":500,"steps":4000,"phase":"joint","seconds":41.5,"total":1.25,"terms":{…},…}
//! {"event":"extracted","time":0.5,"path":"runs/a-b/meshes/surface-002.ply","vertices":22030,…}
//! ```
//!
//! The field `event` names the kind. JSON has no NaN and no infinity: such values are null.

use std::path::Path;

use serde_json::{Value, json};

use super::{Event, Preparation};
use crate::session::metrics::Metrics;

/// An event as a JSON object.
pub(super) fn value(event: &Event) -> Value {
    match event {
        Event::Started {
            backend,
            device,
            steps,
            first_step,
            networks,
            points,
            correspondences,
        } => {
            let weights = networks.iter().map(|(name, count)| (*name, json!(count)));
            json!({
                "event": "started", "backend": backend, "device": device, "steps": steps,
                "first_step": first_step, "networks": Value::from_iter(weights),
                "points": points, "correspondences": correspondences,
            })
        }
        Event::Note(text) => json!({"event": "note", "text": text}),
        Event::Doubtful { finding, cure } => {
            json!({"event": "doubtful", "finding": finding, "cure": cure})
        }
        Event::Preparing(what) => {
            let what = match what {
                Preparation::Points => "points",
                Preparation::Distances => "distances",
            };
            json!({"event": "preparing", "what": what})
        }
        Event::Matching {
            stage,
            done,
            total,
            interval: [interval, intervals],
        } => json!({
            "event": "matching", "stage": stage.to_string(), "done": done, "total": total,
            "interval": interval, "intervals": intervals,
        }),
        Event::Matched {
            interval: [interval, intervals],
            pairs,
            coverage,
            cycle: [median, most],
            seconds,
        } => json!({
            "event": "matched", "interval": interval, "intervals": intervals,
            "pairs": pairs, "coverage": coverage,
            "cycle": {"median": median, "quantile_95": most}, "seconds": seconds,
        }),
        Event::PhaseEntered { phase, step } => {
            json!({"event": "phase", "phase": phase, "step": step})
        }
        Event::Tick { step } => json!({"event": "tick", "step": step}),
        Event::Step(report) => {
            let mut value = serde_json::to_value(Metrics::from(report)).unwrap_or_default();
            value["event"] = json!("step");
            value["steps"] = json!(report.steps);
            value
        }
        Event::Checkpoint { step, path } => {
            json!({"event": "checkpoint", "step": step, "path": text(path)})
        }
        _ => result(event),
    }
}

/// Of what comes after training.
fn result(event: &Event) -> Value {
    match event {
        Event::Extracting { frames } => json!({"event": "extracting", "frames": frames}),
        Event::Extracted {
            time,
            path,
            vertices,
            triangles,
            components,
            left_out,
            consistency,
            touches_box,
        } => json!({
            "event": "extracted", "time": time, "path": text(path), "vertices": vertices,
            "triangles": triangles, "components": components, "left_out": left_out,
            "consistency": consistency, "touches_box": touches_box,
        }),
        Event::Trusted { time, trust } => json!({
            "event": "trusted", "time": time, "median": trust.median,
            "quantile_95": trust.most, "greatest": trust.greatest, "place": trust.place,
        }),
        Event::Drawing => json!({"event": "drawing"}),
        Event::Reported { path } => json!({"event": "reported", "path": text(path)}),
        Event::Measuring { done, total } => {
            json!({"event": "measuring", "done": done, "total": total})
        }
        Event::Interrupted { step } => json!({"event": "interrupted", "step": step}),
        Event::Finished { step, seconds } => {
            json!({"event": "finished", "step": step, "seconds": seconds})
        }
        _ => unreachable!("an event of training"),
    }
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::{Phase, StepReport, TermReport};

    #[test]
    fn a_step_has_its_terms_and_what_is_no_number_is_null() {
        let report = StepReport {
            step: 3,
            steps: 10,
            phase: Phase::Joint,
            seconds: 1.5,
            total: f64::NAN,
            terms: vec![TermReport {
                name: "data",
                raw: 0.5,
                weighted: 50.0,
            }],
            learning_rate: 0.1,
            velocity_learning_rate: 0.2,
            peak_memory_bytes: None,
        };
        let found = Event::Step(report).json();
        assert_eq!(found["event"], "step");
        assert_eq!((&found["step"], &found["steps"]), (&json!(3), &json!(10)));
        assert_eq!(found["terms"]["data"]["weighted"], 50.0);
        assert_eq!(found["total"], Value::Null);
    }

    #[test]
    fn each_event_is_an_object_that_says_what_it_is() {
        let path = Path::new("run").join("report.html");
        for (event, name) in [
            (Event::Note("a\nb".to_owned()), "note"),
            (Event::Tick { step: 1 }, "tick"),
            (Event::Drawing, "drawing"),
            (Event::Reported { path }, "reported"),
            (Event::Interrupted { step: 2 }, "interrupted"),
        ] {
            let found = event.json();
            assert_eq!(found["event"], name);
            assert_eq!(found.to_string().lines().count(), 1);
        }
    }
}
