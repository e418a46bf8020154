//! Values that exclude each other although each is in its range.

use super::error::RecipeError;
use super::rule::Value;
use super::source::{Entries, Entry, Place};

/// How the first of two keys must compare with the second.
#[derive(Debug, Clone, Copy)]
enum Relation {
    Less,
    AtMost,
}

/// Every pair of keys that must stand in a relation.
const RELATIONS: [(&str, Relation, &str); 4] = [
    ("implicit.skip", Relation::Less, "implicit.depth"),
    ("velocity.skip", Relation::Less, "velocity.depth"),
    ("training.warm-up", Relation::AtMost, "training.ramp-until"),
    (
        "training.warm-up",
        Relation::AtMost,
        "training.velocity-until",
    ),
];

impl Relation {
    fn holds(self, first: f64, second: f64) -> bool {
        match self {
            Relation::Less => first < second,
            Relation::AtMost => first <= second,
        }
    }

    fn forwards(self) -> &'static str {
        match self {
            Relation::Less => "less than",
            Relation::AtMost => "at most",
        }
    }

    fn backwards(self) -> &'static str {
        match self {
            Relation::Less => "more than",
            Relation::AtMost => "at least",
        }
    }
}

/// A value that leaves some methods without what they learn from.
struct Lack {
    key: &'static str,
    value: &'static str,
    methods: &'static [&'static str],
    /// What they do with what is lacking, and the cure.
    need: &'static str,
}

const LACKS: [Lack; 2] = [
    Lack {
        key: "data.normals",
        value: "none",
        methods: &["lipmlp", "nfgp"],
        need: "is trained on the normals of the shapes; set it to \"auto\"",
    },
    Lack {
        key: "data.correspondences",
        value: "none",
        methods: &["eigenbasis", "nfgp"],
        need: "is fitted to correspondences; name a file of pairs there",
    },
];

/// Checks every relation between two keys of a complete recipe, and what its method needs.
///
/// # Errors
/// The first one that does not hold; the message begins with a value that the user gave.
pub(super) fn check(entries: &Entries) -> Result<(), RecipeError> {
    lacks(entries)?;
    for (first, relation, second) in RELATIONS {
        let (Some(one), Some(other)) = (entries.get(first), entries.get(second)) else {
            continue;
        };
        if relation.holds(magnitude(&one.value), magnitude(&other.value)) {
            continue;
        }
        return Err(match one.place {
            Place::Preset(_) => conflict((second, other), relation.backwards(), (first, one)),
            _ => conflict((first, one), relation.forwards(), (second, other)),
        });
    }
    Ok(())
}

/// Whether the method has what it learns from.
fn lacks(entries: &Entries) -> Result<(), RecipeError> {
    let Some(method) = entries.get("method.name") else {
        return Ok(());
    };
    let is = |entry: &Entry, word: &str| matches!(&entry.value, Value::Text(text) if text == word);
    for lack in &LACKS {
        if let Some(entry) = entries.get(lack.key)
            && is(entry, lack.value)
            && lack.methods.iter().any(|name| is(method, name))
        {
            return Err(RecipeError::Lacking {
                at: entry.place.about(lack.key, &entry.value.to_string()),
                method: method.value.to_string(),
                need: lack.need,
            });
        }
    }
    Ok(())
}

fn conflict(
    (key, entry): (&str, &Entry),
    relation: &'static str,
    (other_key, other): (&str, &Entry),
) -> RecipeError {
    RecipeError::Conflict {
        at: entry.place.about(key, &entry.value.to_string()),
        relation,
        other: format!("{other_key} = {}", other.value),
        place: other.place.to_string(),
    }
}

fn magnitude(value: &Value) -> f64 {
    match value {
        Value::Whole(number) => *number as f64,
        Value::Number(number) => *number,
        other => panic!("{other} is no number, so no relation can be stated for it"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipe::keys::KEYS;
    use crate::recipe::rule::Kind;

    #[test]
    fn every_relation_names_two_numbers_that_there_are() {
        for (first, _, second) in RELATIONS {
            for id in [first, second] {
                let key = KEYS.iter().find(|key| key.id() == id).expect(id);
                assert!(
                    matches!(key.rule.kind, Kind::Whole { .. } | Kind::Number(_)),
                    "{id}"
                );
            }
        }
    }
}
