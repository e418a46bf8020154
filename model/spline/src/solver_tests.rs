//! The solver: its gradient, what it recovers, and that its bits depend on nothing else.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};

use crate::cell::are_finite;
use crate::frozen::{Frozen, half_squares};
use crate::hop::Pass;
use crate::real::Real;
use crate::{
    Cloud, Options, Pairs, Problem, Solver, SplineError, SplineField, StepReport, TimeBasis,
    Weights,
};

/// A sphere of area 1 and an ellipsoid about as large; pairs by the affine map between them.
pub(crate) fn ellipsoid(count: usize, pairs: usize) -> Problem {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let radius = 0.282;
    let axes = [1.4, 0.9, 0.8];
    let sphere: Vec<[f64; 3]> = (0..count).map(|_| UnitSphere.sample(&mut rng)).collect();
    let narrow = |x: [f64; 3]| x.map(|x| x as f32);
    let stretched = |x: [f64; 3]| narrow([0, 1, 2].map(|i| radius * axes[i] * x[i]));
    let normal = |x: [f64; 3]| {
        let n = [0, 1, 2].map(|i| x[i] / axes[i]);
        let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
        narrow(n.map(|x| x / length))
    };
    let source: Vec<[f32; 3]> = sphere
        .iter()
        .map(|x| narrow(x.map(|x| radius * x)))
        .collect();
    let target: Vec<[f32; 3]> = sphere.iter().map(|&x| stretched(x)).collect();
    Problem {
        pairs: Pairs {
            source: source[..pairs].to_vec(),
            target: target[..pairs].to_vec(),
            ..Pairs::default()
        },
        shapes: [
            Cloud {
                points: source,
                normals: Some(sphere.iter().map(|&x| narrow(x)).collect()),
                ..Cloud::default()
            },
            Cloud {
                points: target,
                normals: Some(sphere.iter().map(|&x| normal(x)).collect()),
                ..Cloud::default()
            },
        ],
    }
}

/// Steps and samples of a quick run.
pub(crate) fn quick() -> Options {
    Options {
        steps: vec![3, 2],
        band: 3000,
        surface_samples: 100,
        surface_samples_alone: 300,
        ..Options::default()
    }
}

fn solve(problem: Problem, options: Options) -> Result<(SplineField, StepReport), SplineError> {
    let mut solver = Solver::new(problem, Weights::default(), options)?;
    let mut report = solver.advance(0)?;
    for step in 1..solver.steps() {
        report = solver.advance(step)?;
    }
    Ok((solver.field().clone(), report))
}

/// The mean distance of carried points from where they belong.
fn error(field: &SplineField, from: &[[f32; 3]], to: &[[f32; 3]]) -> f64 {
    let carried = field.carry(from, 0.0, 1.0, 4);
    let distance = |(a, b): (&[f32; 3], &[f32; 3])| {
        (0..3)
            .map(|i| f64::from(a[i] - b[i]).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    carried.iter().zip(to).map(distance).sum::<f64>() / to.len() as f64
}

#[test]
fn the_gradient_is_that_of_the_objective() {
    let (weights, options) = (Weights::default(), quick());
    let problem = ellipsoid(2000, 200);
    let mut solver = Solver::<f64>::new(problem, weights, options).expect("valid");
    for step in 0..2 {
        solver.advance(step).expect("finite");
    }
    let field = solver.field().clone();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut direction = field.clone();
    for value in direction.nodes.iter_mut().flat_map(|node| &mut node.0[0]) {
        *value = rng.random_range(-1.0..1.0);
    }
    // Idle lanes belong to no coefficient.
    let direction =
        SplineField::from_parts(*field.grid(), TimeBasis::Linear, &direction.coefficients());
    let direction = direction.expect("finite").nodes;
    let pass = Pass {
        step: 2,
        draw: 2,
        level: 0,
        merge: false,
    };
    let frozen = Frozen::new(solver.hop(), &field, solver.options(), pass);
    let (mut system, _) = solver.linearise(&field, 0, 2, false).expect("finite");
    let (ridge, gradient) = (system.ridge(), system.gradient(&field));
    let slope: f64 = (gradient.iter().zip(&direction))
        .flat_map(|(g, d)| g.0[0].into_iter().zip(d.0[0]))
        .map(|(g, d)| g * d)
        .sum();
    let objective = |by: f64| {
        let mut moved = field.clone();
        for (node, direction) in moved.nodes.iter_mut().zip(&direction) {
            node.add_plain(by, direction);
        }
        frozen.objective(solver.hop(), &moved, solver.options())
            + ridge * half_squares(&moved.nodes)
    };
    let e = 1e-5;
    let difference = (objective(e) - objective(-e)) / (2.0 * e);
    // Paths that touch faces of cells, and the third derivative times e^2.
    let allowed = 1e-5 * difference.abs();
    assert!(
        slope.abs() > 1e-2 && (slope - difference).abs() < allowed,
        "{slope} {difference}"
    );
}

#[test]
fn a_motion_along_a_screw_is_recovered() {
    // Half a radian about z, .1 along it. V is linear in space: a spline is exactly that.
    let mut problem = ellipsoid(3000, 500);
    let (sin, cos) = 0.5f32.sin_cos();
    let turned = |[x, y, z]: [f32; 3]| [cos * x - sin * y, sin * x + cos * y, z];
    let moved = |x: [f32; 3]| {
        let [x, y, z] = turned(x);
        [x, y, z + 0.1]
    };
    let ellipsoid = problem.shapes[1].clone();
    problem.pairs.source = ellipsoid.points[..500].to_vec();
    problem.pairs.target = problem.pairs.source.iter().map(|&x| moved(x)).collect();
    problem.shapes[1] = Cloud {
        points: ellipsoid.points.iter().map(|&x| moved(x)).collect(),
        normals: ellipsoid
            .normals
            .as_ref()
            .map(|n| n.iter().map(|&x| turned(x)).collect()),
        ..Cloud::default()
    };
    problem.shapes[0] = ellipsoid.clone();
    let options = Options {
        steps: vec![6, 4],
        tolerance: 1e-3,
        iterations: 300,
        ..quick()
    };
    let (field, report) = solve(problem.clone(), options).expect("finite");
    // RK4 with two steps of a quarter radian is off by 1e-5 times the radius.
    let end = error(&field, &ellipsoid.points, &problem.shapes[1].points);
    assert!(end < 1e-4, "{end:e}");
    // The middle is nowhere given: half the angle, half the way.
    let (sin, cos) = 0.25f32.sin_cos();
    let half = |[x, y, z]: [f32; 3]| [cos * x - sin * y, sin * x + cos * y, z + 0.05];
    let wanted: Vec<[f32; 3]> = ellipsoid.points.iter().map(|&x| half(x)).collect();
    let carried = field.carry(&ellipsoid.points, 0.0, 0.5, 4);
    let middle: f64 = (carried.iter().zip(&wanted))
        .map(|(a, b)| (0..3).map(|i| f64::from(a[i] - b[i]).abs()).sum::<f64>())
        .sum();
    assert!(middle / (wanted.len() as f64) < 5e-4);
    // The ridge pulls at nodes where the band ends, which strains by .05; the turn's rate is .5.
    assert!(
        report.terms.strain < 4e-3 && report.terms.screw < 1e-4,
        "{report:?}"
    );
}

#[test]
fn a_resumed_run_is_the_uninterrupted_one() {
    let new =
        || Solver::<f32>::new(ellipsoid(1500, 100), Weights::default(), quick()).expect("valid");
    let mut whole = new();
    for step in 0..whole.steps() {
        whole.advance(step).expect("finite");
    }
    // Also between the levels, after step 2.
    for stop in 1..whole.steps() {
        let mut first = new();
        for step in 0..stop {
            first.advance(step).expect("finite");
        }
        let field = first.field();
        let stored = field.coefficients();
        let field = SplineField::from_parts(*field.grid(), field.time_basis(), &stored);
        let mut second = new();
        second
            .resume_from(field.expect("stored"), stop)
            .expect("same grid");
        for step in stop..second.steps() {
            second.advance(step).expect("finite");
        }
        assert_eq!(second.field(), whole.field());
    }
    let wrong = new().resume_from(whole.field().clone(), 1);
    assert!(matches!(wrong, Err(SplineError::Field { step: 1, .. })));
    let beyond = whole.advance(5);
    assert!(matches!(
        beyond,
        Err(SplineError::Step { step: 5, steps: 5 })
    ));
}

#[test]
fn the_bits_are_the_same_on_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let run = || solve(ellipsoid(3000, 200), quick()).expect("finite");
        pool.expect("threads").install(run)
    };
    let (one, two, five) = (on(1), on(2), on(5));
    assert_eq!(one, two);
    assert_eq!(one, five);
}

#[test]
fn a_fifth_of_wrong_pairs_costs_little() {
    let right = ellipsoid(3000, 500);
    let [source, target] = right.shapes.each_ref().map(|cloud| cloud.points.clone());
    let mut wrong = right.clone();
    for at in (0..500).step_by(5) {
        wrong.pairs.target[at] = target[2999 - 3 * at];
    }
    let options = || Options {
        steps: vec![6, 4],
        ..quick()
    };
    let of = |problem| {
        error(
            &solve(problem, options()).expect("finite").0,
            &source,
            &target,
        )
    };
    let (good, bad) = (of(right), of(wrong.clone()));
    // The way is about .05 on the mean; wrong targets are .4 off.
    assert!(good < 2e-3 && bad < 4e-3, "{good} {bad}");
    // Without confidence in the wrong ones, they cost nothing.
    wrong.pairs.confidence = (0..500)
        .map(|at| f32::from(u8::from(at % 5 != 0)))
        .collect();
    let told = of(wrong);
    assert!(told < 1.5 * good && told < bad, "{good} {bad} {told}");
}

#[test]
fn shapes_without_pairs_meet() {
    for normals in [true, false] {
        let mut problem = ellipsoid(3000, 0);
        for cloud in &mut problem.shapes {
            cloud.normals = cloud.normals.take().filter(|_| normals);
        }
        let (_, report) = solve(problem, quick()).expect("finite");
        // From .03 before; without normals the samples' own distance, about .01, is the least there can be.
        let most = if normals { 2e-3 } else { 1.2e-2 };
        assert!(report.terms.on_surface < most, "{report:?}");
        assert_eq!(report.terms.matching, 0.0);
    }
}

#[test]
fn odd_shapes_give_finite_fields() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut square = |z: f32| (0..500).map(|_| [rng.random(), rng.random(), z]).collect();
    let cloud = |points: Vec<[f32; 3]>, up: bool| Cloud {
        normals: up.then(|| vec![[0.0, 0.0, 1.0]; points.len()]),
        points,
        ..Cloud::default()
    };
    let flat = [cloud(square(0.0), true), cloud(square(0.0), false)];
    let tiny = ellipsoid(64, 0).shapes;
    let spot = [0.3, 0.0, 0.0];
    let coincident = [
        cloud(vec![spot; 200], false),
        cloud(vec![[0.0; 3]; 90], true),
    ];
    let one = [cloud(vec![spot], true), cloud(vec![spot], true)];
    let no_normal = [cloud(square(0.1), true), {
        let points = square(0.0);
        Cloud {
            normals: Some(vec![[0.0; 3]; points.len()]),
            points,
            ..Cloud::default()
        }
    }];
    for shapes in [flat, tiny, coincident, one, no_normal] {
        for pairs in [0, 1] {
            let shapes = shapes.clone();
            let pairs = Pairs {
                source: shapes[0].points[..pairs].to_vec(),
                target: shapes[1].points[..pairs].to_vec(),
                confidence: vec![0.0; pairs],
                found: false,
            };
            let (field, report) = solve(Problem { shapes, pairs }, quick()).expect("finite");
            assert!(are_finite(&field.nodes) && report.size.is_finite());
        }
    }
    for time in [TimeBasis::Constant, TimeBasis::Linear] {
        let options = Options { time, ..quick() };
        let (field, _) = solve(ellipsoid(500, 50), options).expect("finite");
        let rates = field.jets(&[[0.1, 0.2, 0.0]], &[0.5])[0].rate;
        assert_eq!(rates == [0.0; 3], time == TimeBasis::Constant);
    }
}

#[test]
fn what_is_wrong_with_the_input_is_said() {
    let message = |problem: Problem, weights: Weights, options: Options| {
        let made = Solver::<f32>::new(problem, weights, options);
        made.err().expect("wrong input").to_string()
    };
    let said = |change: &dyn Fn(&mut Problem, &mut Weights, &mut Options)| {
        let (mut problem, mut weights) = (ellipsoid(64, 4), Weights::default());
        let mut options = quick();
        change(&mut problem, &mut weights, &mut options);
        message(problem, weights, options)
    };
    type Change<'a> = &'a dyn Fn(&mut Problem, &mut Weights, &mut Options);
    let wrong: [(Change, &str); 10] = [
        (
            &|p, _, _| p.shapes[1].points.clear(),
            "the target has no points",
        ),
        (&|p, _, _| p.shapes[0].points[3][1] = f32::NAN, "point 3 is"),
        (
            &|p, _, _| p.pairs.target.truncate(3),
            "pairs' targets: 3 entries for 4",
        ),
        (
            &|p, _, _| p.pairs.confidence = vec![1.0, -1.0, 1.0, 1.0],
            "confidence 1 is -1",
        ),
        (&|_, w, _| w.screw = f64::INFINITY, "screw = inf"),
        (&|_, w, _| w.strain = 0.0, "strain = 0"),
        (&|_, _, o| o.steps.clear(), "levels = 0"),
        (&|_, _, o| o.spacing = -1.0, "spacing = -1"),
        (&|_, _, o| o.spacing = 1e-4, "nodes, at most"),
        (&|_, _, o| o.tolerance = 1.0, "tolerance = 1"),
    ];
    for (change, words) in wrong {
        let found = said(change);
        assert!(found.contains(words), "{found}");
    }
}

#[test]
fn a_result_that_is_no_number_is_an_error_and_leaves_the_field() {
    let weights = Weights {
        matching: 1e300,
        ..Weights::default()
    };
    let mut solver = Solver::<f32>::new(ellipsoid(300, 20), weights, quick()).expect("valid");
    let before = solver.field().clone();
    // The weight is beyond f32.
    let result = solver.advance(0);
    assert!(
        matches!(result, Err(SplineError::NotFinite { step: 0, .. })),
        "{result:?}"
    );
    assert_eq!(*solver.field(), before);
}

#[test]
fn single_precision_is_enough() {
    fn run<R: Real>() -> (f64, f64) {
        let made = Solver::<R>::new(ellipsoid(3000, 300), Weights::default(), quick());
        let mut solver = made.expect("valid");
        let mut last = (0.0, 0.0);
        for step in 0..solver.steps() {
            let report = solver.advance(step).expect("finite");
            last = (report.terms.weighted(solver.weights()), report.size);
        }
        last
    }
    let ((narrow, _), (wide, _)) = (run::<f32>(), run::<f64>());
    // Conjugate gradients end at .03 of the residual, perhaps an iteration apart.
    assert!((narrow - wide).abs() < 2e-2 * wide, "{narrow} {wide}");
}

#[test]
fn what_arrives_at_a_border_is_left_free() {
    // The second shape is the first, but for all that is right of a cut: without a border that is drawn to the cut.
    let whole = ellipsoid(3000, 0);
    let source = whole.shapes[0].clone();
    let left = |x: &[f32; 3]| x[0] < 0.05;
    let kept: Vec<usize> = (0..source.points.len())
        .filter(|k| left(&source.points[*k]))
        .collect();
    let normals = source.normals.as_ref().expect("normals");
    let mut cut = Cloud {
        points: kept.iter().map(|k| source.points[*k]).collect(),
        normals: Some(kept.iter().map(|k| normals[*k]).collect()),
        border: kept.iter().map(|k| source.points[*k][0] > 0.02).collect(),
    };
    let drawn = |cut: Cloud| {
        let shapes = [source.clone(), cut];
        let problem = Problem {
            shapes,
            ..Problem::default()
        };
        let (field, _) = solve(problem, quick()).expect("finite");
        let right: Vec<[f32; 3]> = source
            .points
            .iter()
            .filter(|x| x[0] > 0.15)
            .copied()
            .collect();
        let moved = field.carry(&right, 0.0, 1.0, 4);
        let ways = moved
            .iter()
            .zip(&right)
            .map(|(a, b)| f64::from((a[0] - b[0]).abs()));
        ways.sum::<f64>() / right.len() as f64
    };
    let free = drawn(cut.clone());
    cut.border.clear();
    let held = drawn(cut);
    assert!(free < 0.01 && held > 4.0 * free, "{free} {held}");
}
