//! The linear blend of the two signed distance fields, `f(x, t) = (1 - t) g(x) + t h(x)`.
//!
//! `g` and `h` are two Implicit-Nets with their time held at 0, each fitted to its own end with the terms of
//! [`super::ends`]. The classical way of shape averaging (Payne and Toga, "Distance field manipulation of
//! surface models", 1992): it needs no correspondences, and it dissolves and regrows whatever moves by more
//! than its own thickness.

use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::ends::{self, EndSamples, EndWeights, Seen};
use super::renumbered;
use crate::backend::ModelBackend;
use crate::implicit_net::{ImplicitNet, ImplicitNetConfig};
use crate::morph::Geometry;
use crate::objective::Objective;
use crate::operators::{Derivatives, ImplicitJet, Operators};

/// What the parameters of the second network are numbered from.
const SECOND: u64 = 1000;

/// The shape of a [`SdfBlend`]: of both of its networks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SdfBlendConfig {
    /// Each network.
    pub implicit: ImplicitNetConfig,
}

impl SdfBlendConfig {
    /// Two networks with different weights and the same initial sphere.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> SdfBlend<B> {
        SdfBlend::new(
            self.implicit.init(seed, device),
            self.implicit.init(seed.wrapping_add(1), device),
        )
    }
}

/// The two distance fields `g` and `h`.
#[derive(Module, Debug)]
pub struct SdfBlend<B: Backend> {
    source: ImplicitNet<B>,
    target: ImplicitNet<B>,
}

impl<B: ModelBackend> SdfBlend<B> {
    /// Of two networks, whose parameters are each numbered from 1.
    fn new(source: ImplicitNet<B>, target: ImplicitNet<B>) -> Self {
        Self {
            source,
            target: renumbered(target, SECOND),
        }
    }

    /// `g`, the field of the source.
    pub fn source(&self) -> &ImplicitNet<B> {
        &self.source
    }

    /// `h`, the field of the target.
    pub fn target(&self) -> &ImplicitNet<B> {
        &self.target
    }

    /// `g` and `h` with their derivatives at `[n, 3]`; their rates mean nothing.
    pub fn end_jets(&self, x: Tensor<B, 2>, operators: &impl Operators) -> [ImplicitJet<B>; 2] {
        let t = Tensor::zeros([x.dims()[0], 1], &x.device());
        [&self.source, &self.target].map(|net| operators.implicit_jet(net, x.clone(), t.clone()))
    }

    /// `f`, `grad f` and `f_t = h - g` at `[n, 3]` and `[n, 1]`.
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

    /// The terms of [`super::ends`], each the mean of the two ends' own.
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
        ends::objective(&ends, weights)
    }
}

impl<B: ModelBackend> Geometry<B> for SdfBlend<B> {
    fn value(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let zeros = t.zeros_like();
        let g = self.source.forward(x.clone(), zeros.clone());
        let h = self.target.forward(x, zeros);
        between(g, h, t)
    }

    fn gradient(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.jet(x, t, &Derivatives::Forward).gradient
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
pub(crate) mod tests {
    use super::super::testing::{check_gradients, end_weights, radius, small, spheres, trained};
    use super::*;
    use crate::testing::{Plain, Train, column, host, points, shaken};

    /// A blend of two exact initial spheres.
    pub(crate) fn of_spheres<B: ModelBackend>(
        mut implicit: ImplicitNetConfig,
        radii: [f64; 2],
    ) -> SdfBlend<B> {
        let [source, target] = radii.map(|radius| {
            implicit.sphere_radius = radius;
            implicit.init(1, &Default::default())
        });
        SdfBlend::new(source, target)
    }

    #[test]
    fn the_gradient_of_every_term_reaches_the_weights_of_both_networks() {
        let implicit = small(5.0);
        let net: SdfBlend<Train> = SdfBlendConfig { implicit }.init(3, &Default::default());
        let (near, far) = (spheres(16, [0.3; 2]), spheres(24, [0.45; 2]));
        check_gradients(&shaken(net, 0.05), |net: &SdfBlend<Train>| {
            net.objective([&near, &far], &end_weights(), &Derivatives::Forward)
        });
    }

    #[test]
    fn each_network_learns_its_own_end_and_the_radius_changes_evenly_between() {
        let implicit = small(10.0);
        let net: SdfBlend<Train> = SdfBlendConfig { implicit }.init(5, &Default::default());
        let (near, far) = (spheres(96, [0.3; 2]), spheres(96, [0.45; 2]));
        let net = trained(net, 150, 5e-3, |net| {
            net.objective([&near, &far], &end_weights(), &Derivatives::Forward)
        });
        for (t, wanted) in [(0.0, 0.3), (0.5, 0.375), (1.0, 0.45)] {
            let got = radius(&net, t);
            // A tenth of the distance between the ends: the training is short.
            assert!((got - wanted).abs() < 0.015, "{got} at {t}");
        }
    }

    #[test]
    fn the_written_gradient_and_rate_are_those_of_the_value() {
        let net: SdfBlend<Plain> = shaken(of_spheres(small(5.0), [0.3, 0.5]), 0.2);
        let x = [[0.3, -0.2, 0.1], [-0.35, 0.15, 0.2]];
        let at = |x: &[[f64; 3]], t: f64| host(net.value(points(x), column(&[t; 2])));
        let jet = net.jet(points(&x), column(&[0.3; 2]), &Derivatives::Forward);
        let gradient = host(jet.gradient);
        let step = 5e-3;
        // Differences: 1e-7 / 1e-2 of rounding, and 1e-5 times a third derivative of size 10.
        for axis in 0..3 {
            let moved = |by: f64| {
                x.map(|mut point| {
                    point[axis] += by;
                    point
                })
            };
            let (ahead, behind) = (at(&moved(step), 0.3), at(&moved(-step), 0.3));
            for row in 0..2 {
                let (got, wanted) = (
                    gradient[3 * row + axis],
                    (ahead[row] - behind[row]) / (2.0 * step),
                );
                assert!((got - wanted).abs() < 1e-3, "{got}, wanted {wanted}");
            }
        }
        let (ahead, behind) = (at(&x, 0.8), at(&x, -0.2));
        for (row, rate) in host(jet.rate).into_iter().enumerate() {
            // Linear in time: f32 rounding only.
            assert!((rate - (ahead[row] - behind[row])).abs() < 2e-6);
        }
    }
}
