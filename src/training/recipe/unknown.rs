//! Names that no recipe has, with the nearest that there is.

use toml::de::DeValue;

use super::catalogue;
use super::data::KEYFRAME;
use super::entry::{Place, shortened};
use super::error::RecipeError;
use super::keys::PRESET;
use super::schema::Key;

/// A name above all sections that is none: a section misspelt or a key out of its place.
pub(super) fn at_top(place: &Place, name: &str, value: &DeValue<'_>) -> RecipeError {
    if value.is_table() || value.is_array() {
        return section(format!("{place}: [{}]", shortened(name)), name);
    }
    key(format!("{place}: {}", shortened(name)), "", name)
}

/// A section that no recipe has.
pub(super) fn section(at: String, name: &str) -> RecipeError {
    let sections: Vec<&str> = catalogue::sections()
        .iter()
        .map(|section| section.name)
        .collect();
    let hint = nearest(name, sections.iter().copied())
        .map_or_else(String::new, |near| format!("; did you mean {near}?"));
    RecipeError::Unknown {
        at,
        what: "section",
        hint,
        known: format!("a recipe has {}", sections.join(", ")),
    }
}

/// A key that its section does not have.
pub(super) fn key(at: String, section: &str, name: &str) -> RecipeError {
    let names: Vec<String> = match section {
        "" => vec![PRESET.name()],
        "data.keyframe" => KEYFRAME.iter().map(Key::name).collect(),
        _ => catalogue::keys()
            .filter(|key| key.section == section)
            .map(Key::name)
            .collect(),
    };
    let at_home: Vec<String> = catalogue::keys()
        .filter(|key| key.name() == name)
        .map(|key| format!("[{}]", key.section))
        .collect();
    let hint = if !at_home.is_empty() {
        format!("; it belongs in {}", at_home.join(" or "))
    } else if let Some(near) = nearest(name, names.iter().map(String::as_str)) {
        format!("; did you mean {near}?")
    } else {
        String::new()
    };
    let home = match section {
        "" => "above all sections stands".to_owned(),
        _ => format!("[{section}] has"),
    };
    RecipeError::Unknown {
        at,
        what: "key",
        hint,
        known: format!("{home} {}", names.join(", ")),
    }
}

/// The known name that is most like the one given, if one is like it at all.
fn nearest<'a>(given: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    const ALIKE: f64 = 0.7;
    let given = given.to_lowercase().replace('_', "-");
    known
        .map(|name| (strsim::jaro_winkler(&given, name), name))
        .filter(|(likeness, _)| *likeness >= ALIKE)
        .max_by(|one, other| one.0.total_cmp(&other.0))
        .map(|(_, name)| name)
}
