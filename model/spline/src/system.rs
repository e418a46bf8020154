//! The Gauss-Newton system of one step: products with its matrix, never assembled, and its gradient.

use crate::cell::Node;
use crate::ends::EndTerms;
use crate::field::SplineField;
use crate::preconditioner::Preconditioner;
use crate::prior::PriorTerms;
use crate::real::Real;
use crate::scatter::add_up;

/// The terms, a ridge and the preconditioner.
pub(crate) struct System<R: Real> {
    pub ends: EndTerms<R>,
    pub priors: PriorTerms<R>,
    preconditioner: Preconditioner<R>,
    ridge: R,
    strides: [usize; 2],
}

impl<R: Real> System<R> {
    pub(crate) fn new(
        field: &SplineField<R>,
        ends: EndTerms<R>,
        priors: PriorTerms<R>,
        ridge: f64,
    ) -> Self {
        let strides = field.grid().strides();
        let rates = field.time_basis().rates();
        let nodes = field.nodes.len();
        Self {
            preconditioner: Preconditioner::new(&ends, &priors, ridge, nodes, strides, rates),
            ends,
            priors,
            ridge: R::of(ridge),
            strides,
        }
    }

    pub(crate) fn preconditioner(&self) -> &Preconditioner<R> {
        &self.preconditioner
    }

    /// The weight of half the squares of the coefficients.
    #[cfg(test)]
    pub(crate) fn ridge(&self) -> R {
        self.ridge
    }

    /// The gradient of the objective by the coefficients.
    pub(crate) fn gradient(&mut self, field: &SplineField<R>) -> Vec<Node<R>> {
        let (ends, priors, strides) = (&mut self.ends, &mut self.priors, self.strides);
        rayon::join(
            || ends.spread_residuals(strides),
            || priors.spread_gradient(strides),
        );
        let mut out = vec![Node::ZERO; field.nodes.len()];
        let parts = [self.ends.parts(), self.priors.parts()];
        add_up(&parts, &field.nodes, self.ridge, &mut out);
        out
    }

    /// `q = A p`; gives `p . q`.
    pub(crate) fn product(&mut self, p: &[Node<R>], q: &mut [Node<R>]) -> f64 {
        let (ends, priors, strides) = (&mut self.ends, &mut self.priors, self.strides);
        rayon::join(
            || {
                ends.move_ends(p, strides);
                ends.spread_moves(strides);
            },
            || priors.spread_product(p, strides),
        );
        add_up(&[self.ends.parts(), self.priors.parts()], p, self.ridge, q)
    }
}
