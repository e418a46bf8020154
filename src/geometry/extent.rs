//! Boxes round points in the user's coordinates; [`Bounds`](super::Bounds) are those in normalised ones.

use super::linear::{difference, length};
use super::mesh::Mesh;

/// A box with its sides along the axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// The lowest coordinates.
    pub low: [f64; 3],
    /// The highest.
    pub high: [f64; 3],
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

    /// The box of what belongs to a surface: the vertices of triangles, or all points of a cloud.
    pub(crate) fn of_surface(mesh: &Mesh<f64>) -> Self {
        let corners = mesh.triangles.iter().flatten();
        match mesh.triangles.is_empty() {
            true => Self::of(mesh.vertices.iter().copied()),
            false => Self::of(corners.map(|vertex| mesh.vertices[*vertex as usize])),
        }
    }

    /// The box of two.
    pub(crate) fn joined(mut self, other: &Self) -> Self {
        self.include(other.low);
        self.include(other.high);
        self
    }

    /// Grows to hold a point.
    pub(crate) fn include(&mut self, point: [f64; 3]) {
        self.low = [0, 1, 2].map(|axis| self.low[axis].min(point[axis]));
        self.high = [0, 1, 2].map(|axis| self.high[axis].max(point[axis]));
    }

    /// The length from corner to corner.
    pub(crate) fn diagonal(&self) -> f64 {
        length(self.sides())
    }

    /// The lengths along the axes.
    pub(crate) fn sides(&self) -> [f64; 3] {
        difference(self.high, self.low)
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
        length([0, 1, 2].map(along))
    }
}
