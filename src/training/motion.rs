//! What a step needs of `V`: trajectories, the matching term, and the priors. The same for
//! both geometries.

use burn::tensor::Tensor;
use isomorph_model::flow::transport::transport;
use isomorph_model::loss::{divergence, matching, screw, smoothness, strain};
use isomorph_model::operators::{Operators, VelocityField, VelocityJet, VelocityRequest};
use isomorph_model::trajectory::integrate;
use isomorph_model::{Objective, TrainBackend};

use crate::recipe::LossRecipe;
use crate::samples::Batch;
use crate::settings::Settings;
use crate::tensors::{column, rows};

/// The velocity field in one step.
#[derive(Clone, Copy)]
pub(crate) struct Motion<'a, B: TrainBackend> {
    /// Weights and methods.
    pub settings: &'a Settings,
    /// `V`.
    pub v: &'a dyn VelocityField<B>,
    /// The same `V` for values.
    pub still: &'a dyn VelocityField<B::InnerBackend>,
    /// The scale of the matching term in this step; 0 is the plain distance.
    pub matching_scale: f64,
    /// Where tensors live.
    pub device: &'a B::Device,
}

/// The samples at the times to which `V` carries them, as constants.
pub(crate) struct Still<B: TrainBackend> {
    /// `[n, 3]`.
    pub positions: Tensor<B::InnerBackend, 2>,
    /// Transported normals, `[n, 3]`, where they were asked for and the data has normals.
    pub normals: Option<Tensor<B::InnerBackend, 2>>,
}

/// Points and times at which the terms between the ends are taken, constants: the band first, then the
/// box.
pub(crate) struct Collocation<B: TrainBackend> {
    /// `[n, 3]`.
    pub x: Tensor<B, 2>,
    /// `[n, 1]`.
    pub t: Tensor<B, 2>,
    /// How many of them are the band.
    pub band: usize,
}

/// Whether the batch has a normal at every point that is carried.
pub(crate) fn has_normals(batch: &Batch) -> bool {
    batch.starts.normals.len() == batch.starts.points.len()
}

impl<B: TrainBackend> Motion<'_, B> {
    /// Carries the correspondences to the other end, which gives the matching term of weight `weight`,
    /// and with them the starts to `stops`, none if that is empty: the positions of these.
    pub(crate) fn carry_tracked(
        &self,
        batch: &Batch,
        stops: &[f32],
        weight: f64,
        objective: &mut Objective<B>,
    ) -> Option<Tensor<B, 2>> {
        let pairs = &batch.matched;
        let matched = pairs.len();
        // Each pair both ways: the error of a path is not the same from either end.
        let mut x = [&pairs.sources[..], &pairs.targets].concat();
        let mut from = [&pairs.from[..], &pairs.to].concat();
        let mut to = [&pairs.to[..], &pairs.from].concat();
        if !stops.is_empty() {
            x.extend(&batch.starts.points);
            from.extend(&batch.starts.times);
            to.extend(stops);
        }
        if x.is_empty() {
            return None;
        }
        let (from, to) = (column(&from, self.device), column(&to, self.device));
        let (steps, integrator) = (self.settings.steps, self.settings.integrator);
        let rhs = |x, t| self.v.forward(x, t);
        let arrived = integrate(rhs, self.rows(&x), from, to, steps, integrator);
        if matched > 0 {
            objective.add("matching", weight, || {
                let marks = self.rows(&[&pairs.targets[..], &pairs.sources].concat());
                let there = arrived.clone().slice([0..2 * matched, 0..3]);
                matching::matching(there, marks, self.matching_scale)
            });
        }
        (!stops.is_empty()).then(|| arrived.slice([2 * matched..x.len(), 0..3]))
    }

    /// Carries the starts to the stops of the batch without a graph, with their normals if they are wanted
    /// and there are any.
    pub(crate) fn carry_constants(&self, batch: &Batch, normals: bool) -> Still<B> {
        let settings = self.settings;
        let v = self.still;
        let x = rows::<B::InnerBackend, 3>(&batch.starts.points, self.device);
        let from = column::<B::InnerBackend>(&batch.starts.times, self.device);
        let to = column::<B::InnerBackend>(&batch.stops, self.device);
        let (steps, integrator) = (settings.steps, settings.integrator);
        if normals && has_normals(batch) {
            let n = rows::<B::InnerBackend, 3>(&batch.starts.normals, self.device);
            let operators = &settings.derivatives;
            let (positions, n) = transport(operators, v, x, n, from, to, steps, integrator);
            Still {
                positions,
                normals: Some(n),
            }
        } else {
            let rhs = |x, t| v.forward(x, t);
            Still {
                positions: integrate(rhs, x, from, to, steps, integrator),
                normals: None,
            }
        }
    }

    /// The collocation points of a batch whose carried points are `still`.
    pub(crate) fn collocation(&self, batch: &Batch, still: &Still<B>) -> Collocation<B> {
        let (band, count) = (batch.offsets.len(), batch.starts.points.len());
        let repeats = band.div_ceil(count).max(1);
        let around = |carried: Tensor<B::InnerBackend, 2>| {
            let [_, columns] = carried.dims();
            let repeated = Tensor::from_inner(carried).repeat_dim(0, repeats);
            repeated.slice([0..band, 0..columns])
        };
        let mut x = Vec::new();
        let mut t = Vec::new();
        if band > 0 {
            x.push(around(still.positions.clone()) + self.rows(&batch.offsets));
            t.push(around(column(&batch.stops, self.device)));
        }
        if !batch.uniform.points.is_empty() {
            x.push(self.rows(&batch.uniform.points));
            t.push(column(&batch.uniform.times, self.device));
        }
        Collocation {
            x: Tensor::cat(x, 0),
            t: Tensor::cat(t, 0),
            band,
        }
    }

    /// The priors of `V` at the collocation points, and its jet there: `None` if nothing needs it.
    pub(crate) fn priors(
        &self,
        at: &Collocation<B>,
        wanted: bool,
        objective: &mut Objective<B>,
    ) -> Option<VelocityJet<B>> {
        let loss = &self.settings.loss;
        if !wanted && !has_priors(loss) {
            return None;
        }
        let request = VelocityRequest {
            laplacian: loss.smoothness > 0.0 && loss.smoothness_alpha > 0.0,
            rate: needs_rate(loss),
        };
        let operators = &self.settings.derivatives;
        let jet = operators.velocity_jet(self.v, at.x.clone(), at.t.clone(), request);
        let (alpha, gamma) = (loss.smoothness_alpha, loss.smoothness_gamma);
        objective.add("smoothness", loss.smoothness, || {
            smoothness::smoothness(&jet, alpha, gamma)
        });
        objective.add("divergence", loss.divergence, || {
            divergence::divergence(&jet)
        });
        if at.band > 0 {
            self.band_priors(&jet.first(at.band), objective);
        }
        Some(jet)
    }

    /// The priors that hold near the surface only.
    fn band_priors(&self, jet: &VelocityJet<B>, objective: &mut Objective<B>) {
        let loss = &self.settings.loss;
        objective.add("strain", loss.strain, || {
            strain::strain(jet, loss.strain_scale)
        });
        objective.add("screw", loss.screw, || screw::screw(jet));
    }

    /// The jet of a `V` that does not train, as constants.
    pub(crate) fn constant_jet(&self, at: &Collocation<B>) -> VelocityJet<B> {
        let (x, t) = (at.x.clone().inner(), at.t.clone().inner());
        let request = VelocityRequest::default();
        let operators = &self.settings.derivatives;
        constant(operators.velocity_jet(self.still, x, t, request))
    }

    fn rows(&self, points: &[[f32; 3]]) -> Tensor<B, 2> {
        rows(points, self.device)
    }
}

/// Whether any term is made of the jet of `V` alone.
pub(crate) fn has_priors(loss: &LossRecipe) -> bool {
    let weights = [loss.smoothness, loss.divergence, loss.strain, loss.screw];
    weights.iter().any(|weight| *weight > 0.0)
}

/// Whether any term is made of `dV/dt`.
pub(crate) fn needs_rate(loss: &LossRecipe) -> bool {
    loss.screw > 0.0
}

/// A jet of the inner backend as constants of the training backend.
fn constant<B: TrainBackend>(jet: VelocityJet<B::InnerBackend>) -> VelocityJet<B> {
    VelocityJet {
        value: Tensor::from_inner(jet.value),
        jacobian: Tensor::from_inner(jet.jacobian),
        laplacian: jet.laplacian.map(Tensor::from_inner),
        rate: jet.rate.map(Tensor::from_inner),
    }
}
