//! Distances along a surface that is known by points: shortest paths in the graph of neighbours.
//!
//! Points that are near each other in space but face away from each other lie on two sheets (a
//! finger and the next, an arm and the chest): no link joins them, so that paths go around.
//! Shortest paths by Dijkstra's algorithm.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::num::NonZeroUsize;

use crate::geometry::linear::dot;
use crate::shape::NeighbourSearch;

/// Neighbours that a point is linked to, itself not counted: fewer lengthen paths, more reach
/// around edges.
const LINKS: usize = 10;

/// The least cosine between the normals of points that are linked: a little beyond a right angle,
/// which the edges of boxes and of thin ears need.
const LEAST_AGREEMENT: f64 = -0.2;

/// Points and the lengths of the links between them, each link in both directions.
#[derive(Debug)]
pub(super) struct Graph {
    /// Where the links of each point begin; one more than points.
    starts: Vec<usize>,
    links: Vec<(u32, f64)>,
}

impl Graph {
    /// Links points of a surface with unit normals to their nearest neighbours.
    pub(super) fn of_surface(
        points: &[[f64; 3]],
        normals: &[[f64; 3]],
        search: &NeighbourSearch,
    ) -> Self {
        let count = NonZeroUsize::new(LINKS + 1).expect("one more than a count");
        let neighbours = search.nearest_of_each(points, count);
        let mut both = Vec::with_capacity(2 * LINKS * points.len());
        for (from, found) in (0..).zip(&neighbours) {
            let others = found.iter().filter(|neighbour| neighbour.index != from);
            for to in others {
                let normals = (normals[from as usize], normals[to.index as usize]);
                if dot(normals.0, normals.1) >= LEAST_AGREEMENT {
                    let length = to.squared_distance.sqrt();
                    both.push((from, to.index, length));
                    both.push((to.index, from, length));
                }
            }
        }
        both.sort_unstable_by_key(|&(from, to, _)| (from, to));
        both.dedup_by_key(|&mut (from, to, _)| (from, to));
        let mut starts = vec![0; points.len() + 1];
        for &(from, ..) in &both {
            starts[from as usize + 1] += 1;
        }
        for k in 0..points.len() {
            starts[k + 1] += starts[k];
        }
        let links = both.into_iter().map(|(_, to, length)| (to, length));
        Self {
            starts,
            links: links.collect(),
        }
    }

    /// Every point whose distance from `from` is below `limit`, with it, nearest first.
    pub(super) fn within(&self, from: u32, limit: f64) -> Vec<(u32, f64)> {
        let mut best = rustc_hash::FxHashMap::default();
        let mut queue = BinaryHeap::new();
        let mut reached = Vec::new();
        best.insert(from, 0.0);
        queue.push(Reverse(Reached(0.0, from)));
        while let Some(Reverse(Reached(distance, point))) = queue.pop() {
            if distance > best[&point] {
                continue;
            }
            reached.push((point, distance));
            for &(to, length) in
                &self.links[self.starts[point as usize]..self.starts[point as usize + 1]]
            {
                let through = distance + length;
                if through < limit && best.get(&to).is_none_or(|&known| through < known) {
                    best.insert(to, through);
                    queue.push(Reverse(Reached(through, to)));
                }
            }
        }
        reached
    }
}

/// A distance and where it leads, in the order of distances, then of points.
#[derive(Clone, Copy, PartialEq)]
struct Reached(f64, u32);

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_go_around_between_sheets_that_face_away_from_each_other() {
        // A strip folded in half: out at height 0.01 facing up, back at height 0 facing down,
        // joined at x = 1 by a point that faces sideways. Along it 200 steps of 0.01.
        let mut points = Vec::new();
        let mut normals = Vec::new();
        for k in 0..100 {
            points.push([f64::from(k) * 0.01, 0.0, 0.01]);
            normals.push([0.0, 0.0, 1.0]);
        }
        points.push([1.0, 0.0, 0.005]);
        normals.push([1.0, 0.0, 0.0]);
        for k in (0..100).rev() {
            points.push([f64::from(k) * 0.01, 0.0, 0.0]);
            normals.push([0.0, 0.0, -1.0]);
        }
        let graph = Graph::of_surface(&points, &normals, &NeighbourSearch::new(&points));
        let reached = graph.within(0, 10.0);
        assert_eq!(reached.len(), points.len());
        let &(_, far) = reached
            .iter()
            .find(|(point, _)| *point == 200)
            .expect("reached");
        // 0.01 apart in space; 1.99 to 2.01 along the strip, whose corner a link may cut.
        assert!((1.97..2.02).contains(&far), "{far}");
        let near = graph.within(0, 0.035);
        let near: Vec<u32> = near.into_iter().map(|(point, _)| point).collect();
        assert_eq!(near, [0, 1, 2, 3]);
    }
}
