//! What a comparison runs: pairs of frames and methods, as the command line names them.
//!
//! ```text
//! --pairs 0-18,20-47                                   from-to, frames counted from 0
//! --methods quick,lipmlp                               words that the caller knows
//! --variant 'no divergence=quick,loss.divergence=0'    label = method, then overrides of its recipe
//! ```

use std::fmt;
use std::path::Path;

use serde::{Deserialize, Serialize};

/// Rows that every table has; no method may be called so.
const RESERVED: [&str; 2] = ["linear", "floor"];
/// Longest label, in characters: it has to fit a table and a legend.
const LONGEST_LABEL: usize = 48;

/// A comparison that cannot be run as it was asked for.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// Not a pair of frames.
    #[error("pairs {given}: must be FROM-TO, several separated by commas (such as 0-18,20-47)")]
    NotAPair {
        /// The piece that is none.
        given: String,
    },
    /// No frame lies between the two.
    #[error(
        "pairs {pair}: nothing lies between the two frames; TO must be at least FROM + 2 (here {})",
        pair.from.saturating_add(2)
    )]
    NothingBetween {
        /// The pair.
        pair: FramePair,
    },
    /// The sequence is shorter.
    #[error(
        "pairs {pair}: {sequence} has {frames} frames, 0 to {}; choose among them",
        frames.saturating_sub(1)
    )]
    PastTheEnd {
        /// The pair.
        pair: FramePair,
        /// The name of the sequence.
        sequence: String,
        /// Its frames.
        frames: usize,
    },
    /// No pairs were given.
    #[error(
        "pairs are missing: {sequence} has {frames} frames, 0 to {}; give the first and the last \
         frame of each pair, such as pairs 0-10,10-20",
        frames.saturating_sub(1)
    )]
    NoPairs {
        /// The name of the sequence.
        sequence: String,
        /// Its frames.
        frames: usize,
    },
    /// A method that nobody knows.
    #[error("{given}: no such method \"{word}\"{hint} ({known})")]
    UnknownMethod {
        /// The option and its value.
        given: String,
        /// The word.
        word: String,
        /// The nearest one that there is.
        hint: String,
        /// All that there are.
        known: String,
    },
    /// A variant that is not label, method and overrides.
    #[error("variant {given}: {problem}; write 'LABEL=METHOD,section.key=value,...'")]
    Variant {
        /// The argument.
        given: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The same pair or label a second time; labels that differ in case alone would share a file on
    /// some systems.
    #[error("{given} is given twice; each must be there once")]
    Twice {
        /// What it is, with its option.
        given: String,
    },
    /// A label that is a row of every table.
    #[error("{given}: the row \"{word}\" is in every table; leave it out or choose another label")]
    Reserved {
        /// The option and its value.
        given: String,
        /// The label.
        word: String,
    },
    /// No method at all.
    #[error("methods are missing: nothing to compare ({known})")]
    NoMethods {
        /// All that there are.
        known: String,
    },
}

/// Two frames of a sequence, counted from 0: the only ones that a method sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct FramePair {
    /// The frame at time 0.
    pub from: usize,
    /// The frame at time 1.
    pub to: usize,
}

impl fmt::Display for FramePair {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}-{}", self.from, self.to)
    }
}

/// A row of the comparison: a method and what is changed in its recipe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MethodPlan {
    /// Its name in tables and figures, unique in the comparison.
    pub label: String,
    /// One of the words that the caller knows: a preset of ours or another method.
    pub method: String,
    /// `section.key=value`, as `--set` takes them; not yet checked against the recipe.
    pub overrides: Vec<String>,
}

/// All that a comparison runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// The name of the sequence.
    pub sequence: String,
    /// The pairs, in the order given.
    pub pairs: Vec<FramePair>,
    /// The methods, in the order given: first `--methods`, then `--variant`.
    pub methods: Vec<MethodPlan>,
}

/// What the command line asks for.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The name of the sequence, see [`sequence_name`].
    pub sequence: &'a str,
    /// How many frames it has.
    pub frames: usize,
    /// The value of `--pairs`, without which nothing can be compared.
    pub pairs: Option<&'a str>,
    /// The value of `--methods`.
    pub methods: Option<&'a str>,
    /// The values of `--variant`.
    pub variants: &'a [String],
    /// The methods that there are.
    pub known: &'a [&'a str],
}

impl Plan {
    /// Reads and checks what the command line asks for.
    ///
    /// # Errors
    /// [`PlanError`] for the first thing that is wrong.
    pub fn new(request: &Request<'_>) -> Result<Self, PlanError> {
        Ok(Self {
            sequence: request.sequence.to_owned(),
            pairs: pairs(request)?,
            methods: methods(request)?,
        })
    }
}

/// The name of a sequence: its file without ending, or its folder.
#[must_use]
pub(crate) fn sequence_name(path: &Path) -> String {
    // "..", "." and "sequences/" have no name of their own until they are resolved.
    let resolved = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let name = if resolved.is_dir() {
        resolved.file_name()
    } else {
        resolved.file_stem()
    };
    name.map_or_else(
        || "sequence".to_owned(),
        |name| name.to_string_lossy().into_owned(),
    )
}

fn pairs(request: &Request<'_>) -> Result<Vec<FramePair>, PlanError> {
    let text = request.pairs.ok_or_else(|| PlanError::NoPairs {
        sequence: request.sequence.to_owned(),
        frames: request.frames,
    })?;
    let pairs = text.split(',').map(pair).collect::<Result<Vec<_>, _>>()?;
    for (place, pair) in pairs.iter().enumerate() {
        if pair.to >= request.frames {
            return Err(PlanError::PastTheEnd {
                pair: *pair,
                sequence: request.sequence.to_owned(),
                frames: request.frames,
            });
        }
        if pairs[..place].contains(pair) {
            let given = format!("pairs {pair}");
            return Err(PlanError::Twice { given });
        }
    }
    Ok(pairs)
}

fn pair(text: &str) -> Result<FramePair, PlanError> {
    let given = text.trim();
    let frames = given
        .split_once('-')
        .and_then(|(from, to)| Some((from.trim().parse().ok()?, to.trim().parse().ok()?)));
    let (from, to): (usize, usize) = frames.ok_or_else(|| PlanError::NotAPair {
        given: given.to_owned(),
    })?;
    let pair = FramePair { from, to };
    if to < from.saturating_add(2) {
        return Err(PlanError::NothingBetween { pair });
    }
    Ok(pair)
}

fn methods(request: &Request<'_>) -> Result<Vec<MethodPlan>, PlanError> {
    let words = request.methods.unwrap_or_default().split(',');
    let mut methods = Vec::new();
    for word in words.map(str::trim).filter(|word| !word.is_empty()) {
        let given = format!("methods {word}");
        methods.push((plain(&given, word, request.known)?, given));
    }
    for text in request.variants {
        let variant = variant(text, request.known)?;
        methods.push((variant, format!("variant {text}")));
    }
    if methods.is_empty() {
        let known = request.known.join(", ");
        return Err(PlanError::NoMethods { known });
    }
    let mut plans: Vec<MethodPlan> = Vec::with_capacity(methods.len());
    for (plan, given) in methods {
        if plans
            .iter()
            .any(|before| before.label.eq_ignore_ascii_case(&plan.label))
        {
            let given = format!("{given}: the label \"{}\"", plan.label);
            return Err(PlanError::Twice { given });
        }
        plans.push(plan);
    }
    Ok(plans)
}

/// A method under its own name.
fn plain(given: &str, word: &str, known: &[&str]) -> Result<MethodPlan, PlanError> {
    refuse_reserved(given, word)?;
    refuse_unknown(given, word, known)?;
    Ok(MethodPlan {
        label: word.to_owned(),
        method: word.to_owned(),
        overrides: Vec::new(),
    })
}

/// A method under another label with changes: `LABEL=METHOD,section.key=value,...`.
fn variant(text: &str, known: &[&str]) -> Result<MethodPlan, PlanError> {
    let refused = |problem: String| PlanError::Variant {
        given: text.to_owned(),
        problem,
    };
    let (label, rest) = text
        .split_once('=')
        .ok_or_else(|| refused("it has no \"=\"".to_owned()))?;
    let label = label.trim();
    let length = label.chars().count();
    if !(1..=LONGEST_LABEL).contains(&length) {
        return Err(refused(format!(
            "the label has {length} characters, allowed are 1 to {LONGEST_LABEL}"
        )));
    }
    if label.chars().any(char::is_control) {
        return Err(refused("the label holds a control character".to_owned()));
    }
    let given = format!("variant {text}");
    refuse_reserved(&given, label)?;
    let (method, changes) = match rest.split_once(',') {
        Some((method, changes)) => (method.trim(), overrides(changes)),
        None => (rest.trim(), Vec::new()),
    };
    refuse_unknown(&given, method, known)?;
    if let Some(wrong) = changes.iter().find(|change| !opens_an_override(change)) {
        return Err(refused(format!("\"{wrong}\" is not section.key=value")));
    }
    Ok(MethodPlan {
        label: label.to_owned(),
        method: method.to_owned(),
        overrides: changes,
    })
}

/// Splits overrides at the commas that another override follows: paths and lists may hold commas.
fn overrides(text: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for piece in text.split(',') {
        match found.last_mut() {
            Some(last) if !opens_an_override(piece.trim()) => {
                last.push(',');
                last.push_str(piece);
            }
            _ => found.push(piece.trim().to_owned()),
        }
    }
    found
}

/// Whether the text begins as `section.key=`.
fn opens_an_override(text: &str) -> bool {
    let is_word = |word: &str| {
        !word.is_empty()
            && word
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "-_".contains(c))
    };
    text.split_once('=')
        .and_then(|(key, _)| key.split_once('.'))
        .is_some_and(|(section, key)| is_word(section) && is_word(key))
}

fn refuse_reserved(given: &str, word: &str) -> Result<(), PlanError> {
    if RESERVED.contains(&word) {
        return Err(PlanError::Reserved {
            given: given.to_owned(),
            word: word.to_owned(),
        });
    }
    Ok(())
}

fn refuse_unknown(given: &str, word: &str, known: &[&str]) -> Result<(), PlanError> {
    // Below this likeness a suggestion puzzles more than it helps.
    const ALIKE: f64 = 0.7;
    if known.contains(&word) {
        return Ok(());
    }
    let nearest = known
        .iter()
        .map(|name| (strsim::jaro_winkler(&word.to_lowercase(), name), name))
        .filter(|(likeness, _)| *likeness >= ALIKE)
        .max_by(|one, other| one.0.total_cmp(&other.0));
    Err(PlanError::UnknownMethod {
        given: given.to_owned(),
        word: word.to_owned(),
        hint: nearest.map_or_else(String::new, |(_, name)| format!("; did you mean {name}?")),
        known: known.join(", "),
    })
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
