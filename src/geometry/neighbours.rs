//! k nearest neighbours, exact, by kiddo's immutable k-d tree.
//!
//! The immutable tree is chosen because kiddo's growing one panics as soon as more points than a
//! bucket holds share a coordinate: every planar or gridded scan does. The tests hold the immutable
//! one to such clouds.

use std::num::NonZeroUsize;

use kiddo::SquaredEuclidean;
use kiddo::immutable::float::kdtree::ImmutableKdTree;
use rayon::prelude::*;

/// How many points a leaf of the tree aims at.
const BUCKET: usize = 32;

/// Queries for one nearest point that a core takes at a time: each takes about a microsecond, which
/// is less than handing it to another core.
const QUERIES_AT_LEAST: usize = 256;

/// One found neighbour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Neighbour {
    /// Its place in the points that were given.
    pub index: u32,
    /// Its squared distance from the query.
    pub squared_distance: f64,
}

/// Points arranged for nearest-neighbour queries.
#[derive(Debug)]
pub(crate) struct NeighbourSearch<const DIMENSIONS: usize = 3> {
    tree: ImmutableKdTree<f64, u32, DIMENSIONS, BUCKET>,
}

impl<const DIMENSIONS: usize> NeighbourSearch<DIMENSIONS> {
    /// Arranges the points; O(n log n).
    ///
    /// # Panics
    /// If there are no points, or 2^32 or more.
    pub(crate) fn new(points: &[[f64; DIMENSIONS]]) -> Self {
        assert!(!points.is_empty(), "neighbours of no points");
        assert!(
            u32::try_from(points.len()).is_ok(),
            "{} points, at most 2^32 - 1",
            points.len()
        );
        Self {
            tree: ImmutableKdTree::new_from_slice(points),
        }
    }

    /// The nearest point to `query`.
    pub(crate) fn nearest_one(&self, query: [f64; DIMENSIONS]) -> Neighbour {
        let found = self.tree.nearest_one::<SquaredEuclidean>(&query);
        Neighbour {
            index: found.item,
            squared_distance: found.distance,
        }
    }

    /// The `count` points nearest to `query`, nearest first; all of them if there are fewer. A
    /// query that is itself one of the points finds itself first, at distance 0.
    pub(crate) fn nearest(&self, query: [f64; DIMENSIONS], count: NonZeroUsize) -> Vec<Neighbour> {
        let found = self.tree.nearest_n::<SquaredEuclidean>(&query, count);
        let neighbour = |found: &kiddo::NearestNeighbour<f64, u32>| Neighbour {
            index: found.item,
            squared_distance: found.distance,
        };
        found.iter().map(neighbour).collect()
    }

    /// [`Self::nearest`] of each query, on all cores; the order of the queries is kept.
    pub(crate) fn nearest_of_each(
        &self,
        queries: &[[f64; DIMENSIONS]],
        count: NonZeroUsize,
    ) -> Vec<Vec<Neighbour>> {
        queries
            .par_iter()
            .map(|&query| self.nearest(query, count))
            .collect()
    }

    /// [`Self::nearest_one`] of each query, on all cores; the order of the queries is kept.
    pub(crate) fn nearest_one_of_each(&self, queries: &[[f64; DIMENSIONS]]) -> Vec<Neighbour> {
        queries
            .par_iter()
            .with_min_len(QUERIES_AT_LEAST)
            .map(|&query| self.nearest_one(query))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::geometry::linear::{difference, dot};

    fn squared(a: [f64; 3], b: [f64; 3]) -> f64 {
        let d = difference(a, b);
        dot(d, d)
    }

    /// Distances of the nearest by looking at every point.
    fn by_exhaustion(points: &[[f64; 3]], query: [f64; 3], count: usize) -> Vec<f64> {
        let mut all: Vec<f64> = points.iter().map(|&point| squared(point, query)).collect();
        all.sort_by(f64::total_cmp);
        all.truncate(count);
        all
    }

    fn check(points: &[[f64; 3]]) {
        let search = NeighbourSearch::new(points);
        let count = NonZeroUsize::new(9).expect("nine");
        let queries: Vec<[f64; 3]> = points.iter().step_by(points.len() / 50).copied().collect();
        let found = search.nearest_of_each(&queries, count);
        let nearest: Vec<_> = queries
            .iter()
            .map(|&query| search.nearest_one(query))
            .collect();
        assert_eq!(search.nearest_one_of_each(&queries), nearest);
        for (query, neighbours) in queries.iter().zip(&found) {
            let expected = by_exhaustion(points, *query, 9);
            assert_eq!(neighbours.len(), 9);
            for (neighbour, distance) in neighbours.iter().zip(expected) {
                // The same sum of three squares, perhaps in another order: a few roundings.
                assert!((neighbour.squared_distance - distance).abs() <= 1e-12 * distance);
                let there = squared(points[neighbour.index as usize], *query);
                assert!((there - distance).abs() <= 1e-12 * distance);
            }
            // The query is one of the points.
            assert_eq!(search.nearest_one(*query).squared_distance, 0.0);
        }
    }

    #[test]
    fn neighbours_are_those_found_by_exhaustion() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        check(&Vec::from_iter((0..5000).map(|_| rng.random::<[f64; 3]>())));
    }

    #[test]
    fn a_planar_grid_with_every_point_twice_is_no_trouble() {
        let grid = (0..10_000).map(|i| [f64::from(i / 2 % 100), f64::from(i / 200), 7.0]);
        check(&grid.collect::<Vec<_>>());
        // The whole grid on one line, and 500 points on one spot.
        let line = (0..10_000).map(|i| [f64::from(i % 97), 0.0, 0.0]);
        check(&line.collect::<Vec<_>>());
        check(&[vec![[1.0, 2.0, 3.0]; 500], vec![[2.0; 3]; 9500]].concat());
    }

    #[test]
    fn asking_for_more_than_there_are_gives_all() {
        let search = NeighbourSearch::new(&[[0.0; 3], [1.0; 3], [3.0; 3]]);
        let found = search.nearest([0.9; 3], NonZeroUsize::new(10).expect("ten"));
        assert_eq!(
            Vec::from_iter(found.iter().map(|neighbour| neighbour.index)),
            [1, 0, 2]
        );
    }
}
