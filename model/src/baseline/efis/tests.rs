//! The couplings against their own definitions: inverse, determinant, derivatives, gradients; and two spheres.

use burn::module::{ParamId, list_param_ids};
use burn::optim::GradientsParams;
use burn::tensor::Tensor;

use super::super::blend::tests::of_spheres;
use super::*;
use crate::flow::{Carried, EndFields, Geometry, Motion};
use crate::operators::Derivatives;
use crate::testing::learning::{check_gradients, radius, small_siren, spheres, trained};
use crate::testing::{Plain, Train, assert_close, column, host, numbers, points, shaken};

const X: [[f64; 3]; 3] = [[0.3, -0.2, 0.1], [-0.35, 0.15, 0.2], [0.05, 0.4, -0.3]];
const RADII: [f64; 2] = [0.3, 0.4];

fn config() -> CouplingFlowConfig {
    CouplingFlowConfig {
        rounds: 2,
        width: 8,
        omega: 3.0,
    }
}

/// A flow that moves points by some tenths.
fn flow() -> CouplingFlow<Plain> {
    shaken(config().init(3, &Default::default()), 0.05)
}

/// A Jacobian row by row on the host, `[n][i][k]`, and the rate `[n][i]` where there is one.
fn entries(jet: &CarriedJet<Plain>) -> Vec<[[f64; 3]; 3]> {
    let rows = jet.rows.clone().map(|row| {
        let n = row.dims()[0];
        host(row.slice([0..n, 0..3]))
    });
    let n = rows[0].len() / 3;
    let entry = |p: usize| [0, 1, 2].map(|i| [0, 1, 2].map(|k| rows[i][3 * p + k]));
    (0..n).map(entry).collect()
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

#[test]
fn a_fresh_flow_is_close_to_the_identity() {
    let fresh: CouplingFlow<Plain> = config().init(3, &Default::default());
    let moved = fresh.carry(points(&X), 0.0, 1.0) - points(&X);
    // Twelve shifts of about 1e-3 of a unit's weight of sqrt(6 / 8) / 3 each, half of which cancel.
    let most = host(moved.abs().max())[0];
    assert!(most > 0.0 && most < 5e-3, "{most}");
}

#[test]
fn the_inverse_is_exact_and_the_way_there_and_back_is_the_identity() {
    let flow = flow();
    let x = || numbers::<Plain>(64, 3, 0.3);
    let t = || (numbers::<Plain>(64, 1, 0.7) + 1.0) * 0.5;
    let there = flow.forward(x(), t());
    let moved = host((there.clone() - x()).abs().max())[0];
    assert!(moved > 0.05, "the test moves its points: {moved}");
    // 24 scalings and shifts of numbers of size 1, each with f32 rounding of 6e-8.
    assert_close(host(flow.inverse(there, t())), host(x()), 5e-6, "inverse");
    let back = flow.carry(flow.carry(x(), 0.2, 0.9), 0.9, 0.2);
    assert_close(host(back), host(x()), 1e-5, "there and back");
    // By way of a time between, as at once.
    let by_way = flow.carry(flow.carry(x(), 0.0, 0.4), 0.4, 1.0);
    assert_close(
        host(by_way),
        host(flow.carry(x(), 0.0, 1.0)),
        1e-5,
        "by way of 0.4",
    );
    let path = flow.path(x(), &[0.0, 0.4, 1.0]);
    assert_close(host(path[0].clone()), host(x()), 0.0, "path at 0");
    assert_close(
        host(path[2].clone()),
        host(flow.carry(x(), 0.0, 1.0)),
        1e-6,
        "path at 1",
    );
}

#[test]
fn the_derivatives_and_the_determinant_are_those_of_differences() {
    let flow = flow();
    let (from, to) = ([0.0, 0.35, 1.0], [1.0, 0.9, 0.2]);
    let carried =
        |x: &[[f64; 3]], to: &[f64]| host(flow.between(points(x), column(&from), column(to)));
    let z = flow.inverse_jet(CarriedJet::start(points(&X)), column(&from));
    let jet = flow.forward_jet_with_rate(z, column(&to));
    assert_close(host(jet.value.clone()), carried(&X, &to), 1e-6, "value");
    let (jacobians, rate) = (entries(&jet), host(jet.rate()));
    let step = 5e-3;
    // Differences: rounding of 1e-6 / 1e-2, and the third derivative times 4e-6.
    let tolerance = 2e-3;
    for k in 0..3 {
        let moved = |by: f64| {
            let x = X.map(|mut x| {
                x[k] += by;
                x
            });
            carried(&x, &to)
        };
        let (ahead, behind) = (moved(step), moved(-step));
        for (p, jacobian) in jacobians.iter().enumerate() {
            for (i, row) in jacobian.iter().enumerate() {
                let wanted = (ahead[3 * p + i] - behind[3 * p + i]) / (2.0 * step);
                assert!(
                    (row[k] - wanted).abs() < tolerance,
                    "{} and {wanted}",
                    row[k]
                );
            }
        }
    }
    let later = |by: f64| carried(&X, &to.map(|t| t + by));
    let (ahead, behind) = (later(step), later(-step));
    for (got, (ahead, behind)) in rate.iter().zip(ahead.iter().zip(&behind)) {
        let wanted = (ahead - behind) / (2.0 * step);
        assert!((got - wanted).abs() < tolerance, "rate {got} and {wanted}");
    }
    for (jacobian, log_det) in jacobians.iter().zip(host(jet.log_det)) {
        let wanted = determinant(jacobian).abs().ln();
        assert!(wanted.abs() > 1e-3, "the test changes volumes: {wanted}");
        // f32 rounding of 24 sums and of nine entries of size 1.
        assert!((log_det - wanted).abs() < 5e-6, "{log_det} and {wanted}");
    }
}

#[test]
fn the_velocity_is_how_the_path_goes_on() {
    let flow = flow();
    let step = 5e-3;
    let velocity = host(flow.velocity(points(&X), 0.4).expect("a flow has one"));
    let at = |time: f64| host(flow.carry(points(&X), 0.4, time));
    for (got, (ahead, behind)) in velocity
        .iter()
        .zip(at(0.4 + step).iter().zip(&at(0.4 - step)))
    {
        // As in the test of the derivatives.
        assert!((got - (ahead - behind) / (2.0 * step)).abs() < 2e-3);
    }
}

#[test]
fn a_turn_is_an_isometry_and_a_stretch_is_none() {
    let row = |values: [f64; 3]| points::<Plain>(&[values]);
    let jet = |rows: [[f64; 3]; 3]| CarriedJet {
        value: points(&[[0.0; 3]]),
        rows: rows.map(row),
        log_det: column(&[0.0]),
    };
    let turn = jet([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]);
    // f32 rounding of 1.
    assert!(host(isometry(&turn))[0] < 1e-12);
    // (4 - 1)^2, and a shear of 0.5: (1.25 - 1)^2 + 2 * 0.5^2.
    let stretch = jet([[2.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]]);
    assert_close(
        host(isometry(&stretch)),
        vec![9.5625],
        1e-5,
        "stretch and shear",
    );
}

#[test]
fn the_surface_at_the_ends_is_that_of_the_end_fields_and_its_gradient_that_of_its_values() {
    let ends = of_spheres(small_siren(5.0), RADII);
    let geometry = EfisGeometry::new(ends.clone(), flow());
    let at = |x: &[[f64; 3]], t: f64| host(geometry.value(points(x), column(&[t; 3])));
    for (t, net) in [(0.0, ends.source()), (1.0, ends.target())] {
        let wanted = host(net.forward(points(&X), column(&[0.0; 3])));
        // There and back through the flow: see the test of the inverse.
        assert_close(at(&X, t), wanted, 1e-5, "end");
    }
    let gradient = host(geometry.gradient(points(&X), column(&[0.35; 3])));
    let step = 5e-3;
    for axis in 0..3 {
        let moved = |by: f64| {
            let x = X.map(|mut x| {
                x[axis] += by;
                x
            });
            at(&x, 0.35)
        };
        for (row, (ahead, behind)) in moved(step).iter().zip(moved(-step)).enumerate() {
            let (got, wanted) = (gradient[3 * row + axis], (ahead - behind) / (2.0 * step));
            assert!((got - wanted).abs() < 2e-3, "{got}, wanted {wanted}");
        }
    }
    let from = geometry.value_from(Carried::ends(&geometry, points(&X), 0.35), 0.35);
    assert_close(host(from), at(&X, 0.35), 1e-6, "from both ends");
}

/// Samples of two spheres, the second moved, with points of the two that correspond.
fn samples(count: usize) -> EfisSamples<Train> {
    let both = spheres::<Train>(count, RADII);
    let half = |k: usize| {
        let part = |tensor: &Tensor<Train, 2>, columns: usize| {
            tensor
                .clone()
                .slice([k * count..(k + 1) * count, 0..columns])
        };
        crate::flow::EndSamples {
            surface: part(&both.surface, 3),
            surface_times: part(&both.surface_times, 1),
            normals: None,
            space: part(&both.space, 3),
            space_times: part(&both.space_times, 1),
            distances: None,
        }
    };
    let ends = [half(0), half(1)];
    let landmarks = [ends[0].surface.clone(), ends[1].surface.clone()];
    EfisSamples {
        times: (numbers(2 * count, 1, 0.2) + 1.0) * 0.5,
        landmarks: Some(landmarks),
        ends,
    }
}

#[test]
fn the_gradient_of_every_term_reaches_the_weights_of_the_flow() {
    let ends = of_spheres::<Train>(small_siren(5.0), RADII);
    let ends = burn::module::Module::no_grad(shaken(ends, 0.02));
    let samples = samples(24);
    let flow = shaken(config().init(3, &Default::default()), 0.05);
    for derivatives in [Derivatives::Forward, Derivatives::Nested] {
        let weights = EfisWeights::default();
        let terms =
            |flow: &CouplingFlow<Train>| objective(flow, &ends, &samples, &weights, &derivatives);
        let names: Vec<_> = terms(&flow).terms().iter().map(|term| term.name).collect();
        let all = [
            "data",
            "normals",
            "signs",
            "speed",
            "isometry",
            "volume",
            "landmarks",
        ];
        assert_eq!(names, all);
        check_gradients(&flow, terms);
    }
}

#[test]
fn the_gradient_of_a_step_is_the_same_to_the_last_bit_each_time() {
    let ends = of_spheres::<Train>(small_siren(5.0), RADII);
    let ends = burn::module::Module::no_grad(shaken(ends, 0.02));
    let samples = samples(44);
    let flow = shaken(config().init(3, &Default::default()), 0.05);
    let gradient = || {
        let weights = EfisWeights::default();
        let terms = objective(&flow, &ends, &samples, &weights, &Derivatives::Forward);
        let total = terms.total().expect("seven terms");
        let gradients = GradientsParams::from_grads(total.backward(), &flow);
        let of = |id: &ParamId| host(gradients.get::<Plain, 2>(*id).expect("all have one"));
        list_param_ids(&flow).iter().map(of).collect::<Vec<_>>()
    };
    let first = gradient();
    let mut between = Vec::new();
    for size in 1..20 {
        // Moves what is allocated next: burn-ndarray's reciprocal depends on where its numbers lie.
        between.push(vec![1u8; 37 * size]);
        assert!(gradient() == first, "after {size}");
    }
}

/// A flow after a short training with these samples.
fn trained_on(samples: &EfisSamples<Train>, ends: &EndFields<Train>) -> CouplingFlow<Plain> {
    let constant = burn::module::Module::no_grad(ends.clone());
    let flow = trained(config().init(3, &Default::default()), 120, 5e-3, |flow| {
        let weights = EfisWeights::default();
        objective(flow, &constant, samples, &weights, &Derivatives::Forward)
    });
    burn::module::AutodiffModule::valid(&flow)
}

/// The least and the greatest distance from the origin.
fn radii(x: Tensor<Plain, 2>) -> [f64; 2] {
    let radii = host((x.clone() * x).sum_dim(1).sqrt());
    [
        radii.iter().copied().fold(f64::INFINITY, f64::min),
        radii.iter().copied().fold(0.0, f64::max),
    ]
}

#[test]
fn without_landmarks_a_trained_flow_takes_each_sphere_onto_the_other_and_the_surface_goes_along() {
    let ends = of_spheres::<Train>(small_siren(5.0), RADII);
    let samples = EfisSamples {
        landmarks: None,
        ..samples(24)
    };
    let flow = trained_on(&samples, &ends);
    // Between the points of the training.
    let sphere = |end: usize| {
        spheres::<Plain>(40, RADII)
            .surface
            .slice([40 * end..40 * (end + 1), 0..3])
    };
    let there = radii(flow.carry(sphere(0), 0.0, 1.0));
    let back = radii(flow.carry(sphere(1), 1.0, 0.0));
    // The way is 0.1 long. The isometry term keeps a few hundredths of it from being gone, and 120 steps the same.
    for (found, wanted) in [(there, RADII[1]), (back, RADII[0])] {
        let off = found.map(|radius| (radius - wanted).abs());
        assert!(
            off.iter().all(|off| *off < 0.012),
            "{found:?}, wanted {wanted}"
        );
    }
    let half = radii(flow.carry(sphere(0), 0.0, 0.5));
    let geometry = EfisGeometry::new(burn::module::AutodiffModule::valid(&ends), flow);
    let middle = radius(&geometry, 0.5);
    assert!((middle - 0.35).abs() < 0.015, "{middle}");
    // What is carried stays on the surface, up to what the ends are missed by.
    let off = half.map(|radius| (radius - middle).abs());
    assert!(
        off.iter().all(|off| *off < 0.01),
        "{half:?}, surface {middle}"
    );
}

#[test]
fn landmarks_turn_the_sphere() {
    let ends = of_spheres::<Train>(small_siren(5.0), RADII);
    let (sine, cosine) = 0.3f64.sin_cos();
    let turned = |x: &Tensor<Train, 2>| {
        let turn = points([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]].as_slice());
        x.clone().matmul(turn)
    };
    let samples = samples(24);
    let samples = EfisSamples {
        landmarks: samples.landmarks.map(|[from, to]| [from, turned(&to)]),
        ..samples
    };
    let arrived = host(trained_on(&samples, &ends).carry(points(&[[0.18, 0.0, 0.24]]), 0.0, 1.0));
    let wanted = [0.24 * cosine, 0.24 * sine, 0.32];
    for (got, wanted) in arrived.iter().zip(wanted) {
        // A seventh of the turn's 0.07 along y.
        assert!((got - wanted).abs() < 0.01, "{arrived:?}, wanted {wanted}");
    }
}
