//! `eigenbasis`: a divergence-free flow in a sine basis, fitted to the correspondences. It moves points and
//! has no field: its surface is the source's mesh, carried.

use std::io;

use burn::module::Module;
use isomorph_model::baseline::eigenbasis::{Eigenbasis, EigenbasisConfig, EigenbasisWeights};
use isomorph_model::trajectory::{Integrator, Steps};
use isomorph_model::{Geometry, Motion, TrainBackend};

use super::{Method, Trainee};
use crate::posed::{Posed, Slopes};
use crate::schedule::Schedule;
use crate::recipe::{Recipe, TrainingRecipe};
use crate::data::{Bounds, TrainingData};
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates};
use crate::samples::Drawn;
use crate::tensors::rows;

/// Steps of the integrator between two times: the field is fixed, and as smooth as its highest mode.
const STEPS: Steps = Steps::Even(8);

/// The box's padding, as a share of its longest side: no point crosses its walls.
const PADDING: f64 = 0.15;

/// The flow and how it is fitted.
pub(super) struct Flow<B: TrainBackend> {
    training: TrainingRecipe,
    weights: EigenbasisWeights,
    schedule: Schedule,
    device: B::Device,
    net: Trainee<B, Eigenbasis<B>>,
}

impl<B: TrainBackend> Flow<B> {
    /// Before the first step.
    pub(super) fn new(recipe: &Recipe, bounds: &Bounds, device: &B::Device) -> Self {
        let config = EigenbasisConfig {
            modes: recipe.method.modes,
            lower: bounds.min.map(f64::from),
            upper: bounds.max.map(f64::from),
            padding: PADDING,
            steps: STEPS,
            integrator: Integrator::Midpoint,
        };
        Self {
            schedule: Schedule::new(&recipe.training),
            training: recipe.training.clone(),
            weights: EigenbasisWeights {
                matching: recipe.loss.matching,
                robust_scale: recipe.loss.matching_scale,
                prior: recipe.method.prior,
            },
            net: Trainee::new("velocity", config.init(device), device),
            device: device.clone(),
        }
    }
}

impl<B: TrainBackend> Method<B> for Flow<B> {
    fn phase(&self, _: usize) -> Phase {
        Phase::Motion
    }

    fn rates(&self, step: usize) -> Rates {
        let training = &self.training;
        let first = training.velocity_learning_rate;
        Rates {
            implicit: 0.0,
            velocity: self.schedule.rate(first, step, 0, training.steps),
        }
    }

    fn draw(&self, data: &TrainingData, step: usize) -> Drawn {
        Drawn::matched(data, &self.training, step)
    }

    fn objective(&self, _: &TrainingData, drawn: &Drawn, _: usize) -> Posed<B> {
        let pairs = &drawn.batch.matched;
        let (x0, x1) = (
            rows(&pairs.sources, &self.device),
            rows(&pairs.targets, &self.device),
        );
        let net = self.net.replica();
        Posed::new(net.objective(x0, x1, &self.weights)).by(net)
    }

    fn descend(&mut self, step: usize, slopes: &mut Slopes) {
        let rate = self.rates(step).velocity;
        self.net.advance(slopes.take(0), rate, self.training.clip);
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        vec![("V", self.net.net.num_params())]
    }

    fn records(&self) -> io::Result<Records> {
        let mut records = Records::default();
        self.net.record(&mut records)?;
        Ok(records)
    }

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        self.net.restore(records)
    }

    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>> {
        None
    }

    fn motion(&self) -> Option<Box<dyn Motion<B::InnerBackend>>> {
        Some(Box::new(self.net.valid()))
    }
}
