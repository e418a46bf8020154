//! `match`: pairs of two shapes found from the shapes alone, and runs that find their own.

use serde_json::Value;

use crate::support::mesh::{Mesh, Point, distance, turned};
use crate::support::ply;
use crate::support::workplace::{Workplace, turn};

/// A tapered, bent bar: no rotation takes it to itself.
fn body() -> Mesh {
    Mesh::bar([1.0, 0.25, 0.5], 0.0625).map(|[x, y, z]| {
        let taper = 1.0 + 0.6 * x;
        [x, y * taper, z * (1.0 - 0.4 * x) + 0.5 * x * x + 0.3 * y]
    })
}

/// Its vertices in another order, turned and moved; vertex k of the source is vertex `last - k`.
fn elsewhere(mesh: &Mesh) -> (Mesh, impl Fn(Point) -> Point) {
    let motion = |x: Point| {
        let [x, y, z] = turned(x, 2.0);
        [x + 5.0, y, z - 1.0]
    };
    let last = mesh.vertices.len() as u32 - 1;
    let mut moved = mesh.clone().map(motion);
    moved.vertices.reverse();
    for triangle in &mut moved.triangles {
        *triangle = triangle.map(|vertex| last - vertex);
    }
    (moved, motion)
}

fn pairs(csv: &str) -> Vec<(usize, usize, f64)> {
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("source_index,target_index,confidence"));
    let pair = |line: &str| {
        let fields: Vec<f64> = line
            .split(',')
            .map(|field| field.parse().expect("a number"))
            .collect();
        let [source, target, confidence] = fields[..] else {
            panic!("{line}: not three fields")
        };
        (source as usize, target as usize, confidence)
    };
    lines.map(pair).collect()
}

#[test]
fn a_mesh_is_found_again_after_a_rigid_motion() {
    let _turn = turn();
    let place = Workplace::new();
    let source = body();
    let (target, motion) = elsewhere(&source);
    place.write("a.ply", ply::text(&source));
    place.write("b.ply", ply::text(&target));
    let arguments = [
        "match", "a.ply", "b.ply", "--points", "6000", "--nodes", "300",
    ];
    let more = ["--json", "-o", "found.csv", "--picture", "cycle.svg"];
    let ended = place
        .isomorph(&[&arguments[..], &more].concat())
        .succeeded();
    let report: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    let found = pairs(&std::fs::read_to_string(place.path("found.csv")).expect("pairs"));
    assert_eq!(report["pairs"], found.len());
    assert!(
        found.len() * 2 > source.vertices.len(),
        "{} of {}",
        found.len(),
        source.vertices.len()
    );
    let right = found.iter().filter(|pair| {
        let (truth, matched) = (motion(source.vertices[pair.0]), target.vertices[pair.1]);
        // Vertices are .06 apart, where the bar tapers .03: the true one, or there its neighbour.
        distance(truth, matched) < 0.03
    });
    assert!(right.count() * 100 >= found.len() * 97);
    assert!(found.iter().all(|pair| (0.5..=1.0).contains(&pair.2)));
    // The surfaces are sampled independently of each other, .015 apart: closest points settle the
    // angle to a degree.
    let degrees = report["rigid"]["degrees"].as_f64().expect("a number");
    assert!((degrees - 2f64.to_degrees()).abs() < 2.0, "{degrees}");
    for side in ["source", "target"] {
        assert!(
            report["coverage"][side].as_f64().expect("a share") > 0.95,
            "{report}"
        );
        let median = report["cycle"][side]["median"].as_f64().expect("a length");
        assert!(median < 0.02, "{report}");
    }
    let svg = std::fs::read_to_string(place.path("cycle.svg")).expect("a picture");
    let svg = roxmltree::Document::parse(&svg).expect("XML");
    let texts: Vec<&str> = svg
        .descendants()
        .filter_map(|node| node.text())
        .map(str::trim)
        .collect();
    assert!(texts.contains(&"source to target and back"), "{texts:?}");
    // And for people.
    let text = place
        .isomorph(&[&arguments[..], &["--count", "50"]].concat())
        .succeeded()
        .stdout;
    assert!(
        text.contains("50 of ") && text.contains("rigid part   114"),
        "{text}"
    );
    assert_eq!(
        place.names(),
        ["a.ply", "b.ply", "cycle.svg", "found.csv", "pairs.csv"]
    );
}

#[test]
fn a_run_that_finds_its_own_pairs_keeps_them_for_when_it_goes_on() {
    let _turn = turn();
    let keys = [
        "data.correspondences = \"match\"",
        "implicit.depth = 3",
        "implicit.width = 32",
        "velocity.depth = 2",
        "velocity.width = 24",
        "data.points = 1000",
        "training.batch = 200",
        "training.steps = 4",
        "checkpoint.every = 2",
        "result.frames = 0",
    ];
    let source = body();
    // Moved a little, and with other triangles, so that nothing but the form says what belongs to
    // what.
    let target = Mesh::bar([1.0, 0.25, 0.5], 0.125).map(|[x, y, z]| {
        let taper = 1.0 + 0.6 * x;
        [
            x + 0.05,
            y * taper,
            z * (1.0 - 0.4 * x) + 0.5 * x * x + 0.3 * y,
        ]
    });
    let place = Workplace::with_pair(&source, &target, &keys);
    let whole = place.train("whole", &["--backend", "ndarray"]);
    let stored = std::fs::read_to_string(place.path("whole/pairs.csv")).expect("pairs");
    assert!(pairs(&stored).len() > 50, "{stored}");
    let log = std::fs::read_to_string(place.path("whole/run.log")).expect("a log");
    assert!(
        log.contains("matched ") && log.contains(" % of the source"),
        "{log}"
    );
    assert_eq!(whole.step(), 4);
    // Going on, it takes what is stored: here one pair, which no matching would find alone.
    place.write("whole/pairs.csv", "source_index,target_index\n0,0\n");
    place
        .isomorph(&[
            "resume",
            "whole",
            "--quiet",
            "--set",
            "training.steps=6",
            "--backend",
            "ndarray",
        ])
        .succeeded();
    let log = std::fs::read_to_string(place.path("whole/run.log")).expect("a log");
    assert!(log.contains("1 correspondence"), "{log}");
    assert_eq!(log.matches("matched ").count(), 1, "found once: {log}");
    let kept = std::fs::read_to_string(place.path("whole/pairs.csv")).expect("pairs");
    assert_eq!(kept, "source_index,target_index\n0,0\n");
}

#[test]
fn what_cannot_be_matched_is_refused_in_a_line_and_nothing_is_written() {
    let place = Workplace::new();
    place.write("a.ply", ply::text(&body()));
    let cases: &[(&[&str], i32, &[&str])] = &[
        (&["a.ply", "none.ply"], 1, &["none.ply: cannot be read"]),
        (
            &["a.ply", "a.ply", "--nodes", "3"],
            2,
            &["nodes 3", "64 to 10000"],
        ),
        (
            &["a.ply", "a.ply", "--confidence", "2"],
            2,
            &["confidence 2", "0 to 1"],
        ),
        (
            &["a.ply", "a.ply", "--picture", "p.png"],
            2,
            &["--picture p.png", ".svg"],
        ),
    ];
    for (arguments, code, parts) in cases {
        place
            .isomorph(&[&["match"], *arguments].concat())
            .refused(*code, parts);
    }
    assert_eq!(place.names(), ["a.ply"]);
}
