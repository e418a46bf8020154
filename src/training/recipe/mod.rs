//! The recipe: the TOML file that decides a run, typed, checked and printed back resolved.
//!
//! ```toml
//! preset = "quick"          # the values of every key that is left out
//! [data]
//! source = "source.ply"     # the only two keys that must be given;
//! target = "target.ply"     # paths are relative to the recipe
//! [training]
//! steps = 2000
//! ```
//!
//! A recipe holds the keys of the chosen method and geometry: one that would do nothing is an error. What
//! acts is said by the method itself, in its file under `method/`.
//!
//! The module's map, in two storeys. Below is what methods are written with:
//!
//! | file | what it holds |
//! |---|---|
//! | `keys.rs` | the table of the keys that more than one method has |
//! | `schema.rs`, `setting.rs`, `rule.rs`, `words.rs` | how a row becomes a field, of which type, what it accepts, its enums |
//! | `data.rs` | key frames |
//! | `error.rs` | what can be wrong |
//!
//! Above is what takes the methods' list into account; nothing below and no method imports it:
//!
//! | file | what it holds |
//! |---|---|
//! | `read.rs` | from text to recipe |
//! | `source.rs`, `entry.rs`, `unknown.rs` | values of files and `--set`, with their places; names that are none |
//! | `catalogue.rs` | all keys, those of each method included |
//! | `acting.rs`, `old.rs` | keys that do nothing; keys of earlier versions |
//! | `frames.rs`, `consistency.rs` | key frames as they are written; values that exclude each other |
//! | `print.rs`, `init.rs` | a resolved recipe; a first one to edit |
//! | `changes.rs` | what differs between two |
//!
//! Rule for names: a flag, its TOML key (`learning-rate`) and its field (`learning_rate`) are the
//! same word.

mod acting;
mod catalogue;
mod changes;
mod consistency;
mod data;
mod entry;
mod error;
mod fallback;
mod files;
mod frames;
mod init;
mod keys;
mod old;
mod print;
mod read;
pub(crate) mod rule;
pub(crate) mod schema;
pub(crate) mod setting;
mod source;
#[cfg(test)]
mod tests;
mod unknown;
mod words;

use std::fmt;

pub use data::{DataRecipe, KeyframeRecipe};
pub use error::RecipeError;
pub use files::{files_in, listed, natural_order};
pub use isomorph_model::operators::Derivatives;
pub use isomorph_model::trajectory::Integrator;
pub use keys::{
    CheckpointRecipe, ImplicitRecipe, LossRecipe, ResultRecipe, TrainingRecipe, VelocityRecipe,
};
pub use words::{
    Activation, Align, Cleaning, Correspondences, DERIVATIVES, GeometryKind, INTEGRATORS,
    LevelSetForm, Motion, NormalSource, Optimiser, Preset, Schedule, TimeSampling, VelocityKind,
};

use rule::Value;
use schema::Keyed;

/// Everything that decides a run.
///
/// Fields of keys that do nothing in the recipe's method have the preset's values.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// What the keys that the recipe left out fell back to.
    pub preset: Preset,
    /// The key frames and what is known of which points correspond.
    pub data: DataRecipe,
    /// What is trained.
    pub method: MethodRecipe,
    /// The values of the section that the method has alone, in the order of its keys.
    own: Vec<Value>,
    /// The network `f(x, t)`.
    pub implicit: ImplicitRecipe,
    /// The network `V`.
    pub velocity: VelocityRecipe,
    /// The weights of the objective's terms and what shapes them.
    pub loss: LossRecipe,
    /// The steps of the optimiser and what each one samples.
    pub training: TrainingRecipe,
    /// What is kept so that a run can go on after an interruption.
    pub checkpoint: CheckpointRecipe,
    /// The surfaces that training leaves in the run when it ends.
    pub result: ResultRecipe,
}

/// What is trained.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MethodRecipe {
    /// The method's name; with it, `velocity.kind` and `implicit.geometry` say which method it is
    /// ([`crate::method::spec_of`]).
    pub name: &'static str,
}

impl Recipe {
    /// The same with all learning rates multiplied by a factor.
    #[must_use]
    pub fn with_rates_times(mut self, factor: f64) -> Self {
        let training = &mut self.training;
        for rate in [
            &mut training.learning_rate,
            &mut training.velocity_learning_rate,
            &mut training.muon_rate,
            &mut training.velocity_muon_rate,
        ] {
            *rate *= factor;
        }
        self
    }

    /// The keys that the recipe's method has alone.
    ///
    /// # Panics
    /// If `K` is the section of another method.
    pub(crate) fn keys_of<K: Keyed>(&self) -> K {
        assert_eq!(
            self.own.len(),
            K::SECTION.keys.len(),
            "the method {} has no section [{}]",
            self.method.name,
            K::SECTION.name
        );
        K::from_values(self.own.iter().cloned().map(Some))
    }
}

/// A key that has different values in two recipes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// The key with its section, such as `training.steps`.
    pub key: String,
    /// The value in the first recipe, as TOML; "nothing" where the key does nothing there.
    pub before: String,
    /// The value in the second one.
    pub after: String,
}

impl fmt::Display for Change {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: {} -> {}", self.key, self.before, self.after)
    }
}
