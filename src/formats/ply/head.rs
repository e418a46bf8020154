//! The text of a header, as ply-rs takes it.
//!
//! Programs begin the file with a byte order mark, write `PLY` in capitals, end lines in `\r\n` or in `\r` alone
//! (also before binary numbers), and leave lines empty.

use std::io::BufRead;
use std::path::Path;

use crate::formats::error::ShapeError;
use crate::formats::lines::{MARK, refuse_utf_16};

/// The most bytes that a header may have: its comments are a few lines.
const LONGEST: usize = 1 << 20;

/// A header as text.
pub(super) struct Head {
    /// In lines that end in `\n`, none of them empty.
    pub text: String,
    /// How many bytes of the file it is.
    pub length: u64,
    /// How many lines of the file it is.
    pub lines: usize,
    /// The line in the file of each of the text's.
    numbers: Vec<usize>,
}

impl Head {
    /// Takes the header off the front of a file.
    ///
    /// # Errors
    /// Another kind of file; one that ends before its header does.
    pub(super) fn read(path: &Path, file: &mut impl BufRead) -> Result<Self, ShapeError> {
        let unreadable = |reason| ShapeError::Unreadable {
            path: path.to_owned(),
            reason,
        };
        let first = file.fill_buf().map_err(unreadable)?;
        refuse_utf_16(path, first)?;
        let start = if first.starts_with(MARK) {
            MARK.len()
        } else {
            0
        };
        let is_ply = first[start..]
            .get(..3)
            .is_some_and(|word| word.eq_ignore_ascii_case(b"ply"));
        if !is_ply {
            let problem = "does not start with \"ply\": not a PLY file";
            return Err(ShapeError::malformed(path, problem));
        }
        // How the first line ends says how all of them do.
        let ended = first.iter().position(|byte| b"\r\n".contains(byte));
        let is_old =
            ended.is_some_and(|at| first[at] == b'\r' && first.get(at + 1) != Some(&b'\n'));
        let ending = if is_old { b'\r' } else { b'\n' };
        file.consume(start);
        let mut head = Self {
            text: String::new(),
            length: start as u64,
            lines: 0,
            numbers: Vec::new(),
        };
        loop {
            let mut line = Vec::new();
            let most = (LONGEST as u64).saturating_sub(head.length);
            let taken = std::io::Read::take(&mut *file, most).read_until(ending, &mut line);
            head.length += taken.map_err(unreadable)? as u64;
            if line.is_empty() {
                let problem = match most {
                    0 => "the header has no line end_header within its first megabyte",
                    _ => "the file ends within its header: it is truncated",
                };
                return Err(ShapeError::malformed(path, problem));
            }
            head.lines += 1;
            let content = line.trim_ascii();
            if content.is_empty() {
                continue;
            }
            let shown = String::from_utf8_lossy(content);
            // The magic word; no other line of a header is this one.
            if head.numbers.is_empty() {
                head.text += "ply";
            } else {
                head.text += &shown;
            }
            head.text.push('\n');
            head.numbers.push(head.lines);
            if content == b"end_header" {
                return Ok(head);
            }
        }
    }

    /// The number in the file of a line of the text, both counted from 1.
    pub(super) fn line_in_file(&self, line: usize) -> usize {
        let at = line.saturating_sub(1);
        self.numbers.get(at).copied().unwrap_or(self.lines)
    }
}
