//! One array of numpy: a header of text, and numbers.
//!
//! Source: the format NPY 1.0 to 3.0, numpy.lib.format.

use std::io::Read;

use half::f16;

/// The longest header that is read: numpy itself refuses more than 10,000 bytes.
const LONGEST_HEADER: usize = 65_536;

/// The most bytes of an array that are read; an archive can state and hold zeros without end in little space.
const MOST: u64 = 1 << 31;

/// Numbers in rows: the last axis is the fastest.
pub(crate) struct Array {
    /// The length of each axis.
    pub shape: Vec<usize>,
    /// The numbers; whole ones are exact up to 2^53.
    pub values: Vec<f64>,
}

/// What a header states.
struct Header {
    is_big_endian: bool,
    kind: char,
    size: usize,
    /// Whether the first axis is the fastest.
    by_columns: bool,
    shape: Vec<usize>,
}

impl Array {
    /// Reads an array, which ends where its numbers end.
    ///
    /// # Errors
    /// What is wrong, in a line.
    pub(super) fn read(reader: &mut dyn Read) -> Result<Self, String> {
        let header = Header::read(reader)?;
        let count = header
            .shape
            .iter()
            .try_fold(1usize, |all, axis| all.checked_mul(*axis));
        let needed = count
            .and_then(|count| count.checked_mul(header.size))
            .map(|needed| needed as u64);
        let shape = described(&header.shape);
        let Some(needed) = needed.filter(|needed| *needed <= MOST) else {
            return Err(format!(
                "its header states the shape {shape}: more than {MOST} bytes"
            ));
        };
        let mut bytes = Vec::new();
        // One more than needed, to see whether there is more.
        let read = reader.take(needed + 1).read_to_end(&mut bytes);
        read.map_err(|error| format!("{error}: truncated or malformed"))?;
        if bytes.len() as u64 != needed {
            let found = bytes.len();
            let found = if found as u64 > needed {
                "more".to_owned()
            } else {
                found.to_string()
            };
            return Err(format!(
                "its header states the shape {shape}, {needed} bytes, but {found} follow"
            ));
        }
        let stored: Option<Vec<f64>> = (bytes.chunks_exact(header.size))
            .map(|bytes| number(header.kind, bytes, header.is_big_endian))
            .collect();
        let stored = stored.ok_or_else(|| header.unknown())?;
        let values = match (header.by_columns, header.shape.as_slice()) {
            (true, &[rows, columns]) => {
                let at = |k: usize| stored[k % columns * rows + k / columns];
                (0..stored.len()).map(at).collect()
            }
            // One axis is the same in both orders, and arrays of more are not used.
            _ => stored,
        };
        Ok(Self {
            shape: header.shape,
            values,
        })
    }

    /// The shape as numpy writes it.
    pub(crate) fn described(&self) -> String {
        described(&self.shape)
    }
}

fn described(shape: &[usize]) -> String {
    let axes: Vec<String> = shape.iter().map(usize::to_string).collect();
    match axes.as_slice() {
        [one] => format!("({one},)"),
        axes => format!("({})", axes.join(", ")),
    }
}

impl Header {
    fn read(reader: &mut dyn Read) -> Result<Self, String> {
        let mut start = [0; 8];
        let whole = reader.read_exact(&mut start);
        if whole.is_err() || &start[..6] != b"\x93NUMPY" {
            return Err("does not start as an array of numpy (.npy)".to_owned());
        }
        let mut length = [0; 4];
        // Two bytes in version 1, four in versions 2 and 3.
        let wide = if start[6] == 1 { 2 } else { 4 };
        let ended = |_error| "it ends within its header: truncated".to_owned();
        reader.read_exact(&mut length[..wide]).map_err(ended)?;
        let length = u32::from_le_bytes(length) as usize;
        if !(1..=3).contains(&start[6]) || length > LONGEST_HEADER {
            let version = start[6];
            return Err(format!(
                "version {version} with a header of {length} bytes: must be version 1 to 3 of .npy"
            ));
        }
        let mut text = vec![0; length];
        reader.read_exact(&mut text).map_err(ended)?;
        Self::parse(&String::from_utf8_lossy(&text))
    }

    fn parse(text: &str) -> Result<Self, String> {
        let missing = |key: &str| format!("its header has no {key} that can be read: malformed");
        let quoted = value(text, "descr").and_then(|rest| {
            let quote = rest
                .chars()
                .next()
                .filter(|first| ['\'', '"'].contains(first))?;
            rest[1..].split(quote).next()
        });
        let quoted = quoted.ok_or_else(|| missing("plain type of numbers (descr)"))?;
        let order = value(text, "fortran_order").ok_or_else(|| missing("fortran_order"))?;
        let axes = value(text, "shape").and_then(|rest| rest.strip_prefix('(')?.split(')').next());
        let axes = axes
            .ok_or_else(|| missing("shape"))?
            .split(',')
            .map(str::trim);
        let axes: Result<Vec<usize>, _> = axes
            .filter(|axis| !axis.is_empty())
            .map(str::parse)
            .collect();
        let shape = axes.map_err(|error| format!("its header: shape: {error}"))?;
        let mut letters = quoted.chars();
        let first = letters.next().unwrap_or('?');
        let kind = letters.next().unwrap_or('?');
        let size = letters.as_str().parse().unwrap_or(0);
        let header = Self {
            is_big_endian: first == '>',
            kind,
            size,
            by_columns: order.starts_with("True"),
            shape,
        };
        let is_known = number(kind, &[0; 8][..size.min(8)], false).is_some() && size <= 8;
        match is_known && ['<', '>', '|', '='].contains(&first) {
            true => Ok(header),
            false => Err(header.unknown()),
        }
    }

    fn unknown(&self) -> String {
        let Self { kind, size, .. } = self;
        let kind = kind.escape_debug();
        format!("numbers of type {kind}{size}: must be f2, f4, f8, or i or u of 1, 2, 4 or 8 bytes")
    }
}

/// What follows a key of the header and its colon.
fn value<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let quoted = [format!("'{key}'"), format!("\"{key}\"")];
    let rest = quoted
        .iter()
        .find_map(|quoted| header.split_once(quoted.as_str()))?
        .1;
    Some(rest.trim_start().strip_prefix(':')?.trim_start())
}

/// The number in some bytes; none of a type that is not read.
fn number(kind: char, bytes: &[u8], is_big_endian: bool) -> Option<f64> {
    let mut little = [0; 8];
    let size = bytes.len();
    little.get_mut(..size)?.copy_from_slice(bytes);
    if is_big_endian {
        little[..size].reverse();
    }
    let whole = u64::from_le_bytes(little);
    // The sign is the highest bit that is used.
    let signed = || {
        let unused = 64 - 8 * size as u32;
        ((whole << unused) as i64 >> unused) as f64
    };
    Some(match (kind, size) {
        ('f', 2) => f16::from_bits(whole as u16).to_f64(),
        ('f', 4) => f64::from(f32::from_bits(whole as u32)),
        ('f', 8) => f64::from_bits(whole),
        ('i', 1 | 2 | 4 | 8) => signed(),
        ('u', 1 | 2 | 4 | 8) => whole as f64,
        _ => return None,
    })
}
