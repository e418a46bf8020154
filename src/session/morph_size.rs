//! How large a shape is and where, and whether two can be of the same thing in the same frame.

use std::fmt;

use super::morph::Doubt;
use crate::event::significant;
use crate::formats::Shape;
use crate::geometry::Extent;
use crate::geometry::linear::{difference, length};

/// The box round a shape, in the file's coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size(Extent);

/// Shapes of one thing whose sizes differ by more than this factor are likely in different units.
const OTHER_UNIT: f64 = 3.0;

/// Boxes whose centres are further apart than this many of their sizes.
const FAR_APART: f64 = 1.0;

impl Size {
    pub(super) fn of(shape: &Shape) -> Self {
        Self(Extent::of(shape.mesh.vertices.iter().copied()))
    }

    fn centre(&self) -> [f64; 3] {
        let Extent { low, high } = self.0;
        [0, 1, 2].map(|axis| f64::midpoint(low[axis], high[axis]))
    }

    /// The distance of the centres, for people.
    pub(super) fn apart(&self, other: &Self) -> String {
        significant(length(difference(self.centre(), other.centre())))
    }

    /// What speaks against these being one thing in one frame.
    pub(super) fn doubts(&self, other: &Self) -> Vec<Doubt> {
        let mut doubts = Vec::new();
        let (own, others) = (self.0.diagonal(), other.0.diagonal());
        let (small, large) = (own.min(others), own.max(others));
        if large > OTHER_UNIT * small {
            let finding = format!(
                "one shape is {} times as large as the other",
                significant(large / small)
            );
            let cure = "if their units differ, such as metres and millimetres, add --align auto";
            doubts.push(Doubt::new(finding, cure));
        }
        let apart = length(difference(self.centre(), other.centre()));
        if apart > FAR_APART * large {
            let finding = format!(
                "the centres of the shapes are {} apart, more than their size",
                significant(apart)
            );
            let cure = "the motion will contain this way; add --align auto if it should not";
            doubts.push(Doubt::new(finding, cure));
        }
        doubts
    }
}

impl fmt::Display for Size {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0.sides().map(significant);
        write!(formatter, "{x} x {y} x {z}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(size: f64, x: f64) -> Size {
        Size(Extent {
            low: [x, 0.0, 0.0],
            high: [x + size, size, size],
        })
    }

    #[test]
    fn sizes_and_places_that_cannot_be_meant_are_named() {
        assert!(block(1.0, 0.0).doubts(&block(2.0, 0.5)).is_empty());
        let found = block(1.0, 0.0).doubts(&block(1000.0, 0.0));
        assert!(found[0].finding.contains("1000 times"), "{found:?}");
        let found = block(1.0, 0.0).doubts(&block(1.0, 7.0));
        assert!(found[0].finding.contains("7.00 apart"), "{found:?}");
    }

    #[test]
    fn lengths_have_three_digits() {
        assert_eq!(
            [0.012_34, 1.234, 123.4, 12_345.0].map(significant),
            ["0.0123", "1.23", "123", "12345"]
        );
    }
}
