//! Shapes in other units, other places and other directions: laid onto each other, and results where the files lie.

use std::fs;

use crate::support::mesh::{Mesh, Point, distance, turned};
use crate::support::ply;
use crate::support::run::json;
use crate::support::sequence::Sequence;
use crate::support::workplace::{Workplace, turn};

/// Small surfaces and a solver with few samples.
const SMALL: [&str; 8] = [
    "--set",
    "result.resolution=48",
    "--set",
    "spline.band=2000",
    "--set",
    "data.points=2000",
    "--set",
    "spline.spacing=0.15",
];

/// A body without symmetry about the origin, bent by so much.
fn body(bend: f64) -> Mesh {
    Mesh::sphere(1.0, 4).map(|[x, y, z]| {
        let (x, y) = (1.8 * x, y * (0.7 + 0.25 * x));
        [x, y, 0.5 * z + bend * (x * x - 1.0) + 0.1 * y * y]
    })
}

/// In millimetres, in another place, turned by 100 degrees.
fn far([x, y, z]: Point) -> Point {
    let [y, z, x] = turned([y, z, x], 100f64.to_radians());
    [1000.0 * x + 5000.0, 1000.0 * y - 200.0, 1000.0 * z + 800.0]
}

fn mean_apart(one: &Mesh, other: &Mesh) -> f64 {
    let both = one.vertices.iter().zip(&other.vertices);
    both.map(|(a, b)| distance(*a, *b)).sum::<f64>() / one.vertices.len() as f64
}

fn read(place: &Workplace, file: &str) -> Mesh {
    ply::Ply::read(&place.path(file)).mesh()
}

#[test]
fn another_unit_place_and_direction_are_taken_out_and_results_lie_where_the_files_do() {
    let _turn = turn();
    let place = Workplace::new();
    place.write("source.ply", ply::text(&body(0.0)));
    place.write("target.ply", ply::text(&body(0.15).map(far)));
    let morph = [
        "morph",
        "source.ply",
        "target.ply",
        "-o",
        "run",
        "--frames",
        "3",
    ];
    let ended = place.isomorph(&[&morph[..], &SMALL].concat()).succeeded();
    for said in [
        "target.ply is laid onto",
        "scaled by 0.00100, turned by ",
        "results lie where the files do",
    ] {
        assert!(ended.stderr.contains(said), "{}", ended.stderr);
    }
    assert!(!ended.stderr.contains("doubtful"), "{}", ended.stderr);
    let extract = [
        "extract", "run", "--times", "0,0.5,1", "--carry", "-o", "out", "--quiet",
    ];
    place.isomorph(&extract).succeeded();
    let (source, target) = (read(&place, "source.ply"), read(&place, "target.ply"));
    assert_eq!(
        mean_apart(&read(&place, "out/carried-000.ply"), &source),
        0.0,
        "at its own time each vertex is where it was"
    );
    let off = mean_apart(&read(&place, "out/carried-002.ply"), &target);
    assert!(off < 30.0, "{off} of a size of 3600");
    // The surface encloses what the file does, in the file's unit.
    let volume = read(&place, "out/surface-002.ply").volume() / target.volume();
    assert!((volume - 1.0).abs() < 0.05, "{volume}");
    let half = read(&place, "out/surface-001.ply").volume();
    let mean = (source.volume() * target.volume()).sqrt();
    assert!(
        (half / mean - 1.0).abs() < 0.1,
        "even growth: {half}, {mean}"
    );
    // Points of the target, back to the source.
    let back = [
        "warp",
        "run",
        "--points",
        "target.ply",
        "--from",
        "1",
        "--to",
        "0",
        "-o",
        "back.ply",
    ];
    let ended = place.isomorph(&back).succeeded();
    assert!(!ended.stderr.contains("outside"), "{}", ended.stderr);
    let off = mean_apart(&read(&place, "back.ply"), &source);
    assert!(off < 0.03, "{off}");
    place.isomorph(&["map", "run", "-o", "map.csv"]).succeeded();
    let map = fs::read_to_string(place.path("map.csv")).expect("a map");
    let rows = map
        .lines()
        .skip(1)
        .map(|line| line.split(',').collect::<Vec<_>>());
    let (mut same, mut all) = (0, 0);
    for row in rows {
        all += 1;
        same += usize::from(row[0] == row[1]);
    }
    assert!(
        all == source.vertices.len() && 10 * same > 8 * all,
        "{same} of {all}"
    );
    // A grid over all times, in the files' coordinates: inside where the file is.
    place
        .isomorph(&[
            "field",
            "run",
            "--grid",
            "6",
            "--times",
            "1",
            "-o",
            "field.npz",
        ])
        .succeeded();
    let told = place.isomorph(&["info", "run"]).succeeded();
    assert!(
        told.stdout.contains("data.align = \"auto\""),
        "{}",
        told.stdout
    );
    let page = fs::read_to_string(place.path("run/report.html")).expect("a page");
    assert!(page.contains("as they lie on each other"));
    // A run that goes on lays them as before.
    let run = place.run("run");
    fs::remove_dir_all(run.newest()).expect("the last checkpoint");
    place.isomorph(&["resume", "run", "--quiet"]).succeeded();
    let state = run.state();
    let scale = state["placements"][1]["scale"].as_f64().expect("a number");
    assert!((scale / 1000.0 - 1.0).abs() < 1e-3, "{scale}");
}

#[test]
fn shapes_lie_as_they_are_where_nothing_else_is_asked_for() {
    let _turn = turn();
    let place = Workplace::new();
    place.write("source.ply", ply::text(&body(0.0)));
    place.write("target.ply", ply::text(&body(0.15)));
    let near = [
        "morph",
        "source.ply",
        "target.ply",
        "-o",
        "near",
        "--frames",
        "2",
    ];
    let ended = place.isomorph(&[&near[..], &SMALL].concat()).succeeded();
    assert!(!ended.stderr.contains("laid onto"), "{}", ended.stderr);
    assert!(place.run("near").state().get("placements").is_none());
    place.write(
        "large.ply",
        ply::text(&body(0.15).map(|x| x.map(|part| 25.4 * part))),
    );
    let none = [
        "morph",
        "source.ply",
        "large.ply",
        "-o",
        "none",
        "--align",
        "none",
        "--frames",
        "2",
    ];
    let ended = place.isomorph(&[&none[..], &SMALL].concat());
    assert!(
        ended.stderr.contains("add --align auto"),
        "{}",
        ended.stderr
    );
    assert!(
        ended.stderr.contains("set data.align = \"auto\""),
        "{}",
        ended.stderr
    );
    let wrong = ["morph", "source.ply", "target.ply", "--align", "mirror"];
    place
        .isomorph(&wrong)
        .refused(2, &["data.align", "mirror", "rigid", "similarity"]);
}

/// A turn about its own middle is exact, however large, and is measured so.
#[test]
fn a_large_turn_is_exact() {
    let _turn = turn();
    let place = Workplace::new();
    let bar = Mesh::bar([1.6, 0.3, 0.4], 0.1).map(|[x, y, z]| [x, y * (1.0 + 0.2 * x), z]);
    let frame = |k: u32| {
        let angle = (170.0 * f64::from(k) / 4.0).to_radians();
        bar.clone().map(|x| turned(x, angle))
    };
    let truth = Sequence((0..5).map(frame).collect());
    truth.write_folder(&place, "truth");
    for k in [0, 4] {
        place.write(&format!("{k}.ply"), ply::text(&truth.0[k]));
    }
    let changes = [
        "--set",
        "data.align=rigid",
        "--set",
        "data.correspondences=same-vertices",
    ];
    let init = ["init", "0.ply", "4.ply", "--preset", "instant"];
    let text = place.isomorph(&init).succeeded().stdout;
    place.write("recipe.toml", text);
    let train = ["train", "recipe.toml", "--run", "run"];
    let ended = place
        .isomorph(&[&train[..], &changes, &SMALL].concat())
        .succeeded();
    assert!(
        ended.stderr.contains("turned by 170.0 degrees"),
        "{}",
        ended.stderr
    );
    let evaluate = [
        "evaluate",
        "run",
        "--ground-truth",
        "truth",
        "--from",
        "0",
        "--to",
        "4",
        "--samples",
        "2000",
    ];
    place.isomorph(&evaluate).succeeded();
    let found = json(&place.path("run/evaluation.json"));
    let off = found["mean"]["carried"]["tracked_rmse"].as_f64();
    assert!(off.is_some_and(|off| off < 2e-3), "{}", found["mean"]);
}
