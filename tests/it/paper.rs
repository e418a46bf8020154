//! The preset `paper`, cut down: what it prints collapses, and its three corrections are what prevents it.

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::workplace::{Workplace, turn};

/// The preset on a sphere that moves by its radius, with networks and batches that train in seconds.
const RECIPE: &str = "\
preset = \"paper\"
data.source = \"source.ply\"
data.target = \"target.ply\"
data.correspondences = \"same-vertices\"
data.points = 5000
implicit.depth = 4
implicit.width = 64
velocity.depth = 3
velocity.width = 48
training.steps = 300
training.batch = 440
result.frames = 0
";

/// `mean (|grad f| - 1)^2` at the end of training.
fn slope_error(run: &str, keys: &[&str]) -> f64 {
    let place = Workplace::new();
    let sphere = Mesh::sphere(1.0, 3);
    let target = sphere.clone().map(|x| [x[0] + 1.0, x[1], x[2]]);
    place.write("source.ply", ply::text(&sphere));
    place.write("target.ply", ply::text(&target));
    place.write("recipe.toml", RECIPE);
    let keys = keys.iter().flat_map(|key| ["--set", key]);
    let words: Vec<&str> = ["--backend", "flex"].into_iter().chain(keys).collect();
    let metrics = place.train(run, &words).metrics();
    metrics.last().expect("a line of metrics").terms["eikonal"]
}

#[test]
fn the_printed_objective_collapses_and_the_corrected_one_does_not() {
    let _turn = turn();
    // A weight of 1e-6 says what the term is and moves nothing.
    let printed = slope_error(
        "printed",
        &["loss.eikonal=1e-6", "loss.normals=0", "loss.lambda-l=10"],
    );
    let corrected = slope_error("corrected", &[]);
    println!("mean (|grad f| - 1)^2: {printed:.4} as printed, {corrected:.4} corrected");
    // f = 0 everywhere has 1.
    assert!(printed > 0.8, "{printed}");
    assert!(corrected < 0.15, "{corrected}");
}
