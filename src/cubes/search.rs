//! Which nodes of the grid need a value: those next to the surface, found by three steps.
//!
//! 1. **Scan** the box on a coarse grid of 32 to 63 cells along its longest side.
//! 2. **Descend**: keep the cells that may hold a piece of the surface, halve them, evaluate their
//!    corners, and so on down to the fine cells. A field that rises by at most `L` per unit of
//!    length and is zero at a point of a cell of side `s` has `|f(c)| <= L |c - p|` at its corners
//!    `c`. The mean of the eight distances is greatest for `p` in a corner,
//!    `(3 + 3 sqrt 2 + sqrt 3) s / 8 = 1.122 s`, so a cell whose mean `|f|` exceeds `1.122 L s` is
//!    empty. A learned signed distance has `|grad f|` near 1 but not exactly, so `L` is the
//!    steepest slope seen so far between two corners of a cell, times 2 in the scan, where a
//!    mistake would lose a whole piece, and times 1.25 below it. If finer nodes show a slope steeper than
//!    was assumed, the descent starts again with that slope. The last halving, which costs most, keeps
//!    no more than what a sheet or a thread through the cell needs: the mean distance of its corners
//!    from a line through its middle is `s / sqrt 2`, from a plane through it at most `s / 2`.
//! 3. **Follow**: wherever two neighbouring nodes differ in sign, all cells round their edge are
//!    completed, until that leads nowhere new. So no hole can come from step 2.

use super::grid::{ExtractError, Grid};
use super::lattice::{Lattice, Node};

/// Points per call of the field: large enough to keep it busy, small enough for its memory.
const BATCH: usize = 1 << 16;
/// Least number of cells along the longest side in the scan.
const SCAN_CELLS: u32 = 32;
/// Mean distance from a corner of a unit cube to all eight.
const MEAN_DISTANCE: f32 = 1.121_837;
/// What the measured slope is multiplied by in the scan, and in the steps below it.
const SCAN_CAUTION: f32 = 2.0;
const CAUTION: f32 = 1.25;
/// What takes the place of the mean distance and the caution in the last halving.
const LAST_REACH: f32 = 0.75;

/// The state of a search: the field, and all that is known of it.
pub(super) struct Search<'g, F> {
    pub(super) grid: &'g Grid,
    pub(super) lattice: Lattice,
    /// How many points were evaluated, nodes or not.
    pub(super) evaluated: usize,
    /// Smallest and largest value found.
    pub(super) range: [f32; 2],
    field: F,
    awaited: Vec<Node>,
}

impl<'g, F, E> Search<'g, F>
where
    F: FnMut(&[[f32; 3]]) -> Result<Vec<f32>, E>,
{
    pub(super) fn new(grid: &'g Grid, field: F) -> Self {
        let range = [f32::INFINITY, f32::NEG_INFINITY];
        Self {
            grid,
            lattice: Lattice::new(),
            evaluated: 0,
            range,
            field,
            awaited: Vec::new(),
        }
    }

    /// Evaluates the field wherever the surface is; afterwards every cell that it crosses is known.
    pub(super) fn find_surface(&mut self) -> Result<(), ExtractError<E>> {
        // Each round assumes the steepest slope that was measured. Values found before are kept, so that
        // only the cells dropped in error cost anything.
        let mut assumed = 0.0;
        while let Some(steeper) = self.descend(assumed)? {
            assumed = steeper;
        }
        self.follow()
    }

    /// Steps 1 and 2, with slopes of at least `assumed` per fine cell. Returns a steeper slope if
    /// one was found that could have led to a cell being dropped in error.
    fn descend(&mut self, assumed: f32) -> Result<Option<f32>, ExtractError<E>> {
        let mut stride = self.scan_stride();
        let mut cells = self.scan_cells(stride);
        self.complete(&cells, stride)?;
        let mut caution = SCAN_CAUTION;
        let mut steepest = assumed;
        let mut least_allowed = f32::INFINITY;
        while stride > 1 {
            steepest = self.steepest(&cells, stride).max(steepest);
            let factor = if stride == 2 {
                LAST_REACH
            } else {
                // The limit under which any cell was dropped: the slope found in the end is held against it.
                least_allowed = least_allowed.min(caution * steepest);
                caution * MEAN_DISTANCE
            };
            // Slopes are per fine cell, so the side of a cell here is `stride`.
            let reach = factor * steepest * stride as f32;
            cells.retain(|&cell| self.may_hold_surface(cell, stride, reach));
            caution = CAUTION;
            stride /= 2;
            cells = self.halved(&cells, stride);
            self.complete(&cells, stride)?;
        }
        let finest = self.steepest(&cells, stride).max(steepest);
        Ok((finest > least_allowed).then_some(finest))
    }

    /// Step 3.
    fn follow(&mut self) -> Result<(), ExtractError<E>> {
        // All known nodes, not only those of the last descent: the surface may pass by an older one.
        let mut fresh: Vec<(Node, f32)> = self.lattice.known().collect();
        // At first every edge is met at its lower end; later ones may lead back to older nodes.
        let mut directions: &[bool] = &[true];
        while !fresh.is_empty() {
            for (node, value) in fresh {
                for axis in 0..3 {
                    for &forwards in directions {
                        self.complete_round_edge(node, value, axis, forwards);
                    }
                }
            }
            // Only new nodes can make new changes of sign.
            let asked = self.awaited.clone();
            self.evaluate_awaited()?;
            directions = &[false, true];
            let found = |node: Node| Some((node, self.lattice.get(node)?));
            fresh = asked.into_iter().filter_map(found).collect();
        }
        Ok(())
    }

    /// Asks for what is missing of the four cells round one edge, if the field changes sign on it.
    fn complete_round_edge(&mut self, node: Node, value: f32, axis: usize, forwards: bool) {
        let Some(other) = self.neighbour(node, axis, forwards) else {
            return;
        };
        let changes = |found: f32| (found < 0.0) != (value < 0.0);
        if !self.lattice.get(other).is_some_and(changes) {
            return;
        }
        // Both ends with their neighbours across the edge: the corners of the four cells round it.
        let (second, third) = ((axis + 1) % 3, (axis + 2) % 3);
        for end in [node, other] {
            for along_second in self.neighbourhood(end, second) {
                for around in self.neighbourhood(along_second, third) {
                    self.await_value(around);
                }
            }
        }
    }

    /// A node and its neighbours along one axis.
    fn neighbourhood(&self, node: Node, axis: usize) -> impl Iterator<Item = Node> + use<F, E> {
        let before = self.neighbour(node, axis, false);
        let after = self.neighbour(node, axis, true);
        [before, Some(node), after].into_iter().flatten()
    }

    fn neighbour(&self, mut node: Node, axis: usize, forwards: bool) -> Option<Node> {
        let index = &mut node[axis];
        *index = if forwards {
            *index + 1
        } else {
            index.checked_sub(1)?
        };
        (*index <= self.grid.cells()[axis]).then_some(node)
    }

    /// Whether the shape itself reaches the box: a known node on the box is inside.
    pub(super) fn inside_at_box(&self) -> bool {
        let cells = self.grid.cells();
        let on_box = |node: Node| (0..3).any(|axis| node[axis] == 0 || node[axis] == cells[axis]);
        self.lattice
            .known()
            .any(|(node, value)| value < 0.0 && on_box(node))
    }

    /// The scan's step in fine cells: the power of two that leaves 32 to 63 of them on the longest
    /// side, where there are so many.
    fn scan_stride(&self) -> u32 {
        let longest = self.grid.cells().into_iter().max().unwrap_or(1);
        1 << (longest / SCAN_CELLS).max(1).ilog2()
    }

    fn scan_cells(&self, stride: u32) -> Vec<Node> {
        let [nx, ny, nz] = self.grid.cells();
        let row = move |n: u32| (0..n).step_by(stride as usize);
        row(nz)
            .flat_map(|z| row(ny).flat_map(move |y| row(nx).map(move |x| [x, y, z])))
            .collect()
    }

    /// The parts of cells cut in half along each axis; `stride` is the side of the parts.
    fn halved(&self, cells: &[Node], stride: u32) -> Vec<Node> {
        let limit = self.grid.cells();
        let parts = cells
            .iter()
            .flat_map(|&cell| (0..8).map(move |part| corner(cell, part, stride)));
        // The last cell of a row may be cut short by the box.
        parts
            .filter(|part| (0..3).all(|axis| part[axis] < limit[axis]))
            .collect()
    }

    /// A corner of a cell, on the box where the cell reaches past it.
    fn corner_in_box(&self, cell: Node, which: u32, stride: u32) -> Node {
        let limit = self.grid.cells();
        let [x, y, z] = corner(cell, which, stride);
        [x.min(limit[0]), y.min(limit[1]), z.min(limit[2])]
    }

    fn known_corners(&self, cell: Node, stride: u32) -> [f32; 8] {
        let mut nodes = [cell; 8];
        for (which, node) in nodes.iter_mut().enumerate() {
            *node = self.corner_in_box(cell, which as u32, stride);
        }
        let values = self.lattice.get_all(nodes);
        values.expect("`complete` has evaluated the corners of these cells")
    }

    /// The steepest slope between any two corners of a cell, per unit of a fine cell: never more
    /// than the field's own steepest slope, whatever its kinks.
    fn steepest(&self, cells: &[Node], stride: u32) -> f32 {
        let mut steepest = 0.0_f32;
        for &cell in cells {
            let values = self.known_corners(cell, stride);
            // At the box a cell may be cut short, so its sides need not be equal.
            let far = self.corner_in_box(cell, 7, stride);
            let side = |axis: usize| (far[axis] - cell[axis]) as f32;
            let square = [0, 1, 2].map(|axis| side(axis) * side(axis));
            // One over the distance of corners that differ along these axes.
            let mut inverse = [0.0; 8];
            for (axes, inverse) in inverse.iter_mut().enumerate().skip(1) {
                let along = |axis: usize| (axes >> axis & 1) as f32 * square[axis];
                *inverse = (along(0) + along(1) + along(2)).sqrt().recip();
            }
            for j in 1..8 {
                for i in 0..j {
                    steepest = steepest.max((values[i] - values[j]).abs() * inverse[i ^ j]);
                }
            }
        }
        steepest
    }

    fn may_hold_surface(&self, cell: Node, stride: u32, reach: f32) -> bool {
        let values = self.known_corners(cell, stride);
        // A change of sign is proof; without one the mean of the distances decides.
        let inside = values.iter().filter(|&&value| value < 0.0).count();
        let mean = values.iter().map(|value| value.abs()).sum::<f32>() / 8.0;
        (1..8).contains(&inside) || mean < reach
    }

    /// Evaluates all corners of these cells that are not known yet.
    fn complete(&mut self, cells: &[Node], stride: u32) -> Result<(), ExtractError<E>> {
        for &cell in cells {
            for which in 0..8 {
                self.await_value(self.corner_in_box(cell, which, stride));
            }
        }
        self.evaluate_awaited()
    }

    fn await_value(&mut self, node: Node) {
        if self.lattice.await_value(node) {
            self.awaited.push(node);
        }
    }

    fn evaluate_awaited(&mut self) -> Result<(), ExtractError<E>> {
        let nodes = std::mem::take(&mut self.awaited);
        let place = |node: &Node| self.grid.position(node.map(f64::from));
        let points: Vec<[f32; 3]> = nodes.iter().map(place).collect();
        for (node, value) in nodes.into_iter().zip(self.values(&points)?) {
            self.lattice.set(node, value);
        }
        Ok(())
    }

    /// The field at any points, in batches, each value checked.
    pub(super) fn values(&mut self, points: &[[f32; 3]]) -> Result<Vec<f32>, ExtractError<E>> {
        let mut all = Vec::with_capacity(points.len());
        for batch in points.chunks(BATCH) {
            let values = (self.field)(batch).map_err(ExtractError::Field)?;
            if values.len() != batch.len() {
                return Err(ExtractError::Count {
                    asked: batch.len(),
                    found: values.len(),
                });
            }
            for (&point, &value) in batch.iter().zip(&values) {
                // The lattice marks unknown nodes by such values, and no slope could be had from them.
                if !value.is_finite() {
                    return Err(ExtractError::NotFinite { point, value });
                }
                self.range = [self.range[0].min(value), self.range[1].max(value)];
            }
            all.extend_from_slice(&values);
        }
        self.evaluated += points.len();
        Ok(all)
    }
}

/// Corner `which` of a cell: bit `axis` of it says whether it is the upper one on that axis.
#[inline]
pub(super) fn corner(cell: Node, which: u32, stride: u32) -> Node {
    let [x, y, z] = cell;
    [
        x + stride * (which & 1),
        y + stride * (which >> 1 & 1),
        z + stride * (which >> 2 & 1),
    ]
}

#[cfg(test)]
mod tests;
