//! Boxes round points in the user's coordinates; [`Bounds`](super::Bounds) are those in normalised ones.

/// A box with its sides along the axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    low: [f64; 3],
    high: [f64; 3],
}

impl Extent {
    /// Of nothing.
    pub(crate) const NONE: Self = Self {
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
    };

    /// The box of points.
    pub(crate) fn of(points: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let mut extent = Self::NONE;
        points.into_iter().for_each(|point| extent.include(point));
        extent
    }

    /// Grows to hold a point.
    pub(crate) fn include(&mut self, point: [f64; 3]) {
        self.low = [0, 1, 2].map(|axis| self.low[axis].min(point[axis]));
        self.high = [0, 1, 2].map(|axis| self.high[axis].max(point[axis]));
    }

    /// The length from corner to corner.
    pub(crate) fn diagonal(&self) -> f64 {
        let sides = [0, 1, 2].map(|axis| self.high[axis] - self.low[axis]);
        sides.iter().map(|side| side * side).sum::<f64>().sqrt()
    }

    /// How far the boxes are apart; 0 where they meet.
    pub(crate) fn gap(&self, other: &Self) -> f64 {
        let along = |axis: usize| {
            let (below, above) = (
                other.low[axis] - self.high[axis],
                self.low[axis] - other.high[axis],
            );
            below.max(above).max(0.0)
        };
        let gaps = [0, 1, 2].map(along);
        gaps.iter().map(|gap| gap * gap).sum::<f64>().sqrt()
    }
}
