//! Matching as a whole, on bodies whose true correspondence has a formula.

use std::path::PathBuf;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::rotation::tests::turn;
use super::*;
use crate::geometry::Mesh;
use crate::geometry::linear::{add, cross, difference, length, scaled};
use crate::shape::Correspondences;

mod given;

type Point = [f64; 3];

/// A point on a box around `centre` with these edges, uniform by area, and the normal there.
fn on_box(centre: Point, edges: Point, rng: &mut ChaCha8Rng) -> (Point, Point) {
    let areas = [
        edges[1] * edges[2],
        edges[0] * edges[2],
        edges[0] * edges[1],
    ];
    let height = rng.random::<f64>() * areas.iter().sum::<f64>();
    let axis = if height < areas[0] {
        0
    } else if height < areas[0] + areas[1] {
        1
    } else {
        2
    };
    let mut place: Point = edges.map(|edge| (rng.random::<f64>() - 0.5) * edge);
    let side = if rng.random::<bool>() { 1.0 } else { -1.0 };
    place[axis] = 0.5 * side * edges[axis];
    let mut normal = [0.0; 3];
    normal[axis] = side;
    (add(place, centre), normal)
}

/// Points of a body and normals there, with a motion that has a formula.
fn cloud(points: &[(Point, Point)], motion: impl Fn(Point) -> Point) -> Shape {
    // The normal of the moved surface by two tangents moved with it.
    let moved_normal = |x: Point, normal: Point| {
        let reference = if normal[0].abs() > 0.5 {
            [0.0, 1.0, 0.0]
        } else {
            [1.0, 0.0, 0.0]
        };
        let tangents = [cross(normal, reference), reference];
        let [along, across] = tangents.map(|tangent| {
            let step = |sign: f64| motion(add(x, scaled(tangent, sign * 1e-5)));
            difference(step(1.0), step(-1.0))
        });
        let normal = cross(across, along);
        scaled(normal, length(normal).recip()).map(|part| part as f32)
    };
    Shape {
        path: PathBuf::from("body.ply"),
        mesh: Mesh {
            vertices: points.iter().map(|point| motion(point.0)).collect(),
            triangles: Vec::new(),
            normals: Some(
                points
                    .iter()
                    .map(|point| moved_normal(point.0, point.1))
                    .collect(),
            ),
        },
        ..Shape::of(Mesh::default())
    }
}

/// Three boxes of different sizes side by side that no rotation takes into each other.
fn odd_body(count: usize, seed: u64) -> Vec<(Point, Point)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let boxes: [(Point, Point); 3] = [
        ([0.0, 0.0, 0.0], [1.0, 0.2, 0.3]),
        ([0.55, 0.25, 0.0], [0.2, 0.4, 0.3]),
        ([-0.3, 0.0, 0.3], [0.15, 0.15, 0.4]),
    ];
    let mut point = |k: usize| {
        let (centre, edges) = boxes[[0, 0, 0, 1, 1, 2][k % 6]];
        on_box(centre, edges, &mut rng)
    };
    (0..count).map(&mut point).collect()
}

/// The pairs of two shapes, whose progress nobody follows.
fn found(source: &Shape, target: &Shape, options: &MatchOptions) -> Result<Matching, MatchError> {
    match_shapes(
        source,
        target,
        &Correspondences::none(),
        options,
        &mut |_, _, _| {},
    )
}

fn small() -> MatchOptions {
    MatchOptions {
        nodes: 500,
        ..MatchOptions::default()
    }
}

/// Distances between where the source's vertices truly go and where their pairs say, from least to
/// greatest.
fn errors(matching: &Matching, truth: impl Fn(u32) -> Point, target: &Shape) -> Vec<f64> {
    let error = |pair: &MatchedPair| {
        length(difference(
            truth(pair.source),
            target.mesh.vertices[pair.target as usize],
        ))
    };
    let mut errors: Vec<f64> = matching.pairs.iter().map(error).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

fn at(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

#[test]
fn a_rigid_motion_is_recovered_and_every_point_found() {
    let points = odd_body(2000, 1);
    let motion = RigidMotion {
        rotation: turn(1.9),
        translation: [3.0, -1.0, 0.5],
    };
    let source = cloud(&points, |x| x);
    let mut target = cloud(&points, |x| motion.apply(x));
    // Another order: vertex k of the source is vertex 1999 - k of the target.
    target.mesh.vertices.reverse();
    target.mesh.normals.as_mut().expect("normals").reverse();
    let found = found(&source, &target, &small()).expect("matched");
    // Points are float32 once normalised, which near 3 is 2e-7.
    for (found, given) in found
        .rigid
        .rotation
        .as_flattened()
        .iter()
        .zip(motion.rotation.as_flattened())
    {
        assert!((found - given).abs() < 1e-5, "{:?}", found);
    }
    for (found, given) in found.rigid.translation.iter().zip(motion.translation) {
        assert!((found - given).abs() < 1e-5, "{found} instead of {given}");
    }
    assert!((found.rigid.degrees - 1.9f64.to_degrees()).abs() < 1e-3);
    assert!(found.rigid.distance < 1e-5 && found.rigid.distance_unmoved > 0.1);
    let right = found
        .pairs
        .iter()
        .filter(|pair| pair.source + pair.target == 1999)
        .count();
    // Of 2,000 points at random a few are closer together than their registration is exact.
    assert!(
        right + 4 >= found.pairs.len() && right > 1900,
        "{right} of {}",
        found.pairs.len()
    );
    assert!(found.coverage.source > 0.99 && found.coverage.target > 0.99);
}

/// A bar along x bent onto an arc in the x-y plane that spans `angle`.
fn bent(x: Point, angle: f64) -> Point {
    let radius = 1.0 / angle;
    let (sin, cos) = (x[0] * angle).sin_cos();
    [(radius - x[1]) * sin, radius - (radius - x[1]) * cos, x[2]]
}

#[test]
fn the_bend_of_a_bar_is_recovered() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut bar =
        || Vec::from_iter((0..3000).map(|_| on_box([0.0; 3], [1.0, 0.12, 0.2], &mut rng)));
    let (first, second) = (bar(), bar());
    let angle = 1.8;
    let source = cloud(&first, |x| x);
    let target = cloud(&second, |x| bent(x, angle));
    let options = MatchOptions {
        aligned: true,
        ..small()
    };
    let found = found(&source, &target, &options).expect("matched");
    let errors = errors(
        &found,
        |vertex| bent(first[vertex as usize].0, angle),
        &target,
    );
    // 3,000 points on an area of .69 are .015 apart; the ends have moved by .2. A pair is at best
    // the nearest of other points: half a spacing, and the bend stretches the outside by 11 %,
    // which the ties resist.
    assert!(at(&errors, 0.5) < 0.02, "{}", at(&errors, 0.5));
    assert!(at(&errors, 0.95) < 0.04, "{}", at(&errors, 0.95));
    assert!(found.pairs.len() > 1000, "{}", found.pairs.len());
    assert!(
        found.coverage.source > 0.95 && found.coverage.target > 0.95,
        "{:?}",
        found.coverage
    );
    assert!(
        found.cycle.source.median < 0.02,
        "{:?}",
        found.cycle.source.median
    );
}

/// A tuning fork: two prongs along x, .03 apart, joined by a foot at x = 0. The flag says which
/// prong, if any.
fn fork(count: usize, seed: u64) -> Vec<((Point, Point), Option<bool>)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let point = |k: usize| match k % 5 {
        0 => (on_box([-0.05, 0.0, 0.0], [0.1, 0.19, 0.1], &mut rng), None),
        side => {
            let upper = side % 2 == 0;
            let y = if upper { 0.055 } else { -0.055 };
            (
                on_box([0.4, y, 0.0], [0.8, 0.08, 0.1], &mut rng),
                Some(upper),
            )
        }
    };
    (0..count).map(point).collect()
}

/// Bends each prong outwards from its root.
fn spread(x: Point) -> Point {
    let along = x[0].max(0.0);
    let side = if x[1] > 0.0 { 1.0 } else { -1.0 };
    let turned = bent([along, side * x[1] - 0.055, x[2]], 0.7);
    [turned[0] + x[0].min(0.0), side * (turned[1] + 0.055), x[2]]
}

#[test]
fn two_near_parallel_prongs_that_move_apart_are_not_confused() {
    let (first, second) = (fork(3000, 6), fork(3000, 7));
    let points =
        |fork: &[((Point, Point), Option<bool>)]| Vec::from_iter(fork.iter().map(|point| point.0));
    // Either way: near prongs that part, and parted ones that come near.
    for inward in [false, true] {
        let motions: [fn(Point) -> Point; 2] = if inward {
            [spread, |x| x]
        } else {
            [|x| x, spread]
        };
        let source = cloud(&points(&first), motions[0]);
        let target = cloud(&points(&second), motions[1]);
        let options = MatchOptions {
            aligned: true,
            ..small()
        };
        let found = found(&source, &target, &options).expect("matched");
        let prongs = found.pairs.iter().filter_map(|pair| {
            let from = first[pair.source as usize].1?;
            Some((from, second[pair.target as usize].1?))
        });
        let (mut same, mut crossed) = (0, 0);
        prongs.for_each(|(from, to)| if from == to { same += 1 } else { crossed += 1 });
        assert!(same > 500, "{same} and {crossed} crossed");
        assert!(
            crossed * 200 < same,
            "{crossed} of {same} crossed, inward: {inward}"
        );
    }
}

#[test]
fn what_is_missing_in_the_target_stays_unmatched() {
    let hole = [0.55, 0.45, 0.0];
    let within = |x: Point, radius: f64| length(difference(x, hole)) < radius;
    let first = odd_body(4000, 8);
    let mut second = odd_body(4000, 9);
    // The far end of the second box, and nothing else.
    second.retain(|point| !within(point.0, 0.25));
    assert!(second.len() < 3800, "something is cut away");
    let source = cloud(&first, |x| x);
    let target = cloud(&second, |x| x);
    let found = found(&source, &target, &small()).expect("matched");
    // The spacing is .02: what lies 3 of it inside the hole has no counterpart.
    let wrong = found
        .pairs
        .iter()
        .filter(|pair| within(first[pair.source as usize].0, 0.19));
    let (wrong, inside) = (
        wrong.count(),
        first.iter().filter(|point| within(point.0, 0.19)).count(),
    );
    assert!(inside > 100 && wrong * 50 < inside, "{wrong} of {inside}");
    let outside = first.iter().filter(|point| !within(point.0, 0.3)).count();
    assert!(
        found.pairs.len() * 3 > outside,
        "{} of {outside}",
        found.pairs.len()
    );
    assert!(
        found.coverage.target > 0.95 && found.coverage.source < 0.97,
        "{:?}",
        found.coverage
    );
}

#[test]
fn the_same_shapes_give_the_same_pairs_on_any_number_of_cores() {
    let source = cloud(&odd_body(1200, 2), |x| x);
    let target = cloud(&odd_body(1200, 3), |x| bent(x, 0.5));
    let options = MatchOptions {
        nodes: 200,
        points: 1000,
        ..small()
    };
    let everywhere = found(&source, &target, &options).expect("matched").pairs;
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool");
    let alone = one
        .install(|| found(&source, &target, &options))
        .expect("matched")
        .pairs;
    assert_eq!(everywhere, alone);
    let other = MatchOptions { seed: 5, ..options };
    let other = found(&source, &target, &other).expect("matched").pairs;
    assert_ne!(everywhere, other, "another thousand points are drawn");
    let few = MatchOptions {
        count: Some(40),
        ..options
    };
    let few = found(&source, &target, &few).expect("matched");
    assert_eq!(few.pairs.len(), 40);
    assert!(few.pairs.iter().all(|pair| everywhere.contains(pair)));
    // Forty discs of radius .05 would cover .3 of the area if none overlapped; drawn at random they
    // overlap more.
    assert!(few.coverage.source > 0.2, "{:?}", few.coverage);
}

#[test]
fn pairs_are_read_back_as_they_were_written() {
    let shape = cloud(&odd_body(500, 2), |x| x);
    let options = MatchOptions {
        nodes: 150,
        ..small()
    };
    let found = found(&shape, &shape, &options).expect("matched");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("pairs.csv");
    found.write_csv(&path).expect("written");
    let read = Correspondences::read(&path, &shape, &shape).expect("read");
    assert_eq!(read, found.correspondences());
    assert!(
        read.pairs.iter().all(|pair| pair[0] == pair[1]),
        "a shape matches itself"
    );
}

#[test]
fn options_out_of_range_and_shapes_without_a_sure_pair_are_refused() {
    let shape = cloud(&odd_body(300, 2), |x| x);
    let message = |options: MatchOptions| {
        let other = cloud(&odd_body(300, 3), |x| [x[0], 2.0 * x[1], 0.3 * x[2]]);
        found(&shape, &other, &options)
            .expect_err("refused")
            .to_string()
    };
    let base = MatchOptions {
        nodes: 100,
        ..small()
    };
    assert_eq!(
        message(MatchOptions { nodes: 3, ..base }),
        "nodes 3: must be 64 to 10000"
    );
    assert_eq!(
        message(MatchOptions { points: 9, ..base }),
        "points 9: must be 64 or more"
    );
    let confidence = MatchOptions {
        least_confidence: f64::NAN,
        ..base
    };
    assert_eq!(message(confidence), "confidence NaN: must be 0 to 1");
    let count = MatchOptions {
        count: Some(0),
        ..base
    };
    assert_eq!(message(count), "count 0: must be 1 or more");
    let sure = MatchOptions {
        least_confidence: 1.0,
        ..base
    };
    let text = message(sure);
    assert!(
        text.starts_with("body.ply and body.ply: no pair") && text.contains("least confidence"),
        "{text}"
    );
}

#[test]
fn stages_are_reported_in_order_each_from_nothing_to_all() {
    let shape = cloud(&odd_body(300, 2), |x| x);
    let options = MatchOptions {
        nodes: 100,
        ..small()
    };
    let mut reports = Vec::new();
    let mut report = |stage, done, total| reports.push((stage, done, total));
    match_shapes(
        &shape,
        &shape,
        &Correspondences::none(),
        &options,
        &mut report,
    )
    .expect("matched");
    let stages: Vec<MatchStage> = reports.iter().map(|report| report.0).collect();
    assert!(stages.is_sorted_by_key(|&stage| stage as u8));
    for stages in reports.chunk_by(|a, b| a.0 == b.0) {
        let (stage, _, total) = stages[0];
        let done = stages.iter().map(|report| report.1);
        assert!(done.eq(0..=total), "{stage}: {stages:?}");
    }
    assert_eq!(reports.last(), Some(&(MatchStage::Pairs, 1, 1)));
}
