//! Values of a recipe's keys, each with the place where it was given.

use std::collections::BTreeMap;
use std::fmt;

use super::data::KEYFRAMES;
use super::rule::Value;
use super::schema::Key;
use super::words::Preset;

/// Values by key, such as "training.steps".
pub(super) type Entries = BTreeMap<String, Entry>;

/// A value of a key, and where it was given.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) key: &'static Key,
    pub(super) value: Value,
    pub(super) place: Place,
    /// The name of an earlier version under which it was given.
    pub(super) old: Option<&'static str>,
}

impl Entry {
    pub(super) fn new(key: &'static Key, value: Value, place: Place) -> Self {
        Self {
            key,
            value,
            place,
            old: None,
        }
    }

    /// The beginning of an error about it: where, which key, and what was found there.
    pub(super) fn about(&self) -> String {
        let id = self.old.map_or_else(|| self.key.id(), str::to_owned);
        self.place.about(&id, &self.value.to_string())
    }
}

/// Where a value was given.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Place {
    /// In a file, at this line.
    Line { file: String, line: usize },
    /// On the command line, in these words.
    Override(String),
    /// Nowhere: it is the preset's.
    Preset(Preset),
    /// In the recipe that an override changes.
    Held,
}

impl Place {
    /// The beginning of an error about this key: where, which key, and what was found there.
    pub(super) fn about(&self, key: &str, found: &str) -> String {
        match self {
            Place::Override(_) => self.to_string(),
            _ => format!("{self}: {key} = {found}"),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line { file, line } => write!(out, "{file}:{line}"),
            Place::Override(given) => write!(out, "set {given}"),
            Place::Preset(preset) => write!(out, "preset \"{preset}\""),
            Place::Held => out.write_str("the recipe"),
        }
    }
}

/// The name of a key frame's value; key frames are counted from 0, and sort as their numbers.
pub(super) fn keyframe_id(index: usize, key: &Key) -> String {
    format!("data.{KEYFRAMES}.{index:08}.{}", key.name())
}

/// The text on one line, without control characters, cut where it is long.
pub(super) fn shortened(text: &str) -> String {
    const LONGEST: usize = 80;
    let text = text.trim();
    let mut cut: String = text
        .chars()
        .take(LONGEST)
        .map(|letter| {
            if letter.is_control() {
                '\u{FFFD}'
            } else {
                letter
            }
        })
        .collect();
    if text.chars().nth(LONGEST).is_some() {
        cut.push('…');
    }
    cut
}
