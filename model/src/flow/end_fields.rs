//! The end fields: two signed distance fields `g(x)` and `h(x)`, of the source and of the target.
//!
//! Both are Implicit-Nets with their time held at 0, each fitted to its own shape with the terms of
//! [`super::end_terms`]. [`super::FlowGeometry`] carries them along `V`. At rest they give the linear blend
//! `f(x, t) = (1 - t) g(x) + t h(x)`, which is [`EndFields::jet`].
//!
//! Checkpoints hold the two networks under the names of the fields of [`EndFields`].

use burn::module::{Module, ParamId};
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::end_terms::{self, EndSamples, EndWeights, Seen};
use crate::autodiff::ModelBackend;
use crate::nets::{ImplicitNet, ImplicitNetConfig, apart, renumbered};
use crate::objective::Objective;
use crate::operators::{ImplicitJet, Operators};

/// What the parameters of the second network are numbered from. It stands in checkpoints.
const SECOND: u64 = 1000;

/// The shape of [`EndFields`]: of both of its networks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndFieldsConfig {
    /// Each network.
    pub implicit: ImplicitNetConfig,
}

impl EndFieldsConfig {
    /// Two networks with different weights and the same initial sphere.
    ///
    /// # Panics
    /// If a network has more than 1000 parameter tensors, two to a layer.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> EndFields<B> {
        EndFields::new(
            self.implicit.init(seed, device),
            self.implicit.init(seed.wrapping_add(1), device),
        )
    }
}

/// The field of key frame `k` of many: its parameters have numbers of their own.
pub fn end_field<B: ModelBackend>(
    implicit: ImplicitNetConfig,
    k: usize,
    seed: u64,
    device: &B::Device,
) -> ImplicitNet<B> {
    renumbered(
        implicit.init(seed.wrapping_add(k as u64), device),
        k as u64 * SECOND,
    )
}

/// The two signed distance fields `g` and `h`.
#[derive(Module, Debug)]
pub struct EndFields<B: Backend> {
    source: ImplicitNet<B>,
    target: ImplicitNet<B>,
}

impl<B: ModelBackend> EndFields<B> {
    /// Of two networks, whose parameters are each numbered from 1.
    pub(crate) fn new(source: ImplicitNet<B>, target: ImplicitNet<B>) -> Self {
        let ends = Self {
            source,
            target: renumbered(target, SECOND),
        };
        apart(ends, "EndFields")
    }

    /// Of the networks of two key frames, whose parameters have different numbers already ([`end_field`]).
    pub fn beside(source: ImplicitNet<B>, target: ImplicitNet<B>) -> Self {
        apart(Self { source, target }, "EndFields")
    }

    /// `g`, the field of the source.
    pub fn source(&self) -> &ImplicitNet<B> {
        &self.source
    }

    /// `h`, the field of the target.
    pub fn target(&self) -> &ImplicitNet<B> {
        &self.target
    }

    /// The weight matrices between two hidden layers, of both networks.
    pub fn hidden_weights(&self) -> Vec<ParamId> {
        let nets = [&self.source, &self.target].into_iter();
        nets.flat_map(ImplicitNet::hidden_weights).collect()
    }

    /// `g` and `h` with their derivatives at `[n, 3]`; their rates mean nothing.
    pub fn end_jets(&self, x: Tensor<B, 2>, operators: &impl Operators) -> [ImplicitJet<B>; 2] {
        let t = Tensor::zeros([x.dims()[0], 1], &x.device());
        [&self.source, &self.target].map(|net| operators.implicit_jet(net, x.clone(), t.clone()))
    }

    /// `f`, `grad f` and `f_t = h - g` of the linear blend, at `[n, 3]` and `[n, 1]`.
    pub fn jet(
        &self,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        operators: &impl Operators,
    ) -> ImplicitJet<B> {
        let [g, h] = self.end_jets(x, operators);
        ImplicitJet {
            rate: h.value.clone() - g.value.clone(),
            value: between(g.value, h.value, t.clone()),
            gradient: between(g.gradient, h.gradient, t),
        }
    }

    /// The terms of [`super::end_terms`], each the mean of the two ends' own.
    ///
    /// `samples`: those of the source and those of the target. Their times are not read.
    pub fn objective(
        &self,
        samples: [&EndSamples<B>; 2],
        weights: &EndWeights,
        operators: &impl Operators,
    ) -> Objective<B> {
        let seen = |net: &ImplicitNet<B>, samples| {
            let (x, t) = EndSamples::all(samples);
            let jet = operators.implicit_jet(net, x, t.zeros_like());
            Seen { samples, jet }
        };
        let ends = [
            seen(&self.source, samples[0]),
            seen(&self.target, samples[1]),
        ];
        end_terms::objective(&ends, weights)
    }
}

/// `(1 - t) g + t h`; `t`: `[n, 1]`.
pub(crate) fn between<B: Backend>(
    g: Tensor<B, 2>,
    h: Tensor<B, 2>,
    t: Tensor<B, 2>,
) -> Tensor<B, 2> {
    g * (-t.clone() + 1.0) + h * t
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::autodiff::Activation;
    use crate::operators::Derivatives;
    use crate::testing::learning::{check_gradients, end_weights, small, spheres};
    use crate::testing::{Plain, Train, shaken};

    #[test]
    fn the_gradient_of_every_term_reaches_the_weights_of_both_networks() {
        let implicit = small(5.0);
        let net: EndFields<Train> = EndFieldsConfig { implicit }.init(3, &Default::default());
        let (near, far) = (spheres(16, [0.3; 2]), spheres(24, [0.45; 2]));
        check_gradients(&shaken(net, 0.05), |net: &EndFields<Train>| {
            net.objective([&near, &far], &end_weights(), &Derivatives::Forward)
        });
    }

    #[test]
    #[should_panic(expected = "EndFields: two parameters have the number 1001")]
    fn networks_of_more_layers_than_there_are_numbers_for_are_refused() {
        let mut implicit = small(5.0);
        implicit.activation = Activation::Sine { omega: 1.0 };
        (implicit.depth, implicit.width) = (500, 1);
        EndFieldsConfig { implicit }.init::<Plain>(3, &Default::default());
    }
}
