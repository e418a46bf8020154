//! The value of a key that a recipe leaves out: the preset's, or that of runs through many key frames.

use super::catalogue;
use super::entry::{Entries, Place};
use super::rule::Value;
use super::schema::Key;
use super::source;
use super::words::Preset;
use crate::method::MethodSpec;

const STEPS: &str = "training.steps";

/// The steps that a preset has for two key frames.
fn steps_of(preset: Preset) -> Value {
    let key = catalogue::by_id(STEPS).expect("a key of the table");
    key.preset_value(preset).expect("every preset has steps")
}

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
            let steps = spec.steps_of_interval.map(|share| {
                let steps = match steps_of(preset) {
                    Value::Whole(steps) => steps as f64 * share * (key_frames - 1) as f64,
                    other => unreachable!("{other} steps"),
                };
                format!("{STEPS}={}", steps.round())
            });
            let given = spec.many.iter().map(|given| (*given).to_owned());
            for given in given.chain(steps) {
                source::read_override(&given, &mut many).expect("keys of the table");
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
