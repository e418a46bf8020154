//! The velocity of B-splines as a module, against the field of the package `isomorph-spline` in float64, on every
//! backend.
//!
//! A test of its own, not one of the library: it compiles in a fraction of the time.

use burn::module::{AutodiffModule, Module};
use burn::optim::GradientsParams;
use burn::record::{FullPrecisionSettings, NamedMpkBytesRecorder, Recorder};
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};
use burn_autodiff::Autodiff;
use isomorph_model::loss::{divergence, level_set, matching, screw, smoothness, strain};
use isomorph_model::operators::{Derivatives, ImplicitJet, VelocityField, VelocityRequest};
use isomorph_model::trajectory::{Integrator, Steps, integrate};
use isomorph_model::{ModelBackend, Motion, SplineVelocity, TrainBackend};
use isomorph_spline::{Grid, SplineField, TimeBasis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const WAY: Derivatives = Derivatives::Nested;
const ALL: VelocityRequest = VelocityRequest {
    laplacian: true,
    rate: true,
};

/// Runs a generic test on every backend.
macro_rules! on_each_backend {
    ($($name:ident),+ $(,)?) => {
        mod on_ndarray { $( #[test] fn $name() { super::$name::<burn_ndarray::NdArray>(); } )+ }
        #[cfg(feature = "flex")]
        mod on_flex { $( #[test] fn $name() { super::$name::<burn_flex::Flex>(); } )+ }
        #[cfg(feature = "wgpu")]
        mod on_wgpu { $( #[test] fn $name() { super::$name::<burn_wgpu::Wgpu>(); } )+ }
    };
}

on_each_backend!(
    values_and_derivatives_are_those_of_the_field,
    the_laplacian_is_that_of_differences,
    coefficients_and_grid_go_there_and_back_unchanged,
    the_gradient_by_points_is_that_of_the_field,
    the_gradient_by_coefficients_is_that_of_every_term,
    derivatives_by_lifting_are_the_same,
    trajectories_follow_the_field,
);

/// A field whose edge is no power of two, with coefficients drawn at random: as f32 and, the same, as f64.
fn fields(basis: TimeBasis, seed: u64) -> (SplineField, SplineField<f64>) {
    let grid = Grid {
        lower: [-0.5f32, -0.4, -0.3],
        spacing: 0.17,
        cells: [6, 5, 4],
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let count = grid.nodes().iter().product::<usize>() * basis.functions() * 3;
    let drawn: Vec<f32> = (0..count).map(|_| rng.random_range(-0.3..0.3)).collect();
    let wide = Grid {
        lower: grid.lower.map(f64::from),
        spacing: f64::from(grid.spacing),
        cells: grid.cells,
    };
    let drawn_wide: Vec<f64> = drawn.iter().map(|&c| f64::from(c)).collect();
    (
        SplineField::from_parts(grid, basis, &drawn).expect("valid"),
        SplineField::from_parts(wide, basis, &drawn_wide).expect("valid"),
    )
}

/// Points in the box and on all sides of it, with times; off the faces of cells by a tenth of one at least.
fn places(count: usize) -> (Vec<[f64; 3]>, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (low, cells) = ([-0.5, -0.4, -0.3], [6, 5, 4]);
    let mut points = Vec::new();
    for _ in 0..count {
        points.push([0, 1, 2].map(|i| {
            let cell = f64::from(rng.random_range(-2..cells[i] + 2));
            let x: f64 = low[i] + 0.17 * (cell + rng.random_range(0.1..0.9));
            f64::from(x as f32)
        }));
    }
    let times = (0..count).map(|_| f64::from(rng.random::<f32>()));
    (points, times.collect())
}

fn rows<B: Backend, const N: usize>(rows: &[[f64; N]]) -> Tensor<B, 2> {
    let flat = rows.as_flattened().to_vec();
    Tensor::from_data(TensorData::new(flat, [rows.len(), N]), &Default::default())
}

fn column<B: Backend>(values: &[f64]) -> Tensor<B, 2> {
    rows(&values.iter().map(|&x| [x]).collect::<Vec<_>>())
}

fn host<B: Backend, const D: usize>(tensor: Tensor<B, D>) -> Vec<f64> {
    tensor.into_data().iter::<f64>().collect()
}

#[track_caller]
fn assert_close(found: &[f64], wanted: &[f64], tolerance: f64, label: &str) {
    assert_eq!(found.len(), wanted.len(), "{label}");
    for (a, b) in found.iter().zip(wanted) {
        assert!((a - b).abs() <= tolerance, "{label}: {a}, wanted {b}");
    }
}

fn module<B: Backend>(field: &SplineField) -> SplineVelocity<B> {
    SplineVelocity::from_field(field, &Default::default())
}

fn values_and_derivatives_are_those_of_the_field<B: ModelBackend>() {
    for basis in [TimeBasis::Constant, TimeBasis::Linear] {
        let (field, wide) = fields(basis, 1);
        let net = module::<B>(&field);
        let (mut points, mut times) = places(200);
        // The corners of the box, a face of a cell, and far away.
        points.extend([[-0.5, -0.4, -0.3], [0.0, 0.1, 0.0], [9.0, -9.0, 0.1]]);
        times.extend([0.0, 0.5, 1.0]);
        let (x, t) = (rows(&points), column(&times));
        let jets = wide.jets(&points, &times);
        let values: Vec<f64> = jets.iter().flat_map(|jet| jet.value).collect();
        let jacobians: Vec<f64> = jets
            .iter()
            .flat_map(|jet| jet.jacobian.as_flattened().to_vec())
            .collect();
        let rates: Vec<f64> = jets.iter().flat_map(|jet| jet.rate).collect();
        let label = format!("{basis:?}");
        let alone = host(net.forward(x.clone(), t.clone()));
        // Sums of 27 products below 0.3, in f32; slopes are up to 6 times as large.
        assert_close(&alone, &values, 1e-6, &label);
        let jet = net.jet(WAY, x.clone(), t.clone(), ALL);
        assert_close(&host(jet.value), &values, 1e-6, &label);
        assert_close(&host(jet.jacobian), &jacobians, 1e-5, &label);
        assert_close(&host(jet.rate.expect("asked for")), &rates, 2e-6, &label);
        let w = [0.3, -0.8, 0.5];
        let pulled: Vec<f64> = jets
            .iter()
            .flat_map(|jet| [0, 1, 2].map(|k| (0..3).map(|i| jet.jacobian[i][k] * w[i]).sum()))
            .collect();
        let (value, found) = net.pulled_back(WAY, x, t, rows(&vec![w; points.len()]));
        assert_close(&host(value), &values, 1e-6, &label);
        assert_close(&host(found), &pulled, 2e-5, &label);
    }
}

fn the_laplacian_is_that_of_differences<B: ModelBackend>() {
    let (field, wide) = fields(TimeBasis::Linear, 2);
    let (points, times) = places(100);
    let e = 1e-3;
    let mut wanted = vec![0.0; 3 * points.len()];
    for k in 0..3 {
        let slopes = |by: f64| {
            let moved = points.iter().map(|&x| moved(x, k, by));
            wide.jets(&moved.collect::<Vec<_>>(), &times)
        };
        for (at, (ahead, behind)) in slopes(e).iter().zip(slopes(-e)).enumerate() {
            for i in 0..3 {
                let by_k = ahead.jacobian[i][k] - behind.jacobian[i][k];
                wanted[3 * at + i] += by_k / (2.0 * e);
            }
        }
    }
    let jet = module::<B>(&field).jet(WAY, rows(&points), column(&times), ALL);
    // Second derivatives are constant along an axis within a cell: differences are exact. Numbers are up to 100.
    let found = host(jet.laplacian.expect("asked for"));
    assert_close(&found, &wanted, 2e-3, "Laplacian");
    assert!(wanted.iter().any(|x| x.abs() > 10.0));
}

fn moved(mut x: [f64; 3], axis: usize, by: f64) -> [f64; 3] {
    x[axis] += by;
    x
}

fn coefficients_and_grid_go_there_and_back_unchanged<B: ModelBackend>() {
    for basis in [TimeBasis::Constant, TimeBasis::Linear] {
        let (field, _) = fields(basis, 3);
        let net = module::<B>(&field);
        assert_eq!(net.to_field().expect("valid"), field);
        assert_eq!(net.time_basis(), basis);
        // A record brings its grid, whatever the module was before.
        let recorder = NamedMpkBytesRecorder::<FullPrecisionSettings>::default();
        let bytes = Recorder::<B>::record(&recorder, net.into_record(), ()).expect("stored");
        let record = Recorder::<B>::load(&recorder, bytes, &Default::default()).expect("read");
        let box_of_one = [[0.0; 3], [0.1; 3]];
        let other = SplineField::at_rest(box_of_one, 0.1, 0, TimeBasis::Linear).expect("valid");
        let loaded = module::<B>(&other).load_record(record);
        assert_eq!(loaded.to_field().expect("valid"), field);
    }
}

fn the_gradient_by_points_is_that_of_the_field<B: ModelBackend>() {
    let (field, wide) = fields(TimeBasis::Linear, 4);
    let net = module::<Autodiff<B>>(&field);
    let (points, times) = places(60);
    // Through two steps of Runge-Kutta, from each time to the other end.
    let x = rows::<Autodiff<B>, 3>(&points).require_grad();
    let from = column::<Autodiff<B>>(&vec![0.0; points.len()]);
    let to = from.ones_like();
    let rhs = |x, t| net.forward(x, t);
    let end = integrate(rhs, x.clone(), from, to, Steps::Even(2), Integrator::Rk4);
    let w = [0.4, 0.7, -0.6];
    let grads = (end * rows(&vec![w; points.len()])).sum().backward();
    let found = host(x.grad(&grads).expect("it depends on every point"));
    let carried = wide.carry_with_gradient(&points, 0.0, 1.0, 2);
    let wanted: Vec<f64> = carried
        .iter()
        .flat_map(|end| [0, 1, 2].map(|k| (0..3).map(|i| end.gradient[i][k] * w[i]).sum()))
        .collect();
    // Rounding of some hundred operations on numbers near 1; a path that touches a face has one slope there.
    assert_close(&found, &wanted, 1e-4, "trajectory");
    // The slopes themselves change with the point: the strain's own gradient.
    let x = rows::<Autodiff<B>, 3>(&points).require_grad();
    let t = column(&times);
    let jet = net.jet(WAY, x.clone(), t, VelocityRequest::default());
    let grads = strain::strain_energy(&jet, 0.0).sum().backward();
    let found = host(x.grad(&grads).expect("it depends on every point"));
    let energy = |points: &[[f64; 3]]| -> Vec<f64> {
        let jets = wide.jets(points, &times);
        let of = |j: &[[f64; 3]; 3]| -> f64 {
            let d = |a: usize, b: usize| (j[a][b] + j[b][a]) / 2.0;
            (0..9).map(|k| d(k / 3, k % 3).powi(2)).sum()
        };
        jets.iter().map(|jet| of(&jet.jacobian)).collect()
    };
    let e = 1e-4;
    for k in 0..3 {
        let at = |by| energy(&points.iter().map(|&x| moved(x, k, by)).collect::<Vec<_>>());
        for (row, (ahead, behind)) in at(e).iter().zip(at(-e)).enumerate() {
            let wanted = (ahead - behind) / (2.0 * e);
            let off = (found[3 * row + k] - wanted).abs();
            // Numbers up to 300.
            assert!(off < 1e-3 + 1e-4 * wanted.abs(), "{off} of {wanted}");
        }
    }
}

/// What terms are taken at: places, times, and what belongs to them.
struct Scene<B: TrainBackend> {
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    f: ImplicitJet<B>,
}

impl<B: TrainBackend> Scene<B> {
    fn new() -> Self {
        let (points, times) = places(40);
        let x = rows(&points);
        Self {
            // A slope that is neither 1 nor constant.
            f: ImplicitJet {
                value: column(&times) - 0.4,
                gradient: x.clone() + 0.7,
                rate: column(&times) * 0.3,
            },
            t: column(&times),
            x,
        }
    }
}

type TermOf<B> = fn(&SplineVelocity<B>, &Scene<B>) -> Tensor<B, 1>;

/// Every term that V has a part in.
fn terms<B: TrainBackend>() -> Vec<(&'static str, TermOf<B>)> {
    fn jet<B: TrainBackend>(
        v: &SplineVelocity<B>,
        s: &Scene<B>,
    ) -> isomorph_model::operators::VelocityJet<B> {
        v.jet(WAY, s.x.clone(), s.t.clone(), ALL)
    }
    fn arrived<B: TrainBackend>(v: &SplineVelocity<B>, s: &Scene<B>) -> Tensor<B, 2> {
        let rhs = |x, t| v.forward(x, t);
        let (x, from, to) = (s.x.clone(), s.t.zeros_like(), s.t.clone());
        integrate(rhs, x, from, to, Steps::Even(2), Integrator::Rk4)
    }
    vec![
        ("matching", |v, s| {
            matching::matching(arrived(v, s), s.x.clone() * 0.9, 0.0)
        }),
        ("robust matching", |v, s| {
            matching::matching(arrived(v, s), s.x.clone() * 0.9, 0.3)
        }),
        ("on-surface", |v, s| {
            let end = arrived(v, s);
            ((end.clone() * end).sum_dim(1).sqrt() - 0.35).abs().mean()
        }),
        ("mlse", |v, s| level_set::level_set(&s.f, &jet(v, s), 1.0)),
        ("olse", |v, s| level_set::level_set(&s.f, &jet(v, s), 0.0)),
        ("smoothness", |v, s| {
            smoothness::smoothness(&jet(v, s), 0.01, 1.0)
        }),
        ("divergence", |v, s| divergence::divergence(&jet(v, s))),
        ("strain", |v, s| strain::strain(&jet(v, s), 0.0)),
        ("strain of a scale", |v, s| strain::strain(&jet(v, s), 0.3)),
        ("screw", |v, s| screw::screw(&jet(v, s))),
    ]
}

fn the_gradient_by_coefficients_is_that_of_every_term<B: ModelBackend>() {
    let (field, _) = fields(TimeBasis::Linear, 6);
    let net = module::<Autodiff<B>>(&field);
    let scene = Scene::new();
    for (name, term) in terms::<Autodiff<B>>() {
        let grads = GradientsParams::from_grads(term(&net, &scene).backward(), &net);
        let id = *burn::module::list_param_ids(&net).first().expect("one");
        let gradient = host(grads.get::<B, 2>(id).expect("V has a part in it"));
        let slope = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        assert!(slope > 1e-3, "{name}: {slope}");
        let at = |by: f64| {
            let values = field.coefficients().into_iter().zip(&gradient);
            let values = values.map(|(c, g)| (f64::from(c) + by * g / slope) as f32);
            let (grid, basis) = (*field.grid(), TimeBasis::Linear);
            let field = SplineField::from_parts(grid, basis, &values.collect::<Vec<_>>());
            host(term(&module(&field.expect("valid")), &scene))[0]
        };
        // No more than changes the term by 1 % of itself: absolute values have corners.
        let step = (0.01 * at(0.0) / slope).min(4e-3);
        let difference = (at(step) - at(-step)) / (2.0 * step);
        // Truncation, and f32 rounding of the value over the step.
        let allowed = 0.02 * slope + 2e-7 * at(0.0) / step;
        assert!(
            (difference - slope).abs() < allowed,
            "{name}: {difference}, gradient {slope}"
        );
    }
}

/// The Jacobian by one more level of autodiff is that of the sums, and so is its gradient by the coefficients.
fn derivatives_by_lifting_are_the_same<B: ModelBackend>() {
    let (field, _) = fields(TimeBasis::Linear, 7);
    let net = module::<Autodiff<B>>(&field);
    let (points, times) = places(30);
    let (x, t) = (
        rows::<Autodiff<B>, 3>(&points),
        column::<Autodiff<B>>(&times),
    );
    let w = rows::<Autodiff<B>, 3>(&vec![[0.5, -0.2, 0.9]; points.len()]);
    let lifted = net.clone().train::<Autodiff<Autodiff<B>>>().no_grad();
    let above = Tensor::<Autodiff<Autodiff<B>>, 2>::from_inner(x.clone()).require_grad();
    let value = lifted.forward(above.clone(), Tensor::from_inner(t.clone()));
    let mut grads = (value * Tensor::from_inner(w.clone())).sum().backward();
    let by_lifting = above.grad_remove(&mut grads).expect("V depends on x");
    let (_, by_sums) = net.pulled_back(WAY, x, t, w);
    // Sums of 27 products below 2, added up in another order.
    assert_close(
        &host(by_lifting.clone()),
        &host(by_sums.clone()),
        1e-5,
        "pulled back",
    );
    let by_coefficients = |pulled: Tensor<Autodiff<B>, 2>| {
        let grads = (pulled.clone() * pulled).sum().backward();
        let grads = GradientsParams::from_grads(grads, &net);
        let id = *burn::module::list_param_ids(&net).first().expect("one");
        host(grads.get::<B, 2>(id).expect("it depends on them"))
    };
    let (a, b) = (by_coefficients(by_lifting), by_coefficients(by_sums));
    assert!(a.iter().any(|g| g.abs() > 1.0));
    assert_close(&a, &b, 1e-4, "its gradient");
}

fn trajectories_follow_the_field<B: ModelBackend>() {
    let (field, wide) = fields(TimeBasis::Linear, 8);
    let (points, _) = places(50);
    let net = module::<Autodiff<B>>(&field).valid();
    let there = net.carry(rows::<B, 3>(&points), 1.0, 0.25);
    // As many steps as the motion of a module takes.
    let wanted = wide.carry(&points, 1.0, 0.25, 24).concat();
    assert_close(&host(there.clone()), &wanted, 1e-5, "carried");
    let velocity = net.velocity(there, 0.25).expect("it has one");
    let ends: Vec<[f64; 3]> = wanted.as_chunks::<3>().0.to_vec();
    assert_close(
        &host(velocity),
        &wide.values(&ends, 0.25).concat(),
        1e-4,
        "there",
    );
}

#[test]
fn what_is_damaged_is_refused_when_it_becomes_a_field() {
    use burn_ndarray::NdArray;
    let (field, _) = fields(TimeBasis::Linear, 9);
    let (other, _) = fields(TimeBasis::Constant, 9);
    // The record of another number of functions is whole; that of another grid is not.
    let record = module::<NdArray>(&other).into_record();
    let net = module::<NdArray>(&field).load_record(record);
    assert_eq!(net.to_field().expect("valid"), other);
    let mut record = module::<NdArray>(&field).into_record();
    record.grid.cells = [50, 5, 4];
    let damaged = module::<NdArray>(&field).load_record(record).to_field();
    let text = damaged.expect_err("too few").to_string();
    assert!(text.contains("coefficients"), "{text}");
}
