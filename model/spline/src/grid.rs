//! The regular grid of a field, and where a point lies in it.

use crate::basis::{SUPPORT, slopes, weights};
use crate::error::SplineError;
use crate::real::Real;

/// Nodes that a grid may have: a third of a gigabyte for each vector of the solver.
const NODES_AT_MOST: usize = 10_000_000;

/// A box of cubic cells. Each axis has two nodes more than cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid<R: Real = f32> {
    /// The corner of the first cell.
    pub lower: [R; 3],
    /// The edge of a cell.
    pub spacing: R,
    /// Cells along each axis.
    pub cells: [u32; 3],
}

/// The cell of a point: its first node, and the weights and slopes of its nodes on each axis.
#[derive(Clone, Copy)]
pub(crate) struct Located<R> {
    pub first: u32,
    pub weights: [[R; SUPPORT]; 3],
    pub slopes: [[R; SUPPORT]; 3],
}

impl<R: Real> Grid<R> {
    /// The grid over a box with `margin` cells around it.
    pub(crate) fn around(
        lower: [f64; 3],
        upper: [f64; 3],
        spacing: f64,
        margin: usize,
    ) -> Result<Self, SplineError> {
        let mut cells = [0; 3];
        let mut corner = [R::ZERO; 3];
        for i in 0..3 {
            let count = ((upper[i] - lower[i]) / spacing).ceil().max(1.0) + 2.0 * margin as f64;
            if count > NODES_AT_MOST as f64 {
                return Err(SplineError::TooManyNodes {
                    nodes: count,
                    most: NODES_AT_MOST,
                });
            }
            cells[i] = count as u32;
            corner[i] = R::of(0.5 * (lower[i] + upper[i] - count * spacing));
        }
        let grid = Self {
            lower: corner,
            spacing: R::of(spacing),
            cells,
        };
        grid.checked()
    }

    /// The grid, unless its numbers are no grid's.
    pub(crate) fn checked(self) -> Result<Self, SplineError> {
        let finite = self.lower.iter().all(|x| x.wide().is_finite());
        let spacing = self.spacing.wide();
        let positive = spacing.is_finite() && spacing > 0.0 && (1.0 / spacing).is_finite();
        if !finite || !positive || self.cells.contains(&0) {
            return Err(SplineError::Grid {
                found: format!("{self:?}"),
            });
        }
        let nodes = self.cells.iter().map(|&n| f64::from(n) + 2.0).product();
        if nodes > NODES_AT_MOST as f64 {
            return Err(SplineError::TooManyNodes {
                nodes,
                most: NODES_AT_MOST,
            });
        }
        Ok(self)
    }

    /// Nodes along each axis.
    pub fn nodes(&self) -> [usize; 3] {
        self.cells.map(|n| n as usize + SUPPORT - 1)
    }

    /// All nodes.
    pub(crate) fn size(&self) -> usize {
        self.nodes().into_iter().product()
    }

    /// Nodes between neighbours of the first axis, and of the second.
    #[inline(always)]
    pub(crate) fn strides(&self) -> [usize; 2] {
        let z = self.cells[2] as usize + SUPPORT - 1;
        [(self.cells[1] as usize + SUPPORT - 1) * z, z]
    }

    /// The grid of half the spacing over the same box.
    pub(crate) fn halved(&self) -> Result<Self, SplineError> {
        let twice = |n: u32| {
            n.checked_mul(2).ok_or(SplineError::TooManyNodes {
                nodes: f64::INFINITY,
                most: NODES_AT_MOST,
            })
        };
        let [x, y, z] = self.cells;
        Self {
            lower: self.lower,
            spacing: self.spacing * R::HALF,
            cells: [twice(x)?, twice(y)?, twice(z)?],
        }
        .checked()
    }

    /// The cell of a point. A point outside the box takes the nearest place inside, and slopes are zero on
    /// the axes along which it was moved.
    #[inline(always)]
    pub(crate) fn locate(&self, x: [R; 3]) -> Located<R> {
        let inverse = R::ONE / self.spacing;
        let mut out = Located {
            first: 0,
            weights: [[R::ZERO; SUPPORT]; 3],
            slopes: [[R::ZERO; SUPPORT]; 3],
        };
        for i in 0..3 {
            let s = (x[i] - self.lower[i]) * inverse;
            let end = R::of(f64::from(self.cells[i]));
            // Not a number goes to the first cell, from either comparison.
            let inside = if s > R::ZERO { s } else { R::ZERO };
            let inside = if inside < end { inside } else { end };
            let scale = if inside == s { inverse } else { R::ZERO };
            let cell = inside.whole().min(self.cells[i] as i32 - 1);
            let u = inside - R::of(f64::from(cell));
            out.weights[i] = weights(u);
            for (slope, value) in out.slopes[i].iter_mut().zip(slopes(u)) {
                *slope = value * scale;
            }
            let nodes = self.cells[i] + SUPPORT as u32 - 1;
            out.first = out.first * nodes + cell as u32;
        }
        out
    }
}
