//! The methods that the learner can train: ours, and those that it is compared with.
//!
//! | file | methods (`method.name` in the recipe) |
//! |---|---|
//! | `velocity_field.rs` | `velocity-field`: `f(x, t)` carried by `V`, the paper's and ours |
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
mod nfgp;
mod nise;
mod velocity_field;

use std::io;
use std::sync::OnceLock;

use burn::module::AutodiffModule;
use burn::optim::{GradientsParams, Optimizer};
use isomorph_model::{Geometry, Motion, TrainBackend};

use super::batch::Part;
use super::checkpoint::{self, Checkpoint, CheckpointError};
use super::event::Phase;
use super::optimiser::{self, AdamOf};
use super::posed::{Posed, Slopes};
use crate::recipe::{GeometryKind, MethodName, Recipe};
use crate::shape::{Bounds, NeighbourSearch, Pair, SignedDistance};

/// The learning rates of a step; 0 for what the method does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Of what gives the surface.
    pub implicit: f64,
    /// Of what moves points.
    pub velocity: f64,
}

/// Something that can be trained on a pair of shapes.
pub trait Method<B: TrainBackend>: Sync {
    /// Into how many equal parts the samples of a step are divided; they are worked on side by side.
    fn parts(&self) -> usize {
        1
    }

    /// The phase of a step, counted from 0.
    fn phase(&self, step: usize) -> Phase;

    /// The learning rates of a step.
    fn rates(&self, step: usize) -> Rates;

    /// What step `step` minimises, on one part of its own samples of the data, with replicas of the
    /// networks. What the step minimises is the mean over the parts.
    fn objective(&self, data: &TrainingData, step: usize, part: Part) -> Posed<B>;

    /// Moves the networks that train in this step against their gradients, which come in the order in
    /// which [`Self::objective`] names the networks.
    fn descend(&mut self, step: usize, slopes: &mut Slopes);

    /// The networks and how many weights each has.
    fn networks(&self) -> Vec<(&'static str, usize)>;

    /// Networks and optimiser states as the files of a checkpoint.
    ///
    /// # Errors
    /// What burn's recorder says.
    fn records(&self) -> io::Result<Records>;

    /// Takes networks and optimiser states from a checkpoint.
    ///
    /// # Errors
    /// [`CheckpointError`] if a file is damaged.
    fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError>;

    /// The surface as it stands, if the method has one of its own.
    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>>;

    /// The motion as it stands, if the method has one.
    fn motion(&self) -> Option<Box<dyn Motion<B::InnerBackend>>>;
}

/// The least batch that is divided: a quarter of fewer points would not pay for its operations.
const DIVIDED: usize = 512;

/// Into how many parts the samples of a step are divided: a function of the batch and the kind of backend,
/// so that the sums come out the same on any number of cores.
pub(super) fn parts<B: TrainBackend>(batch: usize) -> usize {
    match B::POINTS_AT_A_TIME {
        // A multiple of four, so that two, four or eight cores have the same amount of work each.
        Some(points) if batch >= DIVIDED => ((batch / points + 2) / 4 * 4).max(4),
        _ => 1,
    }
}

/// The method that a recipe names, before its first step; `bounds` encloses both shapes, normalised.
pub fn build<B: TrainBackend>(
    recipe: &Recipe,
    bounds: &Bounds,
    device: &B::Device,
) -> Box<dyn Method<B>> {
    match recipe.method.name {
        MethodName::VelocityField => match recipe.implicit.geometry {
            GeometryKind::Network => {
                Box::new(velocity_field::VelocityField::<B>::new(recipe, device))
            }
            GeometryKind::Flow => Box::new(flow::Flow::<B>::new(recipe, bounds, device)),
        },
        MethodName::Mlp => Box::new(ends::FitMlp::<B>::new(recipe, device)),
        MethodName::SdfBlend => Box::new(ends::FitBlend::<B>::new(recipe, device)),
        MethodName::Lipmlp => Box::new(ends::FitLipMlp::<B>::new(recipe, device)),
        MethodName::Nise | MethodName::NiseVelocity => {
            Box::new(nise::Evolved::<B>::new(recipe, device))
        }
        MethodName::Eigenbasis => Box::new(eigenbasis::Flow::<B>::new(recipe, bounds, device)),
        MethodName::Nfgp => Box::new(nfgp::Deformations::<B>::new(recipe, device)),
    }
}

/// Whether a pair has what the recipe's method needs.
///
/// # Errors
/// What is missing, and what to do about it.
pub fn check(recipe: &Recipe, pair: &Pair) -> Result<(), String> {
    let name = recipe.method.name;
    let normals = pair.source.normals.is_some() && pair.target.normals.is_some();
    if matches!(name, MethodName::Lipmlp | MethodName::Nfgp) && !normals {
        return Err(format!(
            "method.name = \"{name}\": it is trained on the normals of the shapes, and data.normals = \
             \"none\"; set it to \"auto\", or choose another method"
        ));
    }
    let matched = matches!(name, MethodName::Eigenbasis | MethodName::Nfgp);
    if matched && pair.correspondences.is_empty() {
        return Err(format!(
            "method.name = \"{name}\": it is fitted to correspondences, and data.correspondences = \
             \"none\"; name a file of pairs there, or choose another method"
        ));
    }
    Ok(())
}

/// What methods draw their samples from.
pub struct TrainingData {
    /// The two shapes.
    pub pair: Pair,
    distances: OnceLock<[SignedDistance; 2]>,
    source_search: OnceLock<NeighbourSearch>,
}

impl TrainingData {
    /// The data of a pair.
    pub fn new(pair: Pair) -> Self {
        Self {
            pair,
            distances: OnceLock::new(),
            source_search: OnceLock::new(),
        }
    }

    /// Signed distances to the source and to the target; `None` if either has no normals. Made on the
    /// first call: most methods need none.
    pub fn distances(&self) -> Option<&[SignedDistance; 2]> {
        let [source, target] = [&self.pair.source, &self.pair.target];
        let (n0, n1) = (source.normals.as_ref()?, target.normals.as_ref()?);
        Some(self.distances.get_or_init(|| {
            [
                SignedDistance::new(&source.points, n0),
                SignedDistance::new(&target.points, n1),
            ]
        }))
    }

    /// Neighbours among the points of the source; arranged on the first call.
    pub fn source_search(&self) -> &NeighbourSearch {
        self.source_search.get_or_init(|| {
            let points = self.pair.source.points.iter();
            let points: Vec<[f64; 3]> = points.map(|point| point.map(f64::from)).collect();
            NeighbourSearch::new(&points)
        })
    }
}

/// The files of a checkpoint: names and contents.
#[derive(Debug, Default)]
pub struct Records(pub Vec<(String, Vec<u8>)>);

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

    /// Adds the files of network and optimiser.
    pub fn record(&self, records: &mut Records) -> io::Result<()> {
        let net = checkpoint::encode::<B>(self.net.clone().into_record())?;
        let state = checkpoint::encode::<B>(self.optimiser.to_record())?;
        records.0.push((self.file(), net));
        records.0.push((self.optimiser_file(), state));
        Ok(())
    }

    /// Takes both from the files of a checkpoint.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        let net = checkpoint.load::<B, M::Record>(&self.file(), &self.device)?;
        let state = checkpoint.load::<B, _>(&self.optimiser_file(), &self.device)?;
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
