//! The value of a key that a recipe leaves out: the preset's, or that of runs through many key frames.

use super::entry::{Entries, Place};
use super::rule::Value;
use super::schema::Key;
use super::source;
use super::words::Preset;
use crate::method::MethodSpec;

/// Which values keys fall back to.
pub(super) struct Fallback {
    preset: Preset,
    /// Those that hold through many key frames, above the preset's.
    many: Entries,
}

impl Fallback {
    /// Of a preset, a method and so many key frames.
    pub(super) fn new(preset: Preset, spec: &MethodSpec, key_frames: usize) -> Self {
        let mut many = Entries::new();
        if key_frames > 2 {
            for given in spec.many {
                source::read_override(given, &mut many).expect("keys of the table");
            }
        }
        Self { preset, many }
    }

    /// The value of a key; none where no preset can know it.
    pub(super) fn value(&self, key: &Key) -> Option<Value> {
        let many = self.many.get(&key.id()).map(|entry| entry.value.clone());
        many.or_else(|| key.preset_value(self.preset))
    }

    /// Whether there are more than two key frames, and values of theirs.
    pub(super) fn is_of_many(&self) -> bool {
        !self.many.is_empty()
    }

    /// Where such a value comes from.
    pub(super) fn place(&self) -> Place {
        Place::Preset(self.preset)
    }
}
