//! What can be wrong with a recipe, each as one line that says where, what, and what to do.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// A recipe that cannot be used.
#[derive(Debug, Error)]
pub enum RecipeError {
    /// The file is missing, no file, or not text.
    #[error(
        "{}: cannot be read ({reason}); `isomorph init SOURCE TARGET` prints a recipe",
        path.display()
    )]
    Unreadable {
        /// The recipe.
        path: PathBuf,
        /// What the file system says.
        reason: io::Error,
    },
    /// The text is not TOML.
    #[error("{at}: not TOML ({reason}): `{line}`")]
    Syntax {
        /// File and line.
        at: String,
        /// What the TOML reader says.
        reason: String,
        /// The line as it stands there.
        line: String,
    },
    /// An argument of `--set` has no key, no value, or neither.
    #[error("--set {given}: must be section.key=value (such as training.steps=2000)")]
    NotAnOverride {
        /// The argument.
        given: String,
    },
    /// A key or section that no recipe has.
    #[error("{at}: no such {what}{hint} ({known})")]
    Unknown {
        /// File and line, or override, and the key.
        at: String,
        /// "key" or "section".
        what: &'static str,
        /// The nearest one that there is.
        hint: String,
        /// All that there are.
        known: String,
    },
    /// A value of the wrong type or out of range.
    #[error("{at}: must be {allowed}")]
    Refused {
        /// File, line, key and value, or override.
        at: String,
        /// The values allowed.
        allowed: String,
    },
    /// Two values that exclude each other.
    #[error("{at}: must be {relation} {other} ({place}); change one of the two")]
    Conflict {
        /// File, line, key and value, or override.
        at: String,
        /// How the first must compare with the second.
        relation: &'static str,
        /// The other key and its value.
        other: String,
        /// Where the other value comes from.
        place: String,
    },
    /// The method has nothing to learn from.
    #[error("{at}: the method {method} {need}, or choose another method.name")]
    Lacking {
        /// File, line, key and value, or override.
        at: String,
        /// The method, as TOML.
        method: String,
        /// What it does with what is lacking, and the cure.
        need: &'static str,
    },
    /// A key without which no recipe works.
    #[error("{}: {key} is missing ({allowed}); add it under [{section}]", path.display())]
    Missing {
        /// The recipe.
        path: PathBuf,
        /// The key with its section.
        key: String,
        /// Its section.
        section: &'static str,
        /// The values allowed.
        allowed: String,
    },
    /// A path that TOML cannot hold, or that is relative to a folder that is gone.
    #[error("{}: cannot be written in a recipe ({reason}); rename or move it", path.display())]
    Path {
        /// The path.
        path: PathBuf,
        /// What stands against it.
        reason: String,
    },
}
