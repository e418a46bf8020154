//! Hollows: the space that a surface encloses but that is not inside, as in a hollow ball.
//!
//! No sample of the band lies deep in a hollow, and few of the box do. A network that starts as a ball keeps a
//! piece of it there, and the slope of `f` alone does not remove it. So the box samples of a key frame that
//! has hollows are drawn there in part. Without hollows all samples are as they were.

use rand::{Rng, RngExt};
use rayon::prelude::*;

use crate::data::{Bounds, KeyPoints};

/// Cells of the grid along each side of the box.
const CELLS: usize = 24;

/// The hollows of one key frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Hollows {
    /// The corners of their cells with the least coordinates.
    corners: Vec<[f32; 3]>,
    /// The edges of a cell.
    edges: [f32; 3],
}

impl Hollows {
    /// The hollows within a box whose middle is at least `depth` away from the surface. A key frame without
    /// normals has none that can be found.
    pub(crate) fn of(key: &KeyPoints, bounds: &Bounds, depth: f32) -> Self {
        if key.normals.is_none() {
            return Self::default();
        }
        let edges = bounds.extent().map(|length| length / CELLS as f32);
        let corner = |number: usize| {
            let cell = cell(number);
            [0, 1, 2].map(|axis| bounds.min[axis] + edges[axis] * cell[axis] as f32)
        };
        let distance = |number: usize| {
            let corner = corner(number);
            let middle = [0, 1, 2].map(|axis| corner[axis] + edges[axis] / 2.0);
            // What is not known is outside.
            key.around.signed_distance(middle).unwrap_or(f32::INFINITY)
        };
        let distances: Vec<f32> = (0..CELLS.pow(3)).into_par_iter().map(distance).collect();
        let found = enclosed(&distances, edges, depth).into_iter();
        Self {
            corners: found.map(corner).collect(),
            edges,
        }
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// A place in a cell of them.
    ///
    /// # Panics
    /// If there are none.
    pub(crate) fn draw(&self, rng: &mut impl Rng) -> [f32; 3] {
        let corner = self.corners[rng.random_range(0..self.corners.len())];
        [0, 1, 2].map(|axis| corner[axis] + self.edges[axis] * rng.random::<f32>())
    }
}

/// The cells outside of the surface that the border of the grid does not lead to, of all regions that are
/// `depth` away from the surface somewhere.
fn enclosed(distances: &[f32], edges: [f32; 3], depth: f32) -> Vec<usize> {
    let mut seen: Vec<bool> = distances.iter().map(|distance| *distance <= 0.0).collect();
    let mut found = Vec::new();
    let at_border = |number: &usize| {
        let cell = cell(*number);
        cell.iter().any(|k| *k == 0 || *k == CELLS - 1)
    };
    let all = 0..distances.len();
    for start in all.clone().filter(at_border) {
        region(start, distances, edges, &mut seen);
    }
    for start in all {
        let cells = region(start, distances, edges, &mut seen);
        if cells.iter().any(|number| distances[*number] >= depth) {
            found.extend(cells);
        }
    }
    found
}

/// The unseen cells that this one leads to, itself first; no surface lies between a cell and the next.
fn region(start: usize, distances: &[f32], edges: [f32; 3], seen: &mut [bool]) -> Vec<usize> {
    if seen[start] {
        return Vec::new();
    }
    seen[start] = true;
    let mut cells = vec![start];
    let mut next = 0;
    while let Some(&from) = cells.get(next) {
        next += 1;
        for (axis, edge) in edges.into_iter().enumerate() {
            for to in beside(from, axis).into_iter().flatten() {
                // A wall between two places is at most as far from one as the other leaves of the way.
                let is_open = distances[from] + distances[to] > edge;
                if !seen[to] && is_open {
                    seen[to] = true;
                    cells.push(to);
                }
            }
        }
    }
    cells
}

/// The neighbours of a cell along an axis.
fn beside(number: usize, axis: usize) -> [Option<usize>; 2] {
    let stride = CELLS.pow(2 - axis as u32);
    let k = cell(number)[axis];
    [
        (k > 0).then(|| number - stride),
        (k + 1 < CELLS).then(|| number + stride),
    ]
}

/// The numbers of a cell along the axes.
fn cell(number: usize) -> [usize; 3] {
    [
        number / (CELLS * CELLS),
        number / CELLS % CELLS,
        number % CELLS,
    ]
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;
    use std::sync::Arc;

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::data::Surroundings;

    /// A ball of radius 1 with a hollow of this radius, from which a channel leads out.
    struct Ball {
        hollow: f32,
        channel: f32,
    }

    impl Surroundings for Ball {
        fn signed_distance(&self, [x, y, z]: [f32; 3]) -> Option<f32> {
            let r = (x * x + y * y + z * z).sqrt();
            let solid = (r - 1.0).max(self.hollow - r);
            let across = (y * y + z * z).sqrt();
            let channel = if x > 0.0 { self.channel - across } else { -1.0 };
            Some(solid.max(channel))
        }

        fn nearest(&self, _: usize, _: NonZeroUsize) -> Vec<usize> {
            Vec::new()
        }
    }

    fn hollows(hollow: f32, channel: f32) -> Hollows {
        let around = Arc::new(Ball { hollow, channel });
        let normals = Some(vec![[1.0, 0.0, 0.0]].into());
        let key = KeyPoints::new(0.0, vec![[0.0; 3]], normals, around);
        let bounds = Bounds {
            min: [-1.2; 3],
            max: [1.2; 3],
        };
        Hollows::of(&key, &bounds, 0.1)
    }

    #[test]
    fn a_hollow_is_found_whole_and_places_are_drawn_in_it_alone() {
        let found = hollows(0.6, 0.0);
        // Cells of 0.1; those whose middles are within.
        let count = 4.0 / 3.0 * std::f32::consts::PI * 0.6_f32.powi(3) / 0.001;
        assert!((found.corners.len() as f32 / count - 1.0).abs() < 0.05);
        let rng = &mut ChaCha8Rng::seed_from_u64(0);
        for _ in 0..1000 {
            let x = found.draw(rng);
            let r = x.iter().map(|x| x * x).sum::<f32>().sqrt();
            // Half a diagonal of a cell beyond.
            assert!(r < 0.6 + 0.087, "{x:?}");
        }
    }

    #[test]
    fn a_thin_wall_is_no_way_out() {
        // A tenth of a cell.
        assert!(!hollows(0.99, 0.0).is_empty());
    }

    #[test]
    fn what_is_solid_open_or_shallow_has_none() {
        for (hollow, channel) in [(0.0, 0.0), (0.6, 0.3), (0.08, 0.0)] {
            assert!(hollows(hollow, channel).is_empty(), "{hollow} {channel}");
        }
    }
}
