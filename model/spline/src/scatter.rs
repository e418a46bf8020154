//! Sums of many places into one grid, on all cores, with the same bits on any number of them.
//!
//! Places are sorted by cell and divided into even runs, [`chunks`]. A run touches only a contiguous range of
//! nodes, so that its private copy of them is small. The copies are added up in order.

use rayon::prelude::*;

use crate::basis::SUPPORT;
use crate::cell::{LANES, Node};
use crate::real::{Fuse, Kernel, Real, run};

/// Runs of places: also the most cores that share a pass. Of many key frames there are hops to share, and private
/// copies of nodes are what takes memory.
const fn chunks(halves: usize) -> usize {
    if halves == 1 { 16 } else { 4 }
}

/// Nodes that a thread adds up at a time.
pub(crate) const BLOCK: usize = 512;

/// A private copy of a range of nodes: what is summed for each.
pub(crate) struct Part<T> {
    /// The first node.
    pub start: usize,
    pub nodes: Vec<T>,
}

/// Places in a run, of so many in all.
pub(crate) fn run_length<const H: usize>(places: usize) -> usize {
    places.div_ceil(chunks(H)).max(1)
}

/// The private copies for places whose first nodes, sorted, are these.
pub(crate) fn parts<T: Clone, const H: usize>(
    firsts: &[u32],
    strides: [usize; 2],
    zero: &T,
) -> Vec<Part<T>> {
    let beyond = (SUPPORT - 1) * (strides[0] + strides[1] + 1) + 1;
    let part = |run: &[u32]| {
        let start = run[0] as usize;
        let end = run[run.len() - 1] as usize + beyond;
        Part {
            start,
            nodes: vec![zero.clone(); end - start],
        }
    };
    let length = run_length::<H>(firsts.len());
    firsts.chunks(length).map(part).collect()
}

impl<R: Real, const H: usize> Part<Node<R, H>> {
    /// The first node, and the nodes, cleared.
    #[inline(always)]
    pub(crate) fn cleared(&mut self) -> (usize, &mut [Node<R, H>]) {
        self.nodes.fill(Node::ZERO);
        (self.start, &mut self.nodes)
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
pub(crate) fn each_run<S: Send, T: Sync, const H: usize>(
    parts: &mut [Part<S>],
    places: &[T],
    spread: impl Fn(&mut Part<S>, &[T]) + Sync,
) {
    parts
        .par_iter_mut()
        .zip(places.par_chunks(run_length::<H>(places.len())))
        .for_each(|(part, places)| spread(part, places));
}

/// `out = base_factor base + sum of the parts`, and `base . out` in float64.
pub(crate) fn add_up<R: Real, const H: usize>(
    parts: &[&[Part<Node<R, H>>]],
    base: &[Node<R, H>],
    base_factor: R,
    out: &mut [Node<R, H>],
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

struct AddUp<'a, R, const H: usize> {
    parts: &'a [&'a [Part<Node<R, H>>]],
    base: &'a [Node<R, H>],
    base_factor: R,
    start: usize,
    out: &'a mut [Node<R, H>],
    dot: &'a mut f64,
}

impl<R: Real, const H: usize> Kernel for AddUp<'_, R, H> {
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
                    out.add(f, R::ONE, node);
                }
            }
        }
        *self.dot = dot(self.base, self.out);
    }
}

/// The nodes of a part from `start` to `end`.
pub(crate) fn overlap<T>(part: &Part<T>, start: usize, end: usize) -> (usize, usize) {
    (
        part.start.max(start),
        (part.start + part.nodes.len()).min(end),
    )
}

/// The scalar product, summed in float64.
#[inline(always)]
pub(crate) fn dot<R: Real, const H: usize>(a: &[Node<R, H>], b: &[Node<R, H>]) -> f64 {
    let mut sums = [[0.0; LANES]; H];
    for (a, b) in a.iter().zip(b) {
        for h in 0..H {
            for l in 0..LANES {
                sums[h][l] += a.0[h][l].wide() * b.0[h][l].wide();
            }
        }
    }
    sums.as_flattened().iter().sum()
}
