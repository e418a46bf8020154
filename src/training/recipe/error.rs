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
    #[error("set {given}: must be section.key=value (such as training.steps=2000)")]
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
    /// Steps of training where there are steps of a solver.
    #[error("{at}: at most {most} with {kind}; set preset = \"instant\" for 18")]
    TooManySteps {
        /// File, line, key and value, override, or the preset.
        at: String,
        /// How many are allowed.
        most: usize,
        /// The key that makes them steps of a solver.
        kind: String,
    },
    /// The method has nothing to learn from.
    #[error("{at}: the method \"{method}\" {need}; {cure}, or choose another method.name")]
    Lacking {
        /// File, line, key and value, or override.
        at: String,
        /// The method.
        method: &'static str,
        /// What it does with what is lacking.
        need: &'static str,
        /// What to do.
        cure: &'static str,
    },
    /// A key that does nothing in the chosen method, or in no method any more.
    #[error("{at}: {idle}; {cure}{others}")]
    Idle {
        /// File, line, key and value, or override.
        at: String,
        /// "does nothing in the method ...", or why it is no key.
        idle: String,
        /// What to do, and where the key acts.
        cure: String,
        /// Other lines of the file that do nothing either.
        others: String,
    },
    /// Key frames that are none.
    #[error("{at}: {problem}")]
    KeyFrames {
        /// File, line, key and value, or override.
        at: String,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// More key frames than the method takes.
    #[error(
        "{at}: {method} takes two key frames, not {keys}; for more, set preset = \"instant\", \"quick\" or \"default\""
    )]
    ManyKeyFrames {
        /// File and line, or override.
        at: String,
        /// How many there are.
        keys: usize,
        /// The method.
        method: String,
    },
    /// More than two key frames, and one velocity for all times.
    #[error(
        "{at}: no velocity that stays the same leads through {keys} key frames; leave velocity.time-dependent at true"
    )]
    Stationary {
        /// File and line, or override.
        at: String,
        /// How many there are.
        keys: usize,
    },
    /// A key without which no recipe works.
    #[error("{}: {key} is missing ({allowed}); add it under {header}", path.display())]
    Missing {
        /// The recipe.
        path: PathBuf,
        /// The key with its section.
        key: String,
        /// What it stands under.
        header: String,
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
