//! `nise` and `nise-velocity`: two end fields first, then `f(x, t)` between them.
//!
//! | steps | trained |
//! |---|---|
//! | up to `nise.ends-until` of them | the end fields `g` and `h`, each on its own shape |
//! | the others | `f`, with `g` and `h` as constants |

use std::io;

use burn::module::Module;
use isomorph_model::autodiff::activation::Activation;
use isomorph_model::baseline::blend::{SdfBlend, SdfBlendConfig};
use isomorph_model::baseline::nise::{BetweenSamples, Evolution, Nise, NiseConfig, NiseWeights};
use isomorph_model::{Geometry, ImplicitNetConfig, Motion, TrainBackend};

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
use crate::samples::{self, Drawn, EndBatch};
use crate::schedule::Schedule;
use crate::settings::{Settings, end_weights};
use crate::tensors::{column, rows};

/// `nise`.
pub(super) static NISE: MethodSpec = MethodSpec {
    name: "nise",
    geometry: None,
    velocity: None,
    about: "two end fields, and f(x, t) between them under a level-set equation",
    citation: CITATION,
    needs: Needs::NOTHING,
    is_baseline: true,
    acts: ACTS,
    own: Some(NiseKeys::SECTION),
    fixed: &FIXED,
    changes: &CHANGES,
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

/// `nise-velocity`.
pub(super) static NISE_VELOCITY: MethodSpec = MethodSpec {
    name: "nise-velocity",
    geometry: None,
    velocity: None,
    about: "the same as nise with an interpolated velocity",
    citation: CITATION,
    needs: Needs::NOTHING,
    is_baseline: true,
    acts: ACTS,
    own: Some(NiseKeys::SECTION),
    fixed: &FIXED,
    changes: &CHANGES,
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

section! {
    /// The keys of the methods "nise" and "nise-velocity".
    nise: NiseKeys {
        /// Until here only the two end fields train.
        ends_until: f64 = 0.4 | 0.4 | 0.4 | 0.4 | 0.4, Rule::above_zero(0.9).unit("share of the steps");
        /// Frequency of the sine networks. Its authors print 20 to 30.
        omega: f64 = 20 | 20 | 20 | 20 | 20, Rule::above_zero(1000.0);
        /// Weight of the difference between f and the end fields at t = 0 and t = 1.
        ends: f64 = 10_000 | 10_000 | 10_000 | 10_000 | 10_000,
            Rule::positive_or_zero().zero("frees f from its ends");
        /// Weight of the residual of the equation between them.
        residual: f64 = 10 | 10 | 10 | 10 | 10, Rule::positive_or_zero().zero("turns it off");
    }
}

const CITATION: &str = "Novello, da Silva, Schardong, Schirmer, Lopes, Velho, \"Neural Implicit \
                        Surface Evolution\", ICCV 2023";

/// The networks are sines of a frequency of their own; distances are not used.
const ACTS: Acts = Acts {
    implicit: Keys::AllBut(&["activation", "beta"]),
    velocity: Keys::None,
    loss: Keys::Only(&["data", "normals", "eikonal", "off-surface"]),
    training: Keys::Only(&[
        "steps",
        "batch",
        "learning-rate",
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
};

const FIXED: [(&str, &str); 3] = [
    (
        "nise.omega",
        "a trained network cannot change its frequency",
    ),
    ("nise.ends-until", SHARED_OUT),
    ("training.steps", SHARED_OUT),
];

const SHARED_OUT: &str = "the method trains one network after the other and shares its steps out \
                          among them, so their number is fixed";

/// Sines learn faster: at 2e-3 their fields fray.
const CHANGES: [&str; 1] = ["training.learning-rate=5e-4"];

/// The end fields and what lies between them.
pub(super) struct Evolved<B: TrainBackend> {
    keys: NiseKeys,
    evolution: Evolution,
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
    pub(super) fn new(recipe: &Recipe, _: &Bounds, device: &B::Device) -> Self {
        let keys = recipe.keys_of::<NiseKeys>();
        let evolution = if recipe.method.name == NISE_VELOCITY.name {
            Evolution::InterpolatedVelocity
        } else {
            Evolution::CrossFade
        };
        let settings = Settings::new(recipe);
        let training = &settings.training;
        let share = keys.ends_until * training.steps as f64;
        let implicit = sine(keys.omega, settings.implicit);
        let ends = SdfBlendConfig { implicit }.init(training.seed, device);
        let net = field(keys.omega, evolution, &settings, ends.clone(), device);
        Self {
            between_from: (share.round() as usize).max(1),
            schedule: Schedule::new(training),
            ends: Trainee::new("ends", ends, device),
            net: Trainee::new("implicit", net, device),
            keys,
            evolution,
            device: device.clone(),
            settings,
        }
    }
}

/// The recipe's Implicit-Net with sines, which the method is about.
fn sine(omega: f64, implicit: ImplicitNetConfig) -> ImplicitNetConfig {
    ImplicitNetConfig {
        activation: Activation::Sine { omega },
        ..implicit
    }
}

/// `f` before its first step, between two end fields.
fn field<B: TrainBackend>(
    omega: f64,
    evolution: Evolution,
    settings: &Settings,
    ends: SdfBlend<B>,
    device: &B::Device,
) -> Nise<B> {
    let config = NiseConfig {
        implicit: sine(omega, settings.implicit),
        evolution,
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
            ends: EndBatch::draw(data, &self.settings.training, step, false),
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
            data: self.keys.ends,
            normals: self.settings.loss.normals,
            level_set: self.keys.residual,
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
            let net = field(
                self.keys.omega,
                self.evolution,
                &self.settings,
                ends,
                &self.device,
            );
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
