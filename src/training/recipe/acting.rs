//! Keys that do nothing: an error that says which lines to delete, or, in a recipe that is stored with a
//! run, nothing to speak of.

use super::entry::{Entries, Entry, Place};
use super::error::RecipeError;
use super::keys::DataKeys;
use super::rule::Value;
use super::schema::{Key, Keyed};
use super::{Recipe, catalogue, old};
use crate::method::{METHODS, MethodSpec, spec_of};

impl Recipe {
    /// Whether a key such as "training.steps" does anything in the recipe's method.
    pub fn has(&self, id: &str) -> bool {
        catalogue::by_id(id).is_some_and(|key| spec_of(self).acts_on(key))
    }

    /// The keys that act in the recipe's method, each with its value, in the order in which they are
    /// printed; those of `[[data.keyframe]]` are not among them.
    pub(super) fn acting(&self) -> Vec<(&'static Key, Value)> {
        let spec = spec_of(self);
        let values = self.values();
        let acts = values.into_iter().filter(|(key, _)| spec.acts_on(key));
        acts.collect()
    }

    /// All values that there are, in the order in which they are printed.
    fn values(&self) -> Vec<(&'static Key, Value)> {
        let name = Value::Text(self.method.name.to_owned());
        let own = spec_of(self).own.map_or(&[][..], |section| section.keys);
        let mut values = with_keys::<DataKeys>(self.data.to_values());
        values.push((catalogue::method(), name));
        values.extend(own.iter().zip(self.own.iter().cloned()));
        values.extend(typed(&self.implicit));
        values.extend(typed(&self.velocity));
        values.extend(typed(&self.loss));
        values.extend(typed(&self.training));
        values.extend(typed(&self.checkpoint));
        values.extend(typed(&self.result));
        values
    }
}

fn typed<K: Keyed>(section: &K) -> Vec<(&'static Key, Value)> {
    with_keys::<K>(section.to_values())
}

fn with_keys<K: Keyed>(values: Vec<Option<Value>>) -> Vec<(&'static Key, Value)> {
    let keys = K::SECTION.keys.iter().zip(values);
    keys.filter_map(|(key, value)| Some((key, value?)))
        .collect()
}

/// Takes out of the entries what does nothing in this method.
///
/// # Errors
/// If a file or an override gives such a key: the first one, and the lines of the others.
pub(super) fn settle(entries: &mut Entries, spec: &MethodSpec) -> Result<(), RecipeError> {
    // What is held was given when it did something.
    let held = |entry: &Entry| entry.place == Place::Held;
    entries.retain(|_, entry| !(held(entry) && is_idle(entry, spec)));
    let line = |entry: &Entry| match &entry.place {
        Place::Line { line, .. } => *line,
        _ => usize::MAX,
    };
    let mut wrong: Vec<&Entry> = entries
        .values()
        .filter(|entry| is_idle(entry, spec) || entry.old.is_some())
        .collect();
    wrong.sort_by_key(|entry| line(entry));
    let Some((first, others)) = wrong.split_first() else {
        return Ok(());
    };
    let idle = others.iter().filter(|entry| is_idle(entry, spec));
    let lines: Vec<usize> = idle.map(|entry| line(entry)).collect();
    Err(refused(first, spec, &lines))
}

/// The same for the recipe of a run, which any version may have written: what does nothing is left out. The
/// notes name what did something and does no more.
pub(super) fn settle_stored(entries: &mut Entries, spec: &MethodSpec, notes: &mut Vec<String>) {
    entries.retain(|_, entry| {
        if old::is_gone(entry.key) && entry.value != Value::Number(0.0) {
            notes.push(format!(
                "{}: this version has no such term; it is left out",
                entry.about()
            ));
        }
        !is_idle(entry, spec)
    });
}

fn is_idle(entry: &Entry, spec: &MethodSpec) -> bool {
    old::is_gone(entry.key) || !spec.acts_on(entry.key)
}

fn refused(entry: &Entry, spec: &MethodSpec, others: &[usize]) -> RecipeError {
    let (line, given) = match entry.place {
        Place::Line { .. } => ("delete this line", "move this line there"),
        _ => ("leave it out", "write it so"),
    };
    let (idle, cure) = if old::is_gone(entry.key) {
        ("is no key any more".to_owned(), line.to_owned())
    } else if is_idle(entry, spec) {
        let idle = format!("does nothing in the method {}", spec.described());
        (
            idle,
            format!("{line} (it acts in {})", homes(entry.key, spec)),
        )
    } else {
        let new = entry.key.id();
        (format!("is {new} now"), given.to_owned())
    };
    let others = match others {
        [] => String::new(),
        [one] => format!("; line {one} does nothing either"),
        [all @ .., last] => {
            let all: Vec<String> = all.iter().map(usize::to_string).collect();
            format!("; lines {} and {last} do nothing either", all.join(", "))
        }
    };
    RecipeError::Idle {
        at: entry.about(),
        idle,
        cure,
        others,
    }
}

/// The methods in which a key acts, as a recipe chooses them from where this method is chosen.
fn homes(key: &Key, chosen: &MethodSpec) -> String {
    let acts = |spec: &&&MethodSpec| spec.acts_on(key);
    let mut homes: Vec<String> = Vec::new();
    for spec in METHODS.iter().filter(acts) {
        let siblings = METHODS.iter().filter(|other| other.name == spec.name);
        let home = match spec.choice() {
            Some(choice) if spec.name == chosen.name => choice,
            Some(choice) if siblings.filter(acts).count() == 1 => {
                format!("method.name = \"{}\" with {choice}", spec.name)
            }
            _ => format!("method.name = \"{}\"", spec.name),
        };
        if !homes.contains(&home) {
            homes.push(home);
        }
    }
    match homes.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => "no method".to_owned(),
    }
}
