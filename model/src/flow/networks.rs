//! What is trained as what it can do: `f(x, t)` gives a surface, `V(x, t)` moves points, a network or a spline.

use burn::tensor::Tensor;

use super::morph::{Geometry, Motion, follow};
use crate::autodiff::ModelBackend;
use crate::nets::{ImplicitNet, IntervalVelocity, SplineVelocity, VelocityNet};
use crate::operators::reverse;

impl<B: ModelBackend> Geometry<B> for ImplicitNet<B> {
    fn value(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.forward(x, t)
    }

    /// By the written-out reverse sweep: exact, and the only way on a backend without autodiff.
    fn gradient(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        reverse::implicit_jet(self, x, t).gradient
    }
}

/// A velocity field moves points along itself.
macro_rules! moves_points {
    ($($velocity:ident),+) => {$(
        impl<B: ModelBackend> Motion<B> for $velocity<B> {
            fn carry(&self, x: Tensor<B, 2>, from: f64, to: f64) -> Tensor<B, 2> {
                follow(|x, t| self.forward(x, t), x, from, to)
            }

            fn velocity(&self, x: Tensor<B, 2>, time: f64) -> Option<Tensor<B, 2>> {
                let t = Tensor::full([x.dims()[0], 1], time, &x.device());
                Some(self.forward(x, t))
            }
        }
    )+};
}

moves_points!(VelocityNet, IntervalVelocity, SplineVelocity);
