//! The recipe: the TOML file that decides a run, typed, checked and printed back resolved.
//!
//! ```toml
//! preset = "quick"          # the values that every key left out falls back to
//! [data]
//! source = "source.ply"     # the only two keys that must be given;
//! target = "target.ply"     # paths are relative to the recipe
//! [training]
//! steps = 2000
//! ```
//!
//! The module's map: `keys` is the table of all keys, each declared once; `schema` says how a row
//! of it becomes a field, `rule` what a row may accept, `words` its enums. `source` reads values
//! from files and `--set`, `consistency` holds them against each other, `print` writes them out.
//!
//! Rule for names: a flag, its TOML key (`learning-rate`) and its field (`learning_rate`) are the
//! same word.

mod consistency;
mod error;
mod keys;
mod print;
mod rule;
mod schema;
mod source;
#[cfg(test)]
mod tests;
mod words;

use std::fmt;
use std::path::Path;

pub use error::RecipeError;
pub use keys::{
    CheckpointRecipe, DataRecipe, ImplicitRecipe, LossRecipe, MethodRecipe, Recipe, ResultRecipe,
    TrainingRecipe, VelocityRecipe,
};
pub use words::{
    Activation, Correspondences, Derivatives, GeometryKind, Integrator, LevelSetForm, MethodName,
    NormalSource, Preset, Schedule, TimeSampling,
};

use keys::KEYS;
use rule::Value;
use schema::{Key, Setting};
use source::{Entry, Place};

impl Recipe {
    /// Reads the recipe at `path`; `overrides` are the arguments of `--set`, of which later ones
    /// win.
    ///
    /// # Errors
    /// If the file cannot be read, or for what [`Recipe::parse`] refuses.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Recipe, RecipeError> {
        let text = std::fs::read_to_string(path).map_err(|reason| RecipeError::Unreadable {
            path: path.to_owned(),
            reason,
        })?;
        Recipe::parse(&text, path, overrides)
    }

    /// Reads a recipe from its text. `origin` is its file: messages name it, and the paths in the
    /// recipe and in `overrides` are relative to its folder.
    ///
    /// # Errors
    /// On the first thing that is not TOML, not a key, of the wrong type, out of range, at odds
    /// with another value, or missing.
    pub fn parse(text: &str, origin: &Path, overrides: &[String]) -> Result<Recipe, RecipeError> {
        let mut entries = source::read_text(text, origin)?;
        for given in overrides {
            source::read_override(given, &mut entries)?;
        }
        source::make_paths_absolute(&mut entries, origin.parent().unwrap_or(Path::new("")))?;
        let preset = source::preset(&entries);
        for key in KEYS {
            if let Some(value) = key.preset_value(preset) {
                let fallback = Entry {
                    value,
                    place: Place::Preset(preset),
                };
                entries.entry(key.id()).or_insert(fallback);
            }
        }
        consistency::check(&entries)?;
        let values = KEYS
            .iter()
            .map(|key| {
                let entry = entries.remove(&key.id());
                entry
                    .map(|entry| entry.value)
                    .ok_or_else(|| missing(key, origin))
            })
            .collect::<Result<Vec<Value>, RecipeError>>()?;
        Ok(Recipe::from_values(preset, values))
    }

    /// The recipe with every key, each under its meaning as a comment; read again, it is the same
    /// recipe.
    pub fn to_toml(&self) -> String {
        print::resolved(self.preset, &self.values())
    }

    /// A first recipe for these shapes: the data section filled in, every other key a comment with
    /// the preset's value. Paths are written as given.
    ///
    /// # Errors
    /// If a path is not Unicode.
    pub fn commented(
        source: &Path,
        target: &Path,
        correspondences: &Correspondences,
        preset: Preset,
    ) -> Result<String, RecipeError> {
        let source = Value::Text(source::unicode(source)?.to_owned());
        let target = Value::Text(source::unicode(target)?.to_owned());
        if let Correspondences::File(path) = correspondences {
            source::unicode(path)?;
        }
        Ok(print::commented(preset, |key| {
            match (key.section, key.field) {
                ("data", "source") => Some(source.clone()),
                ("data", "target") => Some(target.clone()),
                ("data", "correspondences") => Some(correspondences.to_value()),
                _ => None,
            }
        }))
    }

    /// The keys whose values differ in `other`, in the order in which a recipe prints them. None
    /// differ exactly if the two recipes are equal.
    pub fn changes(&self, other: &Recipe) -> Vec<Change> {
        let presets = std::iter::once((
            &keys::PRESET,
            self.preset.to_value(),
            other.preset.to_value(),
        ));
        let rest = KEYS.iter().zip(self.values()).zip(other.values());
        presets
            .chain(rest.map(|((key, before), after)| (key, before, after)))
            .filter(|(_, before, after)| before != after)
            .map(|(key, before, after)| Change {
                section: key.section,
                key: key.id(),
                before: before.to_string(),
                after: after.to_string(),
            })
            .collect()
    }
}

fn missing(key: &Key, origin: &Path) -> RecipeError {
    RecipeError::Missing {
        path: origin.to_owned(),
        key: key.id(),
        section: key.section,
        allowed: key.rule.allowed(),
    }
}

/// A key that has different values in two recipes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    section: &'static str,
    /// The key with its section, such as `training.steps`.
    pub key: String,
    /// The value in the first recipe, as TOML.
    pub before: String,
    /// The value in the second one.
    pub after: String,
}

impl Change {
    /// Whether the key describes a network, so that checkpoints of the first recipe do not fit
    /// the second.
    pub fn is_of_a_network(&self) -> bool {
        matches!(self.section, "method" | "implicit" | "velocity")
    }
}

impl fmt::Display for Change {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: {} -> {}", self.key, self.before, self.after)
    }
}
