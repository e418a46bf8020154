//! One step's objective: from samples and networks to the named terms.
//!
//! | phase | `V` | `f` |
//! |---|---|---|
//! | velocity warm-up | trained by matching and its priors | absent |
//! | ramp, joint | trained by all terms | trained by all terms |
//! | implicit only | frozen: evaluated without a graph | trained by all of its terms |

use burn::tensor::Tensor;
use isomorph_model::loss::{data, eikonal, level_set, normals, off_surface};
use isomorph_model::operators::{Operators, VelocityJet};
use isomorph_model::{ImplicitNet, Objective, TrainBackend};

use crate::motion::{Collocation, Motion, Still, has_normals};
use crate::recipe::LevelSetForm;
use crate::report::Phase;
use crate::samples::Batch;
use crate::tensors::{column, rows};

/// What one step is made from.
pub struct Step<'a, B: TrainBackend> {
    /// The Velocity-Net, the samples' numbers, weights and methods.
    pub motion: Motion<'a, B>,
    /// Decides which networks train.
    pub phase: Phase,
    /// The share of the weights that tie `f` to `V`.
    pub ramp: f64,
    /// The Implicit-Net.
    pub f: &'a ImplicitNet<B>,
}

/// The samples that `V` carries.
struct Carried<B: TrainBackend> {
    /// Positions at their stop times, `[n, 3]`; tracked by `V`'s weights in the joint phases.
    positions: Tensor<B, 2>,
    /// Transported normals, constants, where the data has normals.
    normals: Option<Tensor<B, 2>>,
    /// `[n, 1]`.
    times: Tensor<B, 2>,
}

impl<B: TrainBackend> Step<'_, B> {
    /// The terms of the objective for one batch.
    pub fn objective(&self, batch: &Batch) -> Objective<B> {
        let mut objective = Objective::new();
        let (carried, still) = self.carry(batch, &mut objective);
        let at = self.motion.collocation(batch, &still);
        let v = self.velocity_terms(&at, &mut objective);
        if self.phase != Phase::WarmUp {
            self.implicit_terms(batch, &carried, at, v, &mut objective);
        }
        objective
    }

    /// Carries the starts to their stops; in the phases that train `V` its trajectories are tracked, and
    /// the correspondences travel along.
    fn carry(&self, batch: &Batch, objective: &mut Objective<B>) -> (Carried<B>, Still<B>) {
        let loss = &self.motion.settings.loss;
        let tracked = match self.phase {
            Phase::ImplicitOnly => None,
            Phase::WarmUp => {
                let weight = loss.matching_warm_up;
                self.motion.carry_tracked(batch, &[], weight, objective)
            }
            _ => self
                .motion
                .carry_tracked(batch, &batch.stops, loss.matching, objective),
        };
        let for_f = self.phase != Phase::WarmUp && loss.transported_normals > 0.0;
        let normals = has_normals(batch) && for_f;
        let still = match &tracked {
            Some(positions) if !normals => Still {
                positions: positions.clone().inner(),
                normals: None,
            },
            _ => self.motion.carry_constants(batch, normals),
        };
        let carried = Carried {
            positions: tracked.unwrap_or_else(|| Tensor::from_inner(still.positions.clone())),
            normals: still.normals.clone().map(Tensor::from_inner),
            times: column(&batch.stops, self.motion.device),
        };
        (carried, still)
    }

    /// The priors of `V`, and its jet at the collocation points where a term needs it.
    fn velocity_terms(
        &self,
        at: &Collocation<B>,
        objective: &mut Objective<B>,
    ) -> Option<VelocityJet<B>> {
        let for_f = self.phase != Phase::WarmUp && self.motion.settings.loss.level_set > 0.0;
        if self.phase == Phase::ImplicitOnly {
            return for_f.then(|| self.motion.constant_jet(at));
        }
        self.motion.priors(at, for_f, objective)
    }

    /// The terms of `f`: one evaluation of its jet at all points of the batch.
    fn implicit_terms(
        &self,
        batch: &Batch,
        carried: &Carried<B>,
        at: Collocation<B>,
        v: Option<VelocityJet<B>>,
        objective: &mut Objective<B>,
    ) {
        let Motion {
            settings, device, ..
        } = self.motion;
        let loss = &settings.loss;
        let ends = batch.ends.points.len();
        let (band, collocation) = (at.band, at.x.dims()[0]);
        let end_points = rows(&batch.ends.points, device);
        let end_times = column(&batch.ends.times, device);
        let x = Tensor::cat(vec![end_points, at.x, carried.positions.clone()], 0);
        let t = Tensor::cat(vec![end_times, at.t, carried.times.clone()], 0);
        let jet = settings.derivatives.implicit_jet(self.f, x, t);
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
                normals::normals(&at_ends, rows(&batch.ends.normals, device))
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
        if band < collocation {
            objective.add("off-surface", loss.off_surface, || {
                off_surface::off_surface(at_collocation.rows(band, collocation).value)
            });
        }
    }
}
