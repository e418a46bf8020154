//! Motions with exact answers: a sphere that moves, a sphere that grows, a bar that turns. Each is trained as
//! the product ships, and in the paper's geometry.
//!
//! Each trains for about 20 seconds and is then held against the exact shape in between, which training
//! never saw. Distances are shares of the sphere's radius or of the bar's length.
//!
//! Thresholds of the paper's geometry are 1.5 to 1.8 times the worst that was measured over the three times and
//! over the seeds 0 to 3, on flex; the measured values stand beside them. Those of the product as it ships are
//! twice and more of fewer seeds.

use std::f64::consts::PI;

use crate::support::mesh::{Mesh, Point, distance, distance_to_bar, turned};
use crate::support::ply::Ply;
use crate::support::run::{Frame, frames};
use crate::support::workplace::{NETWORK, SHIPPED, Workplace, turn};

/// Smaller networks and batches than `quick`, and fewer steps.
const KEYS: &[&str] = &[
    "implicit.depth = 4",
    "implicit.width = 64",
    "velocity.depth = 3",
    "velocity.width = 48",
    "data.points = 10000",
    "training.steps = 800",
    "training.batch = 1000",
    "result.frames = 0",
];

/// A motion that is known at every time.
struct Motion {
    source: Mesh,
    target: Mesh,
    /// What this motion changes in the recipe.
    keys: &'static [&'static str],
    /// Where a point of the source is at a time.
    path: fn(Point, f64) -> Point,
    /// The distance from a point to the shape at a time.
    distance: fn(Point, f64) -> f64,
    /// The volume of the shape at a time.
    volume: fn(f64) -> f64,
}

/// How far from the exact answer a surface may be.
struct Limits {
    mean: f64,
    max: f64,
    /// Of the ratio of the volumes from 1.
    volume: f64,
    /// Of a carried vertex, at most.
    carried: f64,
    /// Mean over the surface of ||grad f| - 1|.
    slope: f64,
}

/// Trains on the two ends, extracts three times in between, and holds them against the exact shapes.
fn check(motion: &Motion, column: &[&str], limits: &Limits) {
    let _turn = turn();
    let keys = [column, KEYS, motion.keys].concat();
    let place = Workplace::with_pair(&motion.source, &motion.target, &keys);
    let run = place.train("run", &["--backend", "flex"]);
    let times = ["--times", "0.25,0.5,0.75", "--resolution", "96"];
    let backend = ["--carry", "--backend", "flex", "--quiet"];
    place
        .isomorph(&[&["extract", "run"][..], &times, &backend].concat())
        .succeeded();
    let frames = frames(&run.path("meshes"));
    assert_eq!(
        frames.iter().map(|frame| frame.time).collect::<Vec<_>>(),
        [0.25, 0.5, 0.75]
    );
    for frame in &frames {
        check_frame(motion, limits, frame);
    }
}

fn check_frame(motion: &Motion, limits: &Limits, frame: &Frame) {
    let time = frame.time;
    let surface = Ply::read(&frame.surface).mesh();
    assert!(surface.is_closed(), "time {time}: open");
    assert_eq!(surface.components(), 1, "time {time}: pieces");
    let distances = surface.vertices.iter().map(|x| (motion.distance)(*x, time));
    let (mean, max) = mean_and_max(distances);
    let volume = surface.volume() / (motion.volume)(time);
    let carried = Ply::read(frame.carried.as_ref().expect("--carry was given")).mesh();
    assert_eq!(
        carried.triangles, motion.source.triangles,
        "time {time}: the triangles are the source's"
    );
    let exact = motion
        .source
        .vertices
        .iter()
        .map(|x| (motion.path)(*x, time));
    let pairs = carried
        .vertices
        .iter()
        .zip(exact)
        .map(|(x, exact)| distance(*x, exact));
    let (_, carried) = mean_and_max(pairs);
    let slope = frame.slope_error;
    let found = format!(
        "time {time}: distance {mean:.4} on average and {max:.4} at most, volume {volume:.4} of the \
         exact one, carried vertices {carried:.4} off at most, |grad f| {slope:.4} from 1"
    );
    println!("{found}");
    assert!(mean <= limits.mean && max <= limits.max, "{found}");
    assert!((volume - 1.0).abs() <= limits.volume, "{found}");
    assert!(carried <= limits.carried, "{found}");
    assert!(slope <= limits.slope, "{found}");
}

fn mean_and_max(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let values: Vec<f64> = values.collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (mean, values.into_iter().fold(0.0, f64::max))
}

const AWAY: Point = [1.0, 0.5, 0.0];

fn moving_sphere() -> Motion {
    let path = |x: Point, time: f64| std::array::from_fn(|axis| x[axis] + time * AWAY[axis]);
    let sphere = Mesh::sphere(1.0, 4);
    Motion {
        target: sphere.clone().map(|x| path(x, 1.0)),
        source: sphere,
        keys: &[],
        path,
        distance: |x, time| (distance(x, AWAY.map(|part| part * time)) - 1.0).abs(),
        volume: |_| 4.0 / 3.0 * PI,
    }
}

#[test]
fn a_sphere_that_moves_keeps_its_shape_and_its_volume() {
    check(
        &moving_sphere(),
        SHIPPED,
        // Measured with seed 0 alone; the limits leave about twice that: 0.0022, 0.0094, 0.0027, 0.0155, 0.0062.
        &Limits {
            mean: 0.006,
            max: 0.03,
            volume: 0.01,
            carried: 0.035,
            slope: 0.02,
        },
    );
}

#[test]
fn a_sphere_that_moves_in_the_papers_geometry_keeps_its_shape_and_its_volume() {
    check(
        &moving_sphere(),
        NETWORK,
        // Measured: 0.0123, 0.0418, 0.0363, 0.0344, 0.0578.
        &Limits {
            mean: 0.02,
            max: 0.07,
            volume: 0.06,
            carried: 0.055,
            slope: 0.1,
        },
    );
}

/// A sphere of radius 1 that grows, and neither its volume nor its distances stay.
fn growing_sphere(
    path: fn(Point, f64) -> Point,
    distance: fn(Point, f64) -> f64,
    volume: fn(f64) -> f64,
) -> Motion {
    let sphere = Mesh::sphere(1.0, 4);
    Motion {
        target: sphere.clone().map(|x| path(x, 1.0)),
        source: sphere,
        keys: &["loss.divergence = 0", "loss.strain = 0"],
        path,
        distance,
        volume,
    }
}

/// A `V = x r'/r` that depends on time has `dV/dt + D V = x r''/r`, the price of `loss.screw`: it is zero where
/// the radius grows evenly, from 1 to 1.5.
fn even_radius(time: f64) -> f64 {
    1.0 + 0.5 * time
}

#[test]
fn a_sphere_that_grows_does_so_evenly() {
    let motion = growing_sphere(
        |x, time| x.map(|part| part * even_radius(time)),
        |x, time| (distance(x, [0.0; 3]) - even_radius(time)).abs(),
        |time| 4.0 / 3.0 * PI * even_radius(time).powi(3),
    );
    check(
        &motion,
        SHIPPED,
        // Measured with seed 0 alone; the limits leave about twice that: 0.0066, 0.0193, 0.0092, 0.0259, 0.0126.
        &Limits {
            mean: 0.015,
            max: 0.04,
            volume: 0.03,
            carried: 0.05,
            slope: 0.03,
        },
    );
}

/// A velocity that does not depend on time grows a sphere from 1 to 1.5 along `r(t) = 1.5^t` if it is
/// linear in x, which is the simplest of those that fit the ends.
fn radius(time: f64) -> f64 {
    1.5_f64.powf(time)
}

#[test]
fn a_sphere_that_grows_in_the_papers_geometry_does_so_at_a_constant_rate() {
    let motion = growing_sphere(
        |x, time| x.map(|part| part * radius(time)),
        |x, time| (distance(x, [0.0; 3]) - radius(time)).abs(),
        |time| 4.0 / 3.0 * PI * radius(time).powi(3),
    );
    check(
        &motion,
        NETWORK,
        // Measured: 0.0211, 0.0344, 0.0518, 0.0273, 0.0483.
        &Limits {
            mean: 0.035,
            max: 0.06,
            volume: 0.08,
            carried: 0.045,
            slope: 0.08,
        },
    );
}

const BAR: Point = [1.0, 0.25, 0.25];

/// A bar that turns by 60 degrees about the third axis.
fn turning_bar() -> Motion {
    let path = |x: Point, time: f64| turned(x, PI / 3.0 * time);
    let bar = Mesh::bar(BAR, 1.0 / 32.0);
    Motion {
        target: bar.clone().map(|x| path(x, 1.0)),
        source: bar,
        keys: &[],
        path,
        distance: |x, time| distance_to_bar(turned(x, -PI / 3.0 * time), BAR),
        volume: |_| BAR.iter().product(),
    }
}

#[test]
fn a_bar_that_turns_stays_a_bar() {
    check(
        &turning_bar(),
        SHIPPED,
        // Measured with seed 0 alone; the limits leave about twice that: 0.0014, 0.0079, 0.0061, 0.0086, 0.0675.
        &Limits {
            mean: 0.003,
            max: 0.02,
            volume: 0.025,
            carried: 0.02,
            slope: 0.15,
        },
    );
}

#[test]
fn a_bar_that_turns_in_the_papers_geometry_stays_a_bar() {
    check(
        &turning_bar(),
        NETWORK,
        // Measured: 0.0071, 0.0497, 0.0630, 0.0106, 0.2728.
        &Limits {
            mean: 0.012,
            max: 0.08,
            volume: 0.1,
            carried: 0.018,
            slope: 0.42,
        },
    );
}
