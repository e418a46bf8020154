//! The sine and its slope over plain memory.
//!
//! ```text
//! value = sin(omega z),   slope = omega cos(omega z)
//! omega z = k pi/2 + r   with a whole k and |r| <= pi/4
//! ```
//!
//! The sine and the cosine of `r` are polynomials, and `k` modulo 4 decides which of the two is which, with
//! which sign. `r` is found by Cody and Waite's reduction ("Software Manual for the Elementary Functions",
//! 1980): `pi/2` in three parts, the first two with so few digits that their products with `k`, and the
//! differences from these, are exact. An angle beyond [`FAR`] goes through the C library in float64.
//!
//! With `omega z` rounded to f32, errors of the value, and of the slope over `omega`, stay below 1.2e-7, one
//! unit in the last place of 1; angles up to 0.78 have sines exact to that fraction of themselves.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2};

use pulp::{Arch, NullaryFnOnce};

use super::pointwise::{Pointwise, ROUND, vectorised};

/// The angle from which on `k` has more digits than its products with the parts of `pi/2` leave room for.
const FAR: f32 = 4096.0 * FRAC_PI_2;

/// The sine of frequency `omega`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sine {
    omega: f32,
}

impl Sine {
    pub(super) fn new(omega: f64) -> Self {
        Self {
            omega: omega as f32,
        }
    }
}

impl Pointwise for Sine {
    fn evaluate(self, arch: Arch, bias: &[f32], value: &mut [f32], slope: &mut [f32]) {
        let mut far = false;
        angles(arch, bias, self.omega, slope, &mut far);
        if far {
            fill_far(self.omega, value, slope);
        } else {
            fill(arch, self.omega, value, slope);
        }
    }

    #[inline(always)]
    fn curvature(self, value: f32, _: f32) -> f32 {
        -(self.omega * self.omega) * value
    }

    #[inline(always)]
    fn third(self, _: f32, slope: f32) -> f32 {
        -(self.omega * self.omega) * slope
    }
}

vectorised! {
    /// Turns rows of inputs into angles, and says whether any is beyond [`FAR`].
    fn angles(bias: &'a [f32], omega: f32, rows: &'a mut [f32], far: &'a mut bool) {
        let mut beyond = false;
        for row in rows.chunks_mut(bias.len()) {
            for (z, b) in row.iter_mut().zip(bias) {
                *z = omega * (*z + b);
                beyond |= z.abs() > FAR;
            }
        }
        *far = beyond;
    }
}

vectorised! {
    /// Turns angles, which `slope` holds, into values and slopes.
    fn fill(omega: f32, value: &'a mut [f32], slope: &'a mut [f32]) {
        for (value, slope) in value.iter_mut().zip(slope) {
            let (sine, cosine) = sine_and_cosine(*slope);
            *value = sine;
            *slope = omega * cosine;
        }
    }
}

/// What [`fill`] does, where angles may be beyond [`FAR`]; the others come out the same to the last bit.
fn fill_far(omega: f32, value: &mut [f32], slope: &mut [f32]) {
    for (value, slope) in value.iter_mut().zip(slope) {
        let (sine, cosine) = if slope.abs() > FAR {
            let (sine, cosine) = f64::from(*slope).sin_cos();
            (sine as f32, cosine as f32)
        } else {
            sine_and_cosine(*slope)
        };
        *value = sine;
        *slope = omega * cosine;
    }
}

/// Sine and cosine of an angle that is not beyond [`FAR`].
#[inline(always)]
fn sine_and_cosine(angle: f32) -> (f32, f32) {
    /// pi/2 in three parts: the first is a multiple of 2^-11, the second of 2^-23.
    const HIGH: f32 = 1.570_800_8;
    const MIDDLE: f32 = -4.410_743_7e-6;
    const LOW: f32 = -4.371_139e-8;
    let shifted = angle * FRAC_2_PI + ROUND;
    let k = shifted - ROUND;
    let r = angle - k * HIGH - k * MIDDLE - k * LOW;
    let q = r * r;
    // By Remez's exchange in 40 digits, for |r| up to pi/4 and the rounding of k: once the coefficients are
    // rounded too, 9e-9 of the sine and 5e-10 of the cosine. Taylor's polynomials would need a term more.
    let s = -0.166_666_55 + q * (0.008_332_158 + q * -1.951_496_5e-4);
    let c = 0.041_666_646 + q * (-0.001_388_736_4 + q * 2.443_809_9e-5);
    let sine = r + r * q * s;
    let cosine = 1.0 - 0.5 * q + q * q * c;
    let quarter = shifted.to_bits();
    let (sine, cosine) = if quarter & 1 == 0 {
        (sine, cosine)
    } else {
        (cosine, sine)
    };
    // The second lowest bit moves to the sign: the sine is negative from half a turn on, the cosine a
    // quarter earlier.
    let flipped = |x: f32, quarter: u32| f32::from_bits(x.to_bits() ^ (quarter & 2) << 30);
    (
        flipped(sine, quarter),
        flipped(cosine, quarter.wrapping_add(1)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values and slopes at inputs, in rows without a bias.
    fn sine(omega: f32, z: &[f32]) -> (Vec<f32>, Vec<f32>) {
        let (mut value, mut slope) = (z.to_vec(), z.to_vec());
        let function = Sine::new(f64::from(omega));
        function.evaluate(Arch::new(), &[0.0; 1000], &mut value, &mut slope);
        (value, slope)
    }

    /// Fails unless all are the sine and the cosine of the angles, in units of the last place of 1.
    #[track_caller]
    fn assert_exact(omega: f32, z: &[f32]) {
        let (value, slope) = sine(omega, z);
        for ((z, value), slope) in z.iter().zip(value).zip(slope) {
            let angle = omega * z;
            let (sin, cos) = f64::from(angle).sin_cos();
            // As documented: 2^-23 is one unit in the last place of 1.
            let off = (f64::from(value) - sin).abs();
            assert!(off <= 1.2e-7, "sine of {angle}: {value}, off by {off}");
            let off = (f64::from(slope) / f64::from(omega) - cos).abs();
            assert!(
                off <= 1.2e-7,
                "cosine of {angle}: {slope} / {omega}, off by {off}"
            );
        }
    }

    #[test]
    fn value_and_slope_are_exact_to_the_last_places_in_the_range_of_networks() {
        for omega in [1.0f32, 4.0, 30.0] {
            let z: Vec<f32> = (-400_000..400_000)
                .map(|k| 2.5e-3 * k as f32 / omega)
                .collect();
            assert_exact(omega, &z);
        }
    }

    #[test]
    fn they_are_exact_at_every_angle_there_is() {
        // Every 3001st number, from the smallest to the largest, both signs.
        let z: Vec<f32> = (0..f32::INFINITY.to_bits())
            .step_by(3001)
            .flat_map(|bits| [f32::from_bits(bits), -f32::from_bits(bits)])
            .collect();
        assert_exact(1.0, &z);
    }

    #[test]
    fn they_are_exact_beside_every_zero_of_sine_and_cosine() {
        // Where the difference of the angle and `k pi/2` has the fewest digits left.
        let z: Vec<f32> = (0..=4097)
            .flat_map(|k| {
                let zero = (f64::from(k) * std::f64::consts::FRAC_PI_2) as f32;
                [zero.next_down(), zero, zero.next_up()]
            })
            .collect();
        let (value, slope) = sine(1.0, &z);
        for ((z, value), slope) in z.iter().zip(value).zip(slope) {
            let (sin, cos) = f64::from(*z).sin_cos();
            for (found, wanted) in [(f64::from(value), sin), (f64::from(slope), cos)] {
                // 1.2e-7 of the value, and 2e-11 for the digits of pi/2 beyond the three parts.
                let bound = 1.2e-7 * wanted.abs() + 2e-11;
                assert!((found - wanted).abs() <= bound, "{z}: {found}, {wanted}");
            }
        }
    }

    #[test]
    fn an_angle_that_is_none_gives_no_number() {
        let (value, slope) = sine(5.0, &[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX]);
        assert!(
            value.iter().chain(&slope).all(|x| x.is_nan()),
            "{value:?} {slope:?}"
        );
        let (value, slope) = sine(5.0, &[f32::NAN, 0.0]);
        assert!(
            value[0].is_nan() && slope[0].is_nan(),
            "{value:?} {slope:?}"
        );
        assert_eq!((value[1], slope[1]), (0.0, 5.0));
    }

    #[test]
    fn an_angle_far_out_leaves_its_neighbours_as_they_are() {
        let mut z: Vec<f32> = (-1500..1500).map(|k| 4.0 * k as f32).collect();
        let (alone, slope_alone) = sine(1.0, &z);
        z[1700] = 1e9;
        let (value, slope) = sine(1.0, &z);
        for k in (0..z.len()).filter(|k| *k != 1700) {
            assert_eq!((value[k], slope[k]), (alone[k], slope_alone[k]), "{}", z[k]);
        }
        assert_ne!(value[1700], alone[1700]);
    }
}
