//! One block of bytes for all arrays of a page, and where each lies in it.
//!
//! Each array begins at a multiple of 4, as the page's program needs it. Numbers are little-endian.

use serde_json::{Value, json};

use crate::geometry::Bounds;

/// The arrays of a page.
pub(super) struct Block {
    bytes: Vec<u8>,
    low: [f32; 3],
    span: f32,
}

impl Block {
    /// For positions in this box.
    pub(super) fn new(bounds: &Bounds) -> Self {
        let sides = [0, 1, 2].map(|k| bounds.max[k] - bounds.min[k]);
        let longest = sides.into_iter().fold(0.0, f32::max);
        Self {
            bytes: Vec::new(),
            low: bounds.min,
            span: if longest > 0.0 { longest } else { 1.0 },
        }
    }

    /// The longest side of the box.
    pub(super) fn span(&self) -> f32 {
        self.span
    }

    /// All bytes.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn put(&mut self, kind: &str, count: usize, bytes: impl IntoIterator<Item = u8>) -> Value {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let at = self.bytes.len();
        self.bytes.extend(bytes);
        json!({"kind": kind, "at": at, "count": count})
    }

    /// Positions as 16-bit numbers: 0 is the lower end of the box, 65535 its longest side.
    pub(super) fn positions<'a>(
        &mut self,
        points: impl IntoIterator<Item = &'a [f32; 3]>,
    ) -> Value {
        let (low, span) = (self.low, self.span);
        let whole = |part: f32, k: usize| {
            // A number that is none becomes 0, as the conversion has it.
            let share = ((part - low[k]) / span).clamp(0.0, 1.0);
            (share * 65535.0).round() as u16
        };
        let bytes: Vec<u8> = (points.into_iter())
            .flat_map(|x| [0, 1, 2].map(|k| whole(x[k], k)))
            .flat_map(u16::to_le_bytes)
            .collect();
        self.put("u16", bytes.len() / 2, bytes)
    }

    /// The corners of triangles over so many vertices; nothing for a cloud.
    pub(super) fn triangles(&mut self, triangles: &[[u32; 3]], vertices: usize) -> Value {
        let corners = triangles.iter().flatten();
        match triangles.len() {
            0 => Value::Null,
            count if vertices <= 1 << 16 => {
                let bytes = corners.flat_map(|corner| (*corner as u16).to_le_bytes());
                self.put("u16", 3 * count, bytes)
            }
            count => {
                let bytes = corners.flat_map(|corner| corner.to_le_bytes());
                self.put("u32", 3 * count, bytes)
            }
        }
    }

    /// Values as shares of the largest, in 8 bits; `null` where there are none.
    pub(super) fn values(&mut self, values: &[f32]) -> Value {
        let finite = values.iter().copied().filter(|value| value.is_finite());
        let most = finite.fold(0.0, f32::max);
        let share = |value: &f32| match most > 0.0 {
            true => (value / most * 255.0).round() as u8,
            false => 0,
        };
        let place = self.put("u8", values.len(), values.iter().map(share));
        json!({"place": place, "most": most})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_begin_at_multiples_of_four_and_positions_are_shares_of_the_longest_side() {
        let mut block = Block::new(&Bounds {
            min: [-1.0, 0.0, 0.0],
            max: [1.0, 1.0, 0.5],
        });
        let values = block.values(&[0.0, 1.0, 4.0]);
        assert_eq!(values["most"], json!(4.0));
        let positions = block.positions([&[-1.0, 1.0, 0.5], &[1.0, 0.0, 9.0]]);
        assert_eq!(positions, json!({"kind": "u16", "at": 4, "count": 6}));
        assert_eq!(block.bytes()[..3], [0, 64, 255]);
        let whole: Vec<u16> = (block.bytes()[4..].as_chunks::<2>().0.iter())
            .map(|bytes| u16::from_le_bytes(*bytes))
            .collect();
        // The last one lies outside and is cut off.
        assert_eq!(whole, [0, 32768, 16384, 65535, 0, 65535]);
    }

    #[test]
    fn many_vertices_take_indices_of_thirty_two_bits() {
        let bounds = Bounds {
            min: [0.0; 3],
            max: [0.0; 3],
        };
        let mut block = Block::new(&bounds);
        assert_eq!(block.triangles(&[[0, 1, 65535]], 65536)["kind"], "u16");
        assert_eq!(block.triangles(&[[0, 1, 65536]], 65537)["kind"], "u32");
        assert_eq!(block.triangles(&[], 3), Value::Null);
    }
}
