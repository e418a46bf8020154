//! The methods: what can be trained.
//!
//! | file | methods (`method.name` in the recipe) |
//! |---|---|
//! | `flow.rs` | `velocity-field` with `implicit.geometry = "flow"`: the default |
//! | `sequence.rs` | the same through more than two key frames |
//! | `network.rs` | `velocity-field` with `implicit.geometry = "network"`: the paper's |
//! | `ends.rs` | `mlp`, `sdf-blend`, `lipmlp`: fitted at t = 0 and t = 1 only |
//! | `spline.rs` | `velocity-field` with `velocity.kind = "spline"`: solved for, not trained |
//! | `trained_spline.rs` | with `"trained-spline"`: solved for first, beside end fields that are networks |
//! | `nise.rs` | `nise`, `nise-velocity` |
//! | `eigenbasis.rs` | `eigenbasis` |
//! | `nfgp.rs` | `nfgp` |
//! | `efis.rs` | `efis` |
//!
//! Each file holds all that a method is: its [`MethodSpec`] (name, needs, the keys of the recipe that act,
//! those that it has alone), and its networks and objective, a [`Method`]. Here stand the only list of
//! them, [`METHODS`], and what follows from it. The loop, the checkpoints, the surfaces and the evaluation
//! are the same for all.

mod efis;
mod eigenbasis;
mod ends;
mod flow;
mod network;
mod nfgp;
mod nise;
mod sequence;
pub(crate) mod spec;
pub mod spline;
mod trained_spline;

use std::io;

use burn::module::{AutodiffModule, ParamId};
use burn::optim::GradientsParams;
use isomorph_model::{Geometry, ModelBackend, Motion, TrainBackend};

use crate::data::{Bounds, Guide, TrainingData};
use crate::optimiser::Optimiser;
use crate::posed::{Posed, Slopes};
use crate::recipe::{self, Change, GeometryKind, Recipe, TrainingRecipe, VelocityKind};
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates};
use crate::samples::Drawn;
use crate::weights::Weights;

pub use spec::{MethodSpec, Needs};

/// Declares the list of methods: for each its spec, and the type that trains it.
macro_rules! methods {
    (
        own { $($o:ident::$OWN:ident => $Own:ident,)+ }
        solved { $($s:ident::$SOLVED:ident,)+ }
        baselines { $($b:ident::$BASE:ident => $Base:ident,)+ }
    ) => {
        /// Every method.
        pub static METHODS: &[&MethodSpec] = &[$(&$o::$OWN,)+ $(&$s::$SOLVED,)+ $(&$b::$BASE,)+];

        /// The default method or the paper's, before its first step; `None` if the recipe names another.
        /// `bounds` encloses all key frames, normalised.
        pub fn own<B: TrainBackend>(
            recipe: &Recipe,
            bounds: &Bounds,
            device: &B::Device,
        ) -> Option<Box<dyn Method<B>>> {
            let chosen = spec_of(recipe);
            if *chosen == flow::FLOW && recipe.data.keyframes.len() > 2 {
                return Some(Box::new(sequence::EndsThroughKeys::<B>::new(recipe, bounds, device)));
            }
            $( if *chosen == $o::$OWN {
                return Some(Box::new($o::$Own::<B>::new(recipe, bounds, device)));
            } )+
            None
        }

        /// A method that isomorph is compared with, before its first step; `None` if the recipe names
        /// none.
        pub fn baseline<B: TrainBackend>(
            recipe: &Recipe,
            bounds: &Bounds,
            device: &B::Device,
        ) -> Option<Box<dyn Method<B>>> {
            let chosen = spec_of(recipe);
            $( if *chosen == $b::$BASE {
                return Some(Box::new($b::$Base::<B>::new(recipe, bounds, device)));
            } )+
            None
        }
    };
}

methods! {
    own {
        flow::FLOW => EndsAndNet,
        trained_spline::TRAINED_SPLINE => EndsAndSpline,
        network::NETWORK => VelocityField,
    }
    solved {
        spline::SPLINE,
    }
    baselines {
        ends::MLP => FitMlp,
        ends::SDF_BLEND => FitBlend,
        ends::LIPMLP => FitLipMlp,
        nise::NISE => Evolved,
        nise::NISE_VELOCITY => Evolved,
        eigenbasis::EIGENBASIS => SineFlow,
        nfgp::NFGP => Deformations,
        efis::EFIS => EndsAndCouplings,
    }
}

/// The names of all methods, each once.
pub fn names() -> Vec<&'static str> {
    let mut names: Vec<_> = METHODS.iter().map(|spec| spec.name).collect();
    // Methods of one name stand side by side.
    names.dedup();
    names
}

/// The method of a recipe.
pub fn spec_of(recipe: &Recipe) -> &'static MethodSpec {
    let kind = recipe.velocity.kind;
    let found = spec(recipe.method.name, recipe.implicit.geometry, kind);
    found.expect("a recipe takes its method's name from the list")
}

/// Whether step `step` of the recipe takes a velocity field that is there already
/// ([`TrainingData::guide`]): key `training.guided-until`, in the methods where it acts.
pub fn is_guided(recipe: &Recipe, step: usize) -> bool {
    flow::is_guided(recipe, step) || starts_solved(recipe) && step == 0
}

/// Whether the first step cannot be without such a field: `V` is that field, and goes on from it.
pub fn starts_solved(recipe: &Recipe) -> bool {
    *spec_of(recipe) == trained_spline::TRAINED_SPLINE
}

/// Whether networks of the recipe are fitted to the shapes at their times, and a motion carries them.
pub fn has_end_fields(recipe: &Recipe) -> bool {
    *spec_of(recipe) == flow::FLOW || starts_solved(recipe)
}

/// The method of a name, where several have it that of the kind of V and of the geometry.
pub(crate) fn spec(
    name: &str,
    geometry: GeometryKind,
    kind: VelocityKind,
) -> Option<&'static MethodSpec> {
    let fits = |spec: &&&MethodSpec| {
        spec.name == name
            && spec.geometry.is_none_or(|own| own == geometry)
            && spec.velocity.is_none_or(|own| own == kind)
    };
    METHODS.iter().find(fits).copied()
}

/// Something that can be trained on key frames.
pub trait Method<B: TrainBackend>: Sync {
    /// Into how many equal parts the samples of a step can be divided; they are worked on side by side.
    fn parts(&self) -> usize {
        1
    }

    /// The phase of a step, counted from 0.
    fn phase(&self, step: usize) -> Phase;

    /// The learning rates of a step.
    fn rates(&self, step: usize) -> Rates;

    /// The samples of a step, all of them.
    fn draw(&self, data: &TrainingData, step: usize) -> Drawn;

    /// What step `step` minimises at samples that are all of its own or one part of them, with replicas of
    /// the networks. What the step minimises is the mean over the parts.
    fn objective(&self, data: &TrainingData, drawn: &Drawn, step: usize) -> Posed<B>;

    /// Moves the networks that train in this step against their gradients, which come in the order in
    /// which [`Self::objective`] names the networks.
    fn descend(&mut self, step: usize, slopes: &mut Slopes);

    /// The networks and how many weights each has.
    fn networks(&self) -> Vec<(&'static str, usize)>;

    /// Networks and optimiser states.
    ///
    /// # Errors
    /// What burn's recorder says.
    fn records(&self) -> io::Result<Records>;

    /// Takes networks and optimiser states.
    ///
    /// # Errors
    /// [`RecordError`] if a record is missing or of another kind.
    fn restore(&mut self, records: &Records) -> Result<(), RecordError>;

    /// Starts with a velocity field that is there already, if it can be that field: before the first step.
    fn take(&mut self, _: &dyn Guide) {}

    /// Takes the networks of a run through the first `known` key frames, which are learned already. A method whose
    /// networks are others there learns all anew.
    ///
    /// # Errors
    /// [`RecordError`] if a record is missing or of another kind.
    fn grow(&mut self, _: &Records, _known: usize) -> Result<(), RecordError> {
        Ok(())
    }

    /// Learns little of the first `known` key frames, which were learned before the others were there.
    fn spare(&mut self, _known: usize) {}

    /// What the networks have learned, as plain arrays; of the methods that isomorph is compared with nothing.
    fn weights(&self) -> Option<Weights> {
        None
    }

    /// The surface as it stands, if the method has one of its own.
    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>>;

    /// The motion as it stands, if the method has one.
    fn motion(&self) -> Option<Box<dyn Motion<B::InnerBackend>>>;

    /// Surface and motion from each key frame to the next, where there are more than two: these stand in for the other
    /// two.
    fn through(&self) -> Option<Through<B::InnerBackend>> {
        None
    }
}

/// Surface and motion from each key frame to the next, over a time from 0 to 1.
pub struct Through<B: ModelBackend> {
    /// The times of the key frames, 0 to 1.
    pub times: Vec<f64>,
    /// Those from the key frame of this number on.
    pub part: Box<PartOf<B>>,
}

/// Gives what there is from a key frame to the next.
pub type PartOf<B> = dyn Fn(usize) -> (Box<dyn Geometry<B>>, Box<dyn Motion<B>>) + Send + Sync;

/// Whether the data has what the recipe's method needs.
///
/// # Errors
/// What is missing, and what to do about it.
pub fn check(recipe: &Recipe, data: &TrainingData) -> Result<(), String> {
    let MethodSpec { name, needs, .. } = spec_of(recipe);
    if needs.normals && !data.has_normals() {
        return Err(format!(
            "method.name = \"{name}\": it {}, and the shapes have none; set data.normals to \"auto\", or \
             choose another method",
            spec::ON_NORMALS
        ));
    }
    if needs.correspondences && data.pair_count() == 0 {
        return Err(format!(
            "method.name = \"{name}\": it {}, and there are none; name a file of pairs in \
             data.correspondences, or choose another method",
            spec::ON_CORRESPONDENCES
        ));
    }
    Ok(())
}

/// The change of a run's method, which no run takes, and why.
pub fn changed_method(before: &Recipe, after: &Recipe) -> Option<(Change, &'static str)> {
    let mut changes = before.changes(after).into_iter();
    let change = changes
        .find(|change| change.key.starts_with("method.") || change.key == "velocity.kind")?;
    Some((change, "a run keeps its method"))
}

/// The first change that a run cannot take once it has begun, and why: another method, another network, or
/// a key that the method fixes.
pub fn fixed_change(before: &Recipe, after: &Recipe) -> Option<(Change, &'static str)> {
    if let Some(change) = changed_method(before, after) {
        return Some(change);
    }
    let fixed = spec_of(before).fixed;
    before.changes(after).into_iter().find_map(|change| {
        let section = change.key.split('.').next().unwrap_or_default();
        let why = match section {
            "implicit" | "velocity" => "a trained network cannot change its shape",
            _ => {
                let is_fixed = |key: &str| key == change.key || key == section;
                fixed.iter().find(|(key, _)| is_fixed(key))?.1
            }
        };
        Some((change, why))
    })
}

/// What the fields of this project fix beside their networks.
const FIXED_OPTIMISER: [(&str, &str); 1] = [(
    "training.optimiser",
    "the momenta of a checkpoint are those of its optimiser",
)];

/// A network with the optimiser that moves it, under the name of its files.
pub(super) struct Trainee<B: TrainBackend, M: AutodiffModule<B>> {
    /// `NAME.mpk` and `NAME-optimiser.mpk` in a checkpoint, and with Muon `NAME-muon-optimiser.mpk`.
    name: String,
    /// The network.
    pub net: M,
    optimiser: Optimiser<B, M>,
    device: B::Device,
}

impl<B: TrainBackend, M: AutodiffModule<B>> Trainee<B, M> {
    /// A network before its first step, which Adam moves.
    pub(crate) fn new(name: &str, net: M, device: &B::Device) -> Self {
        Self {
            name: name.to_owned(),
            net,
            optimiser: Optimiser::adam(),
            device: device.clone(),
        }
    }

    /// A network of `f` before its first step, with the optimiser of the recipe and its rates for `f`.
    /// Muon moves the matrices `hidden`.
    fn of_field(
        name: &str,
        net: M,
        hidden: Vec<ParamId>,
        training: &TrainingRecipe,
        device: &B::Device,
    ) -> Self {
        let rates = [training.learning_rate, training.muon_rate];
        Self::new(name, net, device).moved_by(training.optimiser, hidden, rates)
    }

    /// The same of what moves points.
    fn of_motion(
        name: &str,
        net: M,
        hidden: Vec<ParamId>,
        training: &TrainingRecipe,
        device: &B::Device,
    ) -> Self {
        let rates = [training.velocity_learning_rate, training.velocity_muon_rate];
        Self::new(name, net, device).moved_by(training.optimiser, hidden, rates)
    }

    /// The same network with this optimiser; the first learning rates of Adam and of Muon.
    fn moved_by(
        mut self,
        kind: recipe::Optimiser,
        hidden: Vec<ParamId>,
        [adam, muon]: [f64; 2],
    ) -> Self {
        self.optimiser = match kind {
            recipe::Optimiser::Adam => Optimiser::adam(),
            recipe::Optimiser::Muon => Optimiser::muon(hidden, muon / adam),
        };
        self
    }

    /// The network with a place of its own in the graph: graphs that share no node can be made and
    /// walked side by side.
    pub(crate) fn replica(&self) -> M {
        M::from_inner(self.net.valid())
    }

    /// One step of the optimiser against the sum of the parts' gradients; see [`Optimiser::advance`].
    pub(crate) fn advance(&mut self, parts: Vec<GradientsParams>, rate: f64, clip: f64) {
        let net = self.net.clone();
        self.net = self.optimiser.advance(net, parts, rate, clip);
    }

    /// The network for values.
    pub(crate) fn valid(&self) -> M::InnerModule {
        self.net.valid()
    }

    /// Adds the records of network and optimiser.
    pub(crate) fn record(&self, records: &mut Records) -> io::Result<()> {
        records.push::<B>(self.file(), self.net.clone().into_record())?;
        self.optimiser.record(&self.name, records)
    }

    /// Takes both from records.
    pub(crate) fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        let net = self.loaded(self.net.clone(), records)?;
        self.optimiser
            .restore(&self.name, &self.file(), records, &self.device)?;
        self.net = net;
        Ok(())
    }

    /// A network with the weights of the record of this name, which has that form.
    fn loaded(&self, form: M, records: &Records) -> Result<M, RecordError> {
        let file = self.file();
        let mut own = Records::default();
        own.push::<B>(file.clone(), form.clone().into_record())
            .map_err(|error| RecordError::new(&file, error.to_string()))?;
        let net = records.get::<B, M::Record>(&file, &own, &self.device)?;
        Ok(form.load_record(net))
    }

    fn file(&self) -> String {
        format!("{}.mpk", self.name)
    }
}
