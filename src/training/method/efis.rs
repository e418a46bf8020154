//! `efis`: two end fields first, then an invertible flow that takes each shape onto the other.
//!
//! | steps | trained |
//! |---|---|
//! | up to `efis.ends-until` of them | the end fields `g` and `h`, each on its own shape |
//! | the others | the flow, with `g` and `h` as constants; known pairs are its landmarks |

use std::io;

use burn::module::Module;
use isomorph_model::baseline::efis::{
    CouplingFlow, CouplingFlowConfig, EfisGeometry, EfisSamples, EfisWeights, objective,
};
use isomorph_model::flow::{EndFields, EndFieldsConfig};
use isomorph_model::{Geometry, Motion, TrainBackend};

use super::ends::OnDevice;
use super::spec::{Acts, Keys, MethodSpec, Needs};
use super::{Method, Trainee};
use crate::data::{Bounds, TrainingData};
use crate::posed::{Posed, Slopes};
use crate::recipe::Recipe;
use crate::recipe::rule::Rule;
use crate::recipe::schema::{Keyed, section};
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates};
use crate::samples::{self, Batch, BatchSizes, Drawn, EndBatch, Matched};
use crate::schedule::Schedule;
use crate::settings::{Settings, end_weights};
use crate::tensors::{column, rows};

/// `efis`.
pub(super) static EFIS: MethodSpec = MethodSpec {
    name: "efis",
    geometry: None,
    velocity: None,
    about: "two end fields, joined by an invertible flow of affine couplings",
    citation: "Buonomo, Digne, Chaine, \"Explicit Flows for Implicit Surfaces\", ACM Transactions on \
               Graphics 45(4), 2026",
    needs: Needs::NOTHING,
    is_baseline: true,
    acts: Acts {
        implicit: Keys::All,
        velocity: Keys::None,
        loss: Keys::Only(&["data", "normals", "eikonal", "off-surface", "distance"]),
        training: Keys::Only(&[
            "steps",
            "batch",
            "correspondence-batch",
            "learning-rate",
            "velocity-learning-rate",
            "schedule",
            "decay",
            "decay-every",
            "final-learning-rate",
            "time-steps",
            "times",
            "derivatives",
            "band-share",
            "band-widths",
            "box-margin",
            "clip",
            "seed",
            "log-every",
        ]),
    },
    own: Some(EfisKeys::SECTION),
    fixed: &[
        ("efis.ends-until", SHARED_OUT),
        (
            "efis.omega",
            "a trained network cannot change its frequency",
        ),
        ("efis.width", "a trained network cannot change its shape"),
        ("training.steps", SHARED_OUT),
    ],
    // Its sines are fast: at 1e-3 the isometry term passes 1e6 within five steps (fox 0-18). At 2e-4, with fitted
    // ends, it stays below 1.
    changes: &["training.velocity-learning-rate=2e-4"],
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

const SHARED_OUT: &str = "the method trains one network after the other and shares its steps out \
                          among them, so their number is fixed";

section! {
    /// The keys of the method "efis".
    efis: EfisKeys {
        /// Until here only the two end fields train.
        ends_until: f64 = 0.4 | 0.4 | 0.4 | 0.4 | 0.4, Rule::above_zero(0.9).unit("share of the steps");
        /// Frequency of the sine networks of the flow. Its authors use 60.
        omega: f64 = 60 | 60 | 60 | 60 | 60, Rule::above_zero(1000.0);
        /// Units in each hidden layer of these networks.
        width: usize = 128 | 128 | 128 | 128 | 128, Rule::whole(4, 4096);
        /// Weight of the squared distance from the other shape on arrival there.
        data: f64 = 10_000 | 10_000 | 10_000 | 10_000 | 10_000,
            Rule::positive_or_zero().zero("leaves the flow to the landmarks");
        /// Weight of the angle between normals on arrival.
        normals: f64 = 100 | 100 | 100 | 100 | 100, Rule::positive_or_zero().zero("ignores the normals");
        /// Weight of the cross entropy of inside and outside, in space.
        signs: f64 = 100 | 100 | 100 | 100 | 100, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the squared velocity.
        speed: f64 = 10 | 10 | 10 | 10 | 10, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the change of lengths.
        isometry: f64 = 10 | 10 | 10 | 10 | 10, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the change of volumes.
        volume: f64 = 1 | 1 | 1 | 1 | 1, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the squared distance between carried points and their correspondences.
        landmarks: f64 = 10_000 | 10_000 | 10_000 | 10_000 | 10_000,
            Rule::positive_or_zero().zero("ignores the correspondences");
    }
}

/// The end fields and the flow between them.
pub(super) struct EndsAndCouplings<B: TrainBackend> {
    weights: EfisWeights,
    settings: Settings,
    schedule: Schedule,
    device: B::Device,
    ends: Trainee<B, EndFields<B>>,
    flow: Trainee<B, CouplingFlow<B>>,
    /// The first step that trains the flow.
    flow_from: usize,
}

impl<B: TrainBackend> EndsAndCouplings<B> {
    /// Before the first step.
    pub(super) fn new(recipe: &Recipe, _: &Bounds, device: &B::Device) -> Self {
        let keys = recipe.keys_of::<EfisKeys>();
        let settings = Settings::new(recipe);
        let training = &settings.training;
        let share = keys.ends_until * training.steps as f64;
        let implicit = settings.implicit;
        let ends = EndFieldsConfig { implicit }.init(training.seed, device);
        let config = CouplingFlowConfig {
            rounds: ROUNDS,
            width: keys.width,
            omega: keys.omega,
        };
        // The end fields take `seed` and the one after it.
        let flow = config.init(training.seed.wrapping_add(2), device);
        Self {
            weights: EfisWeights {
                data: keys.data,
                normals: keys.normals,
                signs: keys.signs,
                speed: keys.speed,
                isometry: keys.isometry,
                volume: keys.volume,
                landmarks: keys.landmarks,
            },
            flow_from: (share.round() as usize).max(1),
            schedule: Schedule::new(training),
            ends: Trainee::new("ends", ends, device),
            flow: Trainee::new("flow", flow, device),
            device: device.clone(),
            settings,
        }
    }

    /// The samples of the flow, of a part whose end fields are sampled already.
    fn samples(&self, drawn: &Drawn, ends: OnDevice<'_, B>) -> EfisSamples<B> {
        let pairs = &drawn.batch.matched;
        let tensor = |points: &[[f32; 3]]| rows(points, &self.device);
        let known = (!pairs.is_empty()).then(|| [tensor(&pairs.sources), tensor(&pairs.targets)]);
        EfisSamples {
            ends: ends.apart(),
            // As many points are drawn on the surfaces as in space.
            times: column(&drawn.ends.between, &self.device),
            landmarks: known,
        }
    }
}

/// Rounds of six couplings; the source's number.
const ROUNDS: usize = 2;

impl<B: TrainBackend> Method<B> for EndsAndCouplings<B> {
    fn phase(&self, step: usize) -> Phase {
        if step < self.flow_from {
            Phase::Ends
        } else {
            Phase::Between
        }
    }

    fn rates(&self, step: usize) -> Rates {
        let training = &self.settings.training;
        let rate = |first, from, until| self.schedule.rate(first, step, from, until);
        match self.phase(step) {
            Phase::Ends => Rates {
                implicit: rate(training.learning_rate, 0, self.flow_from),
                velocity: 0.0,
            },
            _ => Rates {
                implicit: 0.0,
                velocity: rate(
                    training.velocity_learning_rate,
                    self.flow_from,
                    training.steps,
                ),
            },
        }
    }

    fn parts(&self) -> usize {
        samples::parts(self.settings.training.batch)
    }

    fn draw(&self, data: &TrainingData, step: usize) -> Drawn {
        let training = &self.settings.training;
        let count = match self.phase(step) {
            Phase::Ends => 0,
            _ => BatchSizes::new(training, data).matched,
        };
        Drawn {
            ends: EndBatch::draw(data, training, step, self.settings.measures_distances()),
            batch: Batch {
                matched: Matched::draw(data, training.seed, step, count),
                ..Batch::default()
            },
            ..Drawn::default()
        }
    }

    fn objective(&self, data: &TrainingData, drawn: &Drawn, step: usize) -> Posed<B> {
        let derivatives = &self.settings.derivatives;
        if self.phase(step) == Phase::Ends {
            let measured = self.settings.measures_distances();
            let [source, target] = OnDevice::new(data, &drawn.ends, measured, &self.device).apart();
            let weights = end_weights(&self.settings.loss);
            let ends = self.ends.replica();
            let objective = ends.objective([&source, &target], &weights, derivatives);
            return Posed::new(objective).by(ends);
        }
        let on_device = OnDevice::new(data, &drawn.ends, false, &self.device);
        let samples = self.samples(drawn, on_device);
        // Constants: nothing is recorded of them.
        let ends = self.ends.replica().no_grad();
        let flow = self.flow.replica();
        let terms = objective(&flow, &ends, &samples, &self.weights, derivatives);
        Posed::new(terms).by(flow)
    }

    /// One network trains at a time, so the gradients are of that one.
    fn descend(&mut self, step: usize, slopes: &mut Slopes) {
        let (rates, clip) = (self.rates(step), self.settings.training.clip);
        match self.phase(step) {
            Phase::Ends => self.ends.advance(slopes.take(0), rates.implicit, clip),
            _ => self.flow.advance(slopes.take(0), rates.velocity, clip),
        }
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        let (ends, flow) = (&self.ends.net, &self.flow.net);
        vec![("g and h", ends.num_params()), ("Phi", flow.num_params())]
    }

    fn records(&self) -> io::Result<Records> {
        let mut records = Records::default();
        self.ends.record(&mut records)?;
        self.flow.record(&mut records)?;
        Ok(records)
    }

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        self.ends.restore(records)?;
        self.flow.restore(records)
    }

    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>> {
        Some(Box::new(EfisGeometry::new(
            self.ends.valid(),
            self.flow.valid(),
        )))
    }

    fn motion(&self) -> Option<Box<dyn Motion<B::InnerBackend>>> {
        Some(Box::new(self.flow.valid()))
    }
}
