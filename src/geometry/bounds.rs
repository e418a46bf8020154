//! Axis-aligned boxes.

use serde::{Deserialize, Serialize};

/// An axis-aligned box in normalised coordinates.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
pub struct Bounds {
    /// The corner with the least coordinates.
    pub min: [f32; 3],
    /// The corner with the greatest coordinates.
    pub max: [f32; 3],
}

impl Bounds {
    /// The smallest box that holds the points; of no points, an inside-out box that every union
    /// replaces.
    pub fn of(points: &[[f32; 3]]) -> Self {
        let nothing = Self {
            min: [f32::INFINITY; 3],
            max: [f32::NEG_INFINITY; 3],
        };
        points.iter().fold(nothing, |bounds, &point| {
            bounds.union(&Self {
                min: point,
                max: point,
            })
        })
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: [0, 1, 2].map(|axis| self.min[axis].min(other.min[axis])),
            max: [0, 1, 2].map(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    /// The box with this much more room on every side.
    #[must_use]
    pub fn padded(&self, margin: f32) -> Self {
        Self {
            min: self.min.map(|low| low - margin),
            max: self.max.map(|high| high + margin),
        }
    }

    /// Its edge lengths.
    pub fn extent(&self) -> [f32; 3] {
        [0, 1, 2].map(|axis| self.max[axis] - self.min[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_their_points_and_grow_by_the_margin() {
        let bounds = Bounds::of(&[[0.0, 2.0, -1.0], [1.0, -2.0, 3.0]]);
        assert_eq!(
            bounds,
            Bounds {
                min: [0.0, -2.0, -1.0],
                max: [1.0, 2.0, 3.0]
            }
        );
        assert_eq!(bounds.union(&Bounds::of(&[])), bounds);
        assert_eq!(bounds.union(&Bounds::of(&[[9.0; 3]])).max, [9.0; 3]);
        assert_eq!(bounds.padded(0.5).extent(), [2.0, 5.0, 5.0]);
    }
}
