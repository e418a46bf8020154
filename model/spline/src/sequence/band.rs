//! The inverse of the Gauss-Newton matrix' diagonal blocks, one for each node, over all functions of time.
//!
//! Only functions that act in the same interval meet, so that the block of a node is a band: row `3 k + i` of
//! function `k` and axis `i` reaches back to function `k - 2`. Its Cholesky factor has the same band.

use rayon::prelude::*;

use crate::cell::{LANES, Node};
use crate::preconditioner::{LANE_OF, LIFT, NodeBlocks};
use crate::real::Real;
use crate::scatter::BLOCK;
use crate::sequence::field::{ACTING, place};
use crate::system::HopTerms;

/// Pairs of functions that act in the same interval.
const PAIRS: usize = 6;
/// The sum of a pair of functions.
const SUM_OF: [[usize; ACTING]; ACTING] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];
/// Entries of a row before the diagonal.
const WIDTH: usize = 3 * ACTING - 1;

/// Numbers of a symmetric 3 x 3 matrix.
const NUMBERS: usize = 6;

/// The sums of a node.
type Packed<R> = [[R; NUMBERS]; PAIRS];

/// The sums of those nodes on which a hop acts.
struct HopSums<R> {
    /// The nodes, ascending.
    nodes: Vec<u32>,
    sums: Vec<Packed<R>>,
}

impl<R: Real> HopSums<R> {
    fn new(blocks: &NodeBlocks<R, PAIRS>, nodes: usize) -> Self {
        let mut out = Self {
            nodes: Vec::new(),
            sums: Vec::new(),
        };
        for start in (0..nodes).step_by(BLOCK) {
            let sums = blocks.sums(start, BLOCK.min(nodes - start));
            for (k, sums) in sums.into_iter().enumerate() {
                if sums.as_flattened().iter().any(|x| *x != 0.0) {
                    out.nodes.push((start + k) as u32);
                    out.sums.push(sums.map(packed));
                }
            }
        }
        out
    }

    /// The sums of a node, if the hop acts on it.
    fn of(&self, node: usize) -> Option<&Packed<R>> {
        let found = self.nodes.binary_search(&(node as u32));
        found.ok().map(|at| &self.sums[at])
    }
}

fn packed<R: Real>(sums: [f64; LANES]) -> [R; NUMBERS] {
    let [a, b, c, d, e, f, ..] = sums;
    [a, b, c, d, e, f].map(R::of)
}

/// A row of a factor: the entries before the diagonal, and one over the diagonal.
type Row<R> = [R; WIDTH + 1];

/// Factors of the blocks of those nodes on which something acts.
pub(super) struct BandPreconditioner<R> {
    /// Of each node its factor.
    slots: Vec<u32>,
    rows: Vec<Row<R>>,
    size: usize,
}

/// Of nodes on which nothing acts.
const NONE: u32 = u32::MAX;

impl<R: Real> BandPreconditioner<R> {
    pub(super) fn new(hops: &[HopTerms<R, 2>], ridge: f64, nodes: usize) -> Self {
        let size = 3 * (hops.len() + ACTING - 1);
        // Those of one hop take several times what is left of them.
        let sums: Vec<HopSums<R>> = hops
            .par_iter()
            .map(|hop| HopSums::new(&hop.blocks(), nodes))
            .collect();
        let found: Vec<Vec<Option<Vec<Row<R>>>>> = (0..nodes.div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                let start = block * BLOCK;
                let end = nodes.min(start + BLOCK);
                let at = |node: usize| {
                    let hops = sums.iter().enumerate();
                    let acting = hops.filter_map(|(s, sums)| Some((s, sums.of(node)?)));
                    factor(acting, size, ridge)
                };
                (start..end).map(at).collect()
            })
            .collect();
        drop(sums);
        let acting = found.iter().flatten().flatten().count();
        let (mut slots, mut rows) = (Vec::with_capacity(nodes), Vec::with_capacity(acting * size));
        let mut used = 0;
        for of_node in found.into_iter().flatten() {
            match of_node {
                None => slots.push(NONE),
                Some(factor) => {
                    slots.push(used);
                    used += 1;
                    rows.extend(factor);
                }
            }
        }
        Self { slots, rows, size }
    }

    /// `out = P r` for a node.
    #[inline(always)]
    pub(super) fn apply(&self, node: usize, r: &[Node<R>], out: &mut [Node<R>]) {
        out.fill(Node::ZERO);
        let slot = self.slots[node];
        if slot == NONE {
            return;
        }
        let rows = &self.rows[slot as usize * self.size..][..self.size];
        let at = |row: usize| {
            let (entry, lane) = place(row / 3);
            (entry, lane + row % 3)
        };
        for (i, row) in rows.iter().enumerate() {
            let (entry, lane) = at(i);
            let mut sum = r[entry].0[0][lane];
            for back in 1..=WIDTH.min(i) {
                let (entry, lane) = at(i - back);
                sum -= row[WIDTH - back] * out[entry].0[0][lane];
            }
            out[entry].0[0][lane] = sum * row[WIDTH];
        }
        for (i, row) in rows.iter().enumerate().rev() {
            let (entry, lane) = at(i);
            let value = out[entry].0[0][lane] * row[WIDTH];
            out[entry].0[0][lane] = value;
            for back in 1..=WIDTH.min(i) {
                let (entry, lane) = at(i - back);
                out[entry].0[0][lane] -= row[WIDTH - back] * value;
            }
        }
    }
}

/// The Cholesky factor of a node's block; none where nothing acts on the node.
fn factor<'a, R: Real>(
    hops: impl Iterator<Item = (usize, &'a Packed<R>)>,
    size: usize,
    ridge: f64,
) -> Option<Vec<Row<R>>> {
    let mut band = vec![[0.0; WIDTH + 1]; size];
    let mut trace = 0.0;
    for (s, sums) in hops {
        for a in 0..3 * ACTING {
            for b in 0..=a {
                let value = sums[SUM_OF[a / 3][b / 3]][LANE_OF[a % 3][b % 3]].wide();
                band[3 * s + a][WIDTH - (a - b)] += value;
                if a == b {
                    trace += value;
                }
            }
        }
    }
    if trace == 0.0 {
        return None;
    }
    let lift = ridge + LIFT * trace / size as f64;
    for i in 0..size {
        band[i][WIDTH] += lift;
        for back in (0..=WIDTH.min(i)).rev() {
            let j = i - back;
            let mut sum = band[i][WIDTH - back];
            // Columns that both rows have.
            for k in (i - WIDTH.min(i))..j {
                sum -= band[i][WIDTH - (i - k)] * inner(&band, j, k);
            }
            band[i][WIDTH - back] = match back {
                // Positive but for rounding.
                0 => 1.0 / sum.max(lift).sqrt(),
                _ => sum * band[j][WIDTH],
            };
        }
    }
    let narrow = |row: Row<f64>| row.map(R::of);
    Some(band.into_iter().map(narrow).collect())
}

/// Entry `k` of row `j`, `k < j`; zero before its band.
fn inner(band: &[Row<f64>], j: usize, k: usize) -> f64 {
    if j - k > WIDTH {
        0.0
    } else {
        band[j][WIDTH - (j - k)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_solves_its_block() {
        // Two hops, four functions, sums that are those of random places.
        let mut state = 1u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / f64::from(1u32 << 24) - 0.5
        };
        let mut sums = [[[0.0; LANES]; PAIRS]; 2];
        let mut dense = [[0.0; 12]; 12];
        for (s, sums) in sums.iter_mut().enumerate() {
            for _ in 0..20 {
                let g: [f64; 3] = [random(), random(), random()];
                let t: [f64; 3] = [random(), random(), random()];
                for a in 0..9 {
                    for b in 0..9 {
                        let value = t[a / 3] * t[b / 3] * g[a % 3] * g[b % 3];
                        dense[3 * s + a][3 * s + b] += value;
                        if a / 3 <= b / 3 && a % 3 <= b % 3 {
                            sums[SUM_OF[a / 3][b / 3]][LANE_OF[a % 3][b % 3]] += value;
                        }
                    }
                }
            }
        }
        let ridge = 0.1;
        let sums: Vec<Packed<f64>> = sums.iter().map(|sums| sums.map(packed)).collect();
        let rows = factor::<f64>(sums.iter().enumerate(), 12, ridge).expect("something acts");
        let preconditioner = BandPreconditioner {
            slots: vec![0],
            rows,
            size: 12,
        };
        let mut r = vec![Node::<f64>::ZERO; 2];
        for k in 0..4 {
            let (entry, lane) = place(k);
            for i in 0..3 {
                r[entry].0[0][lane + i] = random();
            }
        }
        let mut x = vec![Node::ZERO; 2];
        preconditioner.apply(0, &r, &mut x);
        let flat = |v: &[Node<f64>], row: usize| {
            let (entry, lane) = place(row / 3);
            v[entry].0[0][lane + row % 3]
        };
        let trace: f64 = (0..12).map(|i| dense[i][i]).sum();
        for i in 0..12 {
            dense[i][i] += ridge + LIFT * trace / 12.0;
            let product: f64 = (0..12).map(|j| dense[i][j] * flat(&x, j)).sum();
            assert!((product - flat(&r, i)).abs() < 1e-12, "row {i}");
        }
    }
}
