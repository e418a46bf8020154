//! One field through many key frames: its gradient, how smooth it is at them, and what it recovers.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{MOST_STEPS, SequenceField, SequenceProblem, SequenceSolver};
use crate::frozen::{Frozen, half_squares};
use crate::grid::Grid;
use crate::hop::Pass;
use crate::solver_tests::{ellipsoid, quick};
use crate::{Cloud, Options, Pairs, Problem, Solver, SplineError, Weights};

/// An ellipsoid moved by `motion` at each time, with 300 of its points known throughout.
fn moving(times: &[f64], motion: impl Fn([f32; 3], f64) -> [f32; 3]) -> SequenceProblem {
    let [_, shape] = ellipsoid(3000, 1).shapes;
    let normals = shape.normals.expect("normals");
    let at = |time: f64| -> Vec<[f32; 3]> {
        let points = shape.points.iter();
        points.map(|&x| motion(x, time)).collect()
    };
    // Motions are rigid.
    let turned = |n: [f32; 3], time: f64| {
        let (end, start) = (motion(n, time), motion([0.0; 3], time));
        [0, 1, 2].map(|i| end[i] - start[i])
    };
    let known = |time: f64| at(time)[..300].to_vec();
    SequenceProblem {
        shapes: times
            .iter()
            .map(|&time| Cloud {
                points: at(time),
                normals: Some(normals.iter().map(|&n| turned(n, time)).collect()),
                ..Cloud::default()
            })
            .collect(),
        pairs: times
            .windows(2)
            .map(|two| Pairs {
                source: known(two[0]),
                target: known(two[1]),
                ..Pairs::default()
            })
            .collect(),
        times: times.to_vec(),
    }
}

/// Constant angular velocity about z, and a rise.
fn screw([x, y, z]: [f32; 3], time: f64) -> [f32; 3] {
    let (sin, cos) = (0.3 * time as f32).sin_cos();
    [cos * x - sin * y, sin * x + cos * y, z + 0.05 * time as f32]
}

fn weights() -> Weights {
    Weights {
        strain: 1.0,
        divergence: 1.0,
        screw: 10.0,
        ..Weights::default()
    }
}

fn options() -> Options {
    Options {
        trajectory_steps: 1,
        ..quick()
    }
}

fn solve(problem: SequenceProblem, options: Options) -> Result<SequenceField, SplineError> {
    let mut solver = SequenceSolver::new(problem, weights(), options)?;
    for step in 0..solver.steps() {
        solver.advance(step)?;
    }
    Ok(solver.field().clone())
}

/// The largest distance of points carried from key frame `s` to the part `u` of the interval after it.
fn error(field: &SequenceField, s: usize, u: f32, from: &[[f32; 3]], to: &[[f32; 3]]) -> f64 {
    let carried = field.part(s).carry(from, 0.0, u, 4);
    let distance = |(a, b): (&[f32; 3], &[f32; 3])| {
        let square = |i: usize| f64::from(a[i] - b[i]).powi(2);
        (square(0) + square(1) + square(2)).sqrt()
    };
    carried.iter().zip(to).map(distance).fold(0.0, f64::max)
}

#[test]
fn velocity_and_its_rate_are_continuous_at_uneven_key_frames() {
    let grid = Grid {
        lower: [-1.0f64; 3],
        spacing: 0.5,
        cells: [4; 3],
    };
    let times = vec![2.0, 3.0, 7.0, 7.5];
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let count = 6 * 6 * 6 * 5 * 3;
    let drawn: Vec<f64> = (0..count).map(|_| rng.random_range(-1.0..1.0)).collect();
    let field = SequenceField::from_parts(grid, times, &drawn).expect("valid");
    assert_eq!(field.coefficients(), drawn);
    // In the mean interval, which is 5.5 / 3.
    let length = [3.0 / 5.5, 12.0 / 5.5, 1.5 / 5.5];
    let points: Vec<[f64; 3]> = (0..20)
        .map(|_| [0, 1, 2].map(|_| rng.random_range(-0.9..0.9)))
        .collect();
    for s in 0..2 {
        let end = field.part(s).jets(&points, &[1.0; 20]);
        let start = field.part(s + 1).jets(&points, &[0.0; 20]);
        for (end, start) in end.iter().zip(&start) {
            let (a, b) = (length[s], length[s + 1]);
            for i in 0..3 {
                let value = end.value[i] / a - start.value[i] / b;
                let rate = end.rate[i] / (a * a) - start.rate[i] / (b * b);
                // Roundings of numbers up to about 10.
                assert!(value.abs() < 1e-13 && rate.abs() < 1e-13, "{value} {rate}");
            }
        }
    }
    let refined = field.refined().expect("small");
    for s in 0..3 {
        let (coarse, fine) = (field.part(s), refined.part(s));
        let times = [0.3; 20];
        for (a, b) in (coarse.jets(&points, &times).iter()).zip(&fine.jets(&points, &times)) {
            assert!((0..3).all(|i| (a.value[i] - b.value[i]).abs() < 1e-13));
        }
    }
}

#[test]
fn the_gradient_is_that_of_the_objective() {
    let problem = moving(&[0.0, 0.5, 2.0], screw);
    let mut solver = SequenceSolver::<f64>::new(problem, weights(), options()).expect("valid");
    for step in 0..2 {
        solver.advance(step).expect("finite");
    }
    let field = solver.field().clone();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let drawn: Vec<f64> = (field.coefficients().iter())
        .map(|_| rng.random_range(-1.0..1.0))
        .collect();
    let times = field.times().to_vec();
    let direction = SequenceField::from_parts(*field.grid(), times, &drawn).expect("valid");
    let pass = |s: usize| Pass {
        step: 2,
        draw: s * MOST_STEPS + 2,
        level: 0,
        merge: false,
    };
    let frozen: Vec<Frozen<f64>> = (solver.hops.iter().enumerate())
        .map(|(s, hop)| Frozen::new(hop, &field.part(s), &solver.options, pass(s)))
        .collect();
    let (mut system, _) = solver.linearise(&field, 0, 2, false).expect("finite");
    let gradient = system.gradient(&field);
    let slope: f64 = (gradient.iter().zip(&direction.nodes))
        .flat_map(|(g, d)| g.0[0].into_iter().zip(d.0[0]))
        .map(|(g, d)| g * d)
        .sum();
    let objective = |by: f64| {
        let mut moved = field.clone();
        for (node, direction) in moved.nodes.iter_mut().zip(&direction.nodes) {
            node.add_plain(by, direction);
        }
        let of_hops = (frozen.iter().zip(&solver.hops).enumerate())
            .map(|(s, (frozen, hop))| frozen.objective(hop, &moved.part(s), &solver.options));
        of_hops.sum::<f64>() + system.ridge() * half_squares(&moved.nodes)
    };
    let e = 1e-5;
    let difference = (objective(e) - objective(-e)) / (2.0 * e);
    // Paths that touch faces of cells, and the third derivative times e^2.
    assert!(
        slope.abs() > 1e-2 && (slope - difference).abs() < 1e-5 * difference.abs(),
        "{slope} {difference}"
    );
}

#[test]
fn a_steady_screw_is_recovered_from_uneven_key_frames() {
    let times = [0.0, 0.4, 1.0, 2.0];
    let problem = moving(&times, screw);
    let start: Vec<Vec<[f32; 3]>> = (problem.shapes.iter())
        .map(|shape| shape.points[..300].to_vec())
        .collect();
    let options = Options {
        steps: vec![6, 4],
        tolerance: 1e-3,
        iterations: 300,
        ..options()
    };
    let field = solve(problem, options).expect("finite");
    let [_, shape] = ellipsoid(3000, 1).shapes;
    for s in 0..3 {
        let time = 0.5 * (times[s] + times[s + 1]);
        let between: Vec<[f32; 3]> = shape.points[..300]
            .iter()
            .map(|&x| screw(x, time))
            .collect();
        let found = error(&field, s, 0.5, &start[s], &between);
        // Shapes are .8 long and turn by .6: V is linear in space, and a spline is exactly that.
        assert!(found < 5e-4, "after key frame {s}: {found}");
    }
}

#[test]
fn an_accelerated_motion_is_found_that_pairs_cannot_see() {
    // Speed grows evenly; between two key frames alone the best guess is a constant one.
    let fall = |[x, y, z]: [f32; 3], t: f64| [x, y, z - 0.05 * (t * t) as f32];
    let times = [0.0, 1.0, 2.0, 3.0];
    let problem = moving(&times, fall);
    let shapes: Vec<Cloud> = problem.shapes.clone();
    let options = Options {
        steps: vec![6, 4],
        ..options()
    };
    let alone = Problem {
        shapes: [shapes[1].clone(), shapes[2].clone()],
        pairs: problem.pairs[1].clone(),
    };
    let field = solve(problem, options.clone()).expect("finite");
    let mut solver = Solver::<f32>::new(alone, weights(), options).expect("valid");
    for step in 0..solver.steps() {
        solver.advance(step).expect("finite");
    }
    let [_, shape] = ellipsoid(3000, 1).shapes;
    let between: Vec<[f32; 3]> = shape.points[..300].iter().map(|&x| fall(x, 1.5)).collect();
    let together = error(&field, 1, 0.5, &shapes[1].points[..300], &between);
    let carried = solver.field().carry(&shapes[1].points[..300], 0.0, 0.5, 4);
    let apart = (carried.iter().zip(&between))
        .map(|(a, b)| f64::from((a[2] - b[2]).abs()))
        .fold(0.0, f64::max);
    // The half-way error of a constant speed: .05 / 4.
    assert!(apart > 0.01, "pairs alone: {apart}");
    // The natural cubic spline through the key frames, the limit of no weights at all, misses by .0025.
    assert!(
        together < 0.3 * apart,
        "one field: {together}, pairs alone: {apart}"
    );
}

/// The largest error of carried points half-way through the second interval of a screw through four key frames.
fn half_way(change: impl Fn(&mut Pairs), options: Options) -> f64 {
    let times = [0.0, 1.0, 2.0, 3.0];
    let mut problem = moving(&times, screw);
    problem.pairs.iter_mut().for_each(change);
    let start = problem.shapes[1].points[..300].to_vec();
    let field = solve(problem, options).expect("finite");
    let [_, shape] = ellipsoid(3000, 1).shapes;
    let points = shape.points[..300].iter();
    let between: Vec<[f32; 3]> = points.map(|&x| screw(x, 1.5)).collect();
    error(&field, 1, 0.5, &start, &between)
}

#[test]
fn found_pairs_lead_and_the_surfaces_have_the_last_word() {
    // As matching leaves them: off by the spacing of the points, all to one side.
    let found = |pairs: &mut Pairs| {
        pairs.found = true;
        for target in &mut pairs.target {
            target[0] += 0.02;
        }
    };
    let options = |found_share| Options {
        steps: vec![6, 4],
        surface_samples_alone: 1000,
        found_share,
        ..options()
    };
    let (bound, free) = (half_way(found, options(1.0)), half_way(found, options(0.0)));
    assert!(bound > 0.008, "pairs count throughout: {bound}");
    assert!(free < 0.5 * bound, "{free} instead of {bound}");
    // A single level is led by them.
    let single = Options {
        steps: vec![10],
        ..options(0.0)
    };
    let led = half_way(found, single);
    assert!(led > 0.008, "one level: {led}");
    // Given pairs are kept, whatever the share.
    let given = |pairs: &mut Pairs| {
        found(pairs);
        pairs.found = false;
    };
    assert_eq!(half_way(given, options(0.0)), half_way(given, options(1.0)));
}

#[test]
fn surfaces_without_pairs_arrive_sooner_if_distances_count_by_squares_at_first() {
    let options = |robust_start| Options {
        steps: vec![4, 2],
        surface_samples_alone: 1000,
        robust_start,
        ..options()
    };
    let none = |pairs: &mut Pairs| *pairs = Pairs::default();
    let (plain, eased) = (half_way(none, options(1.0)), half_way(none, options(30.0)));
    assert!(eased < 0.5 * plain, "{eased} instead of {plain}");
    // With pairs nothing differs.
    let keep = |_: &mut Pairs| {};
    assert_eq!(half_way(keep, options(30.0)), half_way(keep, options(1.0)));
}

#[test]
fn a_solver_goes_on_from_a_stored_field_with_the_same_bits() {
    let problem = || moving(&[0.0, 1.0, 1.5], screw);
    let whole = solve(problem(), options()).expect("finite");
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads")
            .install(|| solve(problem(), options()).expect("finite"))
    };
    assert_eq!(on(1), whole);
    assert_eq!(on(3), whole);
    let mut first = SequenceSolver::<f32>::new(problem(), weights(), options()).expect("valid");
    for step in 0..4 {
        first.advance(step).expect("finite");
    }
    let field = first.field();
    let stored =
        SequenceField::from_parts(*field.grid(), field.times().to_vec(), &field.coefficients());
    let mut second = SequenceSolver::new(problem(), weights(), options()).expect("valid");
    let refused = second.resume_from(whole.refined().expect("small"), 4);
    assert!(matches!(refused, Err(SplineError::Field { step: 4, .. })));
    second.resume_from(stored.expect("valid"), 4).expect("fits");
    second.advance(4).expect("finite");
    assert_eq!(*second.field(), whole);
}

#[test]
fn what_is_no_sequence_is_refused() {
    let refused = |change: &dyn Fn(&mut SequenceProblem)| {
        let mut problem = moving(&[0.0, 1.0, 2.0], screw);
        change(&mut problem);
        let found = SequenceSolver::<f32>::new(problem, weights(), options());
        found.err().expect("refused").to_string()
    };
    let times = refused(&|problem| problem.times[1] = 2.0);
    assert!(times.contains("ascending"), "{times}");
    let infinite = refused(&|problem| problem.times[2] = f64::INFINITY);
    assert!(infinite.contains("finite"), "{infinite}");
    let few = refused(&|problem| problem.times.truncate(2));
    assert!(few.contains("3 to 10000"), "{few}");
    let pairs = refused(&|problem| problem.pairs.truncate(1));
    assert!(pairs.contains("pairs between neighbours"), "{pairs}");
    let empty = refused(&|problem| problem.shapes[1] = Cloud::default());
    assert!(empty.contains("no points"), "{empty}");
}
