//! Lines of text files, with their numbers.

use std::borrow::Cow;
use std::path::Path;

use super::error::ShapeError;

/// The byte order mark of UTF-8.
pub(super) const MARK: &[u8] = b"\xef\xbb\xbf";

/// The lines of a file with something on them, counted from 1 and trimmed; a byte order mark is passed over. What
/// is not UTF-8 shows as replacement characters and will not parse.
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
    // A line ends in \n, in \r\n, or in \r as old programs write it.
    let ending = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let lines = bytes.split(move |&byte| byte == ending).enumerate();
    let filled = lines.map(|(at, line)| (at + 1, line.trim_ascii()));
    filled
        .filter(|(_, line)| !line.is_empty())
        .map(|(at, line)| (at, String::from_utf8_lossy(line)))
}

/// The text of a file, in lines that end in \n: without a byte order mark, and where lines end in \r alone, as old
/// programs write them, with that replaced.
///
/// # Errors
/// Text in UTF-16.
pub(crate) fn plain_text<'a>(path: &Path, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>, ShapeError> {
    refuse_utf_16(path, bytes)?;
    let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
    if bytes.contains(&b'\n') || !bytes.contains(&b'\r') {
        return Ok(Cow::Borrowed(bytes));
    }
    let ended = |&byte: &u8| if byte == b'\r' { b'\n' } else { byte };
    Ok(Cow::Owned(bytes.iter().map(ended).collect()))
}

/// Refuses text in UTF-16, which some editors of Windows write.
///
/// # Errors
/// A byte order mark of UTF-16.
pub(crate) fn refuse_utf_16(path: &Path, bytes: &[u8]) -> Result<(), ShapeError> {
    let begins = |mark: &[u8]| bytes.starts_with(mark);
    if begins(b"\xff\xfe") || begins(b"\xfe\xff") {
        let problem = "the text is in UTF-16: save it as UTF-8";
        return Err(ShapeError::malformed(path, problem));
    }
    Ok(())
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
    number_of(word).map_err(|problem| ShapeError::line(path, line, problem))
}

/// The number that a word spells. NaN and infinity are numbers here, in the spellings of C compilers: organised
/// clouds have them where nothing was measured.
///
/// # Errors
/// What it is instead.
pub(super) fn number_of(word: &str) -> Result<f64, String> {
    if let Ok(number) = word.parse() {
        return Ok(number);
    }
    let (sign, name) = match word.strip_prefix('-') {
        Some(name) => (-1.0, name),
        None => (1.0, word.strip_prefix('+').unwrap_or(word)),
    };
    let name = name.to_ascii_lowercase();
    if name.starts_with("nan(")
        || name.starts_with("1.#qnan")
        || name.starts_with("1.#snan")
        || name.starts_with("1.#ind")
    {
        return Ok(f64::NAN);
    }
    if name.starts_with("1.#inf") {
        return Ok(sign * f64::INFINITY);
    }
    let comma = word.contains(',');
    let cure = if comma {
        "; write decimals with a point"
    } else {
        ""
    };
    Err(format!("{:?} is not a number{cure}", shown(word)))
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

    #[test]
    fn what_c_programs_write_for_no_number_is_read_and_words_are_not() {
        for word in ["nan", "-NaN", "-nan(ind)", "1.#QNAN", "-1.#IND", "1.#IND00"] {
            assert!(number_of(word).expect(word).is_nan(), "{word}");
        }
        assert_eq!(number_of("-1.#INF"), Ok(f64::NEG_INFINITY));
        assert_eq!(number_of("inf"), Ok(f64::INFINITY));
        assert!(number_of("nano").is_err() && number_of("1.5x").is_err());
        assert!(
            number_of("0,5")
                .expect_err("a comma")
                .contains("with a point")
        );
    }

    #[test]
    fn utf_16_is_named() {
        let refused = plain_text(Path::new("a.obj"), b"\xff\xfev\0 \0").expect_err("refused");
        assert_eq!(
            refused.to_string(),
            "a.obj: the text is in UTF-16: save it as UTF-8"
        );
    }
}
