//! Values that exclude each other although each is in its range.

use super::entry::{Entries, Entry, Place};
use super::error::RecipeError;
use super::rule::Value;
use super::words::{Correspondences, VelocityKind};
use crate::method::spline::MOST_STEPS;
use crate::method::{MethodSpec, spec};

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

/// Checks every relation between two keys of a complete recipe, and what its method needs. Keys that do
/// nothing are not among the entries; `between` is what is known from each key frame to the next.
///
/// # Errors
/// The first one that does not hold; the message begins with a value that the user gave.
pub(super) fn check(
    entries: &Entries,
    spec: &MethodSpec,
    between: &[Correspondences],
) -> Result<(), RecipeError> {
    lacks(entries, spec, between)?;
    solves(entries, spec)?;
    for (first, relation, second) in RELATIONS {
        let (Some(one), Some(other)) = (entries.get(first), entries.get(second)) else {
            continue;
        };
        if relation.holds(magnitude(&one.value), magnitude(&other.value)) {
            continue;
        }
        return Err(match one.place {
            Place::Preset(_) => conflict(other, relation.backwards(), one),
            _ => conflict(one, relation.forwards(), other),
        });
    }
    Ok(())
}

/// Whether what is solved for has the few steps that it takes.
fn solves(entries: &Entries, spec: &MethodSpec) -> Result<(), RecipeError> {
    let (Some(steps), Some(kind)) = (entries.get("training.steps"), entries.get("velocity.kind"))
    else {
        return Ok(());
    };
    let solved = spec.velocity == Some(VelocityKind::Spline);
    if !solved || magnitude(&steps.value) <= MOST_STEPS as f64 {
        return Ok(());
    }
    Err(RecipeError::TooManySteps {
        at: steps.about(),
        most: MOST_STEPS,
        kind: kind.about(),
    })
}

/// Whether the method has what it learns from.
fn lacks(
    entries: &Entries,
    spec: &MethodSpec,
    between: &[Correspondences],
) -> Result<(), RecipeError> {
    let none_known = between.iter().all(|known| *known == Correspondences::None);
    let lacking = [
        (
            spec.needs.normals,
            "data.normals",
            spec::ON_NORMALS,
            "set it to \"auto\"",
        ),
        (
            spec.needs.correspondences && none_known,
            "data.correspondences",
            spec::ON_CORRESPONDENCES,
            "name a file of pairs there",
        ),
    ];
    for (needed, key, need, cure) in lacking {
        let none = |entry: &&Entry| matches!(&entry.value, Value::Text(text) if text == "none");
        if needed && let Some(entry) = entries.get(key).filter(none) {
            return Err(RecipeError::Lacking {
                at: entry.about(),
                method: spec.name,
                need,
                cure,
            });
        }
    }
    Ok(())
}

fn conflict(entry: &Entry, relation: &'static str, other: &Entry) -> RecipeError {
    RecipeError::Conflict {
        at: entry.about(),
        relation,
        other: format!("{} = {}", other.key.id(), other.value),
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
    use crate::recipe::catalogue;
    use crate::recipe::rule::Kind;

    #[test]
    fn every_relation_names_two_numbers_that_there_are() {
        for (first, _, second) in RELATIONS {
            for id in [first, second] {
                let key = catalogue::by_id(id).expect(id);
                assert!(
                    matches!(key.rule.kind, Kind::Whole { .. } | Kind::Number(_)),
                    "{id}"
                );
            }
        }
    }
}
