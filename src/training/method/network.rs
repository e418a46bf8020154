//! The paper's geometry (`implicit.geometry = "network"`): one network `f(x, t)` and the velocity field `V`
//! that carries it, trained together. The preset `paper` differs from the others in weights, sampling and
//! terms (`recipe/keys.rs`, the columns of the presets).

use std::io;

use burn::module::Module;
use isomorph_model::{Geometry, ImplicitNet, TrainBackend, VelocityNet};

use super::spec::{Acts, Keys, MethodSpec, Needs};
use super::{FIXED_OPTIMISER, Method, Trainee};
use crate::data::{Bounds, TrainingData};
use crate::motion::Motion;
use crate::network_step::Step;
use crate::posed::{Posed, Slopes};
use crate::recipe::{GeometryKind, Recipe, VelocityKind};
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates};
use crate::samples::{self, Batch, BatchSizes, Drawn};
use crate::schedule::Schedule;
use crate::settings::Settings;
use crate::weights::Weights;

/// The paper's method.
pub(super) static NETWORK: MethodSpec = MethodSpec {
    name: "velocity-field",
    geometry: Some(GeometryKind::Network),
    velocity: Some(VelocityKind::Network),
    about: "one network f(x, t), tied to a velocity field V by the level-set equation: the paper's",
    citation: "Sang, Canfes, Cao, Bernard, Cremers, \"Implicit Neural Surface Deformation with \
               Explicit Velocity Fields\", ICLR 2025",
    needs: Needs::NOTHING,
    is_baseline: false,
    acts: Acts {
        implicit: Keys::All,
        velocity: Keys::All,
        loss: Keys::AllBut(&["distance"]),
        training: Keys::AllBut(&["guided-until"]),
    },
    own: None,
    fixed: &FIXED_OPTIMISER,
    changes: &[],
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

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
    pub(super) fn new(recipe: &Recipe, _: &Bounds, device: &B::Device) -> Self {
        let settings = Settings::new(recipe);
        let seed = settings.training.seed;
        let implicit = settings.implicit.init(seed, device);
        let velocity = settings.velocity.init(seed.wrapping_add(1), device);
        let training = &settings.training;
        let (hidden, hidden_velocity) = (implicit.hidden_weights(), velocity.hidden_weights());
        Self {
            schedule: Schedule::new(training),
            implicit: Trainee::of_field("implicit", implicit, hidden, training, device),
            velocity: Trainee::of_motion("velocity", velocity, hidden_velocity, training, device),
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
        samples::parts(self.settings.training.batch)
    }

    fn draw(&self, data: &TrainingData, step: usize) -> Drawn {
        let training = &self.settings.training;
        let sizes = BatchSizes::new(training, data);
        Drawn {
            batch: Batch::draw(data, training, sizes, step),
            ..Drawn::default()
        }
    }

    fn objective(&self, _: &TrainingData, drawn: &Drawn, step: usize) -> Posed<B> {
        let (f, v) = (self.implicit.replica(), self.velocity.replica());
        let still = self.velocity.valid();
        let last_scale = self.settings.loss.matching_scale;
        let network_step = Step {
            motion: Motion {
                settings: &self.settings,
                v: &v,
                still: &still,
                matching_scale: self.schedule.matching_scale(last_scale, step),
                device: &self.device,
            },
            phase: self.schedule.phase(step),
            ramp: self.schedule.ramp(step),
            f: &f,
        };
        Posed::new(network_step.objective(&drawn.batch)).by(f).by(v)
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

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        self.implicit.restore(records)?;
        self.velocity.restore(records)
    }

    fn weights(&self) -> Option<Weights> {
        let mut weights = Weights::default();
        weights.add("implicit", &self.implicit.valid());
        weights.add("velocity", &self.velocity.valid());
        Some(weights)
    }

    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>> {
        Some(Box::new(self.implicit.valid()))
    }

    fn motion(&self) -> Option<Box<dyn isomorph_model::Motion<B::InnerBackend>>> {
        Some(Box::new(self.velocity.valid()))
    }
}
