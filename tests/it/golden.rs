//! The terms of three steps against a file: what a seed and a recipe give must not change unnoticed. Once for
//! the product as it ships, once for the paper's geometry.
//!
//! A change that is meant (of a term, a sample, an initialisation) is a line in the CHANGELOG, and
//! `cargo test --release --test it -- --ignored write_the_golden_terms` writes the file anew.

use std::path::PathBuf;

use serde_json::{Map, Value, json};

use crate::support::run::{self, Logged};
use crate::support::workplace::{NETWORK, SHIPPED, Workplace, turn};

/// The product as it ships, the same without splines to start from, and the paper's geometry.
const COLUMNS: [(&str, &[&str]); 3] = [
    ("shipped", SHIPPED),
    ("without splines", &["training.guided-until = 0"]),
    ("network", NETWORK),
];

const COMMAND: &str = "cargo test --release --test it -- --ignored write_the_golden_terms";

/// Three steps of every term that has a weight, no warm-up before them.
const KEYS: &[&str] = &[
    "training.steps = 3",
    "training.log-every = 1",
    "training.seed = 42",
    "training.warm-up = 0",
    "training.ramp-until = 0",
];

/// The network's column also has the terms of the preset `paper`, and trains both networks in all three.
const OF_THE_NETWORK: &[&str] = &[
    "training.velocity-until = 1",
    "loss.smoothness = 1",
    "loss.off-surface = 30",
];

/// The keys of a column.
fn keys(column: &str, keys: &[&'static str]) -> Vec<&'static str> {
    let more = match column {
        "network" => OF_THE_NETWORK,
        _ => &[],
    };
    [keys, KEYS, more].concat()
}

fn file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden/terms.json")
}

fn terms(keys: &[&str], backend: &str) -> Vec<Logged> {
    Workplace::tiny(keys)
        .train("run", &["--backend", backend])
        .metrics()
}

#[test]
fn the_first_steps_have_the_terms_that_they_always_had() {
    let _turn = turn();
    let golden = run::json(&file());
    for (column, given) in COLUMNS {
        let steps = golden[column].as_array().expect("the steps of a column");
        assert_eq!(steps.len(), 3, "{column}: write the golden terms first");
        for backend in ["ndarray", "flex"] {
            let found = terms(&keys(column, given), backend);
            assert_eq!(found.len(), steps.len(), "{column}, {backend}");
            for (found, wanted) in found.iter().zip(steps) {
                assert_terms(found, wanted, &format!("{column}, {backend}"));
            }
        }
    }
}

/// Holds one step to its golden terms.
#[track_caller]
fn assert_terms(found: &Logged, wanted: &Value, what: &str) {
    assert_eq!(found.step, wanted["step"], "{what}");
    let wanted = wanted["terms"].as_object().expect("terms");
    assert!(
        found.terms.keys().eq(wanted.keys()),
        "{what}: {:?} instead of {:?}",
        found.terms.keys(),
        wanted.keys()
    );
    for (name, wanted) in wanted {
        let (found, wanted) = (found.terms[name], wanted.as_f64().expect("a number"));
        // f32 in another order of summation: 1e-6 between the backends here, and room for processors that
        // add in vectors of another width.
        let near = (found - wanted).abs() <= 1e-4 * wanted.abs();
        assert!(near, "{what}: {name} is {found}, it was {wanted}");
    }
}

#[test]
#[ignore = "writes tests/golden/terms.json anew"]
fn write_the_golden_terms() {
    let _turn = turn();
    let mut golden = Map::new();
    golden.insert("made_by".to_owned(), COMMAND.into());
    golden.insert("backend".to_owned(), "ndarray".into());
    let mut all_keys = Map::new();
    for (column, given) in COLUMNS {
        let keys = keys(column, given);
        let steps = terms(&keys, "ndarray")
            .into_iter()
            .map(|logged| json!({"step": logged.step, "terms": logged.terms}));
        golden.insert(column.to_owned(), steps.collect());
        all_keys.insert(column.to_owned(), json!(keys));
    }
    golden.insert("keys".to_owned(), Value::Object(all_keys));
    let text = serde_json::to_string_pretty(&golden).expect("plain data");
    std::fs::write(file(), text + "\n").expect("the golden file");
}
