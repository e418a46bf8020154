//! The kernels against the composed operations, and both against differences and closed forms.

use super::super::composed::{composed_jet, composed_jet_backward, composed_slope_backward};
use super::*;
use crate::testing::{Plain, Train, assert_close, column, host, numbers};
use burn::tensor::Distribution;

const SHARP: f64 = 3.0;
const ACTIVATIONS: [Activation; 2] = [
    Activation::Softplus { beta: SHARP },
    Activation::Sine { omega: SHARP },
];
const ALL: [Lanes; 5] = [
    Lanes::VALUE,
    Lanes {
        tangents: 3,
        laplacian: false,
    },
    Lanes {
        tangents: 4,
        laplacian: false,
    },
    Lanes {
        tangents: 3,
        laplacian: true,
    },
    Lanes {
        tangents: 4,
        laplacian: true,
    },
];

fn jet<B: ModelBackend>(
    z: &Tensor<B, 2>,
    bias: &Tensor<B, 2>,
    lanes: Lanes,
    activation: Activation,
) -> Tensors<B> {
    let (z, bias) = (primitive(z.clone()), primitive(bias.clone()));
    let (out, slope) = B::activation_jet(z, bias, lanes, activation);
    (tensor(out), tensor(slope))
}

/// What leaves, and the slope.
type Tensors<B> = (Tensor<B, 2>, Tensor<B, 2>);

/// Every activation with every kind of lanes.
fn kinds() -> impl Iterator<Item = (Activation, Lanes)> {
    ACTIVATIONS
        .into_iter()
        .flat_map(|activation| ALL.map(|lanes| (activation, lanes)))
}

fn assert_composed<B: ModelBackend>(activation: Activation, lanes: Lanes, [n, c]: [usize; 2]) {
    let z = numbers::<B>(lanes.blocks() * n, c, 0.3);
    let bias = numbers(1, c, 0.8);
    let (out, slope) = jet(&z, &bias, lanes, activation);
    let (wanted, wanted_slope) = composed_jet(z.clone(), bias, lanes, activation);
    let label = format!(
        "{}: {activation:?}, {lanes:?}, {n} x {c}",
        B::name(&Default::default())
    );
    // Both in f32, results up to 5, terms up to 30, and slopes of the sine up to 3.
    assert_close(host(out.clone()), host(wanted), 1e-5, &label);
    assert_close(host(slope.clone()), host(wanted_slope), 2e-6, &label);
    let grad = numbers(lanes.blocks() * n, c, 2.1);
    let entered = (lanes != Lanes::VALUE).then(|| z.clone());
    let by_z = B::activation_jet_backward(
        entered.clone().map(primitive),
        primitive(out.clone()),
        primitive(slope.clone()),
        primitive(grad.clone()),
        lanes,
        activation,
    );
    let wanted = composed_jet_backward(entered, &out, slope.clone(), grad, lanes, activation);
    // Terms up to 100.
    assert_close(host(tensor::<B>(by_z)), host(wanted), 3e-5, &label);
    let grad = numbers(n, c, 1.1);
    let by_z = B::activation_slope_backward(
        primitive(out.clone()),
        primitive(slope.clone()),
        primitive(grad.clone()),
        activation,
    );
    let wanted = composed_slope_backward(&out, &slope, grad, activation);
    assert_close(host(tensor::<B>(by_z)), host(wanted), 1e-5, &label);
}

#[test]
fn the_kernels_are_the_composed_operations() {
    // Small, and larger than a piece of the kernel.
    for shape in [[3, 5], [700, 70]] {
        for (activation, lanes) in kinds() {
            assert_composed::<Plain>(activation, lanes, shape);
            #[cfg(feature = "flex")]
            assert_composed::<burn_flex::Flex>(activation, lanes, shape);
        }
    }
}

/// A scalar that depends on everything that leaves, unevenly.
fn mixed<B: ModelBackend>(
    z: &Tensor<B, 2>,
    bias: &Tensor<B, 2>,
    (activation, lanes): (Activation, Lanes),
    weights: &Tensor<B, 2>,
    of_slope: &Tensor<B, 2>,
) -> Tensor<B, 1> {
    let (out, slope) = jet(z, bias, lanes, activation);
    (out * weights.clone()).sum() + (slope * of_slope.clone()).sum()
}

#[test]
fn the_first_and_second_derivatives_are_those_of_the_composed_operations() {
    let (n, c) = (2, 3);
    for (activation, lanes) in kinds() {
        let rows = lanes.blocks() * n;
        let up = |x: Tensor<Plain, 2>| Tensor::<Train, 2>::from_inner(x).require_grad();
        let gradients = |composed: bool| {
            let (z, bias) = (up(numbers(rows, c, 0.3)), up(numbers(1, c, 0.8)));
            let lift = |x: &Tensor<Train, 2>| {
                Tensor::<Autodiff<Train>, 2>::from_inner(x.clone()).require_grad()
            };
            let (z2, bias2) = (lift(&z), lift(&bias));
            let constant = |x: Tensor<Plain, 2>| {
                Tensor::<Autodiff<Train>, 2>::from_inner(Tensor::from_inner(x))
            };
            let (weights, of_slope) = (numbers(rows, c, 2.2), numbers(n, c, 1.2));
            let (weights, of_slope) = (constant(weights), constant(of_slope));
            let value = if composed {
                let (out, slope) = composed_jet(z2.clone(), bias2.clone(), lanes, activation);
                (out * weights).sum() + (slope * of_slope).sum()
            } else {
                mixed(&z2, &bias2, (activation, lanes), &weights, &of_slope)
            };
            let mut first = value.backward();
            let by_z = z2.grad_remove(&mut first).expect("depends on z");
            let by_bias = bias2.grad_remove(&mut first).expect("depends on the bias");
            let weights = Tensor::<Train, 2>::from_inner(numbers(rows, c, 0.9));
            let total = (by_z.clone() * weights).sum() + (by_bias.clone() * by_bias.clone()).sum();
            let mut second = total.backward();
            [
                host(by_z.inner()),
                host(by_bias.inner()),
                host(z.grad_remove(&mut second).expect("twice on z")),
                host(bias.grad_remove(&mut second).expect("twice on the bias")),
            ]
        };
        let names = ["by z", "by the bias", "twice by z", "twice by the bias"];
        for ((a, b), name) in gradients(false).into_iter().zip(gradients(true)).zip(names) {
            // Both in f32: units in the last place of the largest terms.
            let largest = b.iter().fold(0.0, |most: f64, b| most.max(b.abs()));
            assert_close(
                a,
                b,
                2e-4_f64.max(1e-6 * largest),
                &format!("{activation:?} {lanes:?} {name}"),
            );
        }
    }
}

#[test]
fn the_derivatives_that_leave_are_those_along_a_curve() {
    // z(s) = z_0 + z_1 s + z_l s^2 / 2 has slope z_1 and curvature z_l at s = 0, so s(z(s)) has the
    // slope h_1 and the curvature h_l, if the other tangents are 0.
    let (z0, z1, zl) = (0.2f64, -0.7f64, 0.4f64);
    let lanes = Lanes {
        tangents: 3,
        laplacian: true,
    };
    let rows = [z0, z1, 0.0, 0.0, zl].map(|z| [z as f32]);
    let z = Tensor::<Plain, 2>::from_floats(rows, &Default::default());
    let functions: [fn(f64) -> f64; 2] =
        [|z| (SHARP * z).exp().ln_1p() / SHARP, |z| (SHARP * z).sin()];
    for (activation, function) in ACTIVATIONS.into_iter().zip(functions) {
        let out = host(jet(&z, &z.zeros_like().slice([0..1, 0..1]), lanes, activation).0);
        let at = |s: f64| function(z0 + z1 * s + zl * s * s / 2.0);
        let h = 1e-4;
        let (slope, bend) = (
            (at(h) - at(-h)) / (2.0 * h),
            (at(h) - 2.0 * at(0.0) + at(-h)) / (h * h),
        );
        let label = format!("{activation:?}");
        // Central differences in float64: h^2 and 1e-16 / h^2 are 1e-8; f32 rounding is the larger.
        assert_close(out, vec![at(0.0), slope, 0.0, 0.0, bend], 1e-6, &label);
    }
}

#[test]
fn the_written_gradients_are_differences_of_what_leaves() {
    // One row of everything, each number of which is moved by h.
    let lanes = ALL[4];
    let (rows, h) = (lanes.blocks(), 4e-3);
    let (z, bias) = (numbers::<Plain>(rows, 1, 0.3), numbers(1, 1, 0.8));
    let weights = numbers::<Plain>(rows, 1, 2.1);
    let by_out = host(weights.clone());
    for activation in ACTIVATIONS {
        let (out, slope) = jet(&z, &bias, lanes, activation);
        let (entered, grad) = (Some(primitive(z.clone())), primitive(weights.clone()));
        let (out, slope) = (primitive(out), primitive(slope));
        let by_z = Plain::activation_jet_backward(entered, out, slope, grad, lanes, activation);
        let at = |moved: usize, by: f64| -> f64 {
            let mut values = host(z.clone());
            values[moved] += by;
            let out = jet(&column(&values), &bias, lanes, activation).0;
            host(out)
                .iter()
                .zip(&by_out)
                .map(|(out, by)| out * by)
                .sum()
        };
        let wanted = (0..rows)
            .map(|k| (at(k, h) - at(k, -h)) / (2.0 * h))
            .collect();
        let label = format!("{activation:?}");
        // Truncation: h^2 / 6 times a third derivative, up to 3^2 times the gradient of 44; f32 rounding
        // over h is smaller.
        assert_close(host(tensor::<Plain>(by_z)), wanted, 3e-3, &label);
    }
}

#[test]
fn nothing_in_gives_nothing_out() {
    let none = Tensor::<Plain, 2>::random([0, 4], Distribution::Default, &Default::default());
    let bias = Tensor::zeros([1, 4], &Default::default());
    for activation in ACTIVATIONS {
        let (out, slope) = jet(&none, &bias, Lanes::VALUE, activation);
        assert_eq!((out.dims(), slope.dims()), ([0, 4], [0, 4]));
    }
}
