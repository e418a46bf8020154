//! What differs between two recipes.

use super::keys::PRESET;
use super::rule::Value;
use super::schema::Key;
use super::setting::Setting;
use super::{Change, Recipe};

/// What stands for the value of a key that does nothing.
const NOTHING: &str = "nothing";

impl Recipe {
    /// The keys whose values differ in `other`, in the order in which a recipe prints them. Keys that act
    /// in neither are not compared.
    pub fn changes(&self, other: &Recipe) -> Vec<Change> {
        let (before, after) = (self.texts(), other.texts());
        let value = |texts: &[(String, String)], id: &str| {
            let found = texts.iter().find(|(key, _)| key == id);
            found.map_or(NOTHING.to_owned(), |(_, value)| value.clone())
        };
        let mut ids: Vec<&String> = before.iter().map(|(id, _)| id).collect();
        // What only the second one has follows the key that it follows there.
        for (place, (id, _)) in after.iter().enumerate() {
            if !ids.contains(&id) {
                let previous = place.checked_sub(1).map(|place| &after[place].0);
                let at = ids.iter().position(|known| Some(*known) == previous);
                ids.insert(at.map_or(0, |at| at + 1), id);
            }
        }
        let changes = ids.into_iter().map(|id| Change {
            key: id.clone(),
            before: value(&before, id),
            after: value(&after, id),
        });
        changes
            .filter(|change| change.before != change.after)
            .collect()
    }

    /// Every key that acts, with its value as TOML.
    fn texts(&self) -> Vec<(String, String)> {
        let text = |(key, value): (&Key, Value)| (key.id(), value.to_string());
        let preset = self.preset.to_value().map(|preset| (&PRESET, preset));
        let listed = self.data.keyframe_values();
        let listed = listed.iter().enumerate().map(|(index, values)| {
            let values: Vec<String> = values.iter().flatten().map(Value::to_string).collect();
            (format!("data.keyframe {}", index + 1), values.join(", "))
        });
        let preset = preset.into_iter().map(text);
        let acting = self.acting().into_iter().map(text);
        preset.chain(listed).chain(acting).collect()
    }
}
