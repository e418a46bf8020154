#![no_main]

use isomorph::{Backend, Trained};
use isomorph_fuzz::written;
use serde_json::Value;

/// The files of a small run.
struct Stored {
    recipe: &'static str,
    state: &'static str,
    velocity: &'static [u8],
    ends: &'static [u8],
}

const RUNS: [Stored; 2] = [
    Stored {
        recipe: include_str!("../runs/network/recipe.toml"),
        state: include_str!("../runs/network/state.json"),
        velocity: include_bytes!("../runs/network/velocity.mpk"),
        ends: include_bytes!("../runs/network/ends.mpk"),
    },
    Stored {
        recipe: include_str!("../runs/solved/recipe.toml"),
        state: include_str!("../runs/solved/state.json"),
        velocity: include_bytes!("../runs/solved/velocity.mpk"),
        ends: include_bytes!("../runs/solved/ends.mpk"),
    },
];

// The first byte chooses the run and the file in it that the others are. Its checksum is right: this is no damage
// by chance.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((which, bytes)) = bytes.split_first() else {
        return;
    };
    let run = &RUNS[usize::from(which >> 1) % 2];
    let (velocity, ends) = match which & 1 {
        0 => (bytes, run.ends),
        _ => (run.velocity, bytes),
    };
    let folder = "run/checkpoints/step-000020";
    let mut state: Value = serde_json::from_str(run.state).expect("JSON");
    for (name, content) in [("velocity.mpk", velocity), ("ends.mpk", ends)] {
        let digest = serde_json::json!({"bytes": content.len(), "crc32": crc32fast::hash(content)});
        state["files"][name] = digest;
        written(&format!("{folder}/{name}"), content);
    }
    written(
        &format!("{folder}/state.json"),
        state.to_string().as_bytes(),
    );
    let recipe = written("run/recipe.toml", run.recipe.as_bytes());
    let place = recipe.parent().expect("it lies in a folder");
    match Trained::open(place, Backend::Ndarray) {
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
