//! `f(x, t) = (1 - t) g(flow(x; t -> 0)) + t h(flow(x; t -> 1))`.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::coupling::CarriedJet;
use super::flow::CouplingFlow;
use crate::autodiff::ModelBackend;
use crate::flow::end_fields::between;
use crate::flow::{Carried, EndFields, Geometry};
use crate::operators::reverse;

/// How exact positions at both ends have to be, in normalised units, where they are interpolated.
const TOLERANCE: f64 = 1e-3;

/// The end fields and the flow between them.
#[derive(Debug)]
pub struct EfisGeometry<B: Backend> {
    ends: EndFields<B>,
    flow: CouplingFlow<B>,
}

impl<B: ModelBackend> EfisGeometry<B> {
    /// Of trained networks.
    pub fn new(ends: EndFields<B>, flow: CouplingFlow<B>) -> Self {
        Self { ends, flow }
    }

    /// `f` from where points are at time 0 and at time 1, `[n, 3]` each.
    fn blend(&self, ends: [Tensor<B, 2>; 2], t: Tensor<B, 2>) -> Tensor<B, 2> {
        let [start, end] = ends;
        let zeros = t.zeros_like();
        let g = self.ends.source().forward(start, zeros.clone());
        between(g, self.ends.target().forward(end, zeros), t)
    }
}

impl<B: ModelBackend> Geometry<B> for EfisGeometry<B> {
    fn value(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.blend(self.flow.to_both_ends(x, t.clone()), t)
    }

    /// The gradient of each end field, pulled back through the flow.
    fn gradient(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let z = self.flow.inverse_jet(CarriedJet::start(x), t.clone());
        let [g, h] = [(self.ends.source(), 0.0), (self.ends.target(), 1.0)].map(|(net, end)| {
            let there = self.flow.forward_jet(z.clone(), t.full_like(end));
            let jet = reverse::implicit_jet(net, there.value.clone(), t.zeros_like());
            there.pulled_back(jet.gradient)
        });
        between(g, h, t)
    }

    fn carried(&self) -> Option<&dyn Carried<B>> {
        Some(self)
    }
}

impl<B: ModelBackend> Carried<B> for EfisGeometry<B> {
    fn tolerance(&self) -> f64 {
        TOLERANCE
    }

    fn ends(&self, x: Tensor<B, 2>, time: f64) -> Tensor<B, 2> {
        let t = Tensor::full([x.dims()[0], 1], time, &x.device());
        Tensor::cat(self.flow.to_both_ends(x, t).into(), 1)
    }

    fn value_from(&self, ends: Tensor<B, 2>, time: f64) -> Tensor<B, 2> {
        let [n, _] = ends.dims();
        let (start, end) = (ends.clone().slice([0..n, 0..3]), ends.slice([0..n, 3..6]));
        let t = Tensor::full([n, 1], time, &start.device());
        self.blend([start, end], t)
    }
}
