//! One step's objective where the geometry is the flow's ([`isomorph_model::FlowGeometry`]): two end
//! fields `g` and `h` fitted to their own shapes, and a velocity field that takes each to the other.
//!
//! ```text
//! on-surface   mean (|h(phi_{0 -> 1}(x_0))| + |g(phi_{1 -> 0}(x_1))|) / 2
//! ```
//!
//! over given points of both shapes: all of the source must arrive on the target and the reverse, with or
//! without correspondences. It moves `V` alone, the end fields are constants of it. As
//! `f(phi(x_0, t), t) = (1 - t) g(x_0) + t h(phi(x_0, 1))`, it is also what the term of that name asks of
//! the other geometry at every time.

use burn::module::Module;
use burn::tensor::Tensor;
use isomorph_model::flow::end_fields::EndFields;
use isomorph_model::flow::end_terms::EndSamples;
use isomorph_model::loss::data;
use isomorph_model::{ImplicitNet, Objective, TrainBackend};

use crate::guided::Guided;
use crate::motion::{Motion, has_priors};
use crate::report::Phase;
use crate::samples::Batch;
use crate::settings::end_weights;
use crate::tensors::{column, rows};

/// The weight of the squared distance from the guide: one term alone, so that it only has to keep gradients
/// well below training.clip and above the optimiser's epsilon.
const GUIDE_WEIGHT: f64 = 100.0;

/// What one step is made from.
pub(crate) struct FlowStep<'a, B: TrainBackend> {
    /// The Velocity-Net, the samples' numbers, weights and methods.
    pub motion: Motion<'a, B>,
    /// Decides which networks train.
    pub phase: Phase,
    /// Whether the surfaces do not pull on each other yet.
    pub warms_up: bool,
    /// The share of the weight of the term that takes each surface onto the other.
    pub ramp: f64,
    /// The end fields.
    pub ends: &'a EndFields<B>,
}

impl<B: TrainBackend> FlowStep<'_, B> {
    /// The terms of the objective: of the end fields at `samples`, of the source and of the target, and of
    /// the velocity field at the batch.
    ///
    /// In the phase [`Phase::Guided`] the velocity field has one term, its mean squared distance from the guide.
    pub(crate) fn objective(
        &self,
        batch: &Batch,
        guided: &Guided,
        samples: [&EndSamples<B>; 2],
    ) -> Objective<B> {
        let settings = self.motion.settings;
        let weights = end_weights(&settings.loss);
        let mut objective = self
            .ends
            .objective(samples, &weights, &settings.derivatives);
        match self.phase {
            Phase::ImplicitOnly => {}
            Phase::Guided => self.guide_term(guided, &mut objective),
            _ => self.motion_terms(batch, &mut objective),
        }
        objective
    }

    fn guide_term(&self, guided: &Guided, objective: &mut Objective<B>) {
        objective.add("guide", GUIDE_WEIGHT, || {
            let device = self.motion.device;
            let (x, t) = (
                rows(&guided.at.points, device),
                column(&guided.at.times, device),
            );
            let off = self.motion.v.forward(x, t) - rows(&guided.velocities, device);
            // Of the vector, not of its three parts.
            off.square().mean() * 3.0
        });
    }

    fn motion_terms(&self, batch: &Batch, objective: &mut Objective<B>) {
        let loss = &self.motion.settings.loss;
        let weight = self.ramp * loss.on_surface;
        let goals = if weight > 0.0 { &batch.goals[..] } else { &[] };
        let matching = if self.warms_up {
            loss.matching_warm_up
        } else {
            loss.matching
        };
        let arrived = self.motion.carry_tracked(batch, goals, matching, objective);
        if let Some(arrived) = arrived {
            objective.add("on-surface", weight, || self.distance(arrived));
        }
        if has_priors(loss) {
            let still = self.motion.carry_constants(batch, false);
            let at = self.motion.collocation(batch, &still);
            self.motion.priors(&at, false, objective);
        }
    }

    /// The mean distance of what arrived from the surface where it should be: the source's points first.
    fn distance(&self, arrived: Tensor<B, 2>) -> Tensor<B, 1> {
        let [count, _] = arrived.dims();
        let value = |net: &ImplicitNet<B>, start: usize, end: usize| {
            let x = arrived.clone().slice([start..end, 0..3]);
            let t = Tensor::zeros([end - start, 1], self.motion.device);
            net.clone().no_grad().forward(x, t)
        };
        let on_target = value(self.ends.target(), 0, count / 2);
        let on_source = value(self.ends.source(), count / 2, count);
        data::data(Tensor::cat(vec![on_target, on_source], 0))
    }
}
