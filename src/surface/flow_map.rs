//! Where the points of a grid's box come from and go to at one time, interpolated.
//!
//! To follow a point along the velocity field takes many passes through its network; to know how far it is
//! from either end surface takes one of each. So the flow is followed at the nodes of a coarse lattice
//! alone, every few nodes of the grid, and interpolated in between by the cubics through four nodes along
//! each axis (Lagrange's). Their error falls with the fourth power of the lattice's cells; who uses a map
//! compares it with the flow itself and halves the cells if they were too large.

use isomorph_training::deformation::CarriedField;
use rayon::prelude::*;

use crate::cubes::Grid;

/// The longest side of a cell of the first lattice tried, in normalised units.
const LONGEST: f64 = 0.025;

/// Points this close to a node, as a share of a cell, are taken to be on it: rounding.
const ON_NODE: f64 = 1e-4;

/// Places that a core interpolates at a time: each takes about a tenth of a microsecond.
const PLACES_AT_LEAST: usize = 1024;

/// Positions at time 0, then at time 1.
type Ends = [f32; 6];

/// What no node holds that has been followed.
const UNKNOWN: Ends = [f32::NAN; 6];

/// The greatest number of the grid's cells, a power of two, that are no longer than a lattice's first cells
/// should be.
pub(super) fn first_stride(grid: &Grid) -> usize {
    let most = (LONGEST / grid.spacing()).max(1.0) as usize;
    1 << most.ilog2()
}

/// The ends of all points of a box at one time.
pub(super) struct FlowMap<'a> {
    field: &'a dyn CarriedField,
    time: f64,
    /// The nodes of the map are nodes of the grid, and one before and two behind its box.
    grid: &'a Grid,
    stride: usize,
    /// Nodes along each axis.
    nodes: [usize; 3],
    ends: Vec<Ends>,
}

/// Where a point lies: the lower node of its cell, and how far above that it is along each axis.
#[derive(Clone, Copy)]
struct Place {
    node: [usize; 3],
    beyond: [f64; 3],
}

impl Place {
    fn on_node(&self) -> bool {
        self.beyond.iter().all(|part| *part == 0.0)
    }
}

impl<'a> FlowMap<'a> {
    /// Nothing is followed yet. `stride`: cells of the grid to a cell of the lattice.
    pub(super) fn new(
        field: &'a dyn CarriedField,
        time: f64,
        grid: &'a Grid,
        stride: usize,
    ) -> Self {
        let nodes = grid
            .cells()
            .map(|cells| (cells as usize).div_ceil(stride) + 4);
        Self {
            field,
            time,
            grid,
            stride,
            nodes,
            ends: vec![UNKNOWN; nodes.iter().product()],
        }
    }

    /// The field at points of the box.
    pub(super) fn values(&mut self, points: &[[f32; 3]]) -> Vec<f32> {
        let places: Vec<Place> = points.iter().map(|x| self.place(*x)).collect();
        self.follow(&places);
        let ends: Vec<Ends> = places
            .par_iter()
            .with_min_len(PLACES_AT_LEAST)
            .map(|place| self.interpolated(place))
            .collect();
        self.field.values_from(&ends, self.time)
    }

    /// Whether all but one in twenty of these points end as near to where the flow itself takes them as
    /// that does to the truth.
    pub(super) fn is_close_at(&mut self, points: &[[f32; 3]]) -> bool {
        let places: Vec<Place> = points.iter().map(|x| self.place(*x)).collect();
        self.follow(&places);
        let tolerance = self.field.tolerance();
        let far = |found: &[f32], wanted: &[f32]| {
            let off = found
                .iter()
                .zip(wanted)
                .map(|(a, b)| f64::from(a - b).powi(2));
            off.sum::<f64>() > tolerance.powi(2)
        };
        let followed = self.field.ends(points, self.time);
        let off = places.iter().zip(&followed).filter(|(place, wanted)| {
            let found = self.interpolated(place);
            far(&found[..3], &wanted[..3]) || far(&found[3..], &wanted[3..])
        });
        20 * off.count() <= points.len()
    }

    /// Follows the nodes that these places need and that have not been followed before.
    fn follow(&mut self, places: &[Place]) {
        let (nodes, known) = (self.nodes, &mut self.ends);
        let mut missing = Vec::new();
        let mut want = |node: [usize; 3]| {
            let first = &mut known[index(node, nodes)][0];
            if first.is_nan() {
                // Any number: it is asked for once.
                *first = 0.0;
                missing.push(node);
            }
        };
        let mut last = None;
        for place in places {
            if place.on_node() {
                want(place.node);
            } else if last != Some(place.node) {
                last = Some(place.node);
                stencil(place.node).for_each(&mut want);
            }
        }
        let at: Vec<[f32; 3]> = missing.iter().map(|node| self.position(*node)).collect();
        let found = self.field.ends(&at, self.time);
        for (node, ends) in missing.into_iter().zip(found) {
            self.ends[index(node, nodes)] = ends;
        }
    }

    fn interpolated(&self, place: &Place) -> Ends {
        if place.on_node() {
            return self.ends[index(place.node, self.nodes)];
        }
        let [x, y, z] = place.beyond.map(cubic);
        let mut sum = [0.0; 6];
        // Rows of four nodes that follow each other in memory, in the order of `stencil`.
        for (c, z) in z.into_iter().enumerate() {
            for (b, y) in y.into_iter().enumerate() {
                let [i, j, k] = place.node;
                let first = index([i - 1, j - 1 + b, k - 1 + c], self.nodes);
                for (ends, x) in self.ends[first..first + 4].iter().zip(x) {
                    let weight = x * y * z;
                    for axis in 0..6 {
                        sum[axis] += weight * f64::from(ends[axis]);
                    }
                }
            }
        }
        sum.map(|end| end as f32)
    }

    /// The cell of a point of the box.
    fn place(&self, x: [f32; 3]) -> Place {
        let mut place = Place {
            node: [0; 3],
            beyond: [0.0; 3],
        };
        for (axis, cells) in self.grid.cells_from_corner(x).into_iter().enumerate() {
            let at = (cells / self.stride as f64).max(0.0);
            let nearest = at.round();
            let on_node = (at - nearest).abs() < ON_NODE;
            let lower = if on_node { nearest } else { at.floor() };
            // One node lies before the box.
            place.node[axis] = (lower as usize + 1).min(self.nodes[axis] - 3);
            place.beyond[axis] = if on_node { 0.0 } else { at - lower };
        }
        place
    }

    fn position(&self, node: [usize; 3]) -> [f32; 3] {
        let in_cells = node.map(|index| (index as f64 - 1.0) * self.stride as f64);
        self.grid.position(in_cells)
    }
}

/// The place of a node among all of them.
fn index([x, y, z]: [usize; 3], nodes: [usize; 3]) -> usize {
    x + nodes[0] * (y + nodes[1] * z)
}

/// The 64 nodes around the cell above a node.
fn stencil(node: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let [x, y, z] = node.map(|index| index - 1);
    (0..64).map(move |k| [x + k % 4, y + k / 4 % 4, z + k / 16])
}

/// The weights of the values at -1, 0, 1 and 2 in the cubic through them, at `x` between 0 and 1.
fn cubic(x: f64) -> [f64; 4] {
    let (before, after, last) = (x + 1.0, x - 1.0, x - 2.0);
    [
        -x * after * last / 6.0,
        before * after * last / 2.0,
        -before * x * last / 2.0,
        before * x * after / 6.0,
    ]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use isomorph_training::deformation::SurfaceField;

    use super::super::learned::Learned;
    use super::*;
    use crate::shape::Bounds;

    /// A ball of radius 0.4 at time 0 whose points move along the first axis by `0.1 t sin(wave y)`.
    struct Waving {
        wave: f64,
        /// Whether it says that a flow carries it.
        says: bool,
        followed: Arc<AtomicUsize>,
    }

    impl Waving {
        fn new(wave: f64) -> Self {
            Self {
                wave,
                says: true,
                followed: Arc::default(),
            }
        }

        fn by(&self, y: f32, span: f64) -> f32 {
            ((self.wave * f64::from(y)).sin() * 0.1 * span) as f32
        }
    }

    impl CarriedField for Waving {
        fn tolerance(&self) -> f64 {
            1e-3
        }

        fn ends(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 6]> {
            self.followed.fetch_add(points.len(), Ordering::Relaxed);
            let ends = |[x, y, z]: &[f32; 3]| {
                let (start, end) = (self.by(*y, -time), self.by(*y, 1.0 - time));
                [x + start, *y, *z, x + end, *y, *z]
            };
            points.iter().map(ends).collect()
        }

        fn values_from(&self, ends: &[[f32; 6]], _: f64) -> Vec<f32> {
            let value = |[x, y, z, ..]: &[f32; 6]| (x * x + y * y + z * z).sqrt() - 0.4;
            ends.iter().map(value).collect()
        }
    }

    impl SurfaceField for Waving {
        fn values(&self, points: &[[f32; 3]], time: f64) -> Vec<f32> {
            self.values_from(&self.ends(points, time), time)
        }

        fn gradients(&self, points: &[[f32; 3]], _: f64) -> Vec<[f32; 3]> {
            points.to_vec()
        }

        fn carried(&self) -> Option<&dyn CarriedField> {
            self.says.then_some(self)
        }
    }

    fn bounds() -> Bounds {
        Bounds {
            min: [-0.6, -0.5, -0.5],
            max: [0.61, 0.5, 0.52],
        }
    }

    fn grid(resolution: usize) -> Grid {
        Grid::new(bounds().min, bounds().max, resolution).expect("a good grid")
    }

    #[test]
    fn a_point_on_a_node_is_followed_and_one_between_nodes_interpolated() {
        let (waving, grid) = (Waving::new(9.0), grid(128));
        assert_eq!(first_stride(&grid), 2);
        let mut map = FlowMap::new(&waving, 0.5, &grid, 2);
        let nodes =
            [[0.0; 3], [4.0, 8.0, 100.0], [128.0, 106.0, 108.0]].map(|at| grid.position(at));
        let on = map.values(&nodes);
        assert_eq!(
            waving.followed.load(Ordering::Relaxed),
            3,
            "each once, alone"
        );
        assert_eq!(on, waving.values(&nodes, 0.5));
        let between = [[0.5, 7.3, 99.1], [127.9, 105.0, 107.0], [64.0, 3.0, 8.0]];
        let between = between.map(|at| grid.position(at));
        let wanted = waving.values(&between, 0.5);
        for (found, wanted) in map.values(&between).iter().zip(wanted) {
            // 0.05 (9 h)^4 3 / 128 with h = 0.019: 1e-6; and f32 rounding of positions near 0.5.
            assert!((found - wanted).abs() < 3e-6, "{found}, wanted {wanted}");
        }
    }

    /// How far the farthest vertex of the wave's surface is from it, how many points were followed to find
    /// it, and how many without a map.
    fn surface(wave: f64) -> (f32, usize, usize) {
        let [(off, followed), (_, all)] = [true, false].map(|says| {
            let waving = Waving {
                says,
                ..Waving::new(wave)
            };
            let followed = waving.followed.clone();
            let learned = Learned {
                bounds: bounds(),
                ..Learned::of_field(waving)
            };
            let found = learned.surface_at(&grid(256), 0.5, 0.0, &mut |_| {});
            let vertices = found.expect("a sphere has a surface").mesh.vertices;
            let followed = followed.load(Ordering::Relaxed);
            let exact = Waving::new(wave);
            let off = exact.values(&vertices, 0.5).into_iter();
            (
                off.fold(0.0, |most: f32, off| most.max(off.abs())),
                followed,
            )
        });
        (off, followed, all)
    }

    #[test]
    fn the_surface_is_that_of_the_flow_at_a_fraction_of_its_points() {
        let (off, followed, all) = surface(9.0);
        // The curvature of the surface over a cell of 0.0047, h^2 / (8 * 0.4), and half as much for the wave.
        assert!(off < 2e-5, "{off}");
        assert!(4 * followed < all, "{followed} of {all}");
    }

    #[test]
    fn a_flow_too_fine_for_the_map_is_followed_itself() {
        let (off, followed, all) = surface(300.0);
        // A wave of 4.4 cells: chords miss it by (300 * 0.0047)^2 / 8 of 0.05 at most; the map's cubics
        // would miss the wave altogether.
        assert!(off < 0.013, "{off}");
        assert!(followed > all, "{followed} of {all}");
    }
}
