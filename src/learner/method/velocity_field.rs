//! `f(x, t)` carried by `V`, trained together: the paper's method and ours, which differ in weights,
//! sampling and terms only (`recipe/keys.rs`, the columns of the presets).

use std::io;

use burn::module::Module;
use isomorph_model::{Geometry, ImplicitNet, TrainBackend, VelocityNet};

use super::{Method, Rates, Records, Trainee, TrainingData, parts};
use crate::learner::batch::{self, BatchSizes, Part};
use crate::learner::checkpoint::{Checkpoint, CheckpointError};
use crate::learner::event::Phase;
use crate::learner::motion::Motion;
use crate::learner::posed::{Posed, Slopes};
use crate::learner::schedule::Schedule;
use crate::learner::settings::Settings;
use crate::learner::step::Step;
use crate::recipe::Recipe;

/// The two networks and how they are trained.
pub(super) struct VelocityField<B: TrainBackend> {
    settings: Settings,
    schedule: Schedule,
    device: B::Device,
    implicit: Trainee<B, ImplicitNet<B>>,
    velocity: Trainee<B, VelocityNet<B>>,
}

impl<B: TrainBackend> VelocityField<B> {
    /// Both networks as the recipe's seed makes them.
    pub(super) fn new(recipe: &Recipe, device: &B::Device) -> Self {
        let settings = Settings::new(recipe);
        let seed = settings.training.seed;
        let implicit = settings.implicit.init(seed, device);
        let velocity = settings.velocity.init(seed.wrapping_add(1), device);
        Self {
            schedule: Schedule::new(&settings.training),
            implicit: Trainee::new("implicit", implicit, device),
            velocity: Trainee::new("velocity", velocity, device),
            device: device.clone(),
            settings,
        }
    }
}

impl<B: TrainBackend> Method<B> for VelocityField<B> {
    fn phase(&self, step: usize) -> Phase {
        self.schedule.phase(step)
    }

    fn rates(&self, step: usize) -> Rates {
        Rates {
            implicit: self.schedule.implicit_rate(step),
            velocity: self.schedule.velocity_rate(step),
        }
    }

    fn parts(&self) -> usize {
        parts::<B>(self.settings.training.batch)
    }

    fn objective(&self, data: &TrainingData, step: usize, part: Part) -> Posed<B> {
        let training = &self.settings.training;
        let sizes = BatchSizes::new(training, data.pair.correspondences.len(), part.of);
        let batch = batch::draw(&data.pair, training, sizes, step).part(part);
        let (f, v) = (self.implicit.replica(), self.velocity.replica());
        let step = Step {
            motion: Motion {
                settings: &self.settings,
                sizes: sizes.part(part.of),
                v: &v,
                matching_scale: self
                    .schedule
                    .matching_scale(self.settings.loss.matching_scale, step),
                device: &self.device,
            },
            phase: self.schedule.phase(step),
            ramp: self.schedule.ramp(step),
            f: &f,
        };
        Posed::new(step.objective(&batch)).by(f).by(v)
    }

    fn descend(&mut self, step: usize, slopes: &mut Slopes) {
        let clip = self.settings.training.clip;
        let (phase, rates) = (self.phase(step), self.rates(step));
        if phase != Phase::WarmUp {
            self.implicit.advance(slopes.take(0), rates.implicit, clip);
        }
        if phase != Phase::ImplicitOnly {
            self.velocity.advance(slopes.take(1), rates.velocity, clip);
        }
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        let (f, v) = (&self.implicit.net, &self.velocity.net);
        vec![("f", f.num_params()), ("V", v.num_params())]
    }

    fn records(&self) -> io::Result<Records> {
        let mut records = Records::default();
        self.implicit.record(&mut records)?;
        self.velocity.record(&mut records)?;
        Ok(records)
    }

    fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.implicit.restore(checkpoint)?;
        self.velocity.restore(checkpoint)
    }

    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>> {
        Some(Box::new(self.implicit.valid()))
    }

    fn motion(&self) -> Option<Box<dyn isomorph_model::Motion<B::InnerBackend>>> {
        Some(Box::new(self.velocity.valid()))
    }
}
