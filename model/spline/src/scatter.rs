//! Sums of many places into one grid, on all cores, with the same bits on any number of them.
//!
//! Places are sorted by cell and divided into [`CHUNKS`] even runs. A run touches only a contiguous range of
//! nodes, so that its private copy of them is small. The copies are added up in order.

use rayon::prelude::*;

use crate::basis::SUPPORT;
use crate::cell::Node;
use crate::real::{Fuse, Kernel, Real, run};

/// Runs of places: also the most cores that share a pass.
pub(crate) const CHUNKS: usize = 16;

/// Nodes that a thread adds up at a time.
pub(crate) const BLOCK: usize = 512;

/// A private copy of a range of nodes, `N` vectors for each.
pub(crate) struct Part<R, const N: usize> {
    /// The first node.
    pub start: usize,
    pub nodes: Vec<[Node<R>; N]>,
}

/// Places in a run, of so many in all.
pub(crate) fn run_length(places: usize) -> usize {
    places.div_ceil(CHUNKS).max(1)
}

/// The private copies for places whose first nodes, sorted, are these.
pub(crate) fn parts<R: Real, const N: usize>(
    firsts: &[u32],
    strides: [usize; 2],
) -> Vec<Part<R, N>> {
    let beyond = (SUPPORT - 1) * (strides[0] + strides[1] + 1) + 1;
    let part = |run: &[u32]| {
        let start = run[0] as usize;
        let end = run[run.len() - 1] as usize + beyond;
        Part {
            start,
            nodes: vec![[Node::ZERO; N]; end - start],
        }
    };
    firsts.chunks(run_length(firsts.len())).map(part).collect()
}

impl<R: Real> Part<R, 1> {
    /// The first node, and the nodes, cleared.
    #[inline(always)]
    pub(crate) fn cleared(&mut self) -> (usize, &mut [Node<R>]) {
        let nodes = self.nodes.as_flattened_mut();
        nodes.fill(Node::ZERO);
        (self.start, nodes)
    }
}

/// The numbers of places with their first nodes, in the order of these.
pub(crate) fn by_first(firsts: impl Iterator<Item = u32>) -> Vec<(u32, u32)> {
    let numbered = firsts.zip(0..);
    let mut order: Vec<(u32, u32)> = numbered.collect();
    order.sort_unstable();
    order
}

/// Gives each run of sorted places to `spread`, with its private copy of the nodes, on all cores.
pub(crate) fn each_run<R: Real, T: Sync, const N: usize>(
    parts: &mut [Part<R, N>],
    places: &[T],
    spread: impl Fn(&mut Part<R, N>, &[T]) + Sync,
) {
    parts
        .par_iter_mut()
        .zip(places.par_chunks(run_length(places.len())))
        .for_each(|(part, places)| spread(part, places));
}

/// `out = base_factor base + sum of the parts`, and `base . out` in float64.
pub(crate) fn add_up<R: Real>(
    parts: &[&[Part<R, 1>]],
    base: &[Node<R>],
    base_factor: R,
    out: &mut [Node<R>],
) -> f64 {
    let dots: Vec<f64> = out
        .par_chunks_mut(BLOCK)
        .zip(base.par_chunks(BLOCK))
        .enumerate()
        .map(|(block, (out, base))| {
            let mut dot = 0.0;
            run(AddUp {
                parts,
                base,
                base_factor,
                start: block * BLOCK,
                out,
                dot: &mut dot,
            });
            dot
        })
        .collect();
    dots.iter().sum()
}

struct AddUp<'a, R> {
    parts: &'a [&'a [Part<R, 1>]],
    base: &'a [Node<R>],
    base_factor: R,
    start: usize,
    out: &'a mut [Node<R>],
    dot: &'a mut f64,
}

impl<R: Real> Kernel for AddUp<'_, R> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        for (out, base) in self.out.iter_mut().zip(self.base) {
            *out = base.scaled(self.base_factor);
        }
        for part in self.parts.iter().flat_map(|parts| parts.iter()) {
            let end = self.start + self.out.len();
            let (from, to) = overlap(part, self.start, end);
            if from < to {
                let here = &mut self.out[from - self.start..to - self.start];
                let there = &part.nodes[from - part.start..to - part.start];
                for (out, node) in here.iter_mut().zip(there) {
                    out.add(f, R::ONE, &node[0]);
                }
            }
        }
        *self.dot = dot(self.base, self.out);
    }
}

/// The nodes of a part from `start` to `end`.
pub(crate) fn overlap<R, const N: usize>(
    part: &Part<R, N>,
    start: usize,
    end: usize,
) -> (usize, usize) {
    (
        part.start.max(start),
        (part.start + part.nodes.len()).min(end),
    )
}

/// The scalar product, summed in float64.
#[inline(always)]
pub(crate) fn dot<R: Real>(a: &[Node<R>], b: &[Node<R>]) -> f64 {
    let mut sums = [0.0; crate::cell::LANES];
    for (a, b) in a.iter().zip(b) {
        for l in 0..crate::cell::LANES {
            sums[l] += a.0[l].wide() * b.0[l].wide();
        }
    }
    sums.iter().sum()
}
