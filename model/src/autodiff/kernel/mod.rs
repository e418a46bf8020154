//! The activations, their slopes, and what passes beside them through a layer, over plain memory, for
//! backends that live in the host's.
//!
//! | file | what |
//! |---|---|
//! | this one | the formulas of [`super::jet`] and of its backward passes, for any [`Pointwise`] activation |
//! | [`softplus`], [`sine`] | the functions themselves |
//! | [`pointwise`] | what is common to both: the trait, and loops of vector instructions |
//!
//! burn-ndarray and burn-flex call the C library's `expf`, `log1pf`, `sinf` and `cosf` once per element, and
//! take a pass over the memory for every sum and product of a formula. Here the functions are polynomials
//! in straight-line arithmetic, which the compiler turns into vector instructions, and the passes of a
//! formula go over a piece that stays in the cache; [`pulp`] picks the widest instructions that the machine
//! has. All runs on the calling thread: a step is divided between cores by its samples.

mod pointwise;
mod sine;
mod softplus;

use pulp::{Arch, NullaryFnOnce};

use self::pointwise::{Pointwise, vectorised};
use self::sine::Sine;
use self::softplus::Softplus;
use super::activation::Activation;
use super::lanes::{Lanes, SPATIAL};

/// Elements of a piece: 8 kB of each operand, of which a formula has up to four.
const PIECE: usize = 1 << 11;

/// A piece of what [`Pointwise::evaluate`] found.
#[derive(Clone, Copy)]
struct Evaluated<'a> {
    value: &'a [f32],
    slope: &'a [f32],
}

impl<'a> Evaluated<'a> {
    /// Value and slope of each element.
    #[inline(always)]
    fn iter(self) -> impl Iterator<Item = (&'a f32, &'a f32)> {
        self.value.iter().zip(self.slope)
    }
}

/// Calls a function with the activation's [`Pointwise`] as its first argument: compiled once for each.
macro_rules! with {
    ($activation:expr, $call:ident($($argument:expr),*)) => {
        match $activation {
            Activation::Softplus { beta } => $call(Softplus::new(beta), $($argument),*),
            Activation::Sine { omega } => $call(Sine::new(omega), $($argument),*),
        }
    };
}

/// What leaves the activation, of the shape of `z`, and its slope, `[n, c]`, from what enters it, `z`,
/// `[blocks n, c]`, without the bias, `[c]`.
pub(super) fn jet(
    z: &[f32],
    bias: &[f32],
    lanes: Lanes,
    activation: Activation,
) -> (Vec<f32>, Vec<f32>) {
    with!(activation, jet_of(z, bias, lanes))
}

/// The gradient by what entered [`jet`] from that by what left it, `out`, all `[blocks n, c]`; `z` may be
/// empty where the value travels alone.
pub(super) fn jet_backward(
    z: &[f32],
    out: &[f32],
    slope: &[f32],
    grad: &[f32],
    lanes: Lanes,
    activation: Activation,
) -> Vec<f32> {
    with!(activation, jet_backward_of(z, out, slope, grad, lanes))
}

/// The gradient by what entered the activation, from that by its slope; `out` is what left it, the values
/// first.
pub(super) fn slope_backward(
    out: &[f32],
    slope: &[f32],
    grad: &[f32],
    activation: Activation,
) -> Vec<f32> {
    with!(activation, slope_backward_of(out, slope, grad))
}

fn jet_of<F: Pointwise>(
    function: F,
    z: &[f32],
    bias: &[f32],
    lanes: Lanes,
) -> (Vec<f32>, Vec<f32>) {
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
        // Both begin as what entered, and are evaluated in place.
        let (value, slope) = (append(&mut out, z).1, append(&mut slope, z).1);
        function.evaluate(arch, bias, value, slope);
    }
    let block = |k: usize, from: usize, to: usize| &z[k * size + from..k * size + to];
    for k in 1..lanes.blocks() {
        for (from, to) in pieces(size) {
            let slope = &slope[from..to];
            let (before, out) = append(&mut out, block(k, from, to));
            multiply(arch, out, slope);
            // The Laplacian alone also takes the squares of the three tangents of space.
            if k > lanes.tangents {
                let value = &before[from..to];
                let at = Evaluated { value, slope };
                for tangent in 1..=SPATIAL {
                    let z = block(tangent, from, to);
                    add_curved(arch, function, 1.0, z, z, at, out);
                }
            }
        }
    }
    (out, slope)
}

fn jet_backward_of<F: Pointwise>(
    function: F,
    z: &[f32],
    left: &[f32],
    slope: &[f32],
    grad: &[f32],
    lanes: Lanes,
) -> Vec<f32> {
    let size = slope.len();
    let mut out = Vec::with_capacity(grad.len());
    let arch = Arch::new();
    let last = lanes.tangents + 1;
    for k in 0..lanes.blocks() {
        for (from, to) in pieces(size) {
            let (value, slope) = (&left[from..to], &slope[from..to]);
            let at = Evaluated { value, slope };
            let z = |k: usize| &z[k * size + from..k * size + to];
            let g = |k: usize| &grad[k * size + from..k * size + to];
            // The blocks are made in their order, so the result grows and is never filled with zeros.
            let (_, out) = append(&mut out, g(k));
            multiply(arch, out, slope);
            if k == 0 {
                for other in 1..lanes.blocks() {
                    add_curved(arch, function, 1.0, z(other), g(other), at, out);
                }
                for tangent in 1..=SPATIAL * usize::from(lanes.laplacian) {
                    add_third(arch, function, z(tangent), g(last), at, out);
                }
            } else if lanes.laplacian && k <= SPATIAL {
                add_curved(arch, function, 2.0, z(k), g(last), at, out);
            }
        }
    }
    out
}

fn slope_backward_of<F: Pointwise>(
    function: F,
    left: &[f32],
    slope: &[f32],
    grad: &[f32],
) -> Vec<f32> {
    let mut out = Vec::with_capacity(grad.len());
    let arch = Arch::new();
    for (from, to) in pieces(slope.len()) {
        let (value, slope) = (&left[from..to], &slope[from..to]);
        let (_, out) = append(&mut out, &grad[from..to]);
        multiply_curved(arch, function, Evaluated { value, slope }, out);
    }
    out
}

/// Where the pieces of so many elements begin and end.
fn pieces(size: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..size)
        .step_by(PIECE)
        .map(move |from| (from, size.min(from + PIECE)))
}

/// Appends a piece, to be worked on where it then is, and gives it after what was there before: a copy within
/// the cache is cheaper than filling the whole result with zeros first.
fn append<'a>(out: &'a mut Vec<f32>, piece: &[f32]) -> (&'a [f32], &'a mut [f32]) {
    let done = out.len();
    out.extend_from_slice(piece);
    let (before, piece) = out.split_at_mut(done);
    (before, piece)
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
    /// `out *= s''`.
    fn multiply_curved<F: Pointwise>(function: F, at: Evaluated<'a>, out: &'a mut [f32]) {
        for (out, (value, slope)) in out.iter_mut().zip(at.iter()) {
            *out *= function.curvature(*value, *slope);
        }
    }
}

vectorised! {
    /// `out += factor s'' a b`.
    fn add_curved<F: Pointwise>(
        function: F,
        factor: f32,
        a: &'a [f32],
        b: &'a [f32],
        at: Evaluated<'a>,
        out: &'a mut [f32]
    ) {
        let operands = a.iter().zip(b).zip(at.iter());
        for (out, ((a, b), (value, slope))) in out.iter_mut().zip(operands) {
            *out += factor * function.curvature(*value, *slope) * a * b;
        }
    }
}

vectorised! {
    /// `out += s''' g a^2`.
    fn add_third<F: Pointwise>(
        function: F,
        a: &'a [f32],
        g: &'a [f32],
        at: Evaluated<'a>,
        out: &'a mut [f32]
    ) {
        let operands = a.iter().zip(g).zip(at.iter());
        for (out, ((a, g), (value, slope))) in out.iter_mut().zip(operands) {
            *out += function.third(*value, *slope) * g * a * a;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_gets_the_bias_of_its_columns_whatever_the_pieces() {
        let softplus = Activation::Softplus { beta: 4.0 };
        let sine = Activation::Sine { omega: 4.0 };
        // Widths that divide no piece, and more rows than one piece holds.
        for (activation, width) in [softplus, sine]
            .into_iter()
            .flat_map(|activation| [1, 3, 7, 5000].map(|width| (activation, width)))
        {
            let rows = 40_000 / width + 2;
            let bias: Vec<f32> = (0..width).map(|c| 0.01 * c as f32 - 1.0).collect();
            let (value, _) = jet(&vec![0.25; rows * width], &bias, Lanes::VALUE, activation);
            let sums: Vec<f32> = bias.iter().map(|b| b + 0.25).collect();
            let (wanted, _) = jet(&sums, &[0.0], Lanes::VALUE, activation);
            assert!(
                value.chunks(width).all(|row| row == wanted),
                "{activation:?}, width {width}"
            );
        }
    }
}
