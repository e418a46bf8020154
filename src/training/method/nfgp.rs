//! `nfgp`: one invertible deformation per time, each with its share of the steps, started from the one
//! before. The handles are the correspondences, sent along straight lines to that time.

use std::io;

use burn::module::Module;
use isomorph_model::baseline::linear::straight_lines;
use isomorph_model::baseline::nfgp::{
    FixedPoint, Nfgp, NfgpConfig, NfgpMotion, NfgpMotionConfig, NfgpSamples, NfgpWeights,
};
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
use crate::samples::{Drawn, Neighbouring};
use crate::schedule::Schedule;
use crate::tensors::rows;

/// `nfgp`.
pub(super) static NFGP: MethodSpec = MethodSpec {
    name: "nfgp",
    geometry: None,
    velocity: None,
    about: "invertible deformations, one for each time",
    citation: "Yang, Belongie, Hariharan, Koltun, \"Geometry Processing with Neural Fields\", \
               NeurIPS 2021",
    needs: Needs {
        normals: true,
        correspondences: true,
        mesh: true,
    },
    is_baseline: true,
    acts: Acts {
        implicit: Keys::Only(&["width"]),
        velocity: Keys::None,
        loss: Keys::None,
        training: Keys::Only(&[
            "steps",
            "batch",
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
    own: Some(NfgpKeys::SECTION),
    fixed: &[
        ("nfgp.deformations", SHARED_OUT),
        ("nfgp.blocks", "a trained network cannot change its shape"),
        ("training.steps", SHARED_OUT),
    ],
    // Its normalised layers learn slowly.
    changes: &["training.velocity-learning-rate=3e-3"],
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

const SHARED_OUT: &str = "the method trains one deformation after the other and shares its steps out \
                          among them, so their number is fixed";

section! {
    /// The keys of the method "nfgp".
    nfgp: NfgpKeys {
        /// Times at which a deformation is fitted, each with its share of the steps.
        deformations: usize = 8 | 8 | 8 | 8 | 8, Rule::whole(1, 1000);
        /// Residual blocks of a deformation.
        blocks: usize = 6 | 6 | 6 | 6 | 6, Rule::whole(1, 32);
        /// Weight of the distance of the known points (handles) from their targets at that time.
        handles: f64 = 100 | 100 | 100 | 100 | 100, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the change of lengths on the surface.
        stretch: f64 = 0.1 | 0.1 | 0.1 | 0.1 | 0.1, Rule::positive_or_zero().zero("turns it off");
        /// Weight of the change of curvature.
        bend: f64 = 1e-3 | 1e-3 | 1e-3 | 1e-3 | 1e-3, Rule::positive_or_zero().zero("turns it off");
    }
}

/// The deformations and the one in work.
pub(super) struct Deformations<B: TrainBackend> {
    training: TrainingRecipe,
    weights: NfgpWeights,
    schedule: Schedule,
    device: B::Device,
    /// All of them, the one in work as it stands.
    done: Trainee<B, NfgpMotion<B>>,
    /// The one in work.
    work: Trainee<B, Nfgp<B>>,
}

impl<B: TrainBackend> Deformations<B> {
    /// Before the first step.
    pub(super) fn new(recipe: &Recipe, _: &Bounds, device: &B::Device) -> Self {
        let keys = recipe.keys_of::<NfgpKeys>();
        let config = NfgpMotionConfig {
            deformation: NfgpConfig {
                blocks: keys.blocks,
                width: recipe.implicit.width,
                ..NfgpConfig::default()
            },
            times: keys.deformations,
            inverse: FixedPoint::default(),
        };
        let motion: NfgpMotion<B> = config.init(recipe.training.seed, device);
        Self {
            schedule: Schedule::new(&recipe.training),
            training: recipe.training.clone(),
            weights: NfgpWeights {
                handles: keys.handles,
                stretch: keys.stretch,
                bend: keys.bend,
            },
            work: Trainee::new("deformation", motion.start(0), device),
            done: Trainee::new("deformations", motion, device),
            device: device.clone(),
        }
    }

    /// The deformation that a step trains, counted from 0, and its first step and the one after its last.
    fn turn(&self, step: usize) -> (usize, usize, usize) {
        let (times, steps) = (self.done.net.times(), self.training.steps);
        let first = |index: usize| index * steps / times;
        let index = (0..times)
            .rev()
            .find(|index| first(*index) <= step)
            .unwrap_or(0);
        (index, first(index), first(index + 1))
    }
}

impl<B: TrainBackend> Method<B> for Deformations<B> {
    fn phase(&self, _: usize) -> Phase {
        Phase::Motion
    }

    fn rates(&self, step: usize) -> Rates {
        let (_, from, until) = self.turn(step);
        let first = self.training.velocity_learning_rate;
        Rates {
            implicit: 0.0,
            velocity: self.schedule.rate(first, step, from, until),
        }
    }

    fn draw(&self, data: &TrainingData, step: usize) -> Drawn {
        Drawn {
            neighbours: Neighbouring::draw(&data.keys[0], &self.training, step),
            ..Drawn::matched(data, &self.training, step)
        }
    }

    fn objective(&self, _: &TrainingData, drawn: &Drawn, step: usize) -> Posed<B> {
        let (index, ..) = self.turn(step);
        let time = self.done.net.time(index);
        let (pairs, drawn) = (&drawn.batch.matched, &drawn.neighbours);
        let tensor = |points: &[[f32; 3]]| rows(points, &self.device);
        let samples = NfgpSamples {
            handles: tensor(&pairs.sources),
            marks: straight_lines(tensor(&pairs.sources), tensor(&pairs.targets), time),
            points: tensor(&drawn.points),
            normals: tensor(&drawn.normals),
            neighbours: tensor(&drawn.neighbours),
            neighbour_normals: tensor(&drawn.neighbour_normals),
        };
        let net = self.work.replica();
        Posed::new(net.objective(&samples, &self.weights)).by(net)
    }

    fn descend(&mut self, step: usize, slopes: &mut Slopes) {
        let rate = self.rates(step).velocity;
        self.work.advance(slopes.take(0), rate, self.training.clip);
        let (index, _, until) = self.turn(step);
        self.done.net.replace(index, &self.work.net);
        if step + 1 == until && index + 1 < self.done.net.times() {
            let next = self.done.net.start(index + 1);
            self.work = Trainee::new("deformation", next, &self.device);
        }
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        vec![("D", self.done.net.num_params())]
    }

    fn records(&self) -> io::Result<Records> {
        let mut records = Records::default();
        self.work.record(&mut records)?;
        self.done.record(&mut records)?;
        Ok(records)
    }

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        self.work.restore(records)?;
        self.done.restore(records)
    }

    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>> {
        None
    }

    fn motion(&self) -> Option<Box<dyn Motion<B::InnerBackend>>> {
        Some(Box::new(self.done.valid()))
    }
}
