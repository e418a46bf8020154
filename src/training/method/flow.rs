//! The flow's geometry (`implicit.geometry = "flow"`): two end fields and the velocity field that carries
//! them, trained side by side. The end fields train in all steps, the velocity field as the schedule says.

use std::io;

use burn::module::{AutodiffModule, Module, ParamId};
use isomorph_model::flow::end_fields::{EndFields, EndFieldsConfig};
use isomorph_model::operators::VelocityField;
use isomorph_model::{FlowGeometry, Geometry, Objective, SplineGrid, TrainBackend, VelocityNet};

use super::ends::OnDevice;
use super::spec::{Acts, Keys, MethodSpec, Needs};
use super::{FIXED_OPTIMISER, Method, Trainee, spec_of};
use crate::data::{Bounds, Guide, TrainingData};
use crate::flow_step::FlowStep;
use crate::guided::Guided;
use crate::motion::Motion;
use crate::posed::{Posed, Slopes};
use crate::recipe::{GeometryKind, Recipe, VelocityKind};
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates};
use crate::samples::{self, Batch, BatchSizes, Drawn, EndBatch};
use crate::schedule::Schedule;
use crate::settings::Settings;
use crate::tensors::rows;
use crate::weights::Weights;

/// The default method.
pub(super) static FLOW: MethodSpec = MethodSpec {
    name: "velocity-field",
    geometry: Some(GeometryKind::Flow),
    velocity: Some(VelocityKind::Network),
    about: "two end fields, carried by a velocity field V: the default",
    citation: "after Sang, Canfes, Cao, Bernard, Cremers, \"Implicit Neural Surface \
               Deformation with Explicit Velocity Fields\", ICLR 2025; the geometry is ours",
    needs: Needs::NOTHING,
    is_baseline: false,
    acts: Acts {
        implicit: Keys::All,
        velocity: Keys::All,
        // The level-set equation holds by itself, and normals are moved by nothing but the flow.
        loss: Keys::AllBut(&[
            "level-set",
            "level-set-form",
            "lambda-l",
            "transported-normals",
        ]),
        training: Keys::All,
    },
    own: None,
    fixed: &FIXED_OPTIMISER,
    changes: &[],
    takes_many: true,
    // Those of splines through many key frames: the mean interval is the unit of time.
    many: &["loss.strain=1.0", "loss.divergence=1.0", "loss.screw=10.0"],
    // An end field between two intervals learns in the steps of both.
    steps_of_interval: Some(2.0 / 3.0),
};

/// Whether V learns from a guide in step `step` of the recipe.
pub(super) fn is_guided(recipe: &Recipe, step: usize) -> bool {
    *spec_of(recipe) == FLOW && Schedule::new(&recipe.training).is_guided(step)
}

/// Points to a side of the lattice that decides how finely the geometry follows the flow.
const PROBES: usize = 24;

/// What may be the `V` of a flow between two shapes.
pub(super) trait FlowVelocity<B: TrainBackend>:
    AutodiffModule<
        B,
        InnerModule: VelocityField<B::InnerBackend>
                         + isomorph_model::Motion<B::InnerBackend>
                         + 'static,
    > + VelocityField<B>
    + Sync
    + 'static
{
    /// Whether it is the guide in the steps that are guided, and does not learn from it.
    const IS_GUIDE: bool;

    /// As the recipe's seed makes it; `bounds` encloses both shapes.
    fn new(settings: &Settings, bounds: &Bounds, device: &B::Device) -> Self;

    /// The matrices that Muon moves.
    fn hidden_weights(&self) -> Vec<ParamId>;

    /// The guide itself, where that is one of its kind.
    fn of_guide(_: &dyn Guide, _: &B::Device) -> Option<Self> {
        None
    }

    /// One of the form of the record of this name.
    ///
    /// # Errors
    /// [`RecordError`] if that record says none.
    fn like_record(&self, _: &Records, _name: &str, _: &B::Device) -> Result<Self, RecordError> {
        Ok(self.clone())
    }

    /// Its grid, if it has one.
    fn grid(&self) -> Option<SplineGrid> {
        None
    }
}

impl<B: TrainBackend> FlowVelocity<B> for VelocityNet<B> {
    const IS_GUIDE: bool = false;

    fn new(settings: &Settings, _: &Bounds, device: &B::Device) -> Self {
        // The end fields take `seed` and the one after it.
        let seed = settings.training.seed.wrapping_add(2);
        settings.velocity.init(seed, device)
    }

    fn hidden_weights(&self) -> Vec<ParamId> {
        self.hidden_weights()
    }
}

/// The end fields, the velocity field and how they are trained.
pub(super) struct EndsAndFlow<B: TrainBackend, V: FlowVelocity<B>> {
    settings: Settings,
    schedule: Schedule,
    device: B::Device,
    /// What holds both shapes and the space around them.
    bounds: Bounds,
    ends: Trainee<B, EndFields<B>>,
    velocity: Trainee<B, V>,
}

/// With a network as `V`.
pub(super) type EndsAndNet<B> = EndsAndFlow<B, VelocityNet<B>>;

impl<B: TrainBackend, V: FlowVelocity<B>> EndsAndFlow<B, V> {
    /// All networks as the recipe's seed makes them; `bounds` encloses both shapes, normalised.
    pub(super) fn new(recipe: &Recipe, bounds: &Bounds, device: &B::Device) -> Self {
        let settings = Settings::new(recipe);
        let seed = settings.training.seed;
        let implicit = settings.implicit;
        let ends = EndFieldsConfig { implicit }.init(seed, device);
        let velocity = V::new(&settings, bounds, device);
        let training = &settings.training;
        let (hidden, hidden_velocity) = (ends.hidden_weights(), velocity.hidden_weights());
        Self {
            schedule: Schedule::new(training),
            bounds: bounds.padded(settings.training.box_margin as f32),
            ends: Trainee::of_field("ends", ends, hidden, training, device),
            velocity: Trainee::of_motion("velocity", velocity, hidden_velocity, training, device),
            device: device.clone(),
            settings,
        }
    }
}

/// The phase of a step.
pub(super) fn phase(schedule: &Schedule, step: usize) -> Phase {
    if schedule.is_guided(step) {
        return Phase::Guided;
    }
    // The end fields train from the first step, so that there is no warm-up of the velocity alone.
    match schedule.phase(step) {
        Phase::WarmUp => Phase::Ramp,
        phase => phase,
    }
}

/// The learning rates of a step.
pub(super) fn rates(settings: &Settings, schedule: &Schedule, step: usize) -> Rates {
    let training = &settings.training;
    let (first, steps) = (training.learning_rate, training.steps);
    Rates {
        implicit: schedule.rate(first, step, 0, steps),
        velocity: schedule.velocity_rate(step),
    }
}

/// The samples of a step between two key frames.
pub(super) fn draw(settings: &Settings, phase: Phase, data: &TrainingData, step: usize) -> Drawn {
    let training = &settings.training;
    let sizes = BatchSizes {
        // The end fields have samples of their own.
        ends: 0,
        ..BatchSizes::new(training, data)
    };
    let ends = EndBatch::draw(data, training, step, settings.measures_distances());
    if phase == Phase::ImplicitOnly {
        return Drawn {
            ends,
            ..Drawn::default()
        };
    }
    if phase == Phase::Guided {
        return Drawn {
            guided: Guided::draw(data, training, sizes, step),
            ends,
            ..Drawn::default()
        };
    }
    Drawn {
        batch: Batch::draw(data, training, sizes, step),
        ends,
        ..Drawn::default()
    }
}

/// What a step between two key frames is made with.
pub(super) struct Made<'a, B: TrainBackend> {
    pub settings: &'a Settings,
    pub schedule: &'a Schedule,
    pub phase: Phase,
    pub device: &'a B::Device,
    pub ends: &'a EndFields<B>,
    pub v: &'a dyn VelocityField<B>,
    /// `V` for values.
    pub still: &'a dyn VelocityField<B::InnerBackend>,
}

impl<B: TrainBackend> Made<'_, B> {
    /// What the step minimises.
    pub(super) fn objective(
        &self,
        data: &TrainingData,
        drawn: &Drawn,
        step: usize,
    ) -> Objective<B> {
        let (settings, schedule, device) = (self.settings, self.schedule, self.device);
        let measured = settings.measures_distances();
        let [source, target] = OnDevice::new(data, &drawn.ends, measured, device).apart();
        let last_scale = settings.loss.matching_scale;
        let flow_step = FlowStep {
            motion: Motion {
                settings,
                v: self.v,
                still: self.still,
                matching_scale: schedule.matching_scale(last_scale, step),
                device,
            },
            phase: self.phase,
            warms_up: schedule.phase(step) == Phase::WarmUp,
            ramp: schedule.ramp(step),
            ends: self.ends,
        };
        flow_step.objective(&drawn.batch, &drawn.guided, [&source, &target])
    }
}

impl<B: TrainBackend, V: FlowVelocity<B>> EndsAndFlow<B, V> {
    /// The end fields as the flow carries them.
    fn carried(&self) -> FlowGeometry<B::InnerBackend> {
        let probes = rows(&lattice(&self.bounds), &self.device);
        FlowGeometry::new(self.ends.valid(), self.velocity.valid(), probes)
    }
}

impl<B: TrainBackend, V: FlowVelocity<B>> Method<B> for EndsAndFlow<B, V> {
    fn phase(&self, step: usize) -> Phase {
        match phase(&self.schedule, step) {
            Phase::Guided if V::IS_GUIDE => Phase::ImplicitOnly,
            phase => phase,
        }
    }

    fn rates(&self, step: usize) -> Rates {
        rates(&self.settings, &self.schedule, step)
    }

    fn parts(&self) -> usize {
        samples::parts(self.settings.training.batch)
    }

    fn draw(&self, data: &TrainingData, step: usize) -> Drawn {
        draw(&self.settings, self.phase(step), data, step)
    }

    fn objective(&self, data: &TrainingData, drawn: &Drawn, step: usize) -> Posed<B> {
        let (ends, v) = (self.ends.replica(), self.velocity.replica());
        let still = self.velocity.valid();
        let made = Made {
            settings: &self.settings,
            schedule: &self.schedule,
            phase: self.phase(step),
            device: &self.device,
            ends: &ends,
            v: &v,
            still: &still,
        };
        Posed::new(made.objective(data, drawn, step)).by(ends).by(v)
    }

    fn descend(&mut self, step: usize, slopes: &mut Slopes) {
        let clip = self.settings.training.clip;
        let (phase, rates) = (self.phase(step), self.rates(step));
        self.ends.advance(slopes.take(0), rates.implicit, clip);
        if phase != Phase::ImplicitOnly {
            self.velocity.advance(slopes.take(1), rates.velocity, clip);
        }
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        let (ends, v) = (&self.ends.net, &self.velocity.net);
        vec![("g and h", ends.num_params()), ("V", v.num_params())]
    }

    fn records(&self) -> io::Result<Records> {
        let mut records = Records::default();
        self.ends.record(&mut records)?;
        self.velocity.record(&mut records)?;
        Ok(records)
    }

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        self.ends.restore(records)?;
        let velocity = &mut self.velocity;
        let name = velocity.file();
        velocity.net = velocity.net.like_record(records, &name, &self.device)?;
        velocity.restore(records)
    }

    fn take(&mut self, guide: &dyn Guide) {
        if let Some(net) = V::of_guide(guide, &self.device) {
            self.velocity.net = net;
        }
    }

    fn weights(&self) -> Option<Weights> {
        let mut weights = Weights {
            flow_steps: Some(self.carried().steps()),
            grid: self.velocity.net.grid(),
            ..Weights::default()
        };
        // Both end fields: `source.` and `target.`.
        weights.add("source", self.ends.valid().source());
        weights.add("target", self.ends.valid().target());
        weights.add("velocity", &self.velocity.valid());
        Some(weights)
    }

    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>> {
        Some(Box::new(self.carried()))
    }

    fn motion(&self) -> Option<Box<dyn isomorph_model::Motion<B::InnerBackend>>> {
        Some(Box::new(self.velocity.valid()))
    }
}

/// The middles of equal cells of a box.
pub(super) fn lattice(bounds: &Bounds) -> Vec<[f32; 3]> {
    let at = |axis: usize, k: usize| {
        let (low, high) = (bounds.min[axis], bounds.max[axis]);
        low + (high - low) * (k as f32 + 0.5) / PROBES as f32
    };
    let of = |k: usize| [k / (PROBES * PROBES), k / PROBES % PROBES, k % PROBES];
    let points = (0..PROBES.pow(3)).map(|k| {
        let of = of(k);
        std::array::from_fn(|axis| at(axis, of[axis]))
    });
    points.collect()
}
