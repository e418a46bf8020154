//! A shape as the registration sees it: many points, and nodes among them, fine and coarse, that
//! carry the rest.

use std::num::NonZeroUsize;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::graph::Graph;
use super::level::{Elements, Level};
use crate::geometry::linear::{difference, dot};
use crate::shape::{NeighbourSearch, NormalSource, Normalisation, Shape, ShapeError, points_of};

/// Nodes of a level for each node of the next coarser one.
const COARSENING: usize = 4;

/// The fewest nodes of a level that is not the only one.
const FEWEST_NODES: usize = 300;

/// Nodes from which distances are measured for [`Surface::remoteness`].
const LANDMARKS: usize = 150;

/// Nearest points among which one that faces the same way is looked for.
const FACING: NonZeroUsize = NonZeroUsize::new(6).expect("6 is not 0");

/// Points of one shape in normalised coordinates, float64, and the nodes among them.
#[derive(Debug)]
pub(super) struct Surface {
    /// Points spread over the surface at random.
    pub points: Vec<[f64; 3]>,
    /// Unit normals there.
    pub normals: Vec<[f64; 3]>,
    /// The points, arranged.
    pub search: NeighbourSearch,
    /// The nodes, finest first. The elements of the first level are the points, those of each other
    /// level the nodes of the one before it.
    pub levels: Vec<Level>,
    /// For each node the mean distance along the surface to all of it: large at the tips of limbs,
    /// small in the middle of the body, and the same in every pose.
    pub remoteness: Vec<f64>,
}

impl Surface {
    /// Spreads up to `points` points over the shape and chooses up to `nodes` nodes among them.
    ///
    /// # Errors
    /// [`ShapeError`] if the shape has no points for it.
    pub(super) fn new(
        shape: &Shape,
        normalisation: &Normalisation,
        [points, nodes]: [usize; 2],
        seed: u64,
    ) -> Result<Self, ShapeError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (positions, normals) =
            points_of(shape, points, NormalSource::Auto, &mut rng, &mut Vec::new())?;
        let normals = normals.expect("normals are asked for");
        // Of a cloud every vertex is taken: enough of them will do.
        let mut chosen: Vec<usize> = (0..positions.len()).collect();
        if chosen.len() > points {
            chosen = rand::seq::index::sample(&mut rng, positions.len(), points).into_vec();
            chosen.sort_unstable();
        }
        let place = |&k: &usize| normalisation.apply(positions[k]).map(f64::from);
        let facing = |&k: &usize| normals[k].map(f64::from);
        let points = chosen.iter().map(place).collect();
        Ok(Self::of(points, chosen.iter().map(facing).collect(), nodes))
    }

    /// The surface of these points and unit normals.
    pub(super) fn of(points: Vec<[f64; 3]>, normals: Vec<[f64; 3]>, nodes: usize) -> Self {
        let search = NeighbourSearch::new(&points);
        let graph = Graph::of_surface(&points, &normals, &search);
        let finest = Elements {
            places: &points,
            normals: &normals,
            graph: &graph,
        };
        let (finest, graph) = Level::new(&finest, farthest_points(&points, nodes));
        let remoteness = remoteness(&graph);
        Self {
            levels: with_coarser(finest, graph),
            points,
            normals,
            search,
            remoteness,
        }
    }

    /// The finest nodes, which carry the points.
    pub(super) fn finest(&self) -> &Level {
        &self.levels[0]
    }

    /// The point nearest to `x` that faces like `normal`; the nearest of all if none does.
    pub(super) fn nearest_facing(&self, x: [f64; 3], normal: [f64; 3]) -> u32 {
        let facing = |index: u32| dot(self.normals[index as usize], normal) > 0.0;
        let nearest = self.search.nearest_one(x).index;
        // Mostly it does, and one is found in half the time of six.
        if facing(nearest) {
            return nearest;
        }
        let found = self.search.nearest(x, FACING);
        let first = found
            .iter()
            .find(|near| facing(near.index))
            .unwrap_or(&found[0]);
        first.index
    }
}

/// A level and those above it, each with a share of the nodes of the one before.
fn with_coarser(finest: Level, graph: Graph) -> Vec<Level> {
    let (mut levels, mut graph) = (vec![finest], graph);
    loop {
        let finer = &levels[levels.len() - 1];
        let count = finer.nodes.len() / COARSENING;
        if count < FEWEST_NODES {
            return levels;
        }
        let elements = Elements {
            places: &finer.places,
            normals: &finer.normals,
            graph: &graph,
        };
        // The first few are spread evenly as well.
        let (level, next) = Level::new(&elements, (0..count as u32).collect());
        levels.push(level);
        graph = next;
    }
}

/// Up to `count` points, each the one farthest from all before it; the first is point 0.
pub(super) fn farthest_points(points: &[[f64; 3]], count: usize) -> Vec<u32> {
    let mut chosen = Vec::with_capacity(count);
    let mut distances = vec![f64::INFINITY; points.len()];
    let mut next = 0;
    while chosen.len() < count.min(points.len()) {
        chosen.push(next as u32);
        let from = points[next];
        let mut farthest = (0, 0.0);
        for (k, (point, distance)) in points.iter().zip(&mut distances).enumerate() {
            let apart = difference(*point, from);
            *distance = distance.min(dot(apart, apart));
            if *distance > farthest.1 {
                farthest = (k, *distance);
            }
        }
        if farthest.1 == 0.0 {
            break;
        }
        next = farthest.0;
    }
    chosen
}

/// The mean distance along the surface from each node to the [`LANDMARKS`] that it is connected
/// with.
fn remoteness(graph: &Graph) -> Vec<f64> {
    let landmarks = graph.points().min(LANDMARKS) as u32;
    let distances: Vec<Vec<(u32, f32)>> = (0..landmarks)
        .into_par_iter()
        .map_init(
            || graph.paths(),
            |paths, landmark| paths.within(landmark, f32::INFINITY),
        )
        .collect();
    let mut sums = vec![(0.0, 0.0); graph.points()];
    for &(node, distance) in distances.iter().flatten() {
        sums[node as usize].0 += f64::from(distance);
        sums[node as usize].1 += 1.0;
    }
    sums.into_iter()
        .map(|(sum, count)| sum / f64::max(count, 1.0))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::level::{NodeMotion, REACH, TIES};
    use super::super::rotation::{RigidMotion, tests::turn};
    use super::*;
    use crate::geometry::linear::{length, times};
    use crate::geometry::testing::cuboid;
    use crate::shape::sample_surface;

    /// Points on the cube of this edge around the origin.
    fn cube(edge: f64, count: usize, nodes: usize) -> Surface {
        let cube = cuboid([edge; 3]).moved(|x| x.map(|part| part - 0.5 * edge));
        let samples = sample_surface(&cube, count, &mut ChaCha8Rng::seed_from_u64(1));
        let normals = samples.normals.iter().map(|normal| normal.map(f64::from));
        Surface::of(samples.points, normals.collect(), nodes)
    }

    #[test]
    fn a_rigid_motion_of_the_nodes_carries_every_point_rigidly() {
        let surface = cube(0.4, 4000, 1300);
        let motion = RigidMotion {
            rotation: turn(1.2),
            translation: [0.1, 0.2, 0.3],
        };
        // From the coarse nodes to the fine ones, and from those to the points.
        let [fine, coarse] = &surface.levels[..] else {
            panic!("two levels of 1,300 and 325 nodes");
        };
        let moved = NodeMotion {
            places: coarse.places.iter().map(|&x| motion.apply(x)).collect(),
            rotations: vec![motion.rotation; coarse.nodes.len()],
        };
        let nodes = coarse.carried(&moved, &fine.places);
        for (k, &point) in surface.points.iter().enumerate() {
            let (place, normal) = fine.carry(&nodes, k as u32, (point, surface.normals[k]));
            // Weights that sum to 1 within a few roundings, of lengths below 1; twice.
            assert!(length(difference(place, motion.apply(point))) < 1e-14);
            let turned = times(&motion.rotation, surface.normals[k]);
            assert!(length(difference(normal, turned)) < 1e-14);
        }
    }

    #[test]
    fn nodes_are_spread_and_tied_to_their_neighbours() {
        // The area is 6 * .41^2 = 1: nodes at a spacing of a tenth.
        let surface = cube(0.408, 4000, 100);
        let nodes = surface.finest().places.clone();
        assert_eq!(nodes.len(), 100);
        let apart = |i: usize, j: usize| length(difference(nodes[i], nodes[j]));
        for i in 0..100 {
            let nearest = (0..100)
                .filter(|&j| j != i)
                .map(|j| apart(i, j))
                .fold(1.0, f64::min);
            assert!(
                nearest > 0.06,
                "the farthest point from all others: {nearest}"
            );
        }
        let mut degree = [0; 100];
        for &[i, j] in &surface.finest().ties {
            assert!(apart(i as usize, j as usize) < REACH * surface.finest().spacing());
            degree[i as usize] += 1;
            degree[j as usize] += 1;
        }
        assert!(
            degree.iter().all(|&ties| ties >= TIES),
            "each has its own, and those of others"
        );
        // Every corner of a cube is as remote as the others, and more so than the middles of the
        // faces.
        let remotest = surface.remoteness.iter().copied().fold(0.0, f64::max);
        let least = surface.remoteness.iter().copied().fold(1.0, f64::min);
        assert!(
            least > 0.3 && remotest < 0.6 && remotest > 1.02 * least,
            "{least} to {remotest}"
        );
    }
}
