//! The inverse of the Gauss-Newton matrix' diagonal blocks, one for each node.
//!
//! A node has 6 unknowns, or 9 between two of many key frames. Its block is a sum over places of `T_k T_l B`, where
//! `B` is a symmetric 3 x 3 matrix:
//!
//! ```text
//! trajectories   B = w_n^2 M^T W M, each place for itself
//! band           B = (strain / 2 + divergence) g g^T + strain / 2 |g|^2 I,   g the gradient of B_n
//! screw          w_n^2 T_k' T_l' I; what it has beside the rate is left out
//! ```
//!
//! A vector holds the six numbers of `B` as `[00 11 22 01 02 12 - -]`, and a node three of them, for
//! `k l = 00, 01, 11`, or six, for `k l = 00, 01, 02, 11, 12, 22`.

use rayon::prelude::*;

use crate::basis::{SUPPORT, Times};
use crate::cell::{LANES, Node};
use crate::ends::{EndPlace, EndTerms};
use crate::prior::{PriorPlace, PriorTerms};
use crate::real::{Fuse, Kernel, Real, run};
use crate::scatter::{BLOCK, Part, each_run, overlap, parts};
use crate::trajectory::Matrix;

/// Unknowns of a node.
const SIZE: usize = 6;
/// Pairs of two functions of time.
const PAIRS: usize = 3;
/// Lanes of the upper triangle.
pub(crate) const LANE_OF: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];
/// Added to a block's diagonal, as a part of its mean.
pub(crate) const LIFT: f64 = 1e-6;

type Sums<R, const P: usize> = [Node<R>; P];

/// The diagonal blocks of one hop, as parts that are to be summed.
pub(crate) struct NodeBlocks<R, const P: usize> {
    of_ends: Vec<Part<Sums<R, P>>>,
    of_priors: Vec<Part<Sums<R, P>>>,
}

/// Columns of the inverse block of each node.
pub(crate) struct Preconditioner<R> {
    inverses: Vec<[Node<R>; SIZE]>,
}

impl<R: Real, const P: usize> NodeBlocks<R, P> {
    /// The blocks of both kinds of terms.
    pub(crate) fn new<const H: usize>(
        ends: &EndTerms<R, H>,
        priors: &PriorTerms<R, H>,
        strides: [usize; 2],
    ) -> Self {
        let zero = [Node::ZERO; P];
        let firsts: Vec<u32> = ends.places.iter().map(|place| place.first).collect();
        let mut of_ends = parts::<_, H>(&firsts, strides, &zero);
        each_run::<_, _, H>(&mut of_ends, &ends.places, |part, places| {
            run(EndBlocks {
                places,
                weights: &ends.weights,
                strides,
                part,
            });
        });
        let firsts: Vec<u32> = priors
            .places
            .iter()
            .map(|place| place.located.first)
            .collect();
        let mut of_priors = parts::<_, H>(&firsts, strides, &zero);
        each_run::<_, _, H>(&mut of_priors, &priors.places, |part, places| {
            run(PriorBlocks {
                places,
                strides,
                part,
            });
        });
        Self { of_ends, of_priors }
    }

    /// The sums of `count` nodes from `start` on.
    pub(crate) fn sums(&self, start: usize, count: usize) -> Vec<[[f64; LANES]; P]> {
        let mut sums = vec![[[0.0; LANES]; P]; count];
        add_parts(&self.of_ends, start, &mut sums);
        add_parts(&self.of_priors, start, &mut sums);
        sums
    }
}

impl<R: Real> Preconditioner<R> {
    /// The blocks and the ridge, inverted.
    pub(crate) fn new(blocks: &NodeBlocks<R, PAIRS>, ridge: f64, nodes: usize) -> Self {
        let mut inverses = vec![[Node::ZERO; SIZE]; nodes];
        inverses
            .par_chunks_mut(BLOCK)
            .enumerate()
            .for_each(|(block, out)| {
                let sums = blocks.sums(block * BLOCK, out.len());
                for (out, sums) in out.iter_mut().zip(&sums) {
                    *out = inverse(sums, ridge);
                }
            });
        Self { inverses }
    }

    /// `out = P r` for a run of nodes that begins at `start`.
    #[inline(always)]
    pub(crate) fn apply<F: Fuse>(&self, f: F, start: usize, r: &[Node<R>], out: &mut [Node<R>]) {
        for ((columns, r), out) in self.inverses[start..].iter().zip(r).zip(out) {
            let mut sum = Node::ZERO;
            for (j, column) in columns.iter().enumerate() {
                sum.add(f, r.0[0][j / 3 * 4 + j % 3], column);
            }
            *out = sum;
        }
    }
}

fn add_parts<R: Real, const P: usize>(
    parts: &[Part<Sums<R, P>>],
    start: usize,
    sums: &mut [[[f64; LANES]; P]],
) {
    for part in parts {
        let (from, to) = overlap(part, start, start + sums.len());
        for at in from..to {
            for (sum, node) in sums[at - start]
                .iter_mut()
                .zip(&part.nodes[at - part.start])
            {
                for (sum, value) in sum.iter_mut().zip(node.0[0]) {
                    *sum += value.wide();
                }
            }
        }
    }
}

/// The inverse of a node's block; zero where nothing acts on the node.
fn inverse<R: Real>(sums: &[[f64; LANES]; PAIRS], ridge: f64) -> [Node<R>; SIZE] {
    let mut block = [[0.0; SIZE]; SIZE];
    let mut trace = 0.0;
    for (i, row) in block.iter_mut().enumerate() {
        for (j, value) in row.iter_mut().enumerate() {
            *value = sums[i / 3 + j / 3][LANE_OF[i % 3][j % 3]];
        }
        trace += row[i];
    }
    let mut out = [Node::ZERO; SIZE];
    if trace == 0.0 {
        return out;
    }
    for (i, row) in block.iter_mut().enumerate() {
        row[i] += ridge + LIFT * trace / SIZE as f64;
    }
    let inverse = inverse_of_positive(block);
    for (column, row) in out.iter_mut().zip(inverse) {
        for (i, value) in row.into_iter().enumerate() {
            column.0[0][i / 3 * 4 + i % 3] = R::of(value);
        }
    }
    out
}

/// The inverse of a symmetric positive matrix, by Gauss and Jordan without pivots.
fn inverse_of_positive(mut a: [[f64; SIZE]; SIZE]) -> [[f64; SIZE]; SIZE] {
    for k in 0..SIZE {
        let pivot = 1.0 / a[k][k];
        let mut row = a[k];
        row[k] = 1.0;
        for value in &mut row {
            *value *= pivot;
        }
        for (i, other) in a.iter_mut().enumerate() {
            if i == k {
                continue;
            }
            let factor = other[k];
            other[k] = 0.0;
            for (value, row) in other.iter_mut().zip(row) {
                *value -= factor * row;
            }
        }
        a[k] = row;
    }
    a
}

/// `M^T W M`, packed.
#[inline(always)]
fn squared<R: Real>(m: &Matrix<R>, w: &Matrix<R>) -> [R; LANES] {
    let mut wm = [[R::ZERO; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            wm[i][j] = w[i][0] * m[0][j] + w[i][1] * m[1][j] + w[i][2] * m[2][j];
        }
    }
    let at = |i: usize, j: usize| m[0][i] * wm[0][j] + m[1][i] * wm[1][j] + m[2][i] * wm[2][j];
    [
        at(0, 0),
        at(1, 1),
        at(2, 2),
        at(0, 1),
        at(0, 2),
        at(1, 2),
        R::ZERO,
        R::ZERO,
    ]
}

/// The products of two functions of time, in the order of the sums.
#[inline(always)]
fn time_pairs<R: Real, const H: usize, const P: usize>(time: &Times<R, H>) -> [R; P] {
    let functions = if P == PAIRS { 2 } else { 3 };
    let mut out = [R::ZERO; P];
    let mut at = 0;
    for k in 0..functions {
        for l in k..functions {
            out[at] = time[k / 2][k % 2] * time[l / 2][l % 2];
            at += 1;
        }
    }
    out
}

struct EndBlocks<'a, R, const H: usize, const P: usize> {
    places: &'a [EndPlace<R, H>],
    weights: &'a [Matrix<R>],
    strides: [usize; 2],
    part: &'a mut Part<Sums<R, P>>,
}

impl<R: Real, const H: usize, const P: usize> Kernel for EndBlocks<'_, R, H, P> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        for place in self.places {
            let weight = &self.weights[place.trajectory as usize];
            let packed = Node([squared(&place.matrix, weight)]);
            let pairs: [R; P] = time_pairs(&place.time);
            let scaled = pairs.map(|pair| packed.scaled(pair));
            let first = place.first as usize - self.part.start;
            for a in 0..SUPPORT {
                for b in 0..SUPPORT {
                    for c in 0..SUPPORT {
                        let w = place.weights[0][a] * place.weights[1][b] * place.weights[2][c];
                        let at = first + a * self.strides[0] + b * self.strides[1] + c;
                        add_scaled(f, &mut self.part.nodes[at], w * w, &scaled);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn add_scaled<R: Real, F: Fuse, const P: usize>(
    f: F,
    sums: &mut Sums<R, P>,
    factor: R,
    parts: &Sums<R, P>,
) {
    for k in 0..P {
        sums[k].add(f, factor, &parts[k]);
    }
}

struct PriorBlocks<'a, R: Real, const H: usize, const P: usize> {
    places: &'a [PriorPlace<R, H>],
    strides: [usize; 2],
    part: &'a mut Part<Sums<R, P>>,
}

impl<R: Real, const H: usize, const P: usize> Kernel for PriorBlocks<'_, R, H, P> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        for place in self.places {
            let (w, d) = (&place.located.weights, &place.located.slopes);
            let [pairs, rate_pairs]: [[R; P]; 2] = place.times.each_ref().map(time_pairs);
            let first = place.located.first as usize - self.part.start;
            for a in 0..SUPPORT {
                for b in 0..SUPPORT {
                    let (ww, dw, wd) = (w[0][a] * w[1][b], d[0][a] * w[1][b], w[0][a] * d[1][b]);
                    for c in 0..SUPPORT {
                        let gradient = [dw * w[2][c], wd * w[2][c], ww * d[2][c]];
                        let weight = ww * w[2][c];
                        let packed = gradients(&place.factors, gradient);
                        let screw = place.factors[2] * weight * weight;
                        let at = first + a * self.strides[0] + b * self.strides[1] + c;
                        let sums = &mut self.part.nodes[at];
                        for k in 0..P {
                            sums[k].add(f, pairs[k], &packed);
                            for i in 0..3 {
                                sums[k].0[0][i] += screw * rate_pairs[k];
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The block of strain and divergence, packed.
#[inline(always)]
fn gradients<R: Real>(factors: &[R; 3], g: [R; 3]) -> Node<R> {
    let half = R::HALF * factors[0];
    let (both, square) = (
        half + factors[1],
        half * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]),
    );
    Node([[
        both * g[0] * g[0] + square,
        both * g[1] * g[1] + square,
        both * g[2] * g[2] + square,
        both * g[0] * g[1],
        both * g[0] * g[2],
        both * g[1] * g[2],
        R::ZERO,
        R::ZERO,
    ]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inverse_times_its_matrix_is_the_identity() {
        let mut a = [[0.0; SIZE]; SIZE];
        for (i, row) in a.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value = 1.0 / (1.0 + i as f64 + j as f64);
            }
            row[i] += 0.5;
        }
        let inverse = inverse_of_positive(a);
        for (i, row) in a.iter().enumerate() {
            for j in 0..SIZE {
                let product: f64 = (0..SIZE).map(|k| row[k] * inverse[k][j]).sum();
                // Condition below 10: a few roundings of float64.
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }
}
