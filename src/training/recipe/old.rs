//! Keys of earlier versions: those that moved, and those that are gone.
//!
//! A recipe that is given to `train` must be brought up to date; one that is stored with a run is
//! read as it was meant.

use super::catalogue;
use super::entry::{Entries, Entry, Place};
use super::rule::Rule;
use super::schema::Key;

/// Keys that had another place until version 0.1, with their present one.
const MOVED: [(&str, &str); 13] = [
    ("method.ends-until", "nise.ends-until"),
    ("method.omega", "nise.omega"),
    ("method.ends", "nise.ends"),
    ("method.residual", "nise.residual"),
    ("method.lipschitz", "lipmlp.lipschitz"),
    ("method.space-scale", "lipmlp.space-scale"),
    ("method.modes", "eigenbasis.modes"),
    ("method.prior", "eigenbasis.prior"),
    ("method.deformations", "nfgp.deformations"),
    ("method.blocks", "nfgp.blocks"),
    ("method.handles", "nfgp.handles"),
    ("method.stretch", "nfgp.stretch"),
    ("method.bend", "nfgp.bend"),
];

/// Weights of terms that version 0.1 had and no preset used.
static REMOVED: [Key; 4] = [
    removed("deviatoric"),
    removed("stretch"),
    removed("steadiness"),
    removed("acceleration"),
];

const fn removed(field: &'static str) -> Key {
    Key {
        section: "loss",
        field,
        doc: "A term of version 0.1.",
        rule: Rule::positive_or_zero(),
        columns: ["0"; 5],
    }
}

/// What runs did before there was a key for it, as TOML, whatever their preset says now.
const BEFORE: [(&str, &str); 4] = [
    ("training.optimiser", "\"adam\""),
    ("training.guided-until", "0"),
    ("data.clean", "\"none\""),
    ("data.mirrored", "true"),
];

/// Gives the recipe of a run that an earlier version wrote what it meant without a key.
pub(super) fn complete(entries: &mut Entries) {
    for (id, text) in BEFORE {
        let key = catalogue::by_id(id).expect("a key of the table");
        let meant = || Entry::new(key, key.value(text), Place::Held);
        entries.entry(key.id()).or_insert_with(meant);
    }
}

/// The present key of one that stood elsewhere, with its old name.
pub(super) fn moved(section: &str, name: &str) -> Option<(&'static str, &'static Key)> {
    let is = |(old, _): &&(&str, &str)| old.split_once('.') == Some((section, name));
    let (old, new) = MOVED.iter().find(is)?;
    Some((old, catalogue::by_id(new)?))
}

/// A key that is gone.
pub(super) fn gone(section: &str, name: &str) -> Option<&'static Key> {
    let mut removed = REMOVED.iter();
    removed.find(|key| key.section == section && key.name() == name)
}

/// Whether a key is gone.
pub(super) fn is_gone(key: &Key) -> bool {
    gone(key.section, &key.name()).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_that_moved_is_there_and_none_that_is_gone() {
        for (old, new) in MOVED {
            assert!(catalogue::by_id(new).is_some(), "{new}");
            assert!(catalogue::by_id(old).is_none(), "{old}");
        }
        for key in &REMOVED {
            assert!(catalogue::by_id(&key.id()).is_none(), "{}", key.id());
        }
    }
}
