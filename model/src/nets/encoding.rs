//! Positional encoding that is 1-Lipschitz and invertible (the paper's Eq. in "Invertible Lipschitz
//! Positional Encoding", after Yang et al. 2021).
//!
//! Per coordinate `[x, sin(2^j pi x) / (2^j pi), cos(2^j pi x) / (2^j pi)]` for `j = 0 .. m - 1`, all
//! divided by `sqrt(2 m + 1)`. The columns come in blocks of three, one per function:
//! `[x | sin_0 | cos_0 | sin_1 | cos_1 | …]`, so that the derivative of a block acts on its three
//! columns alone.
//!
//! Its stretch is the same everywhere. With `k` frequencies the squared derivative of a coordinate's columns
//! is `(1 + sum_j (cos^2 + sin^2)) / (2 m + 1) = (1 + k) / (2 m + 1)`, which is at most 1 here, where `k = m`.
//!
//! # Differs from the paper
//! The paper prints `j = 0 .. m` with the divisor `sqrt(2 m + 1)`. These are `m + 1` frequencies, and as
//! `(m + 2) / (2 m + 1)` is at most 1 for `m >= 1`, they are 1-Lipschitz too. Here there are `m` of them, as in
//! the work that the paper cites: the divisor is then the number of columns per coordinate, and `m = 0`
//! leaves the points as they are.

use std::f64::consts::PI;

use burn::tensor::Tensor;

use crate::autodiff::{Activation, ModelBackend};

/// Columns of the encoding of a point with `frequencies` octaves: `3 (2 m + 1)`.
pub const fn encoded_width(frequencies: usize) -> usize {
    3 * (2 * frequencies + 1)
}

/// What all columns are multiplied by, `1 / sqrt(2 m + 1)`.
pub fn encoding_scale(frequencies: usize) -> f64 {
    1.0 / ((2 * frequencies + 1) as f64).sqrt()
}

/// The encoding of points.
///
/// # Shapes
/// `[n, 3]` to `[n, 3 (2 m + 1)]`; `frequencies = 0` returns the points unchanged.
pub fn encode<B: ModelBackend>(x: Tensor<B, 2>, frequencies: usize) -> Tensor<B, 2> {
    if frequencies == 0 {
        return x;
    }
    let mut blocks = vec![x.clone()];
    for octave in 0..frequencies {
        let k = 2f64.powi(octave as i32) * PI;
        let (sine, cosine) = sine_and_cosine(x.clone(), k);
        blocks.extend([sine / k, cosine / k]);
    }
    Tensor::cat(blocks, 1) * encoding_scale(frequencies)
}

/// First and second derivative of every column by the coordinate that it encodes.
///
/// # Shapes
/// `[n, 3]` to two of `[n, 3 (2 m + 1)]`.
pub fn encoding_derivatives<B: ModelBackend>(
    x: Tensor<B, 2>,
    frequencies: usize,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let mut first = vec![x.ones_like()];
    let mut second = vec![x.zeros_like()];
    for octave in 0..frequencies {
        let k = 2f64.powi(octave as i32) * PI;
        let (sine, cosine) = sine_and_cosine(x.clone(), k);
        first.extend([cosine.clone(), -sine.clone()]);
        second.extend([sine * -k, cosine * -k]);
    }
    let scale = encoding_scale(frequencies);
    (
        Tensor::cat(first, 1) * scale,
        Tensor::cat(second, 1) * scale,
    )
}

/// `sin(k x)` and `cos(k x)`, both from one pass.
fn sine_and_cosine<B: ModelBackend>(x: Tensor<B, 2>, k: f64) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let none = Tensor::zeros([1, x.dims()[1]], &x.device());
    let (sine, slope) = Activation::Sine { omega: k }.value_and_slope(x, none);
    (sine, slope / k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, host, points};

    #[test]
    fn the_columns_are_those_of_the_formula() {
        let encoded = host(encode(points::<Plain>(&[[0.25, -0.5, 0.1]]), 2));
        let scale = 1.0 / 5f64.sqrt();
        assert_eq!(encoded.len(), encoded_width(2));
        let wanted = |axis: usize, x: f64| {
            [
                x,
                (PI * x).sin() / PI,
                (PI * x).cos() / PI,
                (2.0 * PI * x).sin() / (2.0 * PI),
            ]
            .map(|column| column * scale)
            .into_iter()
            .enumerate()
            .map(move |(block, value)| (3 * block + axis, value))
        };
        for (axis, x) in [0.25, -0.5, 0.1].into_iter().enumerate() {
            for (column, value) in wanted(axis, x) {
                // One f32 rounding of values below 1.
                assert!((encoded[column] - value).abs() < 1e-6, "column {column}");
            }
        }
    }

    #[test]
    fn no_pair_of_points_is_pulled_apart() {
        for frequencies in [0, 1, 4, 8] {
            for step in 1..200 {
                let (a, b) = (0.01 * step as f64 - 1.0, 0.013 * (step as f64).sin());
                let pair = points::<Plain>(&[[a, b, -a], [a + 0.003, b - 0.01, 0.002 - a]]);
                let encoded = host(encode(pair, frequencies));
                let (left, right) = encoded.split_at(encoded_width(frequencies));
                let far: f64 = left.iter().zip(right).map(|(p, q)| (p - q).powi(2)).sum();
                let near = 0.003f64.powi(2) + 0.01f64.powi(2) + 0.002f64.powi(2);
                // f32 differences of values below 1 are off by up to 1e-7 each.
                assert!(
                    far.sqrt() <= near.sqrt() + 2e-6,
                    "m = {frequencies}, {far} {near}"
                );
            }
        }
    }

    #[test]
    fn the_squared_derivative_is_the_same_everywhere_and_that_of_the_formula() {
        let x = [[0.3, -0.7, 0.05], [0.0, 0.5, -1.0], [0.123, 0.9, -0.377]];
        for frequencies in [0, 1, 2, 4, 8] {
            let m = frequencies as f64;
            let (first, _) = encoding_derivatives(points::<Plain>(&x), frequencies);
            for row in host(first).chunks(encoded_width(frequencies)) {
                for axis in 0..3 {
                    let squared: f64 = row.iter().skip(axis).step_by(3).map(|d| d * d).sum();
                    // A divisor sqrt(m + 1) would give 1, one of sqrt(2 m) or sqrt(2 m + 2) is off by 5 % or
                    // more; sums of up to 17 f32 numbers below 1 are off by 1e-6.
                    let wanted = (1.0 + m) / (2.0 * m + 1.0);
                    assert!((squared - wanted).abs() < 2e-6, "{m}: {squared}, {wanted}");
                }
            }
        }
    }

    #[test]
    fn the_length_of_a_chord_is_that_of_the_formula() {
        // |e(x + d) - e(x)|^2 = (d^2 + sum_j (2 sin(k_j d / 2) / k_j)^2) / (2 m + 1), whatever x is.
        for frequencies in [0, 1, 2, 4, 8] {
            let waves = (0..frequencies).map(|j| 2f64.powi(j as i32) * PI);
            for (x, d) in [(0.3, 0.2), (-0.71, 0.05), (0.0, 0.4)] {
                let chords = waves
                    .clone()
                    .map(|k| (2.0 * (k * d / 2.0).sin() / k).powi(2));
                let wanted = (d * d + chords.sum::<f64>()) / (2.0 * frequencies as f64 + 1.0);
                let pair = points::<Plain>(&[[x, 0.1, -0.4], [x + d, 0.1, -0.4]]);
                let encoded = host(encode(pair, frequencies));
                let (left, right) = encoded.split_at(encoded_width(frequencies));
                let far: f64 = left.iter().zip(right).map(|(p, q)| (p - q).powi(2)).sum();
                // f32 differences of values below 1 are off by up to 1e-7 each, lengths by 4e-7.
                let off = (far.sqrt() - wanted.sqrt()).abs();
                assert!(off < 1e-6, "m = {frequencies}, {x}, {d}: off by {off}");
            }
        }
    }

    #[test]
    fn the_derivatives_are_central_differences() {
        let (x, h) = ([0.3, -0.7, 0.05], 1e-2);
        let at = |delta: f64| host(encode(points::<Plain>(&[x.map(|c| c + delta)]), 2));
        let (first, second) = encoding_derivatives(points::<Plain>(&[x]), 2);
        let (low, mid, high) = (at(-h), at(0.0), at(h));
        for (column, (a, b)) in host(first).into_iter().zip(host(second)).enumerate() {
            // Truncation h^2 k^2 / 6 with k = 2 pi, and f32 rounding over h (h^2).
            let slope = (high[column] - low[column]) / (2.0 * h);
            assert!(
                (a - slope).abs() < 1e-3,
                "first, column {column}: {a} {slope}"
            );
            let curvature = (high[column] - 2.0 * mid[column] + low[column]) / (h * h);
            assert!(
                (b - curvature).abs() < 2e-2,
                "second, column {column}: {b} {curvature}"
            );
        }
    }
}
