//! The two ways of differentiating against each other, against float64 central differences, and against
//! closed forms.

use super::*;
use crate::autodiff::Activation;
use crate::nets::encoding::encoding_scale;
use crate::nets::{ImplicitNetConfig, Mlp, VelocityNet, VelocityNetConfig};
use crate::testing::{Plain, Train, column, host, points, shaken};

const POINTS: [[f64; 3]; 4] = [
    [0.1, -0.3, 0.25],
    [-0.42, 0.05, 0.31],
    [0.2, 0.4, -0.15],
    [-0.05, -0.1, -0.5],
];
const TIMES: [f64; 4] = [0.0, 0.3, 0.8, 1.0];
const SOFT: Activation = Activation::Softplus { beta: 8.0 };
const SINE: Activation = Activation::Sine { omega: 4.0 };
/// (activation, frequencies, skip).
const SHAPES: [(Activation, usize, usize); 5] = [
    (SOFT, 0, 0),
    (SOFT, 2, 0),
    (SOFT, 1, 2),
    (SINE, 0, 0),
    (SINE, 2, 2),
];

fn implicit(activation: Activation, frequencies: usize, skip: usize) -> ImplicitNet<Plain> {
    let (depth, width, sphere_radius) = (3, 12, 0.4);
    let config = ImplicitNetConfig {
        depth,
        width,
        activation,
        frequencies,
        skip,
        sphere_radius,
    };
    shaken(config.init(7, &Default::default()), 0.3)
}

fn velocity(
    activation: Activation,
    frequencies: usize,
    skip: usize,
    time_dependent: bool,
) -> VelocityNet<Plain> {
    let (depth, width) = (3, 12);
    let config = VelocityNetConfig {
        depth,
        width,
        activation,
        frequencies,
        skip,
        time_dependent,
    };
    shaken(config.init(11, &Default::default()), 0.3)
}

/// The perceptron in float64, written without tensors.
fn mlp_in_f64(mlp: &Mlp<Plain>, input: &[f64]) -> Vec<f64> {
    let activate = |z: f64| match mlp.activation() {
        Activation::Softplus { beta } => z.max(0.0) + (-(beta * z).abs()).exp().ln_1p() / beta,
        Activation::Sine { omega } => (omega * z).sin(),
    };
    let affine = |layer: &crate::nets::mlp::Dense<Plain>, x: &[f64]| {
        let (weight, bias) = (host(layer.weight.val()), host(layer.bias.val()));
        let columns = bias.len();
        let product = |j: usize| -> f64 {
            let terms = x.iter().enumerate();
            terms.map(|(i, x)| x * weight[i * columns + j]).sum()
        };
        (0..columns)
            .map(|j| bias[j] + product(j))
            .collect::<Vec<f64>>()
    };
    let mut hidden = input.to_vec();
    for (k, layer) in mlp.hidden().iter().enumerate() {
        if mlp.skips_at(k) {
            hidden.extend(input);
            hidden.iter_mut().for_each(|h| *h /= 2f64.sqrt());
        }
        hidden = affine(layer, &hidden).into_iter().map(activate).collect();
    }
    affine(mlp.output(), &hidden)
}

fn encode_in_f64(x: [f64; 3], frequencies: usize) -> Vec<f64> {
    let mut columns = x.to_vec();
    for octave in 0..frequencies {
        let k = 2f64.powi(octave as i32) * std::f64::consts::PI;
        columns.extend(x.map(|c| (k * c).sin() / k));
        columns.extend(x.map(|c| (k * c).cos() / k));
    }
    columns
        .into_iter()
        .map(|column| column * encoding_scale(frequencies))
        .collect()
}

fn f_in_f64(net: &ImplicitNet<Plain>, x: [f64; 3], t: f64) -> f64 {
    let mut input = encode_in_f64(x, net.frequencies);
    input.push(t);
    let sphere = match net.mlp.activation() {
        Activation::Softplus { .. } => 0.0,
        Activation::Sine { .. } => {
            (x.iter().map(|c| c * c).sum::<f64>() + 0.01).sqrt() - (0.4f64 * 0.4 + 0.01).sqrt()
        }
    };
    mlp_in_f64(&net.mlp, &input)[0] + sphere
}

fn v_in_f64(net: &VelocityNet<Plain>, x: [f64; 3], t: f64) -> Vec<f64> {
    let mut input = encode_in_f64(x, net.frequencies);
    if net.time_dependent {
        input.push(t - 0.5);
    }
    mlp_in_f64(&net.mlp, &input)
}

fn moved(x: [f64; 3], axis: usize, by: f64) -> [f64; 3] {
    let mut y = x;
    y[axis] += by;
    y
}

/// f32 sums of some hundred products, relative to the largest entry.
fn assert_close(got: &[f64], wanted: &[f64], tolerance: f64, label: &str) {
    assert_eq!(got.len(), wanted.len(), "{label}");
    let size = wanted.iter().fold(1.0f64, |most, w| most.max(w.abs()));
    for (k, (a, b)) in got.iter().zip(wanted).enumerate() {
        assert!(
            (a - b).abs() <= tolerance * size,
            "{label}, entry {k}: {a}, wanted {b}"
        );
    }
}

#[test]
fn the_jet_of_f_is_that_of_central_differences_both_ways() {
    for (activation, frequencies, skip) in SHAPES {
        let net = implicit(activation, frequencies, skip);
        let h = 1e-5;
        for derivatives in [Derivatives::Nested, Derivatives::Forward] {
            let label = format!("{derivatives:?} {activation:?} m {frequencies} skip {skip}");
            let jet = derivatives.implicit_jet(&net, points(&POINTS), column(&TIMES));
            let (mut value, mut gradient, mut rate) = (vec![], vec![], vec![]);
            for (x, t) in POINTS.into_iter().zip(TIMES) {
                value.push(f_in_f64(&net, x, t));
                let along =
                    |k| f_in_f64(&net, moved(x, k, h), t) - f_in_f64(&net, moved(x, k, -h), t);
                gradient.extend((0..3).map(|k| along(k) / (2.0 * h)));
                rate.push((f_in_f64(&net, x, t + h) - f_in_f64(&net, x, t - h)) / (2.0 * h));
            }
            assert_close(&host(jet.value), &value, 2e-5, &label);
            assert_close(&host(jet.gradient), &gradient, 2e-5, &label);
            assert_close(&host(jet.rate), &rate, 2e-5, &label);
        }
    }
}

#[test]
fn the_jet_of_v_is_that_of_central_differences_both_ways() {
    let full = VelocityRequest {
        laplacian: true,
        rate: true,
    };
    let requests = [
        VelocityRequest::default(),
        VelocityRequest {
            laplacian: false,
            ..full
        },
        full,
    ];
    for ((activation, frequencies, skip), timed) in SHAPES
        .into_iter()
        .flat_map(|shape| [(shape, false), (shape, true)])
    {
        let net = velocity(activation, frequencies, skip, timed);
        for derivatives in [Derivatives::Nested, Derivatives::Forward] {
            for request in requests {
                let label = format!(
                    "{derivatives:?} {activation:?} m {frequencies} skip {skip} {timed} {request:?}"
                );
                let jet = derivatives.velocity_jet(&net, points(&POINTS), column(&TIMES), request);
                check_velocity_jet(&net, jet, request, &label);
            }
        }
    }
}

fn check_velocity_jet(
    net: &VelocityNet<Plain>,
    jet: VelocityJet<Plain>,
    request: VelocityRequest,
    label: &str,
) {
    let (h, wide) = (1e-5, 1e-3);
    let (mut value, mut jacobian, mut laplacian, mut rate) = (vec![], vec![], vec![], vec![]);
    for (x, t) in POINTS.into_iter().zip(TIMES) {
        let middle = v_in_f64(net, x, t);
        let (mut j, mut l) = ([0.0; 9], [0.0; 3]);
        for k in 0..3 {
            let (up, down) = (
                v_in_f64(net, moved(x, k, h), t),
                v_in_f64(net, moved(x, k, -h), t),
            );
            let far = [
                v_in_f64(net, moved(x, k, wide), t),
                v_in_f64(net, moved(x, k, -wide), t),
            ];
            for i in 0..3 {
                j[3 * i + k] = (up[i] - down[i]) / (2.0 * h);
                l[i] += (far[0][i] - 2.0 * middle[i] + far[1][i]) / (wide * wide);
            }
        }
        let (later, earlier) = (v_in_f64(net, x, t + h), v_in_f64(net, x, t - h));
        rate.extend((0..3).map(|i| (later[i] - earlier[i]) / (2.0 * h)));
        value.extend(middle);
        jacobian.extend(j);
        laplacian.extend(l);
    }
    assert_close(&host(jet.value), &value, 2e-5, label);
    assert_close(&host(jet.jacobian), &jacobian, 2e-5, label);
    assert_eq!(jet.laplacian.is_some(), request.laplacian, "{label}");
    assert_eq!(jet.rate.is_some(), request.rate, "{label}");
    if let Some(got) = jet.laplacian {
        // Central differences of the second order: fourth derivatives times 1e-6.
        assert_close(&host(got), &laplacian, 2e-4, label);
    }
    if let Some(got) = jet.rate {
        assert_close(&host(got), &rate, 2e-5, label);
    }
}

#[test]
fn a_vector_jacobian_product_is_the_product_with_the_jacobian() {
    let w = [
        [0.3, -1.0, 0.5],
        [1.0, 0.0, 0.0],
        [0.0, 0.2, -0.4],
        [-0.7, 0.7, 0.1],
    ];
    for ((activation, frequencies, skip), timed) in SHAPES.into_iter().zip([true, false].repeat(3))
    {
        let net = velocity(activation, frequencies, skip, timed);
        let (x, t) = (points(&POINTS), column(&TIMES));
        let jet = Derivatives::Forward.velocity_jet(&net, x.clone(), t.clone(), Default::default());
        let jacobian = host(jet.jacobian);
        let mut wanted = vec![];
        for (n, w) in w.iter().enumerate() {
            let entry = |i: usize, k: usize| jacobian[9 * n + 3 * i + k];
            wanted.extend((0..3).map(|k| (0..3).map(|i| entry(i, k) * w[i]).sum::<f64>()));
        }
        for derivatives in [Derivatives::Nested, Derivatives::Forward] {
            let (value, pulled) = derivatives.pulled_back(&net, x.clone(), t.clone(), points(&w));
            let label = format!("{derivatives:?} {activation:?} {frequencies} {skip}");
            assert_close(&host(value), &host(jet.value.clone()), 1e-6, &label);
            assert_close(&host(pulled), &wanted, 1e-5, &label);
        }
    }
}

/// The jet of the linear field `V = A x`.
fn linear(a: [[f64; 3]; 3], x: &[[f64; 3]]) -> VelocityJet<Plain> {
    let apply = |x: &[f64; 3]| a.map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>());
    let value: Vec<[f64; 3]> = x.iter().map(apply).collect();
    let jacobian = points::<Plain>(&a.repeat(x.len())).reshape([x.len(), 3, 3]);
    VelocityJet {
        value: points(&value),
        jacobian,
        laplacian: None,
        rate: None,
    }
}

#[test]
fn divergence_and_strain_of_rotation_shear_and_expansion() {
    let rotation = linear(
        [[0.0, -2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        &POINTS,
    );
    assert_close(&host(rotation.divergence()), &[0.0; 4], 1e-7, "rotation");
    assert_close(&host(rotation.strain_rate()), &[0.0; 36], 1e-7, "rotation");
    let shear = linear([[0.0, 1.0, 0.0], [0.0; 3], [0.0; 3]], &POINTS);
    assert_close(&host(shear.divergence()), &[0.0; 4], 1e-7, "shear");
    let half = [0.0, 0.5, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0].repeat(4);
    assert_close(&host(shear.strain_rate()), &half, 1e-7, "shear");
    let along = host(shear.along(points(&[[0.0, 3.0, 0.0]; 4])));
    assert_close(&along, &[3.0, 0.0, 0.0].repeat(4), 1e-7, "shear along y");
    let expansion = linear([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], &POINTS);
    assert_close(&host(expansion.divergence()), &[3.0; 4], 1e-7, "expansion");
}

#[test]
fn derivatives_can_be_differentiated_by_the_positions_both_ways() {
    for laplacian in [false, true] {
        let rate = false;
        let request = VelocityRequest { laplacian, rate };
        let gradients = [Derivatives::Nested, Derivatives::Forward].map(|operators| {
            let net: VelocityNet<Train> = VelocityNetConfig {
                depth: 2,
                width: 12,
                activation: SOFT,
                frequencies: 1,
                skip: 0,
                time_dependent: false,
            }
            .init(11, &Default::default());
            let net = shaken(net, 0.3);
            let x = points::<Train>(&POINTS).require_grad();
            let jet = operators.velocity_jet(&net, x.clone(), column(&TIMES), request);
            let mut sum = (jet.jacobian.clone() * jet.jacobian).sum();
            if let Some(laplacian) = jet.laplacian {
                sum = sum + (laplacian.clone() * laplacian).sum() * 1e-2;
            }
            host(x.grad(&sum.backward()).expect("J depends on the positions"))
        });
        let size = gradients[1]
            .iter()
            .fold(0.0, |most: f64, g| most.max(g.abs()));
        // f32 rounding through three levels of differentiation.
        assert_close(
            &gradients[0],
            &gradients[1],
            2e-4 * size,
            "by the positions",
        );
        assert!(size > 1e-2, "a gradient to compare: {size}");
    }
}

#[test]
fn the_length_of_nothing_is_a_number_and_so_is_its_gradient() {
    let rows = points::<Train>(&[[0.0; 3], [2.0, -3.0, 6.0]]).require_grad();
    let lengths = length(rows.clone());
    // The root of 1e-12, and 7.
    let [nothing, seven] = host(lengths.clone().inner())[..] else {
        panic!("two rows");
    };
    assert!((0.0..1e-5).contains(&nothing), "{nothing}");
    assert!((seven - 7.0).abs() < 1e-5, "{seven}");
    let gradients = lengths.sum().backward();
    let of_rows = host(rows.grad(&gradients).expect("it takes part"));
    assert!(of_rows.iter().all(|part| part.is_finite()), "{of_rows:?}");
    assert!((of_rows[5] - 6.0 / 7.0).abs() < 1e-5, "{of_rows:?}");
}
