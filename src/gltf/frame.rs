//! Where the numbers of a file lie in the coordinates of the input.

use serde_json::{Value, json};

use super::builder::Precision;

/// Where the numbers of a file lie in the coordinates of the input.
pub(super) struct Frame {
    origin: [f64; 3],
    scale: f64,
}

/// Coordinates that are so many times larger than the shape are written relative to the shape: 32-bit numbers
/// would be too coarse.
const LARGEST_FOR_F32: f64 = 100.0;

impl Frame {
    /// That of all these positions.
    pub(super) fn around<'a>(
        positions: impl IntoIterator<Item = &'a Vec<[f64; 3]>>,
        precision: Precision,
    ) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for x in positions.into_iter().flatten() {
            for k in 0..3 {
                low[k] = low[k].min(x[k]);
                high[k] = high[k].max(x[k]);
            }
        }
        let span = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        let farthest = low
            .iter()
            .chain(&high)
            .fold(0.0, |a: f64, b| a.max(b.abs()));
        let is_empty = low[0] > high[0];
        if precision == Precision::Compact && !is_empty {
            let scale = if span > 0.0 { span } else { 1.0 };
            Self { origin: low, scale }
        } else if farthest > LARGEST_FOR_F32 * span && !is_empty {
            Self {
                origin: low,
                scale: 1.0,
            }
        } else {
            Self {
                origin: [0.0; 3],
                scale: 1.0,
            }
        }
    }

    /// A position in the numbers of the file.
    pub(super) fn apply(&self, x: [f64; 3]) -> [f32; 3] {
        [0, 1, 2].map(|k| ((x[k] - self.origin[k]) / self.scale) as f32)
    }

    /// Gives a node the way back.
    pub(super) fn place(&self, node: &mut Value) {
        if self.scale != 1.0 {
            node["scale"] = json!(vec![self.scale; 3]);
        }
        if self.origin != [0.0; 3] {
            node["translation"] = json!(self.origin);
        }
    }
}
