//! What a method is, apart from what it computes: [`MethodSpec`], one for each method, in its own file.

use crate::recipe::schema::{Key, Section};
use crate::recipe::{GeometryKind, VelocityKind};

/// A method of the recipe: its name, its needs and the keys on which it acts.
#[derive(Debug)]
pub struct MethodSpec {
    /// `method.name` in the recipe.
    pub name: &'static str,
    /// `implicit.geometry`, where that is a part of what the method is.
    pub geometry: Option<GeometryKind>,
    /// `velocity.kind`, where that is a part of what the method is.
    pub velocity: Option<VelocityKind>,
    /// What it is, in one line.
    pub about: &'static str,
    /// Where it was published.
    pub citation: &'static str,
    /// What it cannot do without.
    pub needs: Needs,
    /// Whether it is one that isomorph is compared with.
    pub is_baseline: bool,
    /// The keys that act.
    pub(crate) acts: Acts,
    /// The section of the keys that it has alone.
    pub(crate) own: Option<&'static Section>,
    /// Keys beside those of the networks that are fixed once a run has begun, or all of a section, each with the reason.
    pub(crate) fixed: &'static [(&'static str, &'static str)],
    /// What a comparison changes for it in the preset `quick`, beside the method itself.
    pub(crate) changes: &'static [&'static str],
    /// Whether it takes more than two key frames.
    pub(crate) takes_many: bool,
    /// Values that keys have in every preset where there are more than two key frames.
    pub(crate) many: &'static [&'static str],
    /// The steps of each interval where there are more than two key frames, as a share of those that the preset has for
    /// two, if their number grows with that of the intervals.
    pub(crate) steps_of_interval: Option<f64>,
}

/// What a method cannot do without.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// Normals of all shapes.
    pub normals: bool,
    /// Correspondences.
    pub correspondences: bool,
    /// A mesh as the source: the method has no surface of its own, and moves that one.
    pub mesh: bool,
}

/// The keys of the sections that act; those of `data`, `checkpoint` and `result` always do.
#[derive(Debug)]
pub(crate) struct Acts {
    pub(crate) implicit: Keys,
    pub(crate) velocity: Keys,
    pub(crate) loss: Keys,
    pub(crate) training: Keys,
}

/// Keys of one section, as they are written in a recipe.
#[derive(Debug)]
pub(crate) enum Keys {
    None,
    All,
    AllBut(&'static [&'static str]),
    Only(&'static [&'static str]),
}

impl Needs {
    /// A method for any shapes.
    pub const NOTHING: Self = Self {
        normals: false,
        correspondences: false,
        mesh: false,
    };
}

impl Keys {
    /// Whether the key of this name is one of them.
    fn hold(&self, name: &str) -> bool {
        match self {
            Keys::None => false,
            Keys::All => true,
            Keys::AllBut(others) => !others.contains(&name),
            Keys::Only(names) => names.contains(&name),
        }
    }

    /// The names that are written out.
    #[cfg(test)]
    pub(crate) fn named(&self) -> &'static [&'static str] {
        match self {
            Keys::None | Keys::All => &[],
            Keys::AllBut(names) | Keys::Only(names) => names,
        }
    }
}

/// No two methods have the name, the geometry and the kind of V in common.
impl PartialEq for MethodSpec {
    fn eq(&self, other: &Self) -> bool {
        (self.name, self.geometry, self.velocity) == (other.name, other.geometry, other.velocity)
    }
}

impl Eq for MethodSpec {}

impl MethodSpec {
    /// Whether a key does anything in this method.
    pub(crate) fn acts_on(&self, key: &Key) -> bool {
        let acts = &self.acts;
        match key.section {
            "implicit" if key.field == "geometry" => self.geometry.is_some(),
            "velocity" if key.field == "kind" => self.velocity.is_some(),
            "implicit" => acts.implicit.hold(&key.name()),
            "velocity" => acts.velocity.hold(&key.name()),
            "loss" => acts.loss.hold(&key.name()),
            "training" => acts.training.hold(&key.name()),
            section => match self.own {
                Some(own) if own.name == section => true,
                _ => SHARED.contains(&section),
            },
        }
    }

    /// Whether it has no surface of its own and moves the source's, which must be a mesh.
    pub fn needs_mesh(&self) -> bool {
        self.needs.mesh
    }

    /// The method in messages: `velocity-field with implicit.geometry = "flow"`.
    pub fn described(&self) -> String {
        match self.choice() {
            Some(choice) => format!("{} with {choice}", self.name),
            None => self.name.to_owned(),
        }
    }

    /// The key that tells it from others of its name, as it is written.
    pub(crate) fn choice(&self) -> Option<String> {
        match (self.geometry, self.velocity) {
            (Some(geometry), _) => Some(format!("implicit.geometry = \"{geometry}\"")),
            (None, Some(kind)) => Some(format!("velocity.kind = \"{kind}\"")),
            (None, None) => None,
        }
    }

    /// What makes the preset `quick` this method as a comparison runs it, in the words of `--set`.
    pub fn compare_overrides(&self) -> Vec<String> {
        let name = format!("method.name={}", self.name);
        let geometry = self
            .geometry
            .map(|kind| format!("implicit.geometry={kind}"));
        let kind = self.velocity.map(|kind| format!("velocity.kind={kind}"));
        let steps = self.is_baseline.then(|| BASELINE_STEPS.to_owned());
        let changes = self.changes.iter().map(|change| (*change).to_owned());
        [name]
            .into_iter()
            .chain(geometry)
            .chain(kind)
            .chain(steps)
            .chain(changes)
            .collect()
    }
}

/// Methods that start without splines and are moved by Adam have twice the steps of `quick`.
const BASELINE_STEPS: &str = "training.steps=1000";

/// Sections whose keys act in every method; the first is that above all sections.
const SHARED: [&str; 6] = [
    "",
    "method",
    "data",
    "data.keyframe",
    "checkpoint",
    "result",
];

/// What a method does that needs normals.
pub(crate) const ON_NORMALS: &str = "is trained on the normals of the shapes";

/// What a method does that needs correspondences.
pub(crate) const ON_CORRESPONDENCES: &str = "is fitted to correspondences";
