//! The activations of the networks, with the derivatives that the operators need.
//!
//! | | value `s(z)` | slope `s'(z)` | curvature `s''(z)` |
//! |---|---|---|---|
//! | softplus | `log(1 + exp(beta z)) / beta` | `1 / (1 + exp(-beta z))` | `beta s' (1 - s')` |
//! | sine | `sin(omega z)` | `omega cos(omega z)` | `-omega^2 sin(omega z)` |
//!
//! The paper uses softplus (Section 4) and leaves beta open; the sine is that of SIREN (Sitzmann et
//! al. 2020).

use burn::tensor::Tensor;

use crate::backend::ModelBackend;
use crate::softplus::{self, Lanes};

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
    /// `s(z)`.
    pub fn value<B: ModelBackend>(self, z: Tensor<B, 2>) -> Tensor<B, 2> {
        match self {
            Self::Softplus { beta } => softplus::value_and_slope(z, beta).0,
            Self::Sine { omega } => (z * omega).sin(),
        }
    }

    /// `s(z + bias)` and `s'(z + bias)`.
    ///
    /// # Shapes
    /// `z`: `[n, c]`; `bias`: `[1, c]`; results `[n, c]`.
    pub fn value_and_slope<B: ModelBackend>(
        self,
        z: Tensor<B, 2>,
        bias: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>) {
        match self {
            Self::Softplus { beta } => softplus_jet(z, bias, Lanes::VALUE, beta),
            Self::Sine { omega } => {
                let angle = (z + bias) * omega;
                (angle.clone().sin(), angle.cos() * omega)
            }
        }
    }

    /// The value, tangents and Laplacian that leave the activation where `z` enters it, all stacked as in
    /// [`softplus`].
    ///
    /// # Shapes
    /// `z` and the result: `[blocks n, c]`; `bias`: `[1, c]`.
    pub fn jet<B: ModelBackend>(
        self,
        z: Tensor<B, 2>,
        bias: Tensor<B, 2>,
        lanes: Lanes,
    ) -> Tensor<B, 2> {
        match self {
            Self::Softplus { beta } => softplus_jet(z, bias, lanes, beta).0,
            Self::Sine { omega } => {
                let n = z.dims()[0] / lanes.blocks();
                let (value, slope) = self.value_and_slope(softplus::block(&z, 0, n), bias);
                let curvature = value.clone() * (-omega * omega);
                softplus::pass(value, &slope, &curvature, &z, lanes)
            }
        }
    }
}

fn softplus_jet<B: ModelBackend>(
    z: Tensor<B, 2>,
    bias: Tensor<B, 2>,
    lanes: Lanes,
    beta: f64,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let (z, bias) = (softplus::primitive(z), softplus::primitive(bias));
    let (out, slope) = B::softplus_jet(z, bias, lanes, beta);
    (softplus::tensor(out), softplus::tensor(slope))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, Train, column, host};

    const INPUTS: [f64; 7] = [-1.0e4, -3.0, -0.01, 0.0, 0.02, 2.5, 1.0e4];

    /// No bias.
    fn none<B: ModelBackend>(columns: usize) -> Tensor<B, 2> {
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
            let curvature = match activation {
                Activation::Softplus { beta } => softplus::curvature(&slope, beta),
                Activation::Sine { omega } => value.clone() * (-omega * omega),
            };
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
