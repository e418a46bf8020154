//! The Gauss-Newton system of a step: a sum over hops, each of which sees three functions of time.

use rayon::prelude::*;

use crate::cell::Node;
use crate::conjugate::Linear;
use crate::real::{Fuse, Real};
use crate::scatter::{BLOCK, dot};
use crate::sequence::band::BandPreconditioner;
use crate::sequence::field::{ACTING, SequenceField, place, take};
use crate::system::HopTerms;

/// Hops that are worked on together: what they see of a vector, and give, is held for so many at a time.
const TOGETHER: usize = 16;

/// What a hop sees of a vector, and what it gives.
struct Seen<R> {
    from: Vec<Node<R, 2>>,
    product: Vec<Node<R, 2>>,
}

/// The terms of all hops, a ridge and the preconditioner.
pub(super) struct SequenceSystem<R: Real> {
    hops: Vec<HopTerms<R, 2>>,
    seen: Vec<Seen<R>>,
    preconditioner: BandPreconditioner<R>,
    ridge: R,
    entries: usize,
}

impl<R: Real> SequenceSystem<R> {
    pub(super) fn new(field: &SequenceField<R>, mut hops: Vec<HopTerms<R, 2>>, ridge: f64) -> Self {
        hops.iter_mut().for_each(HopTerms::release);
        let nodes = field.grid().size();
        let seen = |_| Seen {
            from: vec![Node::ZERO; nodes],
            product: vec![Node::ZERO; nodes],
        };
        Self {
            preconditioner: BandPreconditioner::new(&hops, ridge, nodes),
            seen: (0..TOGETHER.min(hops.len())).map(seen).collect(),
            hops,
            ridge: R::of(ridge),
            entries: field.entries(),
        }
    }

    /// Points of the band of all hops.
    pub(super) fn places_of_band(&self) -> usize {
        let each = self.hops.iter();
        each.map(|hop| hop.priors.places.len()).sum()
    }

    /// The weight of half the squares of the coefficients.
    #[cfg(test)]
    pub(super) fn ridge(&self) -> R {
        self.ridge
    }

    /// The gradient of the objective by the coefficients.
    pub(super) fn gradient(&mut self, field: &SequenceField<R>) -> Vec<Node<R>> {
        let mut out = vec![Node::ZERO; field.nodes.len()];
        self.sum(&field.nodes, &mut out, &|hop, seen| {
            hop.gradient(&seen.from, R::ZERO, &mut seen.product);
        });
        out
    }

    /// `out = ridge base + sum of what the hops give`, each given what it sees of `base`; gives `base . out`.
    fn sum(
        &mut self,
        base: &[Node<R>],
        out: &mut [Node<R>],
        give: &(impl Fn(&mut HopTerms<R, 2>, &mut Seen<R>) + Sync),
    ) -> f64 {
        let (entries, block, ridge) = (self.entries, self.block(), self.ridge);
        for (out, base) in out.iter_mut().zip(base) {
            *out = base.scaled(ridge);
        }
        for (batch, hops) in self.hops.chunks_mut(TOGETHER).enumerate() {
            let first = batch * TOGETHER;
            let seen = &mut self.seen[..hops.len()];
            hops.par_iter_mut()
                .zip(seen.par_iter_mut())
                .enumerate()
                .for_each(|(k, (hop, seen))| {
                    take(base, entries, first + k, &mut seen.from);
                    give(hop, seen);
                    hop.release();
                });
            let nodes = block / entries;
            out.par_chunks_mut(block)
                .enumerate()
                .for_each(|(number, out)| {
                    for (k, seen) in seen.iter().enumerate() {
                        let from = &seen.product[number * nodes..];
                        add(from, entries, first + k, out);
                    }
                });
        }
        let dots: Vec<f64> = out
            .par_chunks(block)
            .zip(base.par_chunks(block))
            .map(|(out, base)| dot(base, out))
            .collect();
        dots.iter().sum()
    }
}

/// Adds what hop `s` gives.
fn add<R: Real>(from: &[Node<R, 2>], entries: usize, s: usize, out: &mut [Node<R>]) {
    for (out, from) in out.chunks_exact_mut(entries).zip(from) {
        for j in 0..ACTING {
            let (entry, lane) = place(s + j);
            for i in 0..3 {
                out[entry].0[0][lane + i] += from.0[j / 2][4 * (j % 2) + i];
            }
        }
    }
}

impl<R: Real> Linear<R> for SequenceSystem<R> {
    fn block(&self) -> usize {
        (BLOCK / self.entries).max(1) * self.entries
    }

    fn product(&mut self, p: &[Node<R>], q: &mut [Node<R>]) -> f64 {
        self.sum(p, q, &|hop, seen| {
            hop.product(&seen.from, R::ZERO, &mut seen.product);
        })
    }

    #[inline(always)]
    fn precondition<F: Fuse>(&self, _: F, start: usize, r: &[Node<R>], out: &mut [Node<R>]) {
        let first = start / self.entries;
        let each = r.chunks_exact(self.entries);
        for (k, (r, out)) in each.zip(out.chunks_exact_mut(self.entries)).enumerate() {
            self.preconditioner.apply(first + k, r, out);
        }
    }
}
