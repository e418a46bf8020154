//! Points in cubic cells: all that are within the edge of a cell from a place lie in its cell and
//! the 26 around it.

use std::ops::Range;

use rustc_hash::FxHashMap;

/// Points arranged by cell.
pub(super) struct Cells {
    edge: f64,
    /// The points, cell by cell, each cell's in their own order.
    pub order: Vec<u32>,
    /// Which of `order` lie in a cell.
    runs: FxHashMap<[i32; 3], (u32, u32)>,
}

impl Cells {
    /// Arranges points in cells of this edge, which is above 0.
    pub(super) fn new(points: &[[f64; 3]], edge: f64) -> Self {
        let cells: Vec<[i32; 3]> = points.iter().map(|&point| cell(point, edge)).collect();
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        order.sort_unstable_by_key(|&k| (cells[k as usize], k));
        let mut runs = FxHashMap::default();
        let mut first = 0;
        for run in order.chunk_by(|&a, &b| cells[a as usize] == cells[b as usize]) {
            let next = first + run.len() as u32;
            runs.insert(cells[run[0] as usize], (first, next));
            first = next;
        }
        Self { edge, order, runs }
    }

    /// Where in the order the points lie that are in the cell of `x` or in those around it: every
    /// one within the edge, and others.
    pub(super) fn around(&self, x: [f64; 3]) -> impl Iterator<Item = Range<usize>> {
        let [a, b, c] = cell(x, self.edge);
        (0..27).filter_map(move |k| {
            let offset = [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1];
            // There is no cell beyond the last one.
            let cell = [
                a.checked_add(offset[0])?,
                b.checked_add(offset[1])?,
                c.checked_add(offset[2])?,
            ];
            let (from, to) = self.runs.get(&cell)?;
            Some(*from as usize..*to as usize)
        })
    }
}

/// Casts saturate: what is too far away to count shares the last cell.
fn cell(x: [f64; 3], edge: f64) -> [i32; 3] {
    let along = |axis: usize| (x[axis] / edge).floor() as i32;
    [along(0), along(1), along(2)]
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::geometry::linear::{difference, length};

    #[test]
    fn nothing_within_the_edge_is_left_out_and_far_cells_are() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let points = Vec::from_iter((0..500).map(|_| rng.random::<[f64; 3]>()));
        for edge in [0.05, 0.2, 3.0] {
            let cells = Cells::new(&points, edge);
            for &x in points.iter().take(50) {
                let mut found: Vec<u32> = Vec::new();
                cells
                    .around(x)
                    .for_each(|run| found.extend(&cells.order[run]));
                let apart = |k: u32| length(difference(points[k as usize], x));
                // No two cells share a point.
                found.sort_unstable();
                let count = found.len();
                found.dedup();
                assert_eq!(found.len(), count);
                let near = (0..500).filter(|&k| apart(k) <= edge);
                assert!(near.into_iter().all(|k| found.contains(&k)));
                // Two cells along each axis.
                assert!(found.iter().all(|&k| apart(k) < 2.0 * 3f64.sqrt() * edge));
            }
        }
    }

    #[test]
    fn places_beyond_all_cells_are_no_trouble() {
        let cells = Cells::new(&[[0.0; 3], [1e300, -1e300, 0.0]], 1e-3);
        assert_eq!(cells.around([1e300, -1e300, 0.0]).count(), 1);
        assert_eq!(cells.around([0.5; 3]).count(), 0);
    }
}
