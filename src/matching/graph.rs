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
    links: Vec<(u32, f32)>,
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
        let mut links = Vec::with_capacity(LINKS * points.len());
        for (from, found) in (0..).zip(&neighbours) {
            let others = found.iter().filter(|neighbour| neighbour.index != from);
            for to in others {
                let normals = (normals[from as usize], normals[to.index as usize]);
                if dot(normals.0, normals.1) >= LEAST_AGREEMENT {
                    links.push((from, to.index, to.squared_distance.sqrt() as f32));
                }
            }
        }
        Self::of_links(points.len(), &links)
    }

    /// So many points, joined by links `(from, to, length)` that may be passed in both directions.
    pub(super) fn of_links(points: usize, links: &[(u32, u32, f32)]) -> Self {
        let both = |&(from, to, length): &(u32, u32, f32)| [(from, to, length), (to, from, length)];
        let mut both: Vec<(u32, u32, f32)> = links.iter().flat_map(both).collect();
        both.sort_unstable_by_key(|&(from, to, _)| (from, to));
        both.dedup_by_key(|&mut (from, to, _)| (from, to));
        let mut starts = vec![0; points + 1];
        for &(from, ..) in &both {
            starts[from as usize + 1] += 1;
        }
        for k in 0..points {
            starts[k + 1] += starts[k];
        }
        let links = both.into_iter().map(|(_, to, length)| (to, length));
        Self {
            starts,
            links: links.collect(),
        }
    }

    /// How many points.
    pub(super) fn points(&self) -> usize {
        self.starts.len() - 1
    }

    /// What one search after the other needs.
    pub(super) fn paths(&self) -> Paths<'_> {
        Paths {
            graph: self,
            best: vec![f32::INFINITY; self.starts.len() - 1],
            touched: Vec::new(),
            queue: BinaryHeap::new(),
        }
    }
}

/// Shortest paths in a graph, one search after the other in the same memory.
pub(super) struct Paths<'a> {
    graph: &'a Graph,
    /// The shortest way known to each point; infinite between searches.
    best: Vec<f32>,
    /// Where it is finite.
    touched: Vec<u32>,
    queue: BinaryHeap<Reverse<u64>>,
}

impl Paths<'_> {
    /// Every point whose distance from `from` is below `limit`, with it, nearest first.
    pub(super) fn within(&mut self, from: u32, limit: f32) -> Vec<(u32, f32)> {
        let mut reached = Vec::new();
        self.reach(from, 0.0);
        while let Some(Reverse(key)) = self.queue.pop() {
            let (distance, point) = unpacked(key);
            if distance > self.best[point as usize] {
                continue;
            }
            reached.push((point, distance));
            let graph = self.graph;
            let links = graph.starts[point as usize]..graph.starts[point as usize + 1];
            for &(to, length) in &graph.links[links] {
                let through = distance + length;
                if through < limit && through < self.best[to as usize] {
                    self.reach(to, through);
                }
            }
        }
        for point in self.touched.drain(..) {
            self.best[point as usize] = f32::INFINITY;
        }
        reached
    }

    fn reach(&mut self, point: u32, distance: f32) {
        if self.best[point as usize] == f32::INFINITY {
            self.touched.push(point);
        }
        self.best[point as usize] = distance;
        self.queue.push(Reverse(packed(distance, point)));
    }
}

/// A distance and where it leads as one number, in the order of distances, then of points: the bits
/// of floating-point numbers that are not negative have the order of the numbers.
fn packed(distance: f32, point: u32) -> u64 {
    u64::from(distance.to_bits()) << 32 | u64::from(point)
}

fn unpacked(key: u64) -> (f32, u32) {
    (f32::from_bits((key >> 32) as u32), key as u32)
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
        let reached = graph.paths().within(0, 10.0);
        assert_eq!(reached.len(), points.len());
        let &(_, far) = reached
            .iter()
            .find(|(point, _)| *point == 200)
            .expect("reached");
        // 0.01 apart in space; 1.99 to 2.01 along the strip, whose corner a link may cut.
        assert!((1.97..2.02).contains(&far), "{far}");
        let near = graph.paths().within(0, 0.035);
        let near: Vec<u32> = near.into_iter().map(|(point, _)| point).collect();
        assert_eq!(near, [0, 1, 2, 3]);
    }
}
