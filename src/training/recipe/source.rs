//! Where the values of a recipe come from: the lines of a TOML file and the `--set` overrides,
//! each value checked by its key's rule and remembered with its place.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::RecipeError;
use super::keys::{KEYS, PRESET, SECTIONS};
use super::rule::{Kind, Value};
use super::schema::{Key, Section};
use super::words::Preset;

/// Values by key, such as "training.steps".
pub(super) type Entries = BTreeMap<String, Entry>;

/// A value and where it was given.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) value: Value,
    pub(super) place: Place,
}

/// Where a value was given.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Place {
    /// In a file, at this line.
    Line { file: String, line: usize },
    /// On the command line, in these words.
    Override(String),
    /// Nowhere: it is the preset's.
    Preset(Preset),
}

impl Place {
    /// The beginning of an error about this key: where, which key, and what was found there.
    pub(super) fn about(&self, key: &str, found: &str) -> String {
        match self {
            Place::Override(_) => self.to_string(),
            _ => format!("{self}: {key} = {found}"),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line { file, line } => write!(out, "{file}:{line}"),
            Place::Override(given) => write!(out, "--set {given}"),
            Place::Preset(preset) => write!(out, "preset \"{preset}\""),
        }
    }
}

/// Text of a recipe and its name in messages.
struct Text<'a> {
    text: &'a str,
    name: String,
}

impl Text<'_> {
    fn line(&self, offset: usize) -> usize {
        1 + self
            .text
            .bytes()
            .take(offset)
            .filter(|byte| *byte == b'\n')
            .count()
    }

    fn place(&self, span: &Range<usize>) -> Place {
        Place::Line {
            file: self.name.clone(),
            line: self.line(span.start),
        }
    }

    /// What the user wrote there, or its first line.
    fn found(&self, span: Range<usize>) -> String {
        shortened(
            self.text
                .get(span)
                .unwrap_or_default()
                .lines()
                .next()
                .unwrap_or_default(),
        )
    }
}

/// The text on one line, without control characters, cut where it is long.
fn shortened(text: &str) -> String {
    const LONGEST: usize = 80;
    let text = text.trim();
    let mut cut: String = text
        .chars()
        .take(LONGEST)
        .map(|letter| {
            if letter.is_control() {
                '\u{FFFD}'
            } else {
                letter
            }
        })
        .collect();
    if text.chars().nth(LONGEST).is_some() {
        cut.push('…');
    }
    cut
}

/// The values that a recipe's text gives.
///
/// # Errors
/// The first mistake of the text in the order of its lines.
pub(super) fn read_text(text: &str, origin: &Path) -> Result<Entries, RecipeError> {
    let text = Text {
        text,
        name: origin.display().to_string(),
    };
    let document = DeTable::parse(text.text).map_err(|error| not_toml(&text, &error))?;
    let mut entries = Entries::new();
    for (name, value) in in_order(document.get_ref()) {
        let place = text.place(&name.span());
        if name.get_ref() == PRESET.field {
            read_entry(&text, &PRESET, value, &mut entries)?;
        } else if let Some(section) = SECTIONS.iter().find(|known| known.name == name.get_ref()) {
            let table = value
                .get_ref()
                .as_table()
                .ok_or_else(|| RecipeError::Refused {
                    at: place.about(section.name, &text.found(value.span())),
                    allowed: format!("a section: [{}] on a line of its own, once", section.name),
                })?;
            read_section(&text, section, table, &mut entries)?;
        } else {
            return Err(unknown_at_top(&place, name.get_ref(), value.get_ref()));
        }
    }
    Ok(entries)
}

fn read_section(
    text: &Text<'_>,
    section: &Section,
    table: &DeTable<'_>,
    entries: &mut Entries,
) -> Result<(), RecipeError> {
    for (name, value) in in_order(table) {
        let Some(key) = find(section.name, name.get_ref()) else {
            let place = text.place(&name.span());
            let at = format!("{place}: {}.{}", section.name, shortened(name.get_ref()));
            return Err(unknown_key(at, section.name, name.get_ref()));
        };
        read_entry(text, key, value, entries)?;
    }
    Ok(())
}

/// Reads one `section.key=value` of the command line; the value may be bare where a text goes.
///
/// # Errors
/// If it has no such form, names no key, or its value breaks the key's rule.
pub(super) fn read_override(given: &str, entries: &mut Entries) -> Result<(), RecipeError> {
    let malformed = || RecipeError::NotAnOverride {
        given: given.to_owned(),
    };
    let (id, value) = given.split_once('=').ok_or_else(malformed)?;
    let (id, value) = (id.trim(), value.trim());
    let place = Place::Override(shortened(given));
    let key = if id == PRESET.field {
        &PRESET
    } else {
        let (section, name) = id.split_once('.').ok_or_else(malformed)?;
        if !SECTIONS.iter().any(|known| known.name == section) {
            return Err(unknown_section(place.to_string(), section));
        }
        find(section, name).ok_or_else(|| unknown_key(place.to_string(), section, name))?
    };
    let parsed = DeValue::parse(value).map(Spanned::into_inner);
    let parsed = match parsed {
        Ok(DeValue::String(text)) => DeValue::String(text),
        _ if key.rule.takes_text() => DeValue::String(value.into()),
        Ok(other) => other,
        Err(_) => return Err(refused(&place, key, value, key.rule.allowed())),
    };
    let admitted = key.rule.admit(&parsed);
    let value = admitted.map_err(|allowed| refused(&place, key, value, allowed))?;
    entries.insert(key.id(), Entry { value, place });
    Ok(())
}

/// Makes the paths that a recipe gives absolute; until then they are relative to `folder`.
///
/// # Errors
/// If an absolute path cannot be told or is not Unicode.
pub(super) fn make_paths_absolute(entries: &mut Entries, folder: &Path) -> Result<(), RecipeError> {
    for key in KEYS {
        if !matches!(key.rule.kind, Kind::Path | Kind::WordOrPath(_)) {
            continue;
        }
        let Some(Entry {
            value: Value::Text(text),
            ..
        }) = entries.get_mut(&key.id())
        else {
            continue;
        };
        if matches!(key.rule.kind, Kind::WordOrPath(words) if words.contains(&text.as_str())) {
            continue;
        }
        let path = folder.join(&*text);
        let absolute = std::path::absolute(&path).map_err(|error| RecipeError::Path {
            path,
            reason: error.to_string(),
        })?;
        *text = unicode(&absolute)?.to_owned();
    }
    Ok(())
}

/// The path as text.
///
/// # Errors
/// If it is not Unicode, which is all that TOML holds.
pub(super) fn unicode(path: &Path) -> Result<&str, RecipeError> {
    path.to_str().ok_or_else(|| RecipeError::Path {
        path: path.to_owned(),
        reason: "it is not Unicode, and TOML is".to_owned(),
    })
}

/// The entries of a table in the order of their lines; the parser sorts them by name.
fn in_order<'a, 'i>(
    table: &'a DeTable<'i>,
) -> Vec<(
    &'a Spanned<std::borrow::Cow<'i, str>>,
    &'a Spanned<DeValue<'i>>,
)> {
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(name, _)| name.span().start);
    entries
}

fn find(section: &str, name: &str) -> Option<&'static Key> {
    KEYS.iter()
        .find(|key| key.section == section && key.name() == name)
}

fn read_entry(
    text: &Text<'_>,
    key: &Key,
    found: &Spanned<DeValue<'_>>,
    entries: &mut Entries,
) -> Result<(), RecipeError> {
    let place = text.place(&found.span());
    let value = key
        .rule
        .admit(found.get_ref())
        .map_err(|allowed| refused(&place, key, &text.found(found.span()), allowed))?;
    entries.insert(key.id(), Entry { value, place });
    Ok(())
}

fn refused(place: &Place, key: &Key, found: &str, allowed: String) -> RecipeError {
    RecipeError::Refused {
        at: place.about(&key.id(), found),
        allowed,
    }
}

fn not_toml(text: &Text<'_>, error: &toml::de::Error) -> RecipeError {
    // A mistake at the end of the text is one of its last line, not of the one after it.
    let last = text.text.trim_end().len();
    let line = text.line(error.span().map_or(0, |span| span.start).min(last));
    RecipeError::Syntax {
        at: format!("{}:{line}", text.name),
        reason: error.message().replace('\n', ", "),
        line: shortened(text.text.lines().nth(line - 1).unwrap_or_default()),
    }
}

/// A name above all sections that is none: a section misspelt or a key out of its place.
fn unknown_at_top(place: &Place, name: &str, value: &DeValue<'_>) -> RecipeError {
    if value.is_table() || value.is_array() {
        return unknown_section(format!("{place}: [{}]", shortened(name)), name);
    }
    unknown_key(format!("{place}: {}", shortened(name)), "", name)
}

fn unknown_section(at: String, name: &str) -> RecipeError {
    let sections: Vec<&str> = SECTIONS.iter().map(|section| section.name).collect();
    let hint = nearest(name, sections.iter().copied())
        .map_or_else(String::new, |near| format!("; did you mean {near}?"));
    RecipeError::Unknown {
        at,
        what: "section",
        hint,
        known: format!("a recipe has {}", sections.join(", ")),
    }
}

fn unknown_key(at: String, section: &str, name: &str) -> RecipeError {
    let names: Vec<String> = match section {
        "" => vec![PRESET.name()],
        _ => KEYS
            .iter()
            .filter(|key| key.section == section)
            .map(Key::name)
            .collect(),
    };
    let at_home: Vec<String> = KEYS
        .iter()
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

/// The word of the preset that the entries name.
pub(super) fn preset(entries: &Entries) -> Preset {
    match entries.get(PRESET.field) {
        Some(Entry {
            value: Value::Text(word),
            ..
        }) => Preset::from_word(word).expect("the preset has passed its rule"),
        _ => Preset::Default,
    }
}
