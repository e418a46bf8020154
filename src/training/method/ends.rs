//! The methods that are fitted at t = 0 and t = 1 and left alone between: `mlp`, `sdf-blend`, `lipmlp`.

use std::io;
use std::ops::Range;

use burn::module::AutodiffModule;
use isomorph_model::baseline::blend::{SdfBlend, SdfBlendConfig};
use isomorph_model::baseline::lipmlp::{LipMlp, LipMlpConfig};
use isomorph_model::baseline::mlp::{PlainMlp, PlainMlpConfig};
use isomorph_model::flow::end_terms::EndSamples;
use isomorph_model::{Geometry, Motion, Objective, TrainBackend};

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

/// `mlp`.
pub(super) static MLP: MethodSpec = MethodSpec {
    name: "mlp",
    geometry: None,
    velocity: None,
    about: "one network f(x, t), fitted at t = 0 and t = 1 only",
    citation: "the baseline of the same name in Sang et al., ICLR 2025, Section 5",
    needs: Needs::NOTHING,
    is_baseline: true,
    acts: AT_ENDS,
    own: None,
    fixed: &[],
    changes: &SOFT,
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

/// `sdf-blend`.
pub(super) static SDF_BLEND: MethodSpec = MethodSpec {
    name: "sdf-blend",
    geometry: None,
    velocity: None,
    about: "the linear blend of two distance fields, (1 - t) g + t h",
    citation: "Payne and Toga, \"Distance field manipulation of surface models\", 1992",
    needs: Needs::NOTHING,
    is_baseline: true,
    acts: AT_ENDS,
    own: None,
    fixed: &[],
    changes: &SOFT,
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

/// `lipmlp`.
pub(super) static LIPMLP: MethodSpec = MethodSpec {
    name: "lipmlp",
    geometry: None,
    velocity: None,
    about: "one network f(x, t) with a small Lipschitz constant, fitted at t = 0 and t = 1 only",
    citation: "Liu, Williams, Jacobson, Fidler, Litany, \"Learning Smooth Neural Functions via \
               Lipschitz Regularization\", SIGGRAPH 2022",
    needs: Needs {
        normals: true,
        ..Needs::NOTHING
    },
    is_baseline: true,
    acts: Acts {
        implicit: Keys::Only(&["depth", "width"]),
        velocity: Keys::None,
        loss: Keys::None,
        training: Keys::Only(&[
            "steps",
            "batch",
            "learning-rate",
            "schedule",
            "decay",
            "decay-every",
            "final-learning-rate",
            "band-share",
            "band-widths",
            "box-margin",
            "clip",
            "seed",
            "log-every",
        ]),
    },
    own: Some(LipmlpKeys::SECTION),
    fixed: &[(
        "lipmlp.space-scale",
        "a trained network cannot change its input",
    )],
    changes: &["training.learning-rate=2e-3"],
    takes_many: false,
    many: &[],
    steps_of_interval: None,
};

section! {
    /// The keys of the method "lipmlp".
    lipmlp: LipmlpKeys {
        /// Weight of the bound on the Lipschitz constant.
        lipschitz: f64 = 1e-6 | 1e-6 | 1e-6 | 1e-6 | 1e-6, Rule::positive_or_zero().zero("turns it off");
        /// Factor on positions before the network, so that the bound acts on time.
        space_scale: f64 = 100 | 100 | 100 | 100 | 100, Rule::above_zero(1e6);
    }
}

/// The terms at the ends, and what samples and optimiser take.
const AT_ENDS: Acts = Acts {
    implicit: Keys::All,
    velocity: Keys::None,
    loss: Keys::Only(&["data", "normals", "eikonal", "off-surface", "distance"]),
    training: Keys::Only(&[
        "steps",
        "batch",
        "learning-rate",
        "schedule",
        "decay",
        "decay-every",
        "final-learning-rate",
        "derivatives",
        "band-share",
        "band-widths",
        "box-margin",
        "clip",
        "seed",
        "log-every",
    ]),
};

/// Softplus networks, as the sources of these methods have them or leave open: sines would give a plain
/// network between its ends the freedom to dissolve.
const SOFT: [&str; 3] = [
    "implicit.activation=softplus",
    "implicit.beta=100",
    "training.learning-rate=2e-3",
];

/// A network and what its step at the ends minimises.
pub(super) trait EndNet<B: TrainBackend>:
    AutodiffModule<B, InnerModule: Geometry<B::InnerBackend> + 'static> + Sync + 'static
{
    /// The network as the recipe's seed makes it.
    fn new(recipe: &Recipe, settings: &Settings, device: &B::Device) -> Self;

    /// The terms at the samples of one step.
    fn terms(&self, recipe: &Recipe, settings: &Settings, samples: &OnDevice<B>) -> Objective<B>;

    /// Whether it learns from signed distances.
    const DISTANCES: bool = false;
}

/// One network fitted at both ends in every step.
pub(super) struct EndFit<B: TrainBackend, M: EndNet<B>> {
    recipe: Recipe,
    settings: Settings,
    schedule: Schedule,
    device: B::Device,
    net: Trainee<B, M>,
}

/// `mlp`.
pub(super) type FitMlp<B> = EndFit<B, PlainMlp<B>>;
/// `sdf-blend`.
pub(super) type FitBlend<B> = EndFit<B, SdfBlend<B>>;
/// `lipmlp`.
pub(super) type FitLipMlp<B> = EndFit<B, LipMlp<B>>;

impl<B: TrainBackend, M: EndNet<B>> EndFit<B, M> {
    /// Before the first step.
    pub(super) fn new(recipe: &Recipe, _: &Bounds, device: &B::Device) -> Self {
        let settings = Settings::new(recipe);
        let net = M::new(recipe, &settings, device);
        Self {
            recipe: recipe.clone(),
            schedule: Schedule::new(&settings.training),
            net: Trainee::new("implicit", net, device),
            device: device.clone(),
            settings,
        }
    }

    /// Whether signed distances take part in a step.
    fn measured(&self) -> bool {
        M::DISTANCES || self.settings.measures_distances()
    }
}

impl<B: TrainBackend, M: EndNet<B>> Method<B> for EndFit<B, M> {
    fn phase(&self, _: usize) -> Phase {
        Phase::Ends
    }

    fn rates(&self, step: usize) -> Rates {
        let training = &self.settings.training;
        let implicit = self
            .schedule
            .rate(training.learning_rate, step, 0, training.steps);
        Rates {
            implicit,
            velocity: 0.0,
        }
    }

    fn parts(&self) -> usize {
        samples::parts(self.settings.training.batch)
    }

    fn draw(&self, data: &TrainingData, step: usize) -> Drawn {
        Drawn {
            ends: EndBatch::draw(data, &self.settings.training, step, self.measured()),
            ..Drawn::default()
        }
    }

    fn objective(&self, data: &TrainingData, drawn: &Drawn, _: usize) -> Posed<B> {
        let drawn = OnDevice::new(data, &drawn.ends, self.measured(), &self.device);
        let net = self.net.replica();
        Posed::new(net.terms(&self.recipe, &self.settings, &drawn)).by(net)
    }

    fn descend(&mut self, step: usize, slopes: &mut Slopes) {
        let rate = self.rates(step).implicit;
        let clip = self.settings.training.clip;
        self.net.advance(slopes.take(0), rate, clip);
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        vec![("f", self.net.net.num_params())]
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
        Some(Box::new(self.net.valid()))
    }

    fn motion(&self) -> Option<Box<dyn Motion<B::InnerBackend>>> {
        None
    }
}

impl<B: TrainBackend> EndNet<B> for PlainMlp<B> {
    fn new(_: &Recipe, settings: &Settings, device: &B::Device) -> Self {
        let implicit = settings.implicit;
        PlainMlpConfig { implicit }.init(settings.training.seed, device)
    }

    fn terms(&self, _: &Recipe, settings: &Settings, drawn: &OnDevice<B>) -> Objective<B> {
        let weights = end_weights(&settings.loss);
        self.objective(&drawn.both(), &weights, &settings.derivatives)
    }
}

impl<B: TrainBackend> EndNet<B> for SdfBlend<B> {
    fn new(_: &Recipe, settings: &Settings, device: &B::Device) -> Self {
        let implicit = settings.implicit;
        SdfBlendConfig { implicit }.init(settings.training.seed, device)
    }

    fn terms(&self, _: &Recipe, settings: &Settings, drawn: &OnDevice<B>) -> Objective<B> {
        let weights = end_weights(&settings.loss);
        let [source, target] = drawn.apart();
        self.objective([&source, &target], &weights, &settings.derivatives)
    }
}

impl<B: TrainBackend> EndNet<B> for LipMlp<B> {
    fn new(recipe: &Recipe, settings: &Settings, device: &B::Device) -> Self {
        let config = LipMlpConfig {
            depth: settings.implicit.depth,
            width: settings.implicit.width,
            space_scale: recipe.keys_of::<LipmlpKeys>().space_scale,
        };
        config.init(settings.training.seed, device)
    }

    fn terms(&self, recipe: &Recipe, _: &Settings, drawn: &OnDevice<B>) -> Objective<B> {
        self.objective(&drawn.both(), recipe.keys_of::<LipmlpKeys>().lipschitz)
    }

    const DISTANCES: bool = true;
}

/// The samples of a part on the device.
pub(super) struct OnDevice<'a, B: TrainBackend> {
    pub batch: &'a EndBatch,
    /// Signed distances of the points in space from the shape of their key frame, or none.
    distances: Vec<f32>,
    device: B::Device,
}

impl<'a, B: TrainBackend> OnDevice<'a, B> {
    /// With signed distances if `distances` asks for them and every key frame has normals.
    pub(super) fn new(
        data: &TrainingData,
        batch: &'a EndBatch,
        distances: bool,
        device: &B::Device,
    ) -> Self {
        let points = batch.space.points.iter().zip(&batch.space.times);
        let distance = |(x, t): (&[f32; 3], &f32)| data.key_at(*t).around.signed_distance(*x);
        let known: Option<Vec<f32>> = if distances && data.has_normals() {
            points.map(distance).collect()
        } else {
            None
        };
        Self {
            batch,
            distances: known.unwrap_or_default(),
            device: device.clone(),
        }
    }

    /// All key frames together.
    pub(super) fn both(&self) -> EndSamples<B> {
        let (surface, space) = (&self.batch.surface.points, &self.batch.space.points);
        self.samples(0..surface.len(), 0..space.len())
    }

    /// The source's and the target's.
    pub(super) fn apart(&self) -> [EndSamples<B>; 2] {
        let (n, m) = (
            self.batch.surface.points.len(),
            self.batch.space.points.len(),
        );
        [
            self.samples(0..n / 2, 0..m / 2),
            self.samples(n / 2..n, m / 2..m),
        ]
    }

    fn samples(&self, on: Range<usize>, off: Range<usize>) -> EndSamples<B> {
        let (surface, space) = (&self.batch.surface, &self.batch.space);
        let known = surface.normals.len() == surface.points.len();
        let measured = !self.distances.is_empty();
        EndSamples {
            surface: rows(&surface.points[on.clone()], &self.device),
            surface_times: column(&surface.times[on.clone()], &self.device),
            normals: known.then(|| rows(&surface.normals[on], &self.device)),
            space: rows(&space.points[off.clone()], &self.device),
            space_times: column(&space.times[off.clone()], &self.device),
            distances: measured.then(|| column(&self.distances[off], &self.device)),
        }
    }
}
