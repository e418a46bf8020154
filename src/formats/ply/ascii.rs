//! Rows of numbers in text.
//!
//! Most programs write one row on a line, some break rows or join them. Both are read. A line that holds more
//! than its row is refused where rows stand on lines of their own: then the header does not say what the numbers are.

use std::path::Path;

use ply_rs::ply::{ElementDef, Header, PropertyAccess, PropertyType, ScalarType};

use crate::formats::error::ShapeError;
use crate::formats::lines::{MARK, number_of, shown};

/// The words of a payload, with their lines.
pub(super) struct AsciiRows {
    text: String,
    /// Start and end of each word in the text, and its line.
    words: Vec<(usize, usize, usize)>,
    next: usize,
    /// Whether every row has a line of its own.
    by_lines: bool,
    /// The last line with something on it.
    last_line: usize,
}

impl AsciiRows {
    /// The words of a payload that begins at a line of its file.
    pub(super) fn new(bytes: &[u8], first_line: usize, header: &Header) -> Self {
        // Bytes that are no UTF-8 show as replacement characters and will not parse.
        let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
        let text = String::from_utf8_lossy(bytes).into_owned();
        let ending = if text.contains('\n') { '\n' } else { '\r' };
        let (mut words, mut filled, mut last_line) = (Vec::new(), 0, first_line);
        let mut start = 0;
        for (k, line) in text.split(ending).enumerate() {
            let before = words.len();
            let mut from = None;
            let ends = line.char_indices().chain([(line.len(), ' ')]);
            for (at, letter) in ends {
                match (letter.is_whitespace(), from) {
                    (false, None) => from = Some(at),
                    (true, Some(begun)) => {
                        words.push((start + begun, start + at, first_line + k));
                        from = None;
                    }
                    _ => {}
                }
            }
            if words.len() > before {
                filled += 1;
                last_line = first_line + k;
            }
            start += line.len() + ending.len_utf8();
        }
        let elements = header.elements.values();
        let rows: usize = elements.map(|element| element.count).sum();
        Self {
            text,
            words,
            next: 0,
            by_lines: filled >= rows,
            last_line,
        }
    }

    /// The next row.
    ///
    /// # Errors
    /// The line, and what is wrong with it.
    pub(super) fn next<E: PropertyAccess>(
        &mut self,
        path: &Path,
        element: &ElementDef,
        index: usize,
    ) -> Result<E, ShapeError> {
        let begun = self.next;
        let row = self.row(element);
        let line = self.words.get(begun).map_or(self.last_line, |word| word.2);
        let (name, count) = (&element.name, element.count);
        let row: E = row.map_err(|wrong| match wrong {
            Wrong::Ended => ShapeError::malformed(
                path,
                format!("the file ends within {name} {index} of {count}: it is truncated"),
            ),
            Wrong::Word(problem) => {
                let problem = format!("{name} {index}: {problem}: {}", expected(element));
                ShapeError::line(path, line, problem)
            }
        })?;
        let more = self.words[self.next..]
            .iter()
            .take_while(|word| word.2 == line);
        let more = more.count();
        if self.by_lines && more > 0 {
            let found = self.next - begun + more;
            let problem = format!(
                "{name} {index}: {found} numbers, but the header has {} for {}; add the missing properties to the \
                 header, or remove the numbers",
                self.next - begun,
                names(element)
            );
            return Err(ShapeError::line(path, line, problem));
        }
        Ok(row)
    }

    fn row<E: PropertyAccess>(&mut self, element: &ElementDef) -> Result<E, Wrong> {
        let mut row = E::new();
        for (name, property) in &element.properties {
            match &property.data_type {
                PropertyType::Scalar(kind) => {
                    let word = self.word()?;
                    set(&mut row, name, kind, word)?;
                }
                PropertyType::List(_, kind) => {
                    let word = self.word()?;
                    let count: usize = word.parse().map_err(|_unparsed| not_whole(word))?;
                    if count > self.words.len() - self.next {
                        return Err(Wrong::Ended);
                    }
                    let from = self.next;
                    self.next += count;
                    let words = &self.words[from..self.next];
                    let words = words.iter().map(|word| &self.text[word.0..word.1]);
                    set_list(&mut row, name, kind, words)?;
                }
            }
        }
        Ok(row)
    }

    fn word(&mut self) -> Result<&str, Wrong> {
        let &(from, to, _) = self.words.get(self.next).ok_or(Wrong::Ended)?;
        self.next += 1;
        Ok(&self.text[from..to])
    }

    /// What may follow the last row.
    ///
    /// # Errors
    /// More numbers, where rows do not stand on lines of their own: then the header counts too few of something.
    pub(super) fn check_end(&self, path: &Path) -> Result<(), ShapeError> {
        match self.words.get(self.next) {
            Some(&(from, to, line)) if !self.by_lines => {
                let word = shown(&self.text[from..to]);
                let problem = format!(
                    "{word:?} comes after the last row that the header announces: its counts or properties are too few"
                );
                Err(ShapeError::line(path, line, problem))
            }
            _ => Ok(()),
        }
    }
}

/// What can be wrong with a row.
enum Wrong {
    Ended,
    Word(String),
}

fn not_whole(word: &str) -> Wrong {
    Wrong::Word(format!(
        "{:?} is not a whole number of this size",
        shown(word)
    ))
}

fn number(word: &str) -> Result<f64, Wrong> {
    number_of(word).map_err(Wrong::Word)
}

/// The names of an element's properties.
fn names(element: &ElementDef) -> String {
    let names: Vec<&str> = element.properties.keys().map(String::as_str).collect();
    names.join(" ")
}

/// What a row must look like.
fn expected(element: &ElementDef) -> String {
    format!("must be numbers for {}", names(element))
}

/// Sets a whole number: written as such, or as one with nothing after its point.
macro_rules! whole {
    ($row:ident, $name:ident, $word:ident, $setter:ident, $kind:ty) => {{
        let value: $kind = $word.parse().map_err(|_unparsed| not_whole($word))?;
        $row.$setter($name, value);
    }};
}

fn set<E: PropertyAccess>(
    row: &mut E,
    name: &str,
    kind: &ScalarType,
    word: &str,
) -> Result<(), Wrong> {
    match kind {
        ScalarType::Char => whole!(row, name, word, set_char, i8),
        ScalarType::UChar => whole!(row, name, word, set_uchar, u8),
        ScalarType::Short => whole!(row, name, word, set_short, i16),
        ScalarType::UShort => whole!(row, name, word, set_ushort, u16),
        ScalarType::Int => whole!(row, name, word, set_int, i32),
        ScalarType::UInt => whole!(row, name, word, set_uint, u32),
        ScalarType::Float => {
            row.set_float(name, number(word)? as f32);
        }
        ScalarType::Double => {
            row.set_double(name, number(word)?);
        }
    }
    Ok(())
}

/// All words of a list as numbers of one kind.
macro_rules! list {
    ($row:ident, $name:ident, $words:ident, $setter:ident, $kind:ty) => {{
        let values: Result<Vec<$kind>, Wrong> = $words
            .map(|word| word.parse().map_err(|_unparsed| not_whole(word)))
            .collect();
        $row.$setter($name, values?);
    }};
}

fn set_list<'a, E: PropertyAccess>(
    row: &mut E,
    name: &str,
    kind: &ScalarType,
    words: impl Iterator<Item = &'a str>,
) -> Result<(), Wrong> {
    match kind {
        ScalarType::Char => list!(row, name, words, set_list_char, i8),
        ScalarType::UChar => list!(row, name, words, set_list_uchar, u8),
        ScalarType::Short => list!(row, name, words, set_list_short, i16),
        ScalarType::UShort => list!(row, name, words, set_list_ushort, u16),
        ScalarType::Int => list!(row, name, words, set_list_int, i32),
        ScalarType::UInt => list!(row, name, words, set_list_uint, u32),
        ScalarType::Float => {
            let values: Result<Vec<f32>, Wrong> =
                words.map(|word| Ok(number(word)? as f32)).collect();
            row.set_list_float(name, values?);
        }
        ScalarType::Double => {
            let values: Result<Vec<f64>, Wrong> = words.map(number).collect();
            row.set_list_double(name, values?);
        }
    }
    Ok(())
}
