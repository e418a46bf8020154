//! The softplus and its slope over plain memory.
//!
//! With `e = exp(-|beta z|)` in `(0, 1]` and `s = e / (2 + e)` in `(0, 1/3]`:
//!
//! ```text
//! value = max(z, 0) + log1p(e) / beta,   log1p(e) = 2 (s + s^3/3 + s^5/5 + … + s^13/13)
//! slope = (1 if z >= 0 else e) / (1 + e)
//! ```
//!
//! One exponential and one logarithm per element serve all derivatives. Errors of value and slope stay below
//! 2 units in the last place of the larger of the result and `1 / beta`.

use pulp::{Arch, NullaryFnOnce};

use super::pointwise::{Pointwise, ROUND, vectorised};

/// The softplus of sharpness `beta`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Softplus {
    beta: f32,
}

impl Softplus {
    pub(super) fn new(beta: f64) -> Self {
        Self { beta: beta as f32 }
    }
}

impl Pointwise for Softplus {
    fn evaluate(self, arch: Arch, bias: &[f32], value: &mut [f32], slope: &mut [f32]) {
        fill(arch, bias, self.beta, value, slope);
    }

    #[inline(always)]
    fn curvature(self, _: f32, slope: f32) -> f32 {
        self.beta * slope * (1.0 - slope)
    }

    #[inline(always)]
    fn third(self, _: f32, slope: f32) -> f32 {
        self.beta * self.beta * slope * (1.0 - slope) * (1.0 - 2.0 * slope)
    }
}

vectorised! {
    /// Turns rows of inputs, which both hold, into values and slopes.
    fn fill(bias: &'a [f32], beta: f32, value: &'a mut [f32], slope: &'a mut [f32]) {
        let width = 1.0 / beta;
        let columns = bias.len();
        let rows = value.chunks_mut(columns).zip(slope.chunks_mut(columns));
        for (value, slope) in rows {
            for ((value, slope), b) in value.iter_mut().zip(slope).zip(bias) {
                let z = *value + b;
                let e = exp_of_negative(-(beta * z).abs());
                let s = e / (2.0 + e);
                // Not `max`, which would turn NaN into 0.
                let right = if z < 0.0 { 0.0 } else { z };
                *value = right + width * twice_atanh(s);
                *slope = (if z >= 0.0 { 1.0 } else { e }) / (1.0 + e);
            }
        }
    }
}

/// `exp(x)` for `x <= 0`: `2^n 2^r` with a whole `n` and `|r| <= 1/2`; 0 below -42, where it is 6e-19 and
/// its square, which [`twice_atanh`] takes, would soon be too small for a normal `f32`.
#[inline(always)]
fn exp_of_negative(x: f32) -> f32 {
    const LOG2_E: f32 = std::f32::consts::LOG2_E;
    /// ln 2 in two parts, the first with few digits, so that `n * HIGH` is exact.
    const HIGH: f32 = 0.693_359_4;
    const LOW: f32 = -2.121_944_4e-4;
    let clamped = if x < -42.0 { -42.0 } else { x };
    let shifted = clamped * LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = clamped - n * HIGH - n * LOW;
    // Taylor's polynomial of exp on |r| <= 0.35: the next term is below 1e-8.
    let mut p = 1.0 / 5040.0;
    for coefficient in [
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ] {
        p = p * r + coefficient;
    }
    let scale = f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3f80_0000));
    if x < -42.0 { 0.0 } else { p * scale }
}

/// `2 atanh(s)` for `0 <= s <= 1/3`: the odd series up to `s^13`, the next term below 1e-8 of the sum.
#[inline(always)]
fn twice_atanh(s: f32) -> f32 {
    let q = s * s;
    let mut p = 1.0 / 13.0;
    for coefficient in [1.0 / 11.0, 1.0 / 9.0, 1.0 / 7.0, 0.2, 1.0 / 3.0, 1.0] {
        p = p * q + coefficient;
    }
    2.0 * s * p
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values and slopes at inputs, in rows of `columns` without a bias.
    fn softplus(beta: f32, z: &[f32], columns: usize) -> (Vec<f32>, Vec<f32>) {
        let (mut value, mut slope) = (z.to_vec(), z.to_vec());
        let (function, bias) = (Softplus::new(f64::from(beta)), vec![0.0; columns]);
        function.evaluate(Arch::new(), &bias, &mut value, &mut slope);
        (value, slope)
    }

    #[test]
    fn value_and_slope_are_exact_to_the_last_places_over_the_whole_range() {
        for beta in [0.5f32, 8.0, 100.0] {
            let z: Vec<f32> = (-400_000..400_000)
                .map(|k| 3e-4 * k as f32 / beta)
                .collect();
            // In rows: one bias for each element of one would take the compiler's vectors away.
            let (value, slope) = softplus(beta, &z, 1000);
            let width = 1.0 / f64::from(beta);
            for ((z, value), slope) in z.iter().zip(value).zip(slope) {
                let z = f64::from(*z) * f64::from(beta);
                let wanted = width * (z.max(0.0) + (-z.abs()).exp().ln_1p());
                // Two units in the last place of f32, as documented.
                let bound = 2.4e-7 * wanted.max(width);
                assert!(
                    (f64::from(value) - wanted).abs() <= bound,
                    "value at {z}: {value}"
                );
                let wanted = 1.0 / (1.0 + (-z).exp());
                assert!(
                    (f64::from(slope) - wanted).abs() <= 2.4e-7,
                    "slope at {z}: {slope}"
                );
            }
        }
    }

    #[test]
    fn a_value_that_is_not_a_number_stays_one() {
        let inputs = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        let (value, slope) = softplus(10.0, &inputs, 3);
        assert!(
            value[0].is_nan() && slope[0].is_nan(),
            "{value:?} {slope:?}"
        );
        assert_eq!((value[1], slope[1]), (f32::INFINITY, 1.0));
        assert_eq!((value[2], slope[2]), (0.0, 0.0));
    }
}
