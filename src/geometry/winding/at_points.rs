//! The sums at all points of the tree themselves: the points of a leaf together, with the vector units that the
//! processor has.
//!
//! Points of one leaf see nearly the same groups as one. A group counts as one for all of them if it is far
//! enough from the ball round the leaf, so that no sum is less exact than that of a single place. Lanes are f32,
//! relative to the leaf and in units of the cloud's radius, so that neither its place nor its size costs digits.
//! Products are not contracted, so the width of the vectors does not change a bit.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::super::linear::{difference, dot};
use super::{Charges, FAR, LEAF, Node, SCALE, SummationTree};

/// The points of a leaf, one per lane; lanes without a point repeat the first.
struct Leaf {
    /// Relative to the centre, divided by the radius of the cloud.
    places: [[f32; LEAF]; 3],
    softening: [f32; LEAF],
    centre: [f64; 3],
    radius: f64,
    /// One over the radius of the cloud.
    scale: f64,
}

impl Leaf {
    /// A place as its lanes have them.
    #[inline(always)]
    fn relative(&self, place: [f64; 3]) -> [f32; 3] {
        difference(place, self.centre).map(|along| (self.scale * along) as f32)
    }

    /// A square of a length, or one over it: an area, a charge.
    #[inline(always)]
    fn squared(&self, value: f64) -> f32 {
        (self.scale * self.scale * value) as f32
    }
}

/// Three sums, one per lane each.
type Sums = [[f32; LEAF]; 3];

/// What is summed over all points. Methods that are not inlined would not use the wide vectors.
trait Kernel: Copy + Sync {
    /// Adds what a group has that counts as one.
    fn add_group(self, tree: &SummationTree, node: usize, leaf: &Leaf, sums: &mut Sums);

    /// Adds what a point has.
    fn add_point(self, tree: &SummationTree, point: usize, leaf: &Leaf, sums: &mut Sums);
}

/// Solid angles of discs with these dipoles; the first of the sums alone is used.
#[derive(Clone, Copy)]
struct Winding<'a>(&'a Charges<3>);

/// Fields of these charges at discs.
#[derive(Clone, Copy)]
struct Pull<'a>(&'a Charges<1>);

/// The sums of one leaf.
struct OverAll<'a, K> {
    tree: &'a SummationTree,
    leaf: &'a Leaf,
    kernel: K,
}

impl SummationTree {
    /// [`Self::winding`] about each of the points, in the order in which they were given.
    pub(crate) fn winding_at_points(&self, dipoles: &Charges<3>) -> Vec<f64> {
        let sums = self.at_leaves(Winding(dipoles));
        sums.into_iter().map(|[sum, _, _]| sum).collect()
    }

    /// For each point how the sum of `charges` times the winding numbers about the points changes with the
    /// dipole of that point, in the order in which they were given.
    ///
    /// It is the adjoint of [`Self::winding_at_points`] but for two approximations. That one sees a far
    /// group of dipoles as one without softening, here a far group of charges is one and the disc
    /// keeps its own softening: they differ by about 1.5 `(softening length / distance)^2`, beyond
    /// three radii of the group. And which points form one group differs between the two.
    pub(crate) fn pull_at_points(&self, charges: &Charges<1>) -> Vec<[f64; 3]> {
        self.at_leaves(Pull(charges))
    }

    /// The sums at every point, leaf by leaf on all cores.
    fn at_leaves(&self, kernel: impl Kernel) -> Vec<[f64; 3]> {
        let arch = Arch::new();
        let numbered = 0..self.nodes.len();
        let leaves = numbered.into_par_iter().filter(|&k| self.is_leaf(k));
        let sums = |node| {
            let (tree, leaf) = (self, &self.leaf(node));
            (node, arch.dispatch(OverAll { tree, leaf, kernel }))
        };
        let found: Vec<(&Node, Sums)> = leaves.map(|k| sums(&self.nodes[k])).collect();
        let mut out = vec![[0.0; 3]; self.points.len()];
        for (node, sums) in found {
            for (lane, k) in (node.begin..node.end).enumerate() {
                let given = self.order[k as usize] as usize;
                out[given] = sums.map(|sum| SCALE * f64::from(sum[lane]));
            }
        }
        out
    }

    fn is_leaf(&self, node: usize) -> bool {
        self.nodes[node].after as usize == node + 1
    }

    fn leaf(&self, node: &Node) -> Leaf {
        let (begin, end) = (node.begin as usize, node.end as usize);
        // Those beyond the last repeat the first.
        let point = |lane: usize| {
            if begin + lane < end {
                begin + lane
            } else {
                begin
            }
        };
        let radius = self.nodes[0].far.sqrt() / FAR;
        let mut leaf = Leaf {
            places: [[0.0; LEAF]; 3],
            softening: [0.0; LEAF],
            centre: node.centre,
            radius: node.far.sqrt() / FAR,
            // All points at one place: no sum has a part.
            scale: if radius > 0.0 { radius.recip() } else { 1.0 },
        };
        for lane in 0..LEAF {
            let place = leaf.relative(self.points[point(lane)]);
            for (row, along) in leaf.places.iter_mut().zip(place) {
                row[lane] = along;
            }
            leaf.softening[lane] = leaf.squared(self.softening[point(lane)]);
        }
        leaf
    }
}

impl<K: Kernel> WithSimd for OverAll<'_, K> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Sums {
        let Self { tree, leaf, kernel } = self;
        let mut sums = [[0.0; LEAF]; 3];
        let mut next = 0;
        while let Some(node) = tree.nodes.get(next) {
            let away = difference(node.centre, leaf.centre);
            let beyond = dot(away, away).sqrt() - leaf.radius;
            if beyond > 0.0 && beyond * beyond > node.far {
                kernel.add_group(tree, next, leaf, &mut sums);
                next = node.after as usize;
            } else {
                if node.after as usize == next + 1 {
                    for point in node.begin as usize..node.end as usize {
                        kernel.add_point(tree, point, leaf, &mut sums);
                    }
                }
                next += 1;
            }
        }
        sums
    }
}

impl Kernel for Winding<'_> {
    #[inline(always)]
    fn add_group(self, tree: &SummationTree, node: usize, leaf: &Leaf, sums: &mut Sums) {
        let (place, dipole) = (tree.nodes[node].centre, self.0.nodes[node]);
        add_winding(leaf, place, 0.0, dipole, &mut sums[0]);
    }

    #[inline(always)]
    fn add_point(self, tree: &SummationTree, point: usize, leaf: &Leaf, sums: &mut Sums) {
        let (place, softening) = (tree.points[point], tree.softening[point]);
        add_winding(leaf, place, softening, self.0.points[point], &mut sums[0]);
    }
}

impl Kernel for Pull<'_> {
    #[inline(always)]
    fn add_group(self, tree: &SummationTree, node: usize, leaf: &Leaf, sums: &mut Sums) {
        add_pull(leaf, tree.nodes[node].centre, self.0.nodes[node], sums);
    }

    #[inline(always)]
    fn add_point(self, tree: &SummationTree, point: usize, leaf: &Leaf, sums: &mut Sums) {
        add_pull(leaf, tree.points[point], self.0.points[point], sums);
    }
}

/// `1 / r^3` with `r^2 = |away|^2 + softening`, and nothing at the point itself.
#[inline(always)]
fn fall_off(away: [f32; 3], softening: f32) -> f32 {
    let squared = dot(away, away) + softening;
    let inverse = 1.0 / (squared * squared.sqrt());
    if squared > 0.0 { inverse } else { 0.0 }
}

#[inline(always)]
fn add_winding(
    leaf: &Leaf,
    place: [f64; 3],
    softening: f64,
    dipole: [f64; 3],
    sums: &mut [f32; LEAF],
) {
    let ([x, y, z], place) = (&leaf.places, leaf.relative(place));
    let (softening, dipole) = (
        leaf.squared(softening),
        dipole.map(|part| leaf.squared(part)),
    );
    for lane in 0..LEAF {
        let away = [place[0] - x[lane], place[1] - y[lane], place[2] - z[lane]];
        sums[lane] += dot(dipole, away) * fall_off(away, softening);
    }
}

#[inline(always)]
fn add_pull(leaf: &Leaf, place: [f64; 3], [charge]: [f64; 1], sums: &mut Sums) {
    let ([x, y, z], place) = (&leaf.places, leaf.relative(place));
    let [along_x, along_y, along_z] = sums;
    let charge = leaf.squared(charge);
    for lane in 0..LEAF {
        let away = [x[lane] - place[0], y[lane] - place[1], z[lane] - place[2]];
        let strength = charge * fall_off(away, leaf.softening[lane]);
        along_x[lane] += strength * away[0];
        along_y[lane] += strength * away[1];
        along_z[lane] += strength * away[2];
    }
}

#[cfg(test)]
mod tests {
    use super::super::fall_off;
    use super::*;
    use crate::geometry::density::{NEIGHBOURS, areas, squared_spacing};
    use crate::geometry::neighbours::NeighbourSearch;
    use crate::geometry::testing::sphere_cloud;

    #[test]
    fn the_sums_at_the_points_are_those_over_all_points() {
        // Small and far from the origin.
        let directions = sphere_cloud(3000, 1.0, 42);
        let points: Vec<[f64; 3]> = directions
            .iter()
            .map(|d| [1e-3 * d[0] + 5.0, 1e-3 * d[1], 1e-3 * d[2]])
            .collect();
        let neighbours = NeighbourSearch::new(&points).nearest_of_each(&points, NEIGHBOURS);
        let softening: Vec<f64> = neighbours.iter().map(|n| squared_spacing(n)).collect();
        let areas = areas(&neighbours);
        let tree = SummationTree::new(&points, &softening);
        // Dipoles that turn about: nothing cancels as it does for a closed surface.
        let dipoles: Vec<[f64; 3]> = (directions.iter().zip(&areas))
            .map(|(d, area)| [area * d[1], *area, area * d[2] * d[0]])
            .collect();
        let charges = areas.iter().zip(&directions).map(|(area, d)| [area * d[2]]);
        let charges: Vec<[f64; 1]> = charges.collect();
        let charged = tree.charges(&dipoles);
        let winding = tree.winding_at_points(&charged);
        let pulls = tree.pull_at_points(&tree.charges(&charges));
        // Errors of the leaves' sums and of those for one place alone.
        let (mut together, mut alone) = (0.0, 0.0);
        for at in (0..points.len()).step_by(37) {
            let (mut turns, mut pull) = (0.0, [0.0; 3]);
            for k in 0..points.len() {
                let away = difference(points[k], points[at]);
                turns += dot(dipoles[k], away) * fall_off(away, softening[k]);
                let strength = charges[k][0] * fall_off(away, softening[at]);
                pull = [0, 1, 2].map(|axis| pull[axis] - strength * away[axis]);
            }
            together += (winding[at] - turns).abs();
            alone += (tree.winding(&charged, points[at]) - turns).abs();
            let off = difference(pulls[at], pull);
            assert!(dot(off, off) < 1e-4, "{:?}, not {pull:?}", pulls[at]);
        }
        assert!(together < alone, "{together} off, not {alone}");
        assert!(together < 82.0 * 0.01, "{together} off at 82 points");
    }
}
