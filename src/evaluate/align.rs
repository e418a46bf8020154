//! The best times of a method, in the order of the frames.
//!
//! An animation runs at a pace of its own, which nobody can know from its two ends. So a method is
//! also measured at the times `s_1 <= s_2 <= ...`, chosen from an even grid over [0, 1], that bring
//! it closest to the frames 1, 2, ...: they minimise `sum_k cost(k, s_k)`, by dynamic programming
//!
//! ```text
//! best(k, j) = cost(k, j) + min over i <= j of best(k - 1, i)
//! ```
//!
//! (dynamic time warping without a penalty, H. Sakoe and S. Chiba, 1978; frames are never skipped,
//! times may be).

use rayon::prelude::*;

use super::sampled::{NoArea, sample};
use crate::geometry::{Mesh, Neighbour, NeighbourSearch};

/// Farther than this from a frame's own time a surface is not tried.
pub(super) const WINDOW: f64 = 0.25;

/// Samples in which neighbours are searched while aligning.
const COARSE_SAMPLES: usize = 20_000;

/// Samples that search for theirs.
const COARSE_QUERIES: usize = 2000;

/// `count` times from 0 to 1, both included.
pub(super) fn evenly_spaced(count: usize) -> Vec<f64> {
    let last = (count - 1) as f64;
    (0..count).map(|index| index as f64 / last).collect()
}

/// For each row of `costs` a column, never before that of the row above, such that the sum of the
/// costs is least; the earliest columns where several sums are equal. Infinite costs are not
/// chosen.
///
/// # Panics
/// If there are no columns, or the rows differ in length.
pub(super) fn least_in_order(costs: &[Vec<f64>]) -> Vec<usize> {
    let columns = costs.first().map_or(0, Vec::len);
    // Least sum of the rows so far that ends in or before each column, and where the last one then
    // is.
    let mut least = vec![0.0; columns];
    let mut chosen: Vec<Vec<usize>> = Vec::with_capacity(costs.len());
    for row in costs {
        assert_eq!(row.len(), columns, "costs of one frame and of the first");
        let mut at = Vec::with_capacity(columns);
        for column in 0..columns {
            let here = row[column] + least[column];
            if column > 0 && least[column - 1] <= here {
                least[column] = least[column - 1];
                at.push(at[column - 1]);
            } else {
                least[column] = here;
                at.push(column);
            }
        }
        chosen.push(at);
    }
    let mut limit = columns
        .checked_sub(1)
        .expect("the grid of times is never empty");
    let mut path = Vec::with_capacity(costs.len());
    for at in chosen.iter().rev() {
        limit = at[limit];
        path.push(limit);
    }
    path.reverse();
    path
}

/// A surface as far as aligning needs it.
#[derive(Debug)]
pub(super) struct CoarseSurface {
    search: NeighbourSearch,
    queries: Vec<[f64; 3]>,
}

impl CoarseSurface {
    /// Samples a mesh.
    pub(super) fn new(mesh: &Mesh<f64>, mut rng: rand_chacha::ChaCha8Rng) -> Result<Self, NoArea> {
        let mut points = sample(mesh, COARSE_SAMPLES, &mut rng)?.points;
        let search = NeighbourSearch::new(&points);
        // Samples are independent, so the first ones cover the surface as well as any.
        points.truncate(COARSE_QUERIES);
        Ok(Self {
            search,
            queries: points,
        })
    }

    /// Estimate of `chamfer_squared` between the two.
    pub(super) fn cost(&self, other: &Self) -> f64 {
        let mean_squared = |queries: &[[f64; 3]], search: &NeighbourSearch| {
            let found = queries.iter().map(|&query| search.nearest_one(query));
            let squared = found.map(
                |Neighbour {
                     squared_distance, ..
                 }| squared_distance,
            );
            squared.sum::<f64>() / queries.len() as f64
        };
        mean_squared(&self.queries, &other.search) + mean_squared(&other.queries, &self.search)
    }

    /// [`Self::cost`] against each of the others, on all cores; none where there is no other.
    pub(super) fn costs(&self, others: &[Option<&Self>]) -> Vec<Option<f64>> {
        let cost = |other: &Option<&Self>| other.map(|other| self.cost(other));
        others.par_iter().map(cost).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The least sum over all ways to choose columns in order, by trying them all.
    fn by_exhaustion(costs: &[Vec<f64>], first: usize) -> f64 {
        let Some((row, rest)) = costs.split_first() else {
            return 0.0;
        };
        let sums = (first..row.len()).map(|column| row[column] + by_exhaustion(rest, column));
        sums.fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn the_columns_are_in_order_and_no_others_in_order_cost_less(
            costs in prop::collection::vec(prop::collection::vec(0.0..1.0, 5), 1..5)
        ) {
            let path = least_in_order(&costs);
            prop_assert!(path.is_sorted());
            let sum: f64 = path.iter().zip(&costs).map(|(&column, row)| row[column]).sum();
            // At most five numbers below 1 are added, perhaps in another order: a few roundings.
            prop_assert!((sum - by_exhaustion(&costs, 0)).abs() < 1e-14);
        }
    }

    #[test]
    fn order_overrules_the_best_of_each_frame() {
        // Alone, the frames would choose columns 2 and 0.
        let costs = [vec![3.0, 2.0, 1.0], vec![0.0, 1.5, 4.0]];
        assert_eq!(least_in_order(&costs), [0, 0]);
    }

    #[test]
    fn what_was_not_tried_is_not_chosen_and_of_equals_the_earliest_is() {
        let far = f64::INFINITY;
        let costs = [
            vec![1.0, 1.0, far, far],
            vec![far, 5.0, 5.0, far],
            vec![far, far, 0.0, 0.0],
        ];
        assert_eq!(least_in_order(&costs), [0, 1, 2]);
    }

    #[test]
    fn the_grid_holds_both_ends_and_is_even() {
        assert_eq!(evenly_spaced(5), [0.0, 0.25, 0.5, 0.75, 1.0]);
    }
}
