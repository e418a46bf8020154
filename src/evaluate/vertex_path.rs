//! Vertices over time: those that a method carries, and straight lines between true ends.

use rayon::prelude::*;

use super::Carried;
use super::align::least_in_order;
use super::metrics::mean_squared_error;

/// Positions of the same vertices at several times.
#[derive(Debug)]
pub(super) struct VertexPath {
    /// Ascending.
    pub times: Vec<f64>,
    /// One list of vertices per time.
    pub positions: Carried,
}

impl VertexPath {
    /// `(1 - t) from + t to`.
    pub(super) fn straight(from: &[[f32; 3]], to: &[[f32; 3]], times: &[f64]) -> Self {
        let position = |time: f64| {
            let ends = from.iter().zip(to);
            let blend = |a: f32, b: f32| (1.0 - time) * f64::from(a) + time * f64::from(b);
            ends.map(|(a, b)| [0, 1, 2].map(|axis| blend(a[axis], b[axis]) as f32))
                .collect()
        };
        Self {
            times: times.to_vec(),
            positions: times.iter().map(|&time| position(time)).collect(),
        }
    }

    /// The vertices at one of the times.
    ///
    /// # Panics
    /// If it is not one of them.
    pub(super) fn at(&self, time: f64) -> &[[f32; 3]] {
        let place = self.place(time);
        &self.positions[place]
    }

    fn place(&self, time: f64) -> usize {
        let found = self.times.binary_search_by(|known| known.total_cmp(&time));
        found.unwrap_or_else(|_| panic!("time {time} was not asked for"))
    }

    /// The best times of `grid` for the true vertices of the frames, in order: those with the least
    /// sum of mean squared distances.
    pub(super) fn align(&self, frames: &[&[[f32; 3]]], grid: &[f64]) -> Vec<f64> {
        let tried: Vec<&[[f32; 3]]> = grid.iter().map(|&time| self.at(time)).collect();
        let costs = |truth: &&[[f32; 3]]| -> Vec<f64> {
            let found = tried.iter();
            found
                .map(|found| mean_squared_error(found, truth))
                .collect()
        };
        let costs: Vec<Vec<f64>> = frames.par_iter().map(costs).collect();
        let chosen = least_in_order(&costs);
        chosen.into_iter().map(|column| grid[column]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::align::evenly_spaced;

    #[test]
    fn straight_lines_meet_both_ends_and_halve_in_the_middle() {
        let path = VertexPath::straight(&[[1.0, 2.0, 3.0]], &[[3.0, 2.0, -3.0]], &[0.0, 0.5, 1.0]);
        // Halves and small whole numbers are exact.
        assert_eq!(path.at(0.0), [[1.0, 2.0, 3.0]]);
        assert_eq!(path.at(0.5), [[2.0, 2.0, 0.0]]);
        assert_eq!(path.at(1.0), [[3.0, 2.0, -3.0]]);
    }

    #[test]
    fn a_path_run_through_at_another_pace_is_found_again() {
        let grid = evenly_spaced(129);
        let path = VertexPath::straight(&[[0.0; 3], [1.0; 3]], &[[1.0; 3], [5.0; 3]], &grid);
        // Frames that are exactly the vertices at the squares of eighths: all are in the grid.
        let squares: Vec<f64> = (1..8).map(|k| f64::from(k * k) / 64.0).collect();
        let frames: Vec<&[[f32; 3]]> = squares.iter().map(|&time| path.at(time)).collect();
        assert_eq!(path.align(&frames, &grid), squares);
    }
}
