//! `eigenbasis`: a divergence-free flow in a sine basis, fitted to the correspondences. It moves points and
//! has no field: its surface is the source's mesh, carried.

use std::io;

use burn::module::Module;
use isomorph_model::baseline::eigenbasis::{Eigenbasis, EigenbasisConfig, EigenbasisWeights};
use isomorph_model::trajectory::{Integrator, Steps};
use isomorph_model::{Geometry, Motion, TrainBackend};

use super::spec::{Acts, Keys, MethodSpec, Needs};
use super::{Method, Trainee};
use crate::data::{Bounds, TrainingData};
use crate::posed::{Posed, Slopes};
use crate::recipe::rule::Rule;
use crate::recipe::schema::{Keyed, section};
use crate::recipe::{Recipe, TrainingRecipe};
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates};
use crate::samples::Drawn;
use crate::schedule::Schedule;
use crate::tensors::rows;

/// `eigenbasis`.
pub(super) static EIGENBASIS: MethodSpec = MethodSpec {
    name: "eigenbasis",
    geometry: None,
    velocity: None,
    about: "a divergence-free flow in a sine basis, fitted to the correspondences",
    citation: "Eisenberger, Laehner, Cremers, \"Divergence-Free Shape Interpolation and \
               Correspondence\", Eurographics 2019",
    needs: Needs {
        normals: false,
        correspondences: true,
        mesh: true,
    },
    is_baseline: true,
    acts: Acts {
        implicit: Keys::None,
        velocity: Keys::None,
        loss: Keys::Only(&["matching", "matching-scale"]),
        training: Keys::Only(&[
            "steps",
            "correspondence-batch",
            "velocity-learning-rate",
            "schedule",
            "decay",
            "decay-every",
            "final-learning-rate",
            "clip",
            "seed",
            "log-every",
        ]),
    },
    own: Some(EigenbasisKeys::SECTION),
    fixed: &[("eigenbasis.modes", "a fitted flow cannot change its basis")],
    // Coefficients of one size each: the steps can be larger than a network's.
    changes: &["training.velocity-learning-rate=1e-2"],
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

section! {
    /// The keys of the method "eigenbasis".
    eigenbasis: EigenbasisKeys {
        /// Sine modes along each axis.
        modes: usize = 6 | 6 | 6 | 6 | 6, Rule::whole(1, 16);
        /// Weight of the regulariser that keeps the modes small, higher ones more.
        prior: f64 = 0.01 | 0.01 | 0.01 | 0.01 | 0.01, Rule::positive_or_zero().zero("turns it off");
    }
}

/// Steps of the integrator between two times: the field is fixed, and as smooth as its highest mode.
const STEPS: Steps = Steps::Even(8);

/// The box's padding, as a share of its longest side: no point crosses its walls.
const PADDING: f64 = 0.15;

/// The flow and how it is fitted.
pub(super) struct SineFlow<B: TrainBackend> {
    training: TrainingRecipe,
    weights: EigenbasisWeights,
    schedule: Schedule,
    device: B::Device,
    net: Trainee<B, Eigenbasis<B>>,
}

impl<B: TrainBackend> SineFlow<B> {
    /// Before the first step.
    pub(super) fn new(recipe: &Recipe, bounds: &Bounds, device: &B::Device) -> Self {
        let keys = recipe.keys_of::<EigenbasisKeys>();
        let config = EigenbasisConfig {
            modes: keys.modes,
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
                prior: keys.prior,
            },
            net: Trainee::new("velocity", config.init(device), device),
            device: device.clone(),
        }
    }
}

impl<B: TrainBackend> Method<B> for SineFlow<B> {
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
