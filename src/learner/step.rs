//! One step's objective: from samples and networks to the named terms.
//!
//! | phase | `V` | `f` |
//! |---|---|---|
//! | velocity warm-up | trained by matching and its priors | absent |
//! | ramp, joint | trained by all terms | trained by all terms |
//! | implicit only | frozen: evaluated without a graph | trained by all of its terms |

use burn::module::AutodiffModule;
use burn::tensor::Tensor;
use isomorph_model::loss::{
    data, divergence, eikonal, level_set, matching, normals, off_surface, smoothness, steadiness,
    strain,
};
use isomorph_model::operators::{Operators, VelocityJet, VelocityRequest, transport};
use isomorph_model::trajectory::integrate;
use isomorph_model::{ImplicitNet, Objective, TrainBackend, VelocityNet};

use crate::learner::batch::{Batch, BatchSizes};
use crate::learner::event::Phase;
use crate::learner::settings::Settings;
use crate::recipe::LevelSetForm;
use crate::tensors::{column, rows};

/// What one step is made from.
pub struct Step<'a, B: TrainBackend> {
    /// Weights and methods.
    pub settings: &'a Settings,
    /// How many samples of each kind.
    pub sizes: BatchSizes,
    /// Decides which networks train.
    pub phase: Phase,
    /// The share of the weights that tie `f` to `V`.
    pub ramp: f64,
    /// The Implicit-Net.
    pub f: &'a ImplicitNet<B>,
    /// The Velocity-Net.
    pub v: &'a VelocityNet<B>,
    /// Where tensors live.
    pub device: &'a B::Device,
}

/// The samples that `V` carries.
struct Carried<B: TrainBackend> {
    /// Positions at their stop times, `[n, 3]`; tracked by `V`'s weights in the joint phases.
    positions: Tensor<B, 2>,
    /// The same as constants.
    still: Tensor<B::InnerBackend, 2>,
    /// Transported normals, constants, where the data has normals.
    normals: Option<Tensor<B, 2>>,
    /// `[n, 1]`.
    times: Tensor<B, 2>,
}

impl<B: TrainBackend> Step<'_, B> {
    /// The terms of the objective for one batch.
    pub fn objective(&self, batch: &Batch) -> Objective<B> {
        let mut objective = Objective::new();
        let carried = self.carry(batch, &mut objective);
        let (x, t) = self.collocation(batch, &carried);
        let v = self.velocity_terms(x.clone(), t.clone(), &mut objective);
        if self.phase != Phase::WarmUp {
            self.implicit_terms(batch, &carried, (x, t), v, &mut objective);
        }
        objective
    }

    /// Carries the starts to their stops; in the phases that train `V` its trajectories are tracked, and
    /// the correspondences travel along.
    fn carry(&self, batch: &Batch, objective: &mut Objective<B>) -> Carried<B> {
        let tracked = match self.phase {
            Phase::ImplicitOnly => None,
            _ => self.carry_tracked(batch, objective),
        };
        let (still, normals) = match &tracked {
            Some(positions) if !self.carries_normals(batch) => (positions.clone().inner(), None),
            _ => self.carry_constants(batch),
        };
        Carried {
            positions: tracked.unwrap_or_else(|| Tensor::from_inner(still.clone())),
            still,
            normals,
            times: column(&batch.stops, self.device),
        }
    }

    /// Carries the correspondences to the other end, which gives the matching term, and with them, in
    /// the joint phases, the starts to their stops: the positions of these.
    fn carry_tracked(&self, batch: &Batch, objective: &mut Objective<B>) -> Option<Tensor<B, 2>> {
        let (joint, matched) = (self.phase != Phase::WarmUp, self.sizes.matched);
        let (sources, targets) = &batch.matched;
        let mut x = [&sources[..], targets].concat();
        let mut from = [vec![0.0; matched], vec![1.0; matched]].concat();
        let mut to = [vec![1.0; matched], vec![0.0; matched]].concat();
        if joint {
            x.extend(&batch.starts.points);
            from.extend(&batch.starts.times);
            to.extend(&batch.stops);
        }
        if x.is_empty() {
            return None;
        }
        let (from, to) = (column(&from, self.device), column(&to, self.device));
        let (steps, integrator) = (self.settings.steps, self.settings.integrator);
        let rhs = |x, t| self.v.forward(x, t);
        let arrived = integrate(rhs, self.rows(&x), from, to, steps, integrator);
        let loss = &self.settings.loss;
        let weight = if joint {
            loss.matching
        } else {
            loss.matching_warm_up
        };
        if matched > 0 {
            objective.add("matching", weight, || {
                let marks = self.rows(&[&targets[..], sources].concat());
                let there = arrived.clone().slice([0..2 * matched, 0..3]);
                matching::matching(there, marks, loss.matching_scale)
            });
        }
        joint.then(|| arrived.slice([2 * matched..x.len(), 0..3]))
    }

    fn carries_normals(&self, batch: &Batch) -> bool {
        self.phase != Phase::WarmUp
            && self.settings.loss.transported_normals > 0.0
            && batch.starts.normals.len() == batch.starts.points.len()
    }

    /// The same trajectories without a graph, with the normals where they are wanted.
    fn carry_constants(&self, batch: &Batch) -> (Tensor<B::InnerBackend, 2>, Option<Tensor<B, 2>>) {
        let settings = self.settings;
        let v = self.v.valid();
        let x = rows::<B::InnerBackend>(&batch.starts.points, self.device);
        let from = column::<B::InnerBackend>(&batch.starts.times, self.device);
        let to = column::<B::InnerBackend>(&batch.stops, self.device);
        let (steps, integrator) = (settings.steps, settings.integrator);
        if self.carries_normals(batch) {
            let n = rows::<B::InnerBackend>(&batch.starts.normals, self.device);
            let operators = &settings.derivatives;
            let (x, n) = transport(operators, &v, x, n, from, to, steps, integrator);
            (x, Some(Tensor::from_inner(n)))
        } else {
            let rhs = |x, t| v.forward(x, t);
            (integrate(rhs, x, from, to, steps, integrator), None)
        }
    }

    /// Positions and times of the collocation points, constants: the band first, then the box.
    fn collocation(&self, batch: &Batch, carried: &Carried<B>) -> (Tensor<B, 2>, Tensor<B, 2>) {
        let (band, count) = (self.sizes.band, 2 * self.sizes.carried);
        let repeats = band.div_ceil(count).max(1);
        let near = Tensor::from_inner(carried.still.clone()).repeat_dim(0, repeats);
        let near_times = carried.times.clone().repeat_dim(0, repeats);
        let mut x = Vec::new();
        let mut t = Vec::new();
        if band > 0 {
            x.push(near.slice([0..band, 0..3]) + self.rows(&batch.offsets));
            t.push(near_times.slice([0..band, 0..1]));
        }
        if self.sizes.uniform > 0 {
            x.push(self.rows(&batch.uniform.points));
            t.push(column(&batch.uniform.times, self.device));
        }
        (Tensor::cat(x, 0), Tensor::cat(t, 0))
    }

    /// The priors of `V`, and its jet at the collocation points where a term needs it.
    fn velocity_terms(
        &self,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        objective: &mut Objective<B>,
    ) -> Option<VelocityJet<B>> {
        let loss = &self.settings.loss;
        let trained = self.phase != Phase::ImplicitOnly;
        let for_v = [
            loss.smoothness,
            loss.divergence,
            loss.strain,
            loss.steadiness,
        ];
        let for_f = self.phase != Phase::WarmUp && loss.level_set > 0.0;
        let wanted = for_f || (trained && for_v.iter().any(|weight| *weight > 0.0));
        if !wanted {
            return None;
        }
        if !trained {
            let still = self.v.valid();
            let request = VelocityRequest::default();
            let (x, t) = (x.inner(), t.inner());
            let jet = self
                .settings
                .derivatives
                .velocity_jet(&still, x, t, request);
            return Some(constant(jet));
        }
        let request = VelocityRequest {
            laplacian: loss.smoothness > 0.0 && loss.smoothness_alpha > 0.0,
            rate: loss.steadiness > 0.0,
        };
        let jet = self
            .settings
            .derivatives
            .velocity_jet(self.v, x, t, request);
        let (alpha, gamma) = (loss.smoothness_alpha, loss.smoothness_gamma);
        objective.add("smoothness", loss.smoothness, || {
            smoothness::smoothness(&jet, alpha, gamma)
        });
        objective.add("divergence", loss.divergence, || {
            divergence::divergence(&jet)
        });
        if self.sizes.band > 0 {
            objective.add("strain", loss.strain, || {
                strain::strain(&jet.first(self.sizes.band))
            });
        }
        objective.add("steadiness", loss.steadiness, || {
            steadiness::steadiness(&jet)
        });
        Some(jet)
    }

    /// The terms of `f`: one evaluation of its jet at all points of the batch.
    fn implicit_terms(
        &self,
        batch: &Batch,
        carried: &Carried<B>,
        (x, t): (Tensor<B, 2>, Tensor<B, 2>),
        v: Option<VelocityJet<B>>,
        objective: &mut Objective<B>,
    ) {
        let loss = &self.settings.loss;
        let ends = batch.ends.points.len();
        let collocation = x.dims()[0];
        let all_x = vec![self.rows(&batch.ends.points), x, carried.positions.clone()];
        let all_t = vec![
            column(&batch.ends.times, self.device),
            t,
            carried.times.clone(),
        ];
        let (all_x, all_t) = (Tensor::cat(all_x, 0), Tensor::cat(all_t, 0));
        let jet = self.settings.derivatives.implicit_jet(self.f, all_x, all_t);
        let total = jet.value.dims()[0];
        let at_ends = jet.rows(0, ends);
        let at_collocation = jet.rows(ends, ends + collocation);
        let at_carried = jet.rows(ends + collocation, total);

        // The paper adds the means over the two shapes, which have equal shares: twice the mean of both.
        objective.add("data", loss.data, || {
            data::data(at_ends.value.clone()) * 2.0
        });
        if batch.ends.normals.len() == ends {
            objective.add("normals", loss.normals, || {
                normals::normals(&at_ends, self.rows(&batch.ends.normals))
            });
        }
        objective.add("eikonal", loss.eikonal, || eikonal::eikonal(jet.slope()));
        if let Some(v) = v {
            let lambda_l = match loss.level_set_form {
                LevelSetForm::Mlse => loss.lambda_l,
                LevelSetForm::Olse => 0.0,
            };
            objective.add("level-set", self.ramp * loss.level_set, || {
                level_set::level_set(&at_collocation, &v, lambda_l)
            });
        }
        objective.add("on-surface", self.ramp * loss.on_surface, || {
            data::data(at_carried.value.clone())
        });
        if let Some(carried_normals) = &carried.normals {
            objective.add("transported-normals", loss.transported_normals, || {
                normals::normals(&at_carried, carried_normals.clone())
            });
        }
        if self.sizes.uniform > 0 {
            objective.add("off-surface", loss.off_surface, || {
                let (start, end) = (self.sizes.band, collocation);
                off_surface::off_surface(at_collocation.rows(start, end).value)
            });
        }
    }

    fn rows(&self, points: &[[f32; 3]]) -> Tensor<B, 2> {
        rows(points, self.device)
    }
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
