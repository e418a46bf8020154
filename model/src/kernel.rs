//! The softplus, its slope, and what passes beside it through a layer, over plain memory, for backends that
//! live in the host's.
//!
//! burn-ndarray and burn-flex call the C library's `expf` and `log1pf` once per element, and take a pass
//! over the memory for every sum and product of a formula. Here the functions are polynomials in
//! straight-line arithmetic, which the compiler turns into vector instructions, and the passes of a formula
//! go over a piece that stays in the cache; [`pulp`] picks the widest instructions that the machine has.
//! All runs on the calling thread: a step is divided between cores by its samples.
//!
//! With `e = exp(-|beta z|)` in `(0, 1]` and `s = e / (2 + e)` in `(0, 1/3]`:
//!
//! ```text
//! value = max(z, 0) + log1p(e) / beta,   log1p(e) = 2 (s + s^3/3 + s^5/5 + … + s^13/13)
//! slope = (1 if z >= 0 else e) / (1 + e)
//! ```
//!
//! The formulas of the jet and of its backward pass are those of [`crate::softplus`].

use pulp::{Arch, NullaryFnOnce};

use crate::softplus::{Lanes, SPATIAL};

/// Elements of a piece: 8 kB of each operand, of which a formula has up to four.
const PIECE: usize = 1 << 11;

/// A loop that is compiled once for each set of vector instructions; `arch` says which to take.
///
/// A closure would do, were the compiler bound to inline it: where it does not, all of it runs on the
/// narrowest vectors.
macro_rules! vectorised {
    ($(#[$doc:meta])* fn $name:ident($($argument:ident: $type:ty),*) $body:block) => {
        $(#[$doc])*
        fn $name<'a>(arch: Arch, $($argument: $type),*) {
            struct Pass<'a> {
                $($argument: $type),*
            }
            impl<'a> NullaryFnOnce for Pass<'a> {
                type Output = ();

                #[inline(always)]
                fn call(self) {
                    let Self { $($argument),* } = self;
                    $body
                }
            }
            arch.dispatch(Pass { $($argument),* });
        }
    };
}

/// What leaves the activation of sharpness `beta`, of the shape of `z`, and its slope, `[n, c]`, from what
/// enters it, `z`, `[blocks n, c]`, without the bias, `[c]`.
///
/// Errors of value and slope stay below 2 units in the last place of the larger of the result and
/// `1 / beta`.
pub fn jet(z: &[f32], bias: &[f32], lanes: Lanes, beta: f32) -> (Vec<f32>, Vec<f32>) {
    let size = z.len() / lanes.blocks();
    let mut out = Vec::with_capacity(z.len());
    let mut slope = Vec::with_capacity(size);
    if size == 0 {
        return (out, slope);
    }
    let arch = Arch::new();
    // Whole rows, so that a piece begins where the bias does.
    let piece = (PIECE / bias.len()).max(1) * bias.len();
    for z in z[..size].chunks(piece) {
        let (value, slope) = (append(&mut out, z), append(&mut slope, z));
        softplus(arch, bias, beta, value, slope);
    }
    let block = |k: usize, from: usize, to: usize| &z[k * size + from..k * size + to];
    for k in 1..lanes.blocks() {
        for (from, to) in pieces(size) {
            let slope = &slope[from..to];
            let out = append(&mut out, block(k, from, to));
            multiply(arch, out, slope);
            if k > lanes.tangents {
                for tangent in 1..=SPATIAL {
                    let z = block(tangent, from, to);
                    add_curved(arch, z, z, slope, beta, out);
                }
            }
        }
    }
    (out, slope)
}

/// The gradient by what entered [`jet`] from that by what left it, both `[blocks n, c]`; `z` may be empty
/// where the value travels alone.
pub fn jet_backward(z: &[f32], slope: &[f32], grad: &[f32], lanes: Lanes, beta: f32) -> Vec<f32> {
    let size = slope.len();
    let mut out = Vec::with_capacity(grad.len());
    let arch = Arch::new();
    let last = lanes.tangents + 1;
    for k in 0..lanes.blocks() {
        for (from, to) in pieces(size) {
            let slope = &slope[from..to];
            let z = |k: usize| &z[k * size + from..k * size + to];
            let g = |k: usize| &grad[k * size + from..k * size + to];
            let out = append(&mut out, g(k));
            multiply(arch, out, slope);
            if k == 0 {
                for other in 1..lanes.blocks() {
                    add_curved(arch, z(other), g(other), slope, beta, out);
                }
                for tangent in 1..=SPATIAL * usize::from(lanes.laplacian) {
                    add_third(arch, z(tangent), g(last), slope, beta, out);
                }
            } else if lanes.laplacian && k <= SPATIAL {
                add_curved(arch, z(k), g(last), slope, 2.0 * beta, out);
            }
        }
    }
    out
}

/// The gradient by what entered the activation, from that by its slope.
pub fn slope_backward(slope: &[f32], grad: &[f32], beta: f32) -> Vec<f32> {
    let mut out = Vec::with_capacity(grad.len());
    let arch = Arch::new();
    for (slope, grad) in slope.chunks(PIECE).zip(grad.chunks(PIECE)) {
        let out = append(&mut out, grad);
        multiply_curved(arch, out, slope, beta);
    }
    out
}

/// Where the pieces of so many elements begin and end.
fn pieces(size: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..size)
        .step_by(PIECE)
        .map(move |from| (from, size.min(from + PIECE)))
}

/// Appends a piece, to be worked on where it then is: a copy within the cache is cheaper than filling the
/// whole result with zeros first.
fn append<'a>(out: &'a mut Vec<f32>, piece: &[f32]) -> &'a mut [f32] {
    let done = out.len();
    out.extend_from_slice(piece);
    &mut out[done..]
}

vectorised! {
    /// `out *= factor`.
    fn multiply(out: &'a mut [f32], factor: &'a [f32]) {
        for (out, factor) in out.iter_mut().zip(factor) {
            *out *= factor;
        }
    }
}

vectorised! {
    /// `out *= s''`, with `s'' = beta s' (1 - s')`.
    fn multiply_curved(out: &'a mut [f32], slope: &'a [f32], beta: f32) {
        for (out, slope) in out.iter_mut().zip(slope) {
            *out *= beta * slope * (1.0 - slope);
        }
    }
}

vectorised! {
    /// `out += s'' a b`, with `s'' = beta s' (1 - s')`.
    fn add_curved(a: &'a [f32], b: &'a [f32], slope: &'a [f32], beta: f32, out: &'a mut [f32]) {
        let operands = a.iter().zip(b).zip(slope);
        for (out, ((a, b), slope)) in out.iter_mut().zip(operands) {
            *out += beta * slope * (1.0 - slope) * a * b;
        }
    }
}

vectorised! {
    /// `out += s''' g a^2`, with `s''' = beta s'' (1 - 2 s')`.
    fn add_third(a: &'a [f32], g: &'a [f32], slope: &'a [f32], beta: f32, out: &'a mut [f32]) {
        let operands = a.iter().zip(g).zip(slope);
        for (out, ((a, g), slope)) in out.iter_mut().zip(operands) {
            let third = beta * beta * slope * (1.0 - slope) * (1.0 - 2.0 * slope);
            *out += third * g * a * a;
        }
    }
}

vectorised! {
    /// Turns rows of inputs, which both hold, into values and slopes.
    fn softplus(bias: &'a [f32], beta: f32, value: &'a mut [f32], slope: &'a mut [f32]) {
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
    /// Adding and subtracting it rounds to a whole number, whose bits are then the lowest of the sum.
    const ROUND: f32 = 12_582_912.0;
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

    #[test]
    fn value_and_slope_are_exact_to_the_last_places_over_the_whole_range() {
        for beta in [0.5f32, 8.0, 100.0] {
            let z: Vec<f32> = (-400_000..400_000)
                .map(|k| 3e-4 * k as f32 / beta)
                .collect();
            // In rows: one bias for each element of one would take the compiler's vectors away.
            let (value, slope) = jet(&z, &[0.0; 1000], Lanes::VALUE, beta);
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
        let (value, slope) = jet(&inputs, &[0.0; 3], Lanes::VALUE, 10.0);
        assert!(
            value[0].is_nan() && slope[0].is_nan(),
            "{value:?} {slope:?}"
        );
        assert_eq!((value[1], slope[1]), (f32::INFINITY, 1.0));
        assert_eq!((value[2], slope[2]), (0.0, 0.0));
    }

    #[test]
    fn every_row_gets_the_bias_of_its_columns_whatever_the_pieces() {
        // Widths that divide no piece, and more rows than one piece holds.
        for width in [1, 3, 7, 5000] {
            let rows = 40_000 / width + 2;
            let bias: Vec<f32> = (0..width).map(|c| 0.01 * c as f32 - 1.0).collect();
            let (value, _) = jet(&vec![0.25; rows * width], &bias, Lanes::VALUE, 4.0);
            let sums: Vec<f32> = bias.iter().map(|b| b + 0.25).collect();
            let (wanted, _) = jet(&sums, &[0.0], Lanes::VALUE, 4.0);
            assert!(
                value.chunks(width).all(|row| row == wanted),
                "width {width}"
            );
        }
    }
}
