//! The Gauss-Newton system of a step: a sum over hops, each of which sees three functions of time.

use rayon::prelude::*;

use crate::cell::Node;
use crate::conjugate::Linear;
use crate::real::{Fuse, Real};
use crate::scatter::{BLOCK, dot};
use crate::sequence::band::BandPreconditioner;
use crate::sequence::field::{ACTING, SequenceField, place, take};
use crate::system::HopTerms;

/// The terms of a hop, and the part of a vector and of its product that the hop sees.
struct OfHop<R: Real> {
    terms: HopTerms<R, 2>,
    from: Vec<Node<R, 2>>,
    product: Vec<Node<R, 2>>,
}

/// The terms of all hops, a ridge and the preconditioner.
pub(super) struct SequenceSystem<R: Real> {
    hops: Vec<OfHop<R>>,
    preconditioner: BandPreconditioner<R>,
    ridge: R,
    entries: usize,
}

impl<R: Real> SequenceSystem<R> {
    pub(super) fn new(field: &SequenceField<R>, terms: Vec<HopTerms<R, 2>>, ridge: f64) -> Self {
        let nodes = field.grid().size();
        let of_hop = |terms| OfHop {
            terms,
            from: vec![Node::ZERO; nodes],
            product: vec![Node::ZERO; nodes],
        };
        Self {
            preconditioner: BandPreconditioner::new(&terms, ridge, nodes),
            hops: terms.into_iter().map(of_hop).collect(),
            ridge: R::of(ridge),
            entries: field.entries(),
        }
    }

    /// Points of the band of all hops.
    pub(super) fn places_of_band(&self) -> usize {
        let each = self.hops.iter();
        each.map(|hop| hop.terms.priors.places.len()).sum()
    }

    /// The weight of half the squares of the coefficients.
    #[cfg(test)]
    pub(super) fn ridge(&self) -> R {
        self.ridge
    }

    /// The gradient of the objective by the coefficients.
    pub(super) fn gradient(&mut self, field: &SequenceField<R>) -> Vec<Node<R>> {
        self.hops.par_iter_mut().for_each(|hop| {
            hop.terms.gradient(&hop.from, R::ZERO, &mut hop.product);
        });
        let mut out = vec![Node::ZERO; field.nodes.len()];
        self.add_up(&field.nodes, &mut out);
        out
    }

    /// `out = ridge base + sum of what the hops hold`; gives `base . out`.
    fn add_up(&self, base: &[Node<R>], out: &mut [Node<R>]) -> f64 {
        let (entries, block) = (self.entries, self.block());
        let nodes = block / entries;
        let dots: Vec<f64> = out
            .par_chunks_mut(block)
            .zip(base.par_chunks(block))
            .enumerate()
            .map(|(number, (out, base))| {
                for (out, base) in out.iter_mut().zip(base) {
                    *out = base.scaled(self.ridge);
                }
                for (s, hop) in self.hops.iter().enumerate() {
                    let from = &hop.product[number * nodes..];
                    for (out, from) in out.chunks_exact_mut(entries).zip(from) {
                        for j in 0..ACTING {
                            let (entry, lane) = place(s + j);
                            for i in 0..3 {
                                out[entry].0[0][lane + i] += from.0[j / 2][4 * (j % 2) + i];
                            }
                        }
                    }
                }
                dot(base, out)
            })
            .collect();
        dots.iter().sum()
    }
}

impl<R: Real> Linear<R> for SequenceSystem<R> {
    fn block(&self) -> usize {
        (BLOCK / self.entries).max(1) * self.entries
    }

    fn product(&mut self, p: &[Node<R>], q: &mut [Node<R>]) -> f64 {
        let entries = self.entries;
        self.hops.par_iter_mut().enumerate().for_each(|(s, hop)| {
            take(p, entries, s, &mut hop.from);
            hop.terms.product(&hop.from, R::ZERO, &mut hop.product);
        });
        self.add_up(p, q)
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
