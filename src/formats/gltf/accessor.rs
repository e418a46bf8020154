//! Accessors: numbers out of the bytes of a file.

use serde_json::Value;

use super::document::Document;
use crate::formats::error::ShapeError;
use crate::formats::lines::shown;

/// How a number is stored.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: Option<usize>) -> Option<Self> {
        Some(match code? {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number in the first bytes.
    fn number(self, bytes: &[u8]) -> f64 {
        let byte = |at: usize| bytes.get(at).copied().unwrap_or_default();
        let two = || [byte(0), byte(1)];
        let four = || [byte(0), byte(1), byte(2), byte(3)];
        match self {
            Self::I8 => f64::from(byte(0) as i8),
            Self::U8 => f64::from(byte(0)),
            Self::I16 => f64::from(i16::from_le_bytes(two())),
            Self::U16 => f64::from(u16::from_le_bytes(two())),
            Self::U32 => f64::from(u32::from_le_bytes(four())),
            Self::F32 => f64::from(f32::from_le_bytes(four())),
        }
    }

    /// What stands for 1 in a normalised number.
    fn one(self) -> f64 {
        match self {
            Self::I8 => f64::from(i8::MAX),
            Self::U8 => f64::from(u8::MAX),
            Self::I16 => f64::from(i16::MAX),
            Self::U16 => f64::from(u16::MAX),
            Self::U32 => f64::from(u32::MAX),
            Self::F32 => 1.0,
        }
    }
}

/// The values of an accessor, row by row.
pub(super) struct Rows {
    /// How many numbers a row has.
    pub width: usize,
    pub numbers: Vec<f64>,
}

impl Rows {
    /// The rows as vectors of `N`; further numbers are cut off.
    pub(super) fn vectors<const N: usize>(&self) -> impl Iterator<Item = [f64; N]> {
        let rows = self.numbers.chunks_exact(self.width);
        rows.map(|row| std::array::from_fn(|k| row.get(k).copied().unwrap_or_default()))
    }
}

impl Document<'_> {
    /// Reads an accessor of one of the types of the format that are allowed, such as `VEC3`.
    ///
    /// # Errors
    /// Another type; an accessor without data, or whose data reach beyond its view; one that is sparse.
    pub(super) fn rows(&self, index: usize, allowed: &[&str]) -> Result<Rows, ShapeError> {
        let accessor = self.element("accessors", index)?;
        let wrong = |problem: String| self.malformed(format!("accessors[{index}]: {problem}"));
        let kind = accessor["type"].as_str().unwrap_or("none");
        if !allowed.contains(&kind) {
            let kind = shown(kind);
            return Err(wrong(format!(
                "type {kind}, must be {}",
                allowed.join(" or ")
            )));
        }
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let code = self.whole(accessor, "componentType")?;
        let component = Component::of(code).ok_or_else(|| {
            wrong(format!(
                "componentType {}: must be 5120 to 5126",
                shown(&accessor["componentType"].to_string())
            ))
        })?;
        if accessor.get("sparse").is_some() {
            return Err(wrong(
                "sparse values are not read; export it without".to_owned(),
            ));
        }
        let count = self.whole(accessor, "count")?.unwrap_or(0);
        let Some(view) = self.whole(accessor, "bufferView")? else {
            return Err(wrong(
                "it has no data; if the file is compressed, export it without".to_owned(),
            ));
        };
        let (bytes, stride) = self.view(view)?;
        let start = self.whole(accessor, "byteOffset")?.unwrap_or(0);
        let size = width * component.size();
        let stride = stride.unwrap_or(size);
        let end =
            (start as u128) + (count.saturating_sub(1) as u128) * (stride as u128) + size as u128;
        if stride < size || count > 0 && end > bytes.len() as u128 {
            let held = bytes.len();
            return Err(wrong(format!(
                "{count} values of {size} bytes, {stride} apart, from byte {start} on do not fit into the {held} bytes of \
                 bufferViews[{view}]: truncated or malformed"
            )));
        }
        let one = if accessor["normalized"] == Value::Bool(true) {
            component.one()
        } else {
            1.0
        };
        // The least of a normalised number with a sign is -1, though it could be a little less.
        let least = if one > 1.0 { -1.0 } else { f64::NEG_INFINITY };
        let mut numbers = Vec::with_capacity(count * width);
        for row in 0..count {
            let at = start + row * stride;
            let parts = bytes[at..at + size].chunks_exact(component.size());
            numbers.extend(parts.map(|part| (component.number(part) / one).max(least)));
        }
        Ok(Rows { width, numbers })
    }

    /// Reads an accessor of indices below a count of vertices.
    ///
    /// # Errors
    /// Those of [`Document::rows`], and an index that is too large.
    pub(super) fn indices(&self, index: usize, vertices: usize) -> Result<Vec<u32>, ShapeError> {
        let rows = self.rows(index, &["SCALAR"])?;
        let whole = rows.numbers.into_iter().enumerate().map(|(at, number)| {
            let inside = number >= 0.0 && number < vertices as f64 && number.fract() == 0.0;
            inside.then_some(number as u32).ok_or_else(|| {
                let name = format!("accessors[{index}]");
                self.malformed(format!(
                    "{name}: index {at} is {number} (the primitive has {vertices} vertices)"
                ))
            })
        });
        whole.collect()
    }
}
