//! Where the points of a grid's box come from and go to at one time, interpolated.
//!
//! To follow a point along the velocity field takes many passes through its network; to know how far it is
//! from either end surface takes one of each. So the flow is followed at the nodes of a coarse lattice
//! alone, every few nodes of the grid, and interpolated in between by the cubics through four nodes along
//! each axis (Lagrange's). Their error falls with the fourth power of the lattice's cells; who uses a map
//! compares it with the flow itself and halves the cells if they were too large.

use isomorph_model::{Carried, ModelBackend};

use super::chunks::in_chunks;
use crate::cubes::Grid;
use crate::tensors::{host, rows};

/// The longest side of a cell of the first lattice tried, in normalised units.
const LONGEST: f64 = 0.025;

/// Points this close to a node, as a share of a cell, are taken to be on it: rounding.
const ON_NODE: f64 = 1e-4;

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
pub(super) struct FlowMap<'a, B: ModelBackend> {
    geometry: &'a dyn Carried<B>,
    time: f64,
    device: &'a B::Device,
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

impl<'a, B: ModelBackend> FlowMap<'a, B> {
    /// Nothing is followed yet. `stride`: cells of the grid to a cell of the lattice.
    pub(super) fn new(
        geometry: &'a dyn Carried<B>,
        time: f64,
        device: &'a B::Device,
        grid: &'a Grid,
        stride: usize,
    ) -> Self {
        let nodes = grid
            .cells()
            .map(|cells| (cells as usize).div_ceil(stride) + 4);
        Self {
            geometry,
            time,
            device,
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
        let (geometry, time, device) = (self.geometry, self.time, self.device);
        let known = &*self;
        let values = in_chunks::<B, _, _>(&places, |places| {
            let ends: Vec<Ends> = places
                .iter()
                .map(|place| known.interpolated(place))
                .collect();
            host(geometry.value_from(rows(&ends, device), time))
        });
        values.concat()
    }

    /// Whether all but one in twenty of these points end as near to where the flow itself takes them as
    /// that does to the truth.
    pub(super) fn is_close_at(&mut self, points: &[[f32; 3]]) -> bool {
        let places: Vec<Place> = points.iter().map(|x| self.place(*x)).collect();
        self.follow(&places);
        let tolerance = self.geometry.tolerance();
        let far = |found: &[f32], wanted: &[f32]| {
            let off = found
                .iter()
                .zip(wanted)
                .map(|(a, b)| f64::from(a - b).powi(2));
            off.sum::<f64>() > tolerance.powi(2)
        };
        let followed = self.followed(points);
        let off = places.iter().zip(&followed).filter(|(place, wanted)| {
            let found = self.interpolated(place);
            far(&found[..3], &wanted[..3]) || far(&found[3..], &wanted[3..])
        });
        20 * off.count() <= points.len()
    }

    /// The ends of points by the flow itself.
    fn followed(&self, points: &[[f32; 3]]) -> Vec<Ends> {
        let found = in_chunks::<B, _, _>(points, |points| {
            let ends = self.geometry.ends(rows(points, self.device), self.time);
            host(ends).as_chunks::<6>().0.to_vec()
        });
        found.concat()
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
        let found = self.followed(&at);
        for (node, ends) in missing.into_iter().zip(found) {
            self.ends[index(node, nodes)] = ends;
        }
    }

    fn interpolated(&self, place: &Place) -> Ends {
        if place.on_node() {
            return self.ends[index(place.node, self.nodes)];
        }
        let [x, y, z] = place.beyond.map(cubic);
        let weights = z.iter().flat_map(|z| {
            let y = y.iter().map(move |y| y * z);
            y.flat_map(move |yz| x.map(|x| x * yz))
        });
        let mut sum = [0.0; 6];
        for (weight, node) in weights.zip(stencil(place.node)) {
            let ends = &self.ends[index(node, self.nodes)];
            for (sum, end) in sum.iter_mut().zip(ends) {
                *sum += weight * f64::from(*end);
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

    use burn::tensor::Tensor;
    use burn_ndarray::NdArray;
    use isomorph_model::Geometry;

    use super::super::trained::Trained;
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

        fn by(&self, x: &Tensor<NdArray, 2>, span: f64) -> Tensor<NdArray, 2> {
            let [n, _] = x.dims();
            let y = x.clone().slice([0..n, 1..2]);
            let first = (y * self.wave).sin() * (0.1 * span);
            Tensor::cat(
                vec![first.clone(), first.zeros_like(), first.zeros_like()],
                1,
            )
        }
    }

    impl Carried<NdArray> for Waving {
        fn tolerance(&self) -> f64 {
            1e-3
        }

        fn ends(&self, x: Tensor<NdArray, 2>, time: f64) -> Tensor<NdArray, 2> {
            self.followed.fetch_add(x.dims()[0], Ordering::Relaxed);
            let (start, end) = (self.by(&x, -time), self.by(&x, 1.0 - time));
            Tensor::cat(vec![x.clone() + start, x + end], 1)
        }

        fn value_from(&self, ends: Tensor<NdArray, 2>, _: f64) -> Tensor<NdArray, 2> {
            let [n, _] = ends.dims();
            let start = ends.slice([0..n, 0..3]);
            start.square().sum_dim(1).sqrt() - 0.4
        }
    }

    impl Geometry<NdArray> for Waving {
        fn value(&self, x: Tensor<NdArray, 2>, t: Tensor<NdArray, 2>) -> Tensor<NdArray, 2> {
            let time = f64::from(t.into_data().iter::<f32>().next().unwrap_or(0.0));
            self.value_from(self.ends(x, time), time)
        }

        fn carried(&self) -> Option<&dyn Carried<NdArray>> {
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
        let (waving, grid, device) = (Waving::new(9.0), grid(128), Default::default());
        assert_eq!(first_stride(&grid), 2);
        let mut map = FlowMap::new(&waving, 0.5, &device, &grid, 2);
        let nodes =
            [[0.0; 3], [4.0, 8.0, 100.0], [128.0, 106.0, 108.0]].map(|at| grid.position(at));
        let on = map.values(&nodes);
        assert_eq!(
            waving.followed.load(Ordering::Relaxed),
            3,
            "each once, alone"
        );
        assert_eq!(
            on,
            host(waving.value_from(waving.ends(rows(&nodes, &device), 0.5), 0.5))
        );
        let between = [[0.5, 7.3, 99.1], [127.9, 105.0, 107.0], [64.0, 3.0, 8.0]];
        let between = between.map(|at| grid.position(at));
        let wanted = host(waving.value_from(waving.ends(rows(&between, &device), 0.5), 0.5));
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
            let trained = Trained {
                bounds: bounds(),
                ..Trained::of_field(waving)
            };
            let found = trained.surface_at(&grid(256), 0.5);
            let vertices = found.expect("a sphere has a surface").mesh.vertices;
            let followed = followed.load(Ordering::Relaxed);
            let exact = Waving::new(wave);
            let ends = exact.ends(rows(&vertices, &trained.device), 0.5);
            let off = host(exact.value_from(ends, 0.5)).into_iter();
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
