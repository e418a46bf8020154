//! Sums over the 27 nodes of a cell, and their transposes.
//!
//! ```text
//! V   = sum_abc w_a w_b w_c sum_k T_k c[abc, k]
//! V_t = sum_abc w_a w_b w_c sum_k T_k' c[abc, k]
//! J   = dV / dx, slopes in place of one of the weights
//! ```
//!
//! A node is 8 numbers, `[k][x y z -]`, so that one of them, or half, is one vector. Nodes along the third
//! axis are contiguous: they are summed over the other two axes first.

use crate::basis::{SUPPORT, Times};
use crate::grid::Located;
use crate::real::{Fuse, Real};

/// Numbers of half a node: for each of two functions of time a vector and an idle lane.
pub(crate) const LANES: usize = 8;

/// A vector of space and an idle lane, which is zero. It is carried along to where results are stored: were
/// it dropped before, the compiler would drop it everywhere and take scalars for the third axis.
pub(crate) type Lanes<R> = [R; 4];

/// The coefficients of a node, two functions of time in each half. Idle lanes stay zero.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Node<R, const H: usize = 1>(pub [[R; LANES]; H]);

impl<R: Real, const H: usize> Node<R, H> {
    pub(crate) const ZERO: Self = Self([[R::ZERO; LANES]; H]);

    /// All numbers in a row.
    #[inline(always)]
    pub(crate) fn flat(&self) -> &[R] {
        self.0.as_flattened()
    }

    /// All numbers in a row.
    #[inline(always)]
    pub(crate) fn flat_mut(&mut self) -> &mut [R] {
        self.0.as_flattened_mut()
    }

    /// `self += factor other`.
    #[inline(always)]
    pub(crate) fn add<F: Fuse>(&mut self, f: F, factor: R, other: &Self) {
        for h in 0..H {
            self.0[h] = R::add_eight(f, self.0[h], factor, other.0[h]);
        }
    }

    #[inline(always)]
    pub(crate) fn scaled(&self, factor: R) -> Self {
        let mut out = *self;
        for h in 0..H {
            for l in 0..LANES {
                out.0[h][l] = out.0[h][l] * factor;
            }
        }
        out
    }

    /// The sum over the functions of time.
    #[inline(always)]
    pub(crate) fn at<F: Fuse>(&self, f: F, time: Times<R, H>) -> Lanes<R> {
        let mut out = [R::ZERO; 4];
        for i in 0..4 {
            let first = &self.0[0];
            out[i] = f.multiply_add(time[0][1], first[4 + i], time[0][0] * first[i]);
            for h in 1..H {
                let [a, b] = time[h];
                out[i] = f.multiply_add(a, self.0[h][i], out[i]);
                out[i] = f.multiply_add(b, self.0[h][4 + i], out[i]);
            }
        }
        out
    }

    /// A vector times each function of time.
    #[inline(always)]
    pub(crate) fn outer(vector: Lanes<R>, time: Times<R, H>) -> Self {
        let mut out = Self::ZERO;
        for h in 0..H {
            for l in 0..LANES {
                out.0[h][l] = vector[l % 4] * time[h][l / 4];
            }
        }
        out
    }
}

/// Adds a change to all nodes; its largest number.
pub(crate) fn add_change<R: Real, const H: usize>(
    nodes: &mut [Node<R, H>],
    change: &[Node<R, H>],
) -> f64 {
    let mut size = 0.0f64;
    for (node, change) in nodes.iter_mut().zip(change) {
        for (value, &change) in node.flat_mut().iter_mut().zip(change.flat()) {
            *value += change;
            size = size.max(change.wide().abs());
        }
    }
    size
}

/// Whether all numbers of all nodes are finite.
pub(crate) fn are_finite<R: Real, const H: usize>(nodes: &[Node<R, H>]) -> bool {
    let mut numbers = nodes.iter().flat_map(Node::flat);
    numbers.all(|c| c.wide().is_finite())
}

/// V, its rate and its Jacobian at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet<R: Real = f32> {
    /// `V`.
    pub value: [R; 3],
    /// `V_t`.
    pub rate: [R; 3],
    /// `jacobian[i][j] = dV_i / dx_j`.
    pub jacobian: [[R; 3]; 3],
}

/// A [`Jet`] with idle lanes; `columns[j] = dV / dx_j`.
#[derive(Clone, Copy)]
pub(crate) struct WideJet<R> {
    pub value: Lanes<R>,
    pub rate: Lanes<R>,
    pub columns: [Lanes<R>; 3],
}

impl<R: Real> WideJet<R> {
    #[inline(always)]
    pub(crate) fn narrow(&self) -> Jet<R> {
        let mut jacobian = [[R::ZERO; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                jacobian[i][j] = self.columns[j][i];
            }
        }
        Jet {
            value: first_three(self.value),
            rate: first_three(self.rate),
            jacobian,
        }
    }
}

#[inline(always)]
pub(crate) fn first_three<R: Real>([x, y, z, _]: Lanes<R>) -> [R; 3] {
    [x, y, z]
}

/// A row of three nodes.
#[inline(always)]
fn row<R, const H: usize>(nodes: &[Node<R, H>], at: usize) -> &[Node<R, H>] {
    &nodes[at..at + SUPPORT]
}

/// V at a place.
#[inline(always)]
pub(crate) fn value<R: Real, F: Fuse, const H: usize>(
    f: F,
    nodes: &[Node<R, H>],
    strides: [usize; 2],
    first: u32,
    weights: &[[R; SUPPORT]; 3],
    time: Times<R, H>,
) -> Lanes<R> {
    let mut sums = [Node::ZERO; SUPPORT];
    for a in 0..SUPPORT {
        for b in 0..SUPPORT {
            let row = row(nodes, first as usize + a * strides[0] + b * strides[1]);
            let weight = weights[0][a] * weights[1][b];
            for c in 0..SUPPORT {
                sums[c].add(f, weight, &row[c]);
            }
        }
    }
    across(f, &sums, &weights[2]).at(f, time)
}

/// The sum along the third axis.
#[inline(always)]
fn across<R: Real, F: Fuse, const H: usize>(
    f: F,
    sums: &[Node<R, H>; SUPPORT],
    weights: &[R; SUPPORT],
) -> Node<R, H> {
    let mut out = sums[0].scaled(weights[0]);
    for c in 1..SUPPORT {
        out.add(f, weights[c], &sums[c]);
    }
    out
}

/// The transpose of [`value`] at a vector: added to the nodes.
#[inline(always)]
pub(crate) fn add_value<R: Real, F: Fuse, const H: usize>(
    f: F,
    nodes: &mut [Node<R, H>],
    strides: [usize; 2],
    first: usize,
    weights: &[[R; SUPPORT]; 3],
    part: &Node<R, H>,
) {
    let mut parts = [Node::ZERO; SUPPORT];
    for c in 0..SUPPORT {
        parts[c] = part.scaled(weights[2][c]);
    }
    for a in 0..SUPPORT {
        for b in 0..SUPPORT {
            let at = first + a * strides[0] + b * strides[1];
            let row = &mut nodes[at..at + SUPPORT];
            let weight = weights[0][a] * weights[1][b];
            for c in 0..SUPPORT {
                row[c].add(f, weight, &parts[c]);
            }
        }
    }
}

/// V, its rate and its Jacobian at a place.
#[inline(always)]
pub(crate) fn jet<R: Real, F: Fuse, const H: usize>(
    f: F,
    nodes: &[Node<R, H>],
    strides: [usize; 2],
    place: &Located<R>,
    [time, rates]: [Times<R, H>; 2],
) -> WideJet<R> {
    let (weights, slopes) = (&place.weights, &place.slopes);
    let mut sums = [[Node::ZERO; SUPPORT]; 3];
    for a in 0..SUPPORT {
        for b in 0..SUPPORT {
            let row = row(
                nodes,
                place.first as usize + a * strides[0] + b * strides[1],
            );
            let weight = weights[0][a] * weights[1][b];
            let by_x = slopes[0][a] * weights[1][b];
            let by_y = weights[0][a] * slopes[1][b];
            for c in 0..SUPPORT {
                sums[0][c].add(f, weight, &row[c]);
                sums[1][c].add(f, by_x, &row[c]);
                sums[2][c].add(f, by_y, &row[c]);
            }
        }
    }
    let sum = across(f, &sums[0], &weights[2]);
    WideJet {
        value: sum.at(f, time),
        rate: sum.at(f, rates),
        columns: [
            across(f, &sums[1], &weights[2]).at(f, time),
            across(f, &sums[2], &weights[2]).at(f, time),
            across(f, &sums[0], &slopes[2]).at(f, time),
        ],
    }
}

/// The transpose of [`jet`]: what multiplies V, its rate and its Jacobian, added to the nodes.
#[inline(always)]
pub(crate) fn add_jet<R: Real, F: Fuse, const H: usize>(
    f: F,
    nodes: &mut [Node<R, H>],
    strides: [usize; 2],
    place: &Located<R>,
    first: usize,
    times: [Times<R, H>; 2],
    jet: &WideJet<R>,
) {
    let (weights, slopes) = (&place.weights, &place.slopes);
    let [time, rates] = times;
    let by_x = Node::outer(jet.columns[0], time);
    let by_y = Node::outer(jet.columns[1], time);
    let by_z = Node::outer(jet.columns[2], time);
    let mut sum = Node::outer(jet.value, time);
    sum.add(f, R::ONE, &Node::outer(jet.rate, rates));
    let mut parts = [[Node::ZERO; SUPPORT]; 3];
    for c in 0..SUPPORT {
        parts[0][c] = sum.scaled(weights[2][c]);
        parts[0][c].add(f, slopes[2][c], &by_z);
        parts[1][c] = by_x.scaled(weights[2][c]);
        parts[2][c] = by_y.scaled(weights[2][c]);
    }
    for a in 0..SUPPORT {
        for b in 0..SUPPORT {
            let at = first + a * strides[0] + b * strides[1];
            let row = &mut nodes[at..at + SUPPORT];
            let weight = weights[0][a] * weights[1][b];
            let by_x = slopes[0][a] * weights[1][b];
            let by_y = weights[0][a] * slopes[1][b];
            for c in 0..SUPPORT {
                row[c].add(f, weight, &parts[0][c]);
                row[c].add(f, by_x, &parts[1][c]);
                row[c].add(f, by_y, &parts[2][c]);
            }
        }
    }
}
