//! A box cut into cubic cells, and why no surface could be extracted on it.

/// Cells along the longest side of a grid.
const RESOLUTIONS: std::ops::RangeInclusive<usize> = 8..=2048;
/// Least cell size as a share of the largest coordinate: 64 steps of an f32.
const LEAST_SPACING: f64 = 64.0 * f32::EPSILON as f64;

/// A box cut into cubic cells.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    min: [f64; 3],
    /// Side of a cell.
    spacing: f64,
    /// Cells along each axis.
    cells: [u32; 3],
}

/// A box or a resolution that makes no grid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Too few or too many cells.
    #[error(
        "surface extraction: resolution = {0}: must be {least} to {most} (cells along the longest \
         side of the box); 128 shows the shape, 256 its details",
        least = RESOLUTIONS.start(), most = RESOLUTIONS.end()
    )]
    Resolution(usize),
    /// A side without length, or not finite.
    #[error(
        "surface extraction: box from {min:?} to {max:?}: all coordinates must be finite and max \
         greater than min on every axis; give the bounding box of the shapes and a margin"
    )]
    Box {
        /// Lower corner as given.
        min: [f32; 3],
        /// Upper corner as given.
        max: [f32; 3],
    },
    /// The coordinates are too large for cells of this size.
    #[error(
        "surface extraction: cells of {spacing:e} at coordinates up to {largest:e} are less than \
         64 steps of a 32-bit number; move the box to the origin or lower the resolution"
    )]
    FarFromOrigin {
        /// Side of a cell.
        spacing: f64,
        /// Largest absolute coordinate of the box.
        largest: f64,
    },
}

impl Grid {
    /// A grid over the box from `min` to `max` with `resolution` cells (8 to 2048) along its
    /// longest side.
    ///
    /// The other sides get as many whole cells as cover them, so the grid may reach past `max` by
    /// less than one cell.
    ///
    /// # Errors
    /// A resolution out of range, a box without extent, or one so far from the origin that f32
    /// coordinates cannot tell its cells apart.
    pub(crate) fn new(min: [f32; 3], max: [f32; 3], resolution: usize) -> Result<Self, GridError> {
        if !RESOLUTIONS.contains(&resolution) {
            return Err(GridError::Resolution(resolution));
        }
        let sides: [f64; 3] =
            std::array::from_fn(|axis| f64::from(max[axis]) - f64::from(min[axis]));
        // NaN and infinite coordinates make a side that is not finite.
        if !sides.iter().all(|&side| side.is_finite() && side > 0.0) {
            return Err(GridError::Box { min, max });
        }
        let spacing = sides.into_iter().fold(0.0, f64::max) / resolution as f64;
        let largest = min
            .iter()
            .chain(&max)
            .fold(0.0, |most: f64, &x| most.max(f64::from(x).abs()));
        if spacing < LEAST_SPACING * largest {
            return Err(GridError::FarFromOrigin { spacing, largest });
        }
        // Rounding must not add a layer of cells to a side of exactly so many.
        let whole = |side: f64| (side / spacing - 1e-6).ceil().max(1.0) as u32;
        Ok(Self {
            min: min.map(f64::from),
            spacing,
            cells: sides.map(whole),
        })
    }

    /// Side of a cell, in the units of the box.
    #[must_use]
    pub(crate) fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Cells along each axis.
    #[must_use]
    pub(crate) fn cells(&self) -> [u32; 3] {
        self.cells
    }

    /// How many nodes the grid has.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn points(&self) -> usize {
        self.cells.iter().map(|&cells| cells as usize + 1).product()
    }

    /// How far a point is from the lower corner, in cells.
    pub(crate) fn cells_from_corner(&self, x: [f32; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| (f64::from(x[axis]) - self.min[axis]) / self.spacing)
    }

    /// Where a place given in cells from the lower corner lies.
    pub(crate) fn position(&self, place: [f64; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| (self.min[axis] + self.spacing * place[axis]) as f32)
    }
}

/// Why no surface could be extracted.
#[derive(Debug, thiserror::Error)]
pub enum ExtractError<E> {
    /// The field itself failed.
    #[error(transparent)]
    Field(E),
    /// The field answered with another number of values than points.
    #[error(
        "surface extraction: the field gave {found} values for {asked} points; one each is needed"
    )]
    Count {
        /// Points asked for.
        asked: usize,
        /// Values given.
        found: usize,
    },
    /// A value that is NaN or infinite.
    #[error(
        "surface extraction: f = {value} at {point:?}: must be finite; the network has diverged, \
         take an earlier checkpoint"
    )]
    NotFinite {
        /// The first such point.
        point: [f32; 3],
        /// The value there.
        value: f32,
    },
    /// The field has one sign everywhere.
    #[error(
        "surface extraction: no surface: f lies between {least:e} and {most:e} in the whole box, \
         it must take both signs; check that the box holds the shape, or train longer"
    )]
    NoSurface {
        /// Smallest value seen.
        least: f32,
        /// Largest value seen.
        most: f32,
    },
}
