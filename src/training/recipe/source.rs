//! Where the values of a recipe come from: the lines of a TOML file and the `--set` overrides,
//! each value checked by its key's rule and remembered with its place.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::data::{KEYFRAME, KEYFRAMES};
use super::entry::{Entries, Entry, Place, keyframe_id, shortened};
use super::error::RecipeError;
use super::keys::PRESET;
use super::rule::{Kind, Value};
use super::schema::{Key, Section};
use super::setting::Setting;
use super::words::Correspondences;
use super::{catalogue, old, unknown};

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

/// How what no recipe has is taken.
pub(super) enum Reading<'a> {
    /// As an error.
    Strict,
    /// As what another version wrote: left out, with a note.
    Stored(&'a mut Vec<String>),
}

impl Reading<'_> {
    fn unknown(&mut self, error: RecipeError) -> Result<(), RecipeError> {
        match self {
            Reading::Strict => Err(error),
            Reading::Stored(notes) => {
                notes.push(format!("{error}; it is left out"));
                Ok(())
            }
        }
    }
}

/// The values that a recipe's text gives.
///
/// # Errors
/// The first mistake of the text in the order of its lines.
pub(super) fn read_text(
    text: &str,
    origin: &Path,
    reading: &mut Reading<'_>,
) -> Result<Entries, RecipeError> {
    let text = Text {
        text,
        name: origin.display().to_string(),
    };
    let document = DeTable::parse(text.text).map_err(|error| not_toml(&text, &error))?;
    let mut entries = Entries::new();
    for (name, value) in in_order(document.get_ref()) {
        let place = text.place(&name.span());
        if name.get_ref() == PRESET.field {
            read_entry(&text, &PRESET, PRESET.id(), value, &mut entries)?;
        } else if let Some(section) = section(name.get_ref()) {
            let table = value
                .get_ref()
                .as_table()
                .ok_or_else(|| RecipeError::Refused {
                    at: place.about(section.name, &text.found(value.span())),
                    allowed: format!("a section: [{}] on a line of its own, once", section.name),
                })?;
            read_section(&text, section, table, reading, &mut entries)?;
        } else {
            reading.unknown(unknown::at_top(&place, name.get_ref(), value.get_ref()))?;
        }
    }
    Ok(entries)
}

fn read_section(
    text: &Text<'_>,
    section: &Section,
    table: &DeTable<'_>,
    reading: &mut Reading<'_>,
    entries: &mut Entries,
) -> Result<(), RecipeError> {
    for (name, value) in in_order(table) {
        if (section.name, name.get_ref().as_ref()) == ("data", KEYFRAMES) {
            read_keyframes(text, value, reading, entries)?;
        } else if let Some((key, old)) = find(section.name, name.get_ref()) {
            read_entry(text, key, key.id(), value, entries)?.old = old;
        } else {
            let place = text.place(&name.span());
            let at = format!("{place}: {}.{}", section.name, shortened(name.get_ref()));
            reading.unknown(unknown::key(at, section.name, name.get_ref()))?;
        }
    }
    Ok(())
}

/// Reads every `[[data.keyframe]]`, under the names of [`keyframe_id`].
fn read_keyframes(
    text: &Text<'_>,
    list: &Spanned<DeValue<'_>>,
    reading: &mut Reading<'_>,
    entries: &mut Entries,
) -> Result<(), RecipeError> {
    let refused = || RecipeError::Refused {
        at: text
            .place(&list.span())
            .about("data.keyframe", &text.found(list.span())),
        allowed: "a list: [[data.keyframe]] on a line of its own for each key frame".to_owned(),
    };
    let list = list.get_ref().as_array().ok_or_else(refused)?;
    for (index, item) in list.iter().enumerate() {
        let table = item.get_ref().as_table().ok_or_else(refused)?;
        for (name, value) in in_order(table) {
            if let Some(key) = KEYFRAME.iter().find(|key| key.name() == **name.get_ref()) {
                read_entry(text, key, keyframe_id(index, key), value, entries)?;
            } else {
                let at = format!(
                    "{}: data.keyframe.{}",
                    text.place(&name.span()),
                    shortened(name.get_ref())
                );
                reading.unknown(unknown::key(at, "data.keyframe", name.get_ref()))?;
            }
        }
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
    let (key, old) = if id == PRESET.field {
        (&PRESET, None)
    } else {
        let (in_section, name) = id.split_once('.').ok_or_else(malformed)?;
        if section(in_section).is_none() {
            return Err(unknown::section(place.to_string(), in_section));
        }
        find(in_section, name).ok_or_else(|| unknown::key(place.to_string(), in_section, name))?
    };
    let parsed = DeValue::parse(value).map(Spanned::into_inner);
    let parsed = match parsed {
        Ok(DeValue::String(text)) => DeValue::String(text),
        _ if key.rule.takes_text() => DeValue::String(value.into()),
        Ok(other) => other,
        Err(_) => return Err(refused(&place, &key.id(), value, key.rule.allowed())),
    };
    let admitted = key.rule.admit(&parsed);
    let value = admitted.map_err(|allowed| refused(&place, &key.id(), value, allowed))?;
    let entry = Entry {
        old,
        ..Entry::new(key, value, place)
    };
    entries.insert(key.id(), entry);
    Ok(())
}

/// What is known of corresponding points, from its word or the path of its file.
///
/// # Errors
/// If it is neither.
pub(super) fn pairs_of(text: &str) -> Result<Correspondences, RecipeError> {
    let key = &KEYFRAME[2];
    let admitted = key.rule.admit(&DeValue::String(text.into()));
    let value = admitted.map_err(|allowed| RecipeError::Refused {
        at: Place::Held.about(&key.id(), &shortened(text)),
        allowed,
    })?;
    Ok(Correspondences::from_value(value).expect("it has passed its rule"))
}

/// Makes the paths that a recipe gives absolute; until then they are relative to `folder`.
///
/// # Errors
/// If an absolute path cannot be told or is not Unicode.
pub(super) fn make_paths_absolute(entries: &mut Entries, folder: &Path) -> Result<(), RecipeError> {
    for Entry { key, value, .. } in entries.values_mut() {
        let words = match key.rule.kind {
            Kind::Path => &[],
            Kind::WordOrPath(words) => words,
            _ => continue,
        };
        let Value::Text(text) = value else { continue };
        if words.contains(&text.as_str()) {
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

fn section(name: &str) -> Option<&'static Section> {
    let mut sections = catalogue::sections().iter().copied();
    sections.find(|known| known.name == name)
}

/// The key of this name, present or of an earlier version, and its old name if it has moved.
fn find(section: &str, name: &str) -> Option<(&'static Key, Option<&'static str>)> {
    let present = catalogue::find(section, name).map(|key| (key, None));
    let moved = || old::moved(section, name).map(|(old, key)| (key, Some(old)));
    let gone = || old::gone(section, name).map(|key| (key, None));
    present.or_else(moved).or_else(gone)
}

fn read_entry<'a>(
    text: &Text<'_>,
    key: &'static Key,
    id: String,
    found: &Spanned<DeValue<'_>>,
    entries: &'a mut Entries,
) -> Result<&'a mut Entry, RecipeError> {
    let place = text.place(&found.span());
    let value = key
        .rule
        .admit(found.get_ref())
        .map_err(|allowed| refused(&place, &key.id(), &text.found(found.span()), allowed))?;
    let entry = Entry::new(key, value, place);
    entries.insert(id.clone(), entry);
    Ok(entries.get_mut(&id).expect("it was put in just now"))
}

fn refused(place: &Place, id: &str, found: &str, allowed: String) -> RecipeError {
    RecipeError::Refused {
        at: place.about(id, found),
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
