//! The terms of three steps against a file: what a seed and a recipe give must not change unnoticed.
//!
//! A change that is meant (of a term, a sample, an initialisation) is a line in the CHANGELOG, and
//! `cargo test --release --test it -- --ignored write_the_golden_terms` writes the file anew.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::support::run::{self, Logged};
use crate::support::workplace::{Workplace, turn};

const COMMAND: &str = "cargo test --release --test it -- --ignored write_the_golden_terms";

/// Three steps with every term that has no default weight of zero, no warm-up before them.
const KEYS: &[&str] = &[
    "training.steps = 3",
    "training.log-every = 1",
    "training.seed = 42",
    "training.warm-up = 0",
    "training.ramp-until = 0",
    "training.velocity-until = 1",
    "loss.smoothness = 1",
    "loss.off-surface = 30",
];

fn file() -> PathBuf {
    let here = PathBuf::from(file!());
    here.parent()
        .expect("a folder")
        .join("../golden/terms.json")
}

fn terms(backend: &str) -> Vec<Logged> {
    Workplace::tiny(KEYS)
        .train("run", &["--backend", backend])
        .metrics()
}

#[test]
fn the_first_steps_have_the_terms_that_they_always_had() {
    let _turn = turn();
    let golden = run::json(&file());
    let steps = golden["steps"].as_array().expect("steps");
    for backend in ["ndarray", "flex"] {
        let found = terms(backend);
        assert_eq!(found.len(), steps.len());
        for (found, wanted) in found.iter().zip(steps) {
            let wanted_terms = wanted["terms"].as_object().expect("terms");
            assert!(
                found.terms.keys().eq(wanted_terms.keys()),
                "{:?}",
                found.terms.keys()
            );
            for (name, wanted) in wanted_terms {
                let (found, wanted) = (found.terms[name], wanted.as_f64().expect("a number"));
                // f32 in another order of summation: 1e-6 between the backends here, and room for
                // processors that add in vectors of another width.
                let near = (found - wanted).abs() <= 1e-4 * wanted.abs();
                assert!(near, "{backend}: {name} is {found}, it was {wanted}");
            }
        }
    }
}

#[test]
#[ignore = "writes tests/golden/terms.json anew"]
fn write_the_golden_terms() {
    let _turn = turn();
    let steps = terms("ndarray")
        .into_iter()
        .map(|logged| json!({"step": logged.step, "terms": logged.terms}));
    let golden = json!({
        "made_by": COMMAND,
        "backend": "ndarray",
        "keys": KEYS,
        "steps": steps.collect::<Vec<Value>>(),
    });
    let text = serde_json::to_string_pretty(&golden).expect("plain data");
    std::fs::write(file(), text + "\n").expect("the golden file");
}
