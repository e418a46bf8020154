//! `nise` and `nise-velocity`: two end fields first, then `f(x, t)` between them.
//!
//! | steps | trained |
//! |---|---|
//! | up to `method.ends-until` of them | the end fields `g` and `h`, each on its own shape |
//! | the others | `f`, with `g` and `h` as constants |

use std::io;

use burn::module::Module;
use isomorph_model::autodiff::activation::Activation;
use isomorph_model::baseline::blend::{SdfBlend, SdfBlendConfig};
use isomorph_model::baseline::nise::{BetweenSamples, Evolution, Nise, NiseConfig, NiseWeights};
use isomorph_model::{Geometry, ImplicitNetConfig, Motion, TrainBackend};

use super::ends::OnDevice;
use super::{Method, Trainee};
use crate::data::TrainingData;
use crate::posed::{Posed, Slopes};
use crate::schedule::Schedule;
use crate::settings::{Settings, end_weights};
use crate::recipe::{MethodName, MethodRecipe, Recipe};
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates};
use crate::samples::{self, Drawn, EndBatch};
use crate::tensors::{column, rows};

/// The end fields and what lies between them.
pub(super) struct Evolved<B: TrainBackend> {
    method: MethodRecipe,
    settings: Settings,
    schedule: Schedule,
    device: B::Device,
    ends: Trainee<B, SdfBlend<B>>,
    net: Trainee<B, Nise<B>>,
    /// The first step that trains `f`.
    between_from: usize,
}

impl<B: TrainBackend> Evolved<B> {
    /// Before the first step.
    pub(super) fn new(recipe: &Recipe, device: &B::Device) -> Self {
        let settings = Settings::new(recipe);
        let training = &settings.training;
        let share = recipe.method.ends_until * training.steps as f64;
        let implicit = sine(&recipe.method, settings.implicit);
        let ends = SdfBlendConfig { implicit }.init(training.seed, device);
        let net = field(&recipe.method, &settings, ends.clone(), device);
        Self {
            between_from: (share.round() as usize).max(1),
            schedule: Schedule::new(training),
            ends: Trainee::new("ends", ends, device),
            net: Trainee::new("implicit", net, device),
            method: recipe.method.clone(),
            device: device.clone(),
            settings,
        }
    }
}

/// The recipe's Implicit-Net with sines, which the method is about.
fn sine(method: &MethodRecipe, implicit: ImplicitNetConfig) -> ImplicitNetConfig {
    ImplicitNetConfig {
        activation: Activation::Sine {
            omega: method.omega,
        },
        ..implicit
    }
}

/// `f` before its first step, between two end fields.
fn field<B: TrainBackend>(
    method: &MethodRecipe,
    settings: &Settings,
    ends: SdfBlend<B>,
    device: &B::Device,
) -> Nise<B> {
    let config = NiseConfig {
        implicit: sine(method, settings.implicit),
        evolution: match method.name {
            MethodName::NiseVelocity => Evolution::InterpolatedVelocity,
            _ => Evolution::CrossFade,
        },
    };
    config.init(ends, settings.training.seed.wrapping_add(2), device)
}

impl<B: TrainBackend> Method<B> for Evolved<B> {
    fn phase(&self, step: usize) -> Phase {
        if step < self.between_from {
            Phase::Ends
        } else {
            Phase::Between
        }
    }

    fn rates(&self, step: usize) -> Rates {
        let training = &self.settings.training;
        let (from, until) = match self.phase(step) {
            Phase::Ends => (0, self.between_from),
            _ => (self.between_from, training.steps),
        };
        Rates {
            implicit: self
                .schedule
                .rate(training.learning_rate, step, from, until),
            velocity: 0.0,
        }
    }

    fn parts(&self) -> usize {
        samples::parts(self.settings.training.batch)
    }

    fn draw(&self, data: &TrainingData, step: usize) -> Drawn {
        Drawn {
            ends: EndBatch::draw(data, &self.settings.training, step),
            ..Drawn::default()
        }
    }

    fn objective(&self, data: &TrainingData, drawn: &Drawn, step: usize) -> Posed<B> {
        let drawn = OnDevice::new(data, &drawn.ends, false, &self.device);
        let derivatives = &self.settings.derivatives;
        if self.phase(step) == Phase::Ends {
            let [source, target] = drawn.apart();
            let weights = end_weights(&self.settings.loss);
            let ends = self.ends.replica();
            let objective = ends.objective([&source, &target], &weights, derivatives);
            return Posed::new(objective).by(ends);
        }
        let weights = NiseWeights {
            data: self.method.ends,
            normals: self.settings.loss.normals,
            level_set: self.method.residual,
        };
        let between = BetweenSamples {
            points: rows(&drawn.batch.space.points, &self.device),
            times: column(&drawn.batch.between, &self.device),
        };
        let net = self.net.replica();
        let objective = net.objective(&drawn.both(), &between, &weights, derivatives);
        Posed::new(objective).by(net)
    }

    /// One network trains at a time, so the gradients are of that one.
    fn descend(&mut self, step: usize, slopes: &mut Slopes) {
        let rate = self.rates(step).implicit;
        let clip = self.settings.training.clip;
        if self.phase(step) == Phase::Between {
            self.net.advance(slopes.take(0), rate, clip);
            return;
        }
        self.ends.advance(slopes.take(0), rate, clip);
        if step + 1 == self.between_from {
            let ends = self.ends.net.clone();
            let net = field(&self.method, &self.settings, ends, &self.device);
            self.net = Trainee::new("implicit", net, &self.device);
        }
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        let ends = self.ends.net.num_params();
        vec![("f", self.net.net.num_params() - ends), ("g and h", ends)]
    }

    fn records(&self) -> io::Result<Records> {
        let mut records = Records::default();
        self.ends.record(&mut records)?;
        self.net.record(&mut records)?;
        Ok(records)
    }

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        self.ends.restore(records)?;
        self.net.restore(records)
    }

    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>> {
        Some(Box::new(self.net.valid()))
    }

    fn motion(&self) -> Option<Box<dyn Motion<B::InnerBackend>>> {
        None
    }
}
