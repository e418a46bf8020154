//! The Gauss-Newton system of one step: products with its matrix, never assembled, and its gradient.

use crate::cell::Node;
use crate::conjugate::Linear;
use crate::ends::EndTerms;
use crate::field::SplineField;
use crate::preconditioner::{NodeBlocks, Preconditioner};
use crate::prior::PriorTerms;
use crate::real::{Fuse, Real};
use crate::scatter::{BLOCK, add_up};

/// The terms of one hop from a shape to the next.
pub(crate) struct HopTerms<R: Real, const H: usize> {
    pub ends: EndTerms<R, H>,
    pub priors: PriorTerms<R, H>,
    strides: [usize; 2],
}

impl<R: Real, const H: usize> HopTerms<R, H> {
    pub(crate) fn new(ends: EndTerms<R, H>, priors: PriorTerms<R, H>, strides: [usize; 2]) -> Self {
        Self {
            ends,
            priors,
            strides,
        }
    }

    /// Gives up the private copies of nodes, which take most of the memory, until the next use.
    pub(crate) fn release(&mut self) {
        self.ends.release();
        self.priors.release();
    }

    /// The diagonal blocks of the matrix, `P` sums for each node.
    pub(crate) fn blocks<const P: usize>(&self) -> NodeBlocks<R, P> {
        NodeBlocks::new(&self.ends, &self.priors, self.strides)
    }

    /// The gradient of the objective by the coefficients, and `ridge nodes`.
    pub(crate) fn gradient(&mut self, nodes: &[Node<R, H>], ridge: R, out: &mut [Node<R, H>]) {
        let (ends, priors, strides) = (&mut self.ends, &mut self.priors, self.strides);
        rayon::join(
            || ends.spread_residuals(strides),
            || priors.spread_gradient(strides),
        );
        add_up(&[ends.parts(), priors.parts()], nodes, ridge, out);
    }

    /// `q = A p + ridge p`; gives `p . q`.
    pub(crate) fn product(&mut self, p: &[Node<R, H>], ridge: R, q: &mut [Node<R, H>]) -> f64 {
        let (ends, priors, strides) = (&mut self.ends, &mut self.priors, self.strides);
        rayon::join(
            || {
                ends.move_ends(p, strides);
                ends.spread_moves(strides);
            },
            || priors.spread_product(p, strides),
        );
        add_up(&[ends.parts(), priors.parts()], p, ridge, q)
    }
}

/// The terms of one hop, a ridge and the preconditioner.
pub(crate) struct System<R: Real> {
    pub terms: HopTerms<R, 1>,
    preconditioner: Preconditioner<R>,
    ridge: R,
}

impl<R: Real> System<R> {
    pub(crate) fn new(field: &SplineField<R>, terms: HopTerms<R, 1>, ridge: f64) -> Self {
        Self {
            preconditioner: Preconditioner::new(&terms.blocks(), ridge, field.nodes.len()),
            terms,
            ridge: R::of(ridge),
        }
    }

    /// The weight of half the squares of the coefficients.
    #[cfg(test)]
    pub(crate) fn ridge(&self) -> R {
        self.ridge
    }

    /// The gradient of the objective by the coefficients.
    pub(crate) fn gradient(&mut self, field: &SplineField<R>) -> Vec<Node<R>> {
        let mut out = vec![Node::ZERO; field.nodes.len()];
        self.terms.gradient(&field.nodes, self.ridge, &mut out);
        out
    }
}

impl<R: Real> Linear<R> for System<R> {
    fn block(&self) -> usize {
        BLOCK
    }

    fn product(&mut self, p: &[Node<R>], q: &mut [Node<R>]) -> f64 {
        self.terms.product(p, self.ridge, q)
    }

    #[inline(always)]
    fn precondition<F: Fuse>(&self, f: F, start: usize, r: &[Node<R>], out: &mut [Node<R>]) {
        self.preconditioner.apply(f, start, r, out);
    }
}
