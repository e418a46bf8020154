//! All keys of all methods: the shared sections, the one that chooses the method, and those that methods
//! have alone.

use std::sync::LazyLock;

use super::data::KEYFRAME;
use super::keys::{PRESET, SECTIONS};
use super::rule::Rule;
use super::schema::{Key, Section};
use crate::method::{METHODS, names};

/// The section that chooses the method.
static METHOD: LazyLock<Section> = LazyLock::new(|| Section {
    name: "method",
    doc: "What is trained.",
    keys: Vec::leak(vec![Key {
        section: "method",
        field: "name",
        doc: "\"velocity-field\": the default, or the paper's method; velocity.kind and \
              implicit.geometry choose between its forms. The others are methods that isomorph is compared with.",
        rule: Rule::word(Vec::leak(names())),
        columns: ["\"velocity-field\""; 5],
    }]),
});

/// Every section, in the order in which they are printed.
static ALL: LazyLock<Vec<&'static Section>> = LazyLock::new(|| {
    let mut sections: Vec<&'static Section> = vec![SECTIONS[0], &*METHOD];
    for own in METHODS.iter().filter_map(|spec| spec.own) {
        if sections.iter().all(|known| known.name != own.name) {
            sections.push(own);
        }
    }
    sections.extend(&SECTIONS[1..]);
    sections
});

/// Every section, in the order in which they are printed.
pub(super) fn sections() -> &'static [&'static Section] {
    &ALL
}

/// The key that chooses the method.
pub(super) fn method() -> &'static Key {
    &METHOD.keys[0]
}

/// The keys of all sections, in the order in which they are printed.
pub(super) fn keys() -> impl Iterator<Item = &'static Key> {
    sections().iter().flat_map(|section| section.keys)
}

/// The key of this name in this section; the section of a key above all sections is "".
pub(super) fn find(section: &str, name: &str) -> Option<&'static Key> {
    let is = |key: &&'static Key| key.section == section && key.name() == name;
    [&PRESET]
        .into_iter()
        .chain(keys())
        .chain(&KEYFRAME)
        .find(is)
}

/// The key of this name with its section.
pub(super) fn by_id(id: &str) -> Option<&'static Key> {
    let (section, name) = id.rsplit_once('.').unwrap_or(("", id));
    find(section, name)
}
