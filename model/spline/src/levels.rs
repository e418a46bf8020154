//! The grids of a solver: each level halves the cells of the one before.

use crate::error::SplineError;
use crate::grid::Grid;
use crate::options::Options;
use crate::real::Real;

/// A field that can be put on a grid of half the spacing.
pub(crate) trait OnGrid<R: Real>: Clone {
    fn grid(&self) -> &Grid<R>;

    /// # Errors
    /// If the finer grid has too many nodes.
    fn refined(&self) -> Result<Self, SplineError>;
}

/// The grid of a level, 0 being the first.
///
/// # Errors
/// If it has too many nodes.
pub(crate) fn grid_of<R: Real>(first: Grid<R>, level: usize) -> Result<Grid<R>, SplineError> {
    let mut grid = first;
    for _ in 0..level {
        grid = grid.halved()?;
    }
    Ok(grid)
}

/// A field before a step, on the grid of the step, and its level.
///
/// # Errors
/// If there is no such step, or the field is not on the grid of the step before.
pub(crate) fn before_step<R: Real, F: OnGrid<R>>(
    field: &F,
    first: Grid<R>,
    options: &Options,
    step: usize,
) -> Result<(F, usize), SplineError> {
    let steps = options.steps.iter().sum();
    if step >= steps {
        return Err(SplineError::Step { step, steps });
    }
    let level = options.level(step);
    let grid = grid_of(first, level)?;
    let mut field = field.clone();
    while field.grid().cells[0] < grid.cells[0] {
        field = field.refined()?;
    }
    if *field.grid() != grid {
        return Err(SplineError::Field {
            step,
            found: format!("{:?}", field.grid()),
            wanted: format!("{grid:?} or one coarser"),
        });
    }
    Ok((field, level))
}
