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

/// Checks every relation between two keys of a complete recipe.
///
/// # Errors
/// The first one that does not hold; the message begins with a value that the user gave.
pub(super) fn check(entries: &Entries) -> Result<(), RecipeError> {
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
