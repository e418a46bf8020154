//! Lines of text files, with their numbers.

use std::borrow::Cow;
use std::path::Path;

use super::error::ShapeError;

/// The lines of a file with something on them, counted from 1 and trimmed; a byte order mark is passed over. What
/// is not UTF-8 shows as replacement characters and will not parse.
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // A line ends in \n, in \r\n, or in \r as old programs write it.
    let ending = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let lines = bytes.split(move |&byte| byte == ending).enumerate();
    let filled = lines.map(|(at, line)| (at + 1, line.trim_ascii()));
    filled
        .filter(|(_, line)| !line.is_empty())
        .map(|(at, line)| (at, String::from_utf8_lossy(line)))
}

/// The fields of a line: separated by semicolons, else by commas, else by spaces or tabs.
pub(crate) fn fields(line: &str) -> impl Iterator<Item = &str> {
    let separator = [';', ','].into_iter().find(|&known| line.contains(known));
    // One of the two has all fields, the other none.
    let (separated, spaced) = match separator {
        Some(_) => (line, ""),
        None => ("", line),
    };
    let separated = separator.map(|separator| separated.split(separator).map(str::trim));
    separated
        .into_iter()
        .flatten()
        .chain(spaced.split_whitespace())
}

/// A number of a line.
///
/// # Errors
/// What it is instead.
pub(super) fn number(path: &Path, line: usize, word: &str) -> Result<f64, ShapeError> {
    let parsed = word.parse();
    parsed.map_err(|_unparsed| {
        let comma = word.contains(',');
        let cure = if comma {
            "; write decimals with a point"
        } else {
            ""
        };
        ShapeError::line(
            path,
            line,
            format!("{:?} is not a number{cure}", shown(word)),
        )
    })
}

/// The first three of some words as numbers.
///
/// # Errors
/// Fewer of them, or what is no number.
pub(super) fn vector(path: &Path, line: usize, words: &[&str]) -> Result<[f64; 3], ShapeError> {
    let &[x, y, z, ..] = words else {
        let problem = format!("{} coordinates, 3 needed", words.len());
        return Err(ShapeError::line(path, line, problem));
    };
    let of = |word| number(path, line, word);
    Ok([of(x)?, of(y)?, of(z)?])
}

/// As much of a text as a message shows, in one line.
pub(crate) fn shown(text: &str) -> String {
    let start = text.chars().take(60);
    start
        .map(|letter| if letter.is_control() { ' ' } else { letter })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_as_editors_do_whatever_ends_them() {
        let of = |text: &str| {
            let lines = lines(text.as_bytes());
            lines
                .map(|(at, line)| format!("{at}{line}"))
                .collect::<Vec<_>>()
        };
        assert_eq!(of("\u{feff}a\n\n b \r\nc"), ["1a", "3b", "4c"]);
        assert_eq!(of("a\rb\r\rc"), ["1a", "2b", "4c"]);
    }
}
