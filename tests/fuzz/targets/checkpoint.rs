#![no_main]

use isomorph::{Backend, Trained};
use isomorph_fuzz::written;
use serde_json::Value;

/// A small run: its recipe, and the state and the records of its checkpoint.
struct Stored {
    recipe: &'static str,
    state: &'static str,
    records: &'static [(&'static str, &'static [u8])],
}

/// The stored run of a name with the records of these names.
macro_rules! stored {
    ($run:literal: $($name:literal)*) => {
        Stored {
            recipe: include_str!(concat!("../runs/", $run, "/recipe.toml")),
            state: include_str!(concat!("../runs/", $run, "/state.json")),
            records: &[$((
                concat!($name, ".mpk"),
                include_bytes!(concat!("../runs/", $run, "/", $name, ".mpk")),
            )),*],
        }
    };
}

const RUNS: [Stored; 2] = [
    stored!("network": "ends-muon-optimiser" "ends-optimiser" "ends" "velocity-muon-optimiser"
        "velocity-optimiser" "velocity"),
    stored!("solved": "ends" "velocity"),
];

// The first byte chooses the record that the others are. Its checksum is right: this is no damage by chance.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((place, bytes)) = bytes.split_first() else {
        return;
    };
    let all: usize = RUNS.iter().map(|run| run.records.len()).sum();
    let mut place = usize::from(*place) % all;
    let mut runs = RUNS.iter();
    let run = loop {
        let run = runs.next().expect("the place is below the sum");
        match place.checked_sub(run.records.len()) {
            Some(rest) => place = rest,
            None => break run,
        }
    };
    let folder = "run/checkpoints/step-000002";
    let mut state: Value = serde_json::from_str(run.state).expect("JSON");
    for (k, (name, content)) in run.records.iter().enumerate() {
        let content = if k == place { bytes } else { *content };
        let digest = serde_json::json!({"bytes": content.len(), "crc32": crc32fast::hash(content)});
        state["files"][name] = digest;
        written(&format!("{folder}/{name}"), content);
    }
    written(
        &format!("{folder}/state.json"),
        state.to_string().as_bytes(),
    );
    let recipe = written("run/recipe.toml", run.recipe.as_bytes());
    let folder = recipe.parent().expect("it lies in a folder");
    match Trained::open(folder, Backend::Ndarray) {
        Err(error) => isomorph_fuzz::one_line(&error.to_string(), ".mpk"),
        Ok(trained) => {
            // Whatever numbers it holds: no panic, and one value for each point.
            let points = [[0.1, 0.2, 0.3], [9.0, -9.0, 0.0]];
            if let Ok(moved) = trained.carry(&points, 0.0, 0.5) {
                assert_eq!(moved.len(), points.len());
            }
            let _ = trained.distance(&points, 0.5);
        }
    }
});
