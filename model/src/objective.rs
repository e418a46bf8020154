//! The objective: a weighted sum of terms, each of which has a name.
//!
//! `L = lambda_f L_f + lambda_v L_v + lambda_m L_m` in the paper (Eq. "total loss"); here every part
//! carries its own weight, so that all of them can be read, logged and tested one by one.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

/// One term: its name, its unweighted value `[1]`, and its weight.
#[derive(Clone, Debug)]
pub struct Term<B: Backend> {
    /// As in the recipe and in `metrics.jsonl`.
    pub name: &'static str,
    /// Unweighted.
    pub value: Tensor<B, 1>,
    /// 0 or more.
    pub weight: f64,
}

/// The terms of one step.
#[derive(Clone, Debug, Default)]
pub struct Objective<B: Backend> {
    terms: Vec<Term<B>>,
}

impl<B: Backend> Objective<B> {
    /// No terms yet.
    pub fn new() -> Self {
        Self { terms: Vec::new() }
    }

    /// Adds a term unless its weight is 0, in which case `value` is not called.
    pub fn add(&mut self, name: &'static str, weight: f64, value: impl FnOnce() -> Tensor<B, 1>) {
        if weight > 0.0 {
            self.terms.push(Term {
                name,
                value: value(),
                weight,
            });
        }
    }

    /// The terms, in the order in which they were added.
    pub fn terms(&self) -> &[Term<B>] {
        &self.terms
    }

    /// The weighted sum, `[1]`; `None` if there are no terms.
    pub fn total(&self) -> Option<Tensor<B, 1>> {
        let weighted = self
            .terms
            .iter()
            .map(|term| term.value.clone() * term.weight);
        weighted.reduce(|sum, term| sum + term)
    }

    /// Reads all unweighted values back to the host at once, in order.
    pub fn read(&self) -> Vec<f64> {
        if self.terms.is_empty() {
            return Vec::new();
        }
        // One transfer for all of them: each transfer waits until the device is done.
        let values = self
            .terms
            .iter()
            .map(|term| term.value.clone().detach())
            .collect();
        Tensor::cat(values, 0).into_data().iter::<f64>().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, host};

    #[test]
    fn the_total_is_the_weighted_sum_and_a_weight_of_zero_is_never_evaluated() {
        let one = |value: f32| Tensor::<Plain, 1>::from_floats([value], &Default::default());
        let mut objective = Objective::new();
        assert!(objective.total().is_none());
        objective.add("first", 2.0, || one(3.0));
        objective.add("absent", 0.0, || unreachable!("its weight is 0"));
        objective.add("second", 0.5, || one(4.0));
        assert_eq!(objective.read(), [3.0, 4.0]);
        assert_eq!(host(objective.total().expect("two terms")), [8.0]);
    }
}
