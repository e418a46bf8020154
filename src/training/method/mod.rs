//! The methods that the learner can train: ours, and those that it is compared with.
//!
//! | file | methods (`method.name` in the recipe) |
//! |---|---|
//! | `network.rs` | `velocity-field`: `f(x, t)` carried by `V`, the paper's and ours |
//! | `flow.rs` | the same with `implicit.geometry = "flow"` |
//! | `ends.rs` | `mlp`, `sdf-blend`, `lipmlp`: fitted at t = 0 and t = 1 only |
//! | `nise.rs` | `nise`, `nise-velocity` |
//! | `eigenbasis.rs` | `eigenbasis` |
//! | `nfgp.rs` | `nfgp` |
//!
//! A [`Method`] owns its networks and their optimisers, and says what a step minimises. The loop, the
//! checkpoints, the surfaces and the evaluation are the same for all of them.

mod eigenbasis;
mod ends;
mod flow;
mod network;
mod nfgp;
mod nise;

use std::io;

use burn::module::AutodiffModule;
use burn::optim::{GradientsParams, Optimizer};
use isomorph_model::{Geometry, Motion, TrainBackend};

use crate::data::{Bounds, TrainingData};
use crate::optimiser::{self, AdamOf};
use crate::posed::{Posed, Slopes};
use crate::recipe::{GeometryKind, MethodName, Recipe};
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates};
use crate::samples::Drawn;

/// Something that can be trained on a pair of shapes.
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

    /// The surface as it stands, if the method has one of its own.
    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>>;

    /// The motion as it stands, if the method has one.
    fn motion(&self) -> Option<Box<dyn Motion<B::InnerBackend>>>;
}

/// The default method or the paper's, before its first step; `None` if the recipe names another.
/// `bounds` encloses all key frames, normalised.
pub fn own<B: TrainBackend>(
    recipe: &Recipe,
    bounds: &Bounds,
    device: &B::Device,
) -> Option<Box<dyn Method<B>>> {
    if recipe.method.name != MethodName::VelocityField {
        return None;
    }
    Some(match recipe.implicit.geometry {
        GeometryKind::Network => Box::new(network::VelocityField::<B>::new(recipe, device)),
        GeometryKind::Flow => Box::new(flow::Flow::<B>::new(recipe, bounds, device)),
    })
}

/// A method that isomorph is compared with, before its first step; `None` if the recipe names none.
pub fn baseline<B: TrainBackend>(
    recipe: &Recipe,
    bounds: &Bounds,
    device: &B::Device,
) -> Option<Box<dyn Method<B>>> {
    Some(match recipe.method.name {
        MethodName::VelocityField => return None,
        MethodName::Mlp => Box::new(ends::FitMlp::<B>::new(recipe, device)),
        MethodName::SdfBlend => Box::new(ends::FitBlend::<B>::new(recipe, device)),
        MethodName::Lipmlp => Box::new(ends::FitLipMlp::<B>::new(recipe, device)),
        MethodName::Nise | MethodName::NiseVelocity => {
            Box::new(nise::Evolved::<B>::new(recipe, device))
        }
        MethodName::Eigenbasis => Box::new(eigenbasis::Flow::<B>::new(recipe, bounds, device)),
        MethodName::Nfgp => Box::new(nfgp::Deformations::<B>::new(recipe, device)),
    })
}

/// Whether the data has what the recipe's method needs.
///
/// # Errors
/// What is missing, and what to do about it.
pub fn check(recipe: &Recipe, data: &TrainingData) -> Result<(), String> {
    let name = recipe.method.name;
    let normals = data.has_normals();
    if matches!(name, MethodName::Lipmlp | MethodName::Nfgp) && !normals {
        return Err(format!(
            "method.name = \"{name}\": it is trained on the normals of the shapes, and data.normals = \
             \"none\"; set it to \"auto\", or choose another method"
        ));
    }
    let matched = matches!(name, MethodName::Eigenbasis | MethodName::Nfgp);
    if matched && data.pair_count() == 0 {
        return Err(format!(
            "method.name = \"{name}\": it is fitted to correspondences, and data.correspondences = \
             \"none\"; name a file of pairs there, or choose another method"
        ));
    }
    Ok(())
}

/// A network with the optimiser that moves it, under the name of its files.
pub(super) struct Trainee<B: TrainBackend, M: AutodiffModule<B>> {
    /// `NAME.mpk` and `NAME-optimiser.mpk` in a checkpoint.
    name: &'static str,
    /// The network.
    pub net: M,
    optimiser: AdamOf<M, B>,
    device: B::Device,
}

impl<B: TrainBackend, M: AutodiffModule<B>> Trainee<B, M> {
    /// A network before its first step.
    pub fn new(name: &'static str, net: M, device: &B::Device) -> Self {
        let optimiser = optimiser::adam();
        Self {
            name,
            net,
            optimiser,
            device: device.clone(),
        }
    }

    /// The network with a place of its own in the graph: graphs that share no node can be made and
    /// walked side by side.
    pub fn replica(&self) -> M {
        M::from_inner(self.net.valid())
    }

    /// One step of the optimiser against the sum of the parts' gradients; see [`optimiser::advance`].
    pub fn advance(&mut self, parts: Vec<GradientsParams>, rate: f64, clip: f64) {
        let net = self.net.clone();
        self.net = optimiser::advance(&mut self.optimiser, net, parts, rate, clip);
    }

    /// The network for values.
    pub fn valid(&self) -> M::InnerModule {
        self.net.valid()
    }

    /// Adds the records of network and optimiser.
    pub fn record(&self, records: &mut Records) -> io::Result<()> {
        records.push::<B>(self.file(), self.net.clone().into_record())?;
        records.push::<B>(self.optimiser_file(), self.optimiser.to_record())
    }

    /// Takes both from records.
    pub fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        let net = records.get::<B, M::Record>(&self.file(), &self.device)?;
        let state = records.get::<B, _>(&self.optimiser_file(), &self.device)?;
        self.net = self.net.clone().load_record(net);
        let fresh = std::mem::replace(&mut self.optimiser, optimiser::adam());
        self.optimiser = fresh.load_record(state);
        Ok(())
    }

    fn file(&self) -> String {
        format!("{}.mpk", self.name)
    }

    fn optimiser_file(&self) -> String {
        format!("{}-optimiser.mpk", self.name)
    }
}
