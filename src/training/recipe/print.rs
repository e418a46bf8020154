//! A resolved recipe as text, and how keys are explained in comments.

use super::Recipe;
use super::catalogue;
use super::data::KEYFRAME;
use super::schema::Key;

/// Columns that a comment may take.
const COLUMNS: usize = 100;

impl Recipe {
    /// The recipe with every key that acts, each under its meaning as a comment; read again, it is the same
    /// recipe.
    pub fn to_toml(&self) -> String {
        let mut text =
            comment("The resolved recipe of this run: every key that acts, with its value.");
        text.push_str(&format!("preset = \"{}\"\n", self.preset));
        let values = self.acting();
        for section in catalogue::sections() {
            let of_it = |key: &Key| key.section == section.name;
            if !values.iter().any(|(key, _)| of_it(key)) {
                continue;
            }
            text.push_str(&format!("\n{}[{}]\n", comment(section.doc), section.name));
            for (key, value) in values.iter().filter(|(key, _)| of_it(key)) {
                text.push_str(&about(key, key.doc));
                text.push_str(&format!("{} = {value}\n", key.name()));
            }
            if section.name == "data" {
                text.push_str(&self.keyframes());
            }
        }
        text
    }

    /// The key frames where `source` and `target` do not say them.
    fn keyframes(&self) -> String {
        let mut text = String::new();
        for values in self.data.keyframe_values() {
            text.push_str("\n[[data.keyframe]]\n");
            for (key, value) in KEYFRAME.iter().zip(values) {
                let line = value.map(|value| format!("{} = {value}\n", key.name()));
                text.push_str(&line.unwrap_or_default());
            }
        }
        text
    }
}

/// The comment above a key: its meaning and, on the same line if it fits, what is allowed.
pub(super) fn about(key: &Key, meaning: &str) -> String {
    let doc = comment(meaning);
    let allowed = format!("[{}]", key.rule.described());
    let last = doc.trim_end().lines().last().unwrap_or_default();
    if last.chars().count() + 1 + allowed.chars().count() <= COLUMNS {
        format!("{} {allowed}\n", doc.trim_end())
    } else {
        doc + &comment(&allowed)
    }
}

/// The text as comment lines that begin with "# ", broken between words.
pub(super) fn comment(text: &str) -> String {
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
