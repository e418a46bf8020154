//! The plain network `f(x, t)` fitted at t = 0 and t = 1: what lies between is what the perceptron makes of
//! it ("MLP" in the paper's comparison, Section 5).
//!
//! The terms are those of [`end_terms`]; nothing is said about the times between, and nothing moves.

use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::autodiff::ModelBackend;
use crate::flow::Geometry;
use crate::flow::end_terms::{self, EndSamples, EndWeights, Seen};
use crate::nets::{ImplicitNet, ImplicitNetConfig};
use crate::objective::Objective;
use crate::operators::{Derivatives, Operators};

/// The shape of a [`PlainMlp`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlainMlpConfig {
    /// The network.
    pub implicit: ImplicitNetConfig,
}

impl PlainMlpConfig {
    /// A network whose zero set is its initial sphere at all times.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> PlainMlp<B> {
        PlainMlp {
            net: self.implicit.init(seed, device),
        }
    }
}

/// `f(x, t)`, fitted at the ends only.
#[derive(Module, Debug)]
pub struct PlainMlp<B: Backend> {
    /// The network.
    pub net: ImplicitNet<B>,
}

impl<B: ModelBackend> PlainMlp<B> {
    /// The terms "data", "normals", "eikonal" and "off-surface" of [`end_terms`].
    pub fn objective(
        &self,
        samples: &EndSamples<B>,
        weights: &EndWeights,
        operators: &impl Operators,
    ) -> Objective<B> {
        let (x, t) = samples.all();
        let jet = operators.implicit_jet(&self.net, x, t);
        end_terms::objective(&[Seen { samples, jet }], weights)
    }
}

impl<B: ModelBackend> Geometry<B> for PlainMlp<B> {
    fn value(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.net.forward(x, t)
    }

    fn gradient(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        Derivatives::Forward.implicit_jet(&self.net, x, t).gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::learning::{check_gradients, end_weights, radius, small, spheres, trained};
    use crate::testing::{Train, shaken};

    #[test]
    fn the_gradient_of_every_term_reaches_the_weights() {
        let implicit = small(5.0);
        let net: PlainMlp<Train> = PlainMlpConfig { implicit }.init(3, &Default::default());
        let samples = spheres(16, [0.3, 0.45]);
        check_gradients(&shaken(net, 0.05), |net: &PlainMlp<Train>| {
            net.objective(&samples, &end_weights(), &Derivatives::Forward)
        });
    }

    #[test]
    fn it_learns_both_ends() {
        let implicit = small(10.0);
        let net: PlainMlp<Train> = PlainMlpConfig { implicit }.init(5, &Default::default());
        let samples = spheres(128, [0.3, 0.45]);
        let net = trained(net, 200, 5e-3, |net| {
            net.objective(&samples, &end_weights(), &Derivatives::Forward)
        });
        for (t, wanted) in [(0.0, 0.3), (1.0, 0.45)] {
            let got = radius(&net, t);
            // A tenth of the distance between the ends: the training is short.
            assert!((got - wanted).abs() < 0.015, "{got} at {t}");
        }
    }
}
