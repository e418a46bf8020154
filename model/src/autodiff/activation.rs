//! The activations of the networks, with the derivatives that the operators need.
//!
//! | | value `s(z)` | slope `s'(z)` | curvature `s''` | third `s'''` |
//! |---|---|---|---|---|
//! | softplus | `log(1 + exp(beta z)) / beta` | `1 / (1 + exp(-beta z))` | `beta s' (1 - s')` | `beta s'' (1 - 2 s')` |
//! | sine | `sin(omega z)` | `omega cos(omega z)` | `-omega^2 s` | `-omega^2 s'` |
//!
//! The paper uses softplus (Section 4) and leaves beta open; the sine is that of SIREN (Sitzmann et
//! al. 2020). Here they are written in ordinary tensor operations, for any backend; [`super::jet`] makes one
//! operation of all that a layer needs of them. burn's own `softplus` takes `exp(beta z)`, which overflows.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::lanes::block;

/// An activation, applied to each element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    /// Softplus of sharpness `beta` (larger is closer to a ReLU); stable for every finite input.
    Softplus {
        /// Sharpness, above 0.
        beta: f64,
    },
    /// Sine of frequency `omega`.
    Sine {
        /// Frequency, above 0.
        omega: f64,
    },
}

impl Activation {
    /// `s(z)`, for values only. For gradients there is [`Self::value_and_slope`]: burn's gradient of `log1p` takes a
    /// reciprocal, and that of burn-ndarray is good to 4e-5 only and depends on where in memory the numbers lie.
    pub fn value<B: Backend>(self, z: Tensor<B, 2>) -> Tensor<B, 2> {
        self.composed(z).0
    }

    /// Value and slope from ordinary tensor operations.
    pub(crate) fn composed<B: Backend>(self, z: Tensor<B, 2>) -> (Tensor<B, 2>, Tensor<B, 2>) {
        match self {
            Self::Softplus { beta } => softplus_and_slope(z, beta),
            Self::Sine { omega } => {
                let angle = z * omega;
                (angle.clone().sin(), angle.cos() * omega)
            }
        }
    }

    /// `s''` from what left the activation, whose first rows are `s`, and from `s'`.
    ///
    /// # Shapes
    /// `out`: `[blocks n, c]`; `slope` and the result: `[n, c]`.
    pub(crate) fn curvature<B: Backend>(
        self,
        out: &Tensor<B, 2>,
        slope: &Tensor<B, 2>,
    ) -> Tensor<B, 2> {
        match self {
            Self::Softplus { beta } => (slope.clone() - slope.clone() * slope.clone()) * beta,
            Self::Sine { omega } => block(out, 0, slope.dims()[0]) * (-omega * omega),
        }
    }

    /// `s'''` from `s'` and `s''`, all `[n, c]`.
    pub(crate) fn third<B: Backend>(
        self,
        slope: Tensor<B, 2>,
        curvature: Tensor<B, 2>,
    ) -> Tensor<B, 2> {
        match self {
            Self::Softplus { beta } => curvature * (slope * -2.0 + 1.0) * beta,
            Self::Sine { omega } => slope * (-omega * omega),
        }
    }
}

/// The softplus and its slope with `e = exp(-|beta z|)` in `(0, 1]`.
fn softplus_and_slope<B: Backend>(z: Tensor<B, 2>, beta: f64) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let e = (z.clone().abs() * -beta).exp();
    let value = z.clone().clamp_min(0.0) + e.clone().log1p() / beta;
    // slope = 1 / (1 + e) right of zero and e / (1 + e) left of it. Divided, not multiplied by `recip`:
    // burn-ndarray's vectorised reciprocal is an approximation, good to 4e-5 only.
    let numerator = e.clone().mask_fill(z.greater_equal_elem(0.0), 1.0);
    let slope = numerator / (e + 1.0);
    (value, slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, Train, column, host};

    const INPUTS: [f64; 7] = [-1.0e4, -3.0, -0.01, 0.0, 0.02, 2.5, 1.0e4];

    /// No bias.
    fn none<B: Backend>(columns: usize) -> Tensor<B, 2> {
        Tensor::zeros([1, columns], &Default::default())
    }

    /// Softplus in float64, written another way than the tensor code.
    fn softplus(z: f64, beta: f64) -> f64 {
        if beta * z > 30.0 {
            z
        } else {
            (beta * z).exp().ln_1p() / beta
        }
    }

    #[test]
    fn softplus_is_exact_between() {
        for beta in [1.0, 8.0, 100.0] {
            let inputs: Vec<f64> = (-200..200).map(|k| 0.1 * k as f64 / beta).collect();
            let z = column::<Plain>(&inputs);
            let (value, slope) = Activation::Softplus { beta }.value_and_slope(z.clone(), none(1));
            for ((z, value), slope) in host(z).into_iter().zip(host(value)).zip(host(slope)) {
                // f32 rounding of results up to 20 / beta, and of slopes up to 1.
                assert!(
                    (value - softplus(z, beta)).abs() <= 2e-6 / beta,
                    "{z}: {value}"
                );
                let wanted = 1.0 / (1.0 + (-beta * z).exp());
                assert!(
                    (slope - wanted).abs() <= 3e-7,
                    "slope at {z}: {slope}, {wanted}"
                );
            }
        }
    }

    #[test]
    fn softplus_is_exact_and_finite_far_out() {
        for beta in [1.0, 100.0] {
            let activation = Activation::Softplus { beta };
            let (value, slope) = activation.value_and_slope(column::<Plain>(&INPUTS), none(1));
            for ((z, value), slope) in INPUTS.iter().zip(host(value)).zip(host(slope)) {
                // f32 rounding of the result, relative for the large ones.
                let wanted = softplus(*z, beta);
                assert!(
                    (value - wanted).abs() <= 2e-7 * wanted.abs().max(1.0),
                    "{z}: {value}"
                );
                let wanted = if beta * z < -80.0 {
                    0.0
                } else {
                    1.0 / (1.0 + (-beta * z).exp())
                };
                assert!((slope - wanted).abs() <= 2e-7, "slope at {z}: {slope}");
            }
        }
    }

    #[test]
    fn derivatives_by_autodiff_are_the_written_ones() {
        for activation in [
            Activation::Softplus { beta: 10.0 },
            Activation::Sine { omega: 3.0 },
        ] {
            let z = column::<Train>(&[-0.3, -0.02, 0.0, 0.15, 0.4]).require_grad();
            let (value, slope) = activation.value_and_slope(z.clone(), none(1));
            let curvature = activation.curvature(&value, &slope);
            let by_value = z.grad(&value.sum().backward()).expect("value depends on z");
            // Both sides round the same f32 expressions: a few units in the last place.
            for (a, b) in host(by_value).iter().zip(host(slope.clone())) {
                assert!((a - b).abs() < 1e-5, "{activation:?}: slope {a} and {b}");
            }
            let z = z.detach().require_grad();
            let (_, again) = activation.value_and_slope(z.clone(), none(1));
            let by_slope = z.grad(&again.sum().backward()).expect("slope depends on z");
            for (a, b) in host(by_slope).iter().zip(host(curvature)) {
                assert!(
                    (a - b).abs() < 1e-4,
                    "{activation:?}: curvature {a} and {b}"
                );
            }
        }
    }
}
