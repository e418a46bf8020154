//! A recipe as text: every key resolved, or a first recipe for someone to edit.

use super::keys::{KEYS, PRESET, SECTIONS};
use super::rule::Value;
use super::schema::Key;
use super::words::Preset;

/// Columns that a comment may take.
const COLUMNS: usize = 100;

/// Every key with its value; `values` are in the order of `KEYS`.
pub(super) fn resolved(preset: Preset, values: &[Value]) -> String {
    let mut text = comment("The recipe of this run, resolved: every key with the value it has.");
    text.push_str(&format!("preset = \"{preset}\"\n"));
    for section in SECTIONS {
        text.push_str(&format!("\n{}[{}]\n", comment(section.doc), section.name));
        for (key, value) in KEYS
            .iter()
            .zip(values)
            .filter(|(key, _)| key.section == section.name)
        {
            text.push_str(&about(key));
            text.push_str(&format!("{} = {value}\n", key.name()));
        }
    }
    text
}

/// A recipe to edit: the data live, every other key as a comment `#key = value`, beside it the
/// other presets' values where they differ.
pub(super) fn commented(preset: Preset, data: impl Fn(&Key) -> Option<Value>) -> String {
    let mut text = comment(
        "A recipe of isomorph: how the source becomes the target. A line such as `#depth = 5` \
         shows the value that the preset gives; to change it, remove the # and edit. \
         `isomorph train` with the name of this file starts the run.",
    );
    text.push('\n');
    text.push_str(&about(&PRESET));
    text.push_str(&format!("preset = \"{preset}\"\n"));
    for section in SECTIONS {
        text.push_str(&format!("\n{}[{}]\n", comment(section.doc), section.name));
        for key in KEYS.iter().filter(|key| key.section == section.name) {
            text.push_str(&about(key));
            let value = data(key).or_else(|| key.preset_value(preset));
            let value = value.expect("the data section's required keys are given");
            let mark = if section.name == "data" { "" } else { "#" };
            let elsewhere = other_presets(key, preset, &value);
            text.push_str(&format!("{mark}{} = {value}{elsewhere}\n", key.name()));
        }
    }
    text
}

/// The comment above a key: its documentation and, on the same line if it fits, what is allowed.
fn about(key: &Key) -> String {
    let doc = comment(key.doc);
    let allowed = format!("[{}]", key.rule.described());
    let last = doc.trim_end().lines().last().unwrap_or_default();
    if last.chars().count() + 1 + allowed.chars().count() <= COLUMNS {
        format!("{} {allowed}\n", doc.trim_end())
    } else {
        doc + &comment(&allowed)
    }
}

/// A comment that names the presets in which the key has another value.
fn other_presets(key: &Key, preset: Preset, value: &Value) -> String {
    let others: Vec<String> = Preset::ALL
        .iter()
        .copied()
        .filter(|other| *other != preset && key.section != "data")
        .filter_map(|other| Some((other, key.preset_value(other)?)))
        .filter(|(_, there)| there != value)
        .map(|(other, there)| format!("{other}: {there}"))
        .collect();
    if others.is_empty() {
        String::new()
    } else {
        format!("  # {}", others.join(", "))
    }
}

/// The text as comment lines that begin with "# ", broken between words.
fn comment(text: &str) -> String {
    let mut lines = String::new();
    let mut line = String::from("#");
    for word in text.split_whitespace() {
        if line.chars().count() + 1 + word.chars().count() > COLUMNS {
            lines.push_str(&line);
            lines.push('\n');
            line = String::from("#");
        }
        line.push(' ');
        line.push_str(word);
    }
    lines.push_str(&line);
    lines.push('\n');
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_break_between_words_at_100_columns() {
        let text = comment(&"word ".repeat(40));
        // "#" and 19 times " word" are 96 columns; a 20th word would make 101.
        let lengths: Vec<usize> = text.lines().map(str::len).collect();
        assert_eq!(lengths, [96, 96, 11]);
        assert!(text.lines().all(|line| line.starts_with("# ")));
    }
}
