//! The terms that train the flow, with the end fields as constants.
//!
//! ```text
//! data       mean F(y)^2                     y = flow(x; s -> 1 - s), x on the shape of time s, F the other's field
//! normals    mean (1 - <n, m>)               n of the own field at x, m of J^T grad F(y)
//! signs      mean cross entropy of the sign of the own field at x and of 5 F(y), x in space
//! speed      mean |d Phi_t/dt|^2             of what is at x at time s, t a random time
//! isometry   mean |J J^T - I|^2              J of flow(x; s -> t)
//! volume     mean (log |det J|)^2
//! landmarks  mean |flow(x_0; 0 -> 1) - x_1|^2
//! ```

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::coupling::CarriedJet;
use super::flow::CouplingFlow;
use crate::autodiff::{Activation, ModelBackend};
use crate::flow::{EndFields, EndSamples};
use crate::objective::Objective;
use crate::operators::{ImplicitJet, Operators};

/// What distances are multiplied by before they count as the logarithm of odds.
const SHARPNESS: f64 = 5.0;

/// The weight of each term; 0 leaves it out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EfisWeights {
    /// The other shape's field on arrival.
    pub data: f64,
    /// Agreement of normals on arrival.
    pub normals: f64,
    /// Agreement of inside and outside.
    pub signs: f64,
    /// How fast points move.
    pub speed: f64,
    /// How lengths change.
    pub isometry: f64,
    /// How volumes change.
    pub volume: f64,
    /// Known correspondences.
    pub landmarks: f64,
}

impl Default for EfisWeights {
    /// The source's; that of the landmarks is ours.
    fn default() -> Self {
        Self {
            data: 1e4,
            normals: 1e2,
            signs: 1e2,
            speed: 10.0,
            isometry: 10.0,
            volume: 1.0,
            landmarks: 1e4,
        }
    }
}

/// The samples of a step.
#[derive(Clone, Debug)]
pub struct EfisSamples<B: Backend> {
    /// Those of the source and those of the target; their normals and distances are not read.
    pub ends: [EndSamples<B>; 2],
    /// A random time for each point on the surfaces, the source's first, `[n, 1]`.
    pub times: Tensor<B, 2>,
    /// Corresponding places of both shapes, `[m, 3]` each, if any are known.
    pub landmarks: Option<[Tensor<B, 2>; 2]>,
}

/// The objective of the flow. `ends` has to be untracked (`no_grad`).
pub fn objective<B: ModelBackend>(
    flow: &CouplingFlow<B>,
    ends: &EndFields<B>,
    samples: &EfisSamples<B>,
    weights: &EfisWeights,
    operators: &impl Operators,
) -> Objective<B> {
    let [source, target] = &samples.ends;
    let both = |read: fn(&EndSamples<B>) -> &Tensor<B, 2>| {
        Tensor::cat(vec![read(source).clone(), read(target).clone()], 0)
    };
    let fields = Fields { ends, operators };
    let (x, s) = (both(|end| &end.surface), both(|end| &end.surface_times));
    let mut objective = Objective::new();
    let start = flow.inverse_jet(CarriedJet::start(x.clone()), s.clone());
    if weights.data > 0.0 || weights.normals > 0.0 {
        let there = flow.forward_jet(start.clone(), -s + 1.0);
        let other = fields.of_the_other(there.value.clone(), source.surface.dims()[0]);
        objective.add("data", weights.data, || {
            (other.value.clone() * other.value.clone()).mean()
        });
        objective.add("normals", weights.normals, || {
            let own = fields.own(x, source.surface.dims()[0]).normal().detach();
            let pulled = there.pulled_back(other.gradient.clone());
            let cosine = (own * pulled.clone()).sum_dim(1) / crate::operators::length(pulled);
            (-cosine + 1.0).mean()
        });
    }
    objective.add("signs", weights.signs, || {
        let (x, s) = (both(|end| &end.space), both(|end| &end.space_times));
        let half = source.space.dims()[0];
        let outside = fields
            .own(x.clone(), half)
            .value
            .detach()
            .greater_elem(0.0)
            .float();
        let there = flow.between(x, s.clone(), -s + 1.0);
        let odds = fields.of_the_other(there, half).value * SHARPNESS;
        cross_entropy(odds, outside)
    });
    if weights.speed > 0.0 || weights.isometry > 0.0 || weights.volume > 0.0 {
        let there = flow.forward_jet_with_rate(start, samples.times.clone());
        objective.add("speed", weights.speed, || {
            let rate = there.rate();
            (rate.clone() * rate).sum_dim(1).mean()
        });
        objective.add("isometry", weights.isometry, || isometry(&there));
        objective.add("volume", weights.volume, || {
            (there.log_det.clone() * there.log_det.clone()).mean()
        });
    }
    if let Some([from, to]) = samples.landmarks.clone() {
        objective.add("landmarks", weights.landmarks, || {
            let s = Tensor::zeros([from.dims()[0], 1], &from.device());
            let off = flow.between(from, s.clone(), s + 1.0) - to;
            (off.clone() * off).sum_dim(1).mean()
        });
    }
    objective
}

/// `mean log(1 + exp(z)) - y z`, the cross entropy of `y` (0 or 1) and of the logistic function of `z`, `[1]`.
fn cross_entropy<B: ModelBackend>(z: Tensor<B, 2>, y: Tensor<B, 2>) -> Tensor<B, 1> {
    let softplus = Activation::Softplus { beta: 1.0 };
    let none = Tensor::zeros([1, 1], &z.device());
    (softplus.value_and_slope(z.clone(), none).0 - y * z).mean()
}

/// `mean |J J^T - I|^2`, the squares of all nine entries added, `[1]`.
pub fn isometry<B: Backend>(jet: &CarriedJet<B>) -> Tensor<B, 1> {
    let n = jet.value.dims()[0];
    let row = |i: usize| jet.rows[i].clone().slice([0..n, 0..3]);
    let entry = |i: usize, k: usize| (row(i) * row(k)).sum_dim(1);
    let squared = |tensor: Tensor<B, 2>| tensor.clone() * tensor;
    let diagonal = |i: usize| squared(entry(i, i) - 1.0);
    let apart = |i: usize, k: usize| squared(entry(i, k)) * 2.0;
    let sum = diagonal(0) + diagonal(1) + diagonal(2) + apart(0, 1) + apart(0, 2) + apart(1, 2);
    sum.mean()
}

/// The fields of the ends at points of which the first are the source's.
struct Fields<'a, B: Backend, O> {
    ends: &'a EndFields<B>,
    operators: &'a O,
}

impl<B: ModelBackend, O: Operators> Fields<'_, B, O> {
    /// That of the shape that each point is of.
    fn own(&self, x: Tensor<B, 2>, of_source: usize) -> ImplicitJet<B> {
        self.apart(x, of_source, [0, 1])
    }

    /// That of the shape that each point is carried to.
    fn of_the_other(&self, x: Tensor<B, 2>, of_source: usize) -> ImplicitJet<B> {
        self.apart(x, of_source, [1, 0])
    }

    fn apart(&self, x: Tensor<B, 2>, of_source: usize, nets: [usize; 2]) -> ImplicitJet<B> {
        let [n, _] = x.dims();
        let both = [self.ends.source(), self.ends.target()];
        let halves = [0..of_source, of_source..n];
        let [first, second] = [0, 1].map(|k| {
            let x = x.clone().slice([halves[k].clone(), 0..3]);
            let t = Tensor::zeros([x.dims()[0], 1], &x.device());
            self.operators.implicit_jet(both[nets[k]], x, t)
        });
        let join = |a, b| Tensor::cat(vec![a, b], 0);
        ImplicitJet {
            value: join(first.value, second.value),
            gradient: join(first.gradient, second.gradient),
            rate: join(first.rate, second.rate),
        }
    }
}
