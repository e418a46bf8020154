//! The closest point of a triangle mesh, exact, by a hierarchy of boxes.
//!
//! The closest point of one triangle is found by the regions of its plane (Ericson, *Real-Time Collision
//! Detection*, 2005, Section 5.1.5). It lies on the face, on an edge or on a corner. Which of them it is says
//! on which side of a closed surface a place lies: the direction from it to the place is compared with the
//! normal of the face, or with the angle-weighted normal of the edge or corner (Baerentzen and Aanaes,
//! "Signed distance computation using the angle weighted pseudonormal", 2005).
//!
//! Where a surface passes through itself the closest sheet may lie inside another part, so that its side says
//! nothing. The winding number does: the sum of the solid angles of all triangles over `4 pi`, with far groups
//! of triangles seen as one dipole (Barill et al., "Fast winding numbers for soups and clouds", 2018).

use std::f64::consts::PI;

use rustc_hash::FxHashMap;

use super::edges::weld;
use super::linear::{Scalar, add, cross, difference, dot, length, scaled};
use super::mesh::Mesh;

/// Triangles in a leaf.
const LEAF: usize = 4;

/// How many of its radii away a group counts as one dipole: an error of about 1 % of its winding number.
const FAR: f32 = 3.0;

/// A point of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closest {
    /// Its triangle among those of the search.
    pub triangle: u32,
    /// Where it is.
    pub point: [f32; 3],
    /// Its squared distance from the query.
    pub squared: f32,
    /// Of which part of the triangle it is.
    part: Part,
}

/// A part of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Face,
    /// From the corner of this number to the next.
    Edge(u8),
    Corner(u8),
}

/// A group of triangles that lie together.
#[derive(Debug)]
struct Node {
    low: [f32; 3],
    high: [f32; 3],
    /// Its triangles are `begin..end` in the order of the search.
    begin: u32,
    end: u32,
    /// Its second child; the first follows it. 0 for a leaf.
    second: u32,
    /// The sum of area times normal.
    dipole: [f32; 3],
}

/// Triangles arranged for closest-point queries. Triangles without area are left out.
#[derive(Debug)]
pub(crate) struct TriangleSearch {
    corners: Vec<[[f32; 3]; 3]>,
    /// Outward directions of the face, the edges and the corners of each triangle, of any length.
    normals: Vec<[[f32; 3]; 7]>,
    nodes: Vec<Node>,
}

impl TriangleSearch {
    /// Arranges the triangles, O(n log^2 n); `None` if none has an area.
    pub(crate) fn new<T: Scalar>(mesh: &Mesh<T>) -> Option<Self> {
        let mesh: Mesh<f32> = mesh.moved(|x| x.map(|part| part.into() as f32));
        let with_area = |t: &&[u32; 3]| length(mesh.area_vector(**t)) > 0.0;
        let triangles: Vec<[u32; 3]> = mesh.triangles.iter().filter(with_area).copied().collect();
        if triangles.is_empty() {
            return None;
        }
        let at = |index: u32| mesh.vertices[index as usize];
        let centres: Vec<[f32; 3]> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(at);
                scaled(add(add(a, b), c), 1.0 / 3.0)
            })
            .collect();
        let normals = pseudonormals(&mesh, &triangles);
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut nodes = Vec::with_capacity(triangles.len());
        let corners: Vec<[[f32; 3]; 3]> = triangles.iter().map(|t| t.map(at)).collect();
        split(&corners, &centres, &mut order, 0, &mut nodes);
        let corners: Vec<[[f32; 3]; 3]> = order.iter().map(|&k| corners[k as usize]).collect();
        for node in &mut nodes {
            let within = corners[node.begin as usize..node.end as usize].iter();
            let area = |&[a, b, c]: &[[f32; 3]; 3]| cross(difference(b, a), difference(c, a));
            node.dipole = within.fold([0.0; 3], |sum, t| add(sum, scaled(area(t), 0.5)));
        }
        Some(Self {
            corners,
            normals: order.iter().map(|&k| normals[k as usize]).collect(),
            nodes,
        })
    }

    /// The corners of the triangles, in the order of the search.
    pub(crate) fn corners(&self) -> &[[[f32; 3]; 3]] {
        &self.corners
    }

    /// The point closest to `x`. `near` is a triangle that may be near it, such as that of the query
    /// before: it saves time and changes nothing else.
    pub(crate) fn closest(&self, x: [f32; 3], near: u32) -> Closest {
        let mut best = self.on(near, x);
        let mut stack = [(0_u32, 0.0_f32); 64];
        let mut depth = 1;
        stack[0] = (0, to_box(&self.nodes[0], x));
        while depth > 0 {
            depth -= 1;
            let (index, away) = stack[depth];
            if away >= best.squared {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.second == 0 {
                for k in node.begin..node.end {
                    let found = self.on(k, x);
                    if found.squared < best.squared {
                        best = found;
                    }
                }
                continue;
            }
            let with_distance = |child: u32| (child, to_box(&self.nodes[child as usize], x));
            let (first, second) = (with_distance(index + 1), with_distance(node.second));
            let (nearer, farther) = if first.1 <= second.1 {
                (first, second)
            } else {
                (second, first)
            };
            // What is farther than the best one is left out here already; the nearer one goes on top.
            if farther.1 < best.squared {
                stack[depth] = farther;
                depth += 1;
            }
            if nearer.1 < best.squared {
                stack[depth] = nearer;
                depth += 1;
            }
        }
        best
    }

    /// Whether a place is on the inner side of the surface at its closest point.
    pub(crate) fn is_behind(&self, closest: &Closest, x: [f32; 3]) -> bool {
        dot(difference(x, closest.point), self.normal(closest)) < 0.0
    }

    /// The outward direction of the surface at a closest point, of any length.
    pub(crate) fn normal(&self, closest: &Closest) -> [f32; 3] {
        let normals = &self.normals[closest.triangle as usize];
        match closest.part {
            Part::Face => normals[0],
            Part::Edge(k) => normals[1 + usize::from(k)],
            Part::Corner(k) => normals[4 + usize::from(k)],
        }
    }

    /// How often the surface goes round a place: 1 inside a closed one, 0 outside, 2 where it overlaps
    /// itself.
    pub(crate) fn winding(&self, x: [f32; 3]) -> f64 {
        let mut total = 0.0;
        let mut stack = [0_u32; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            let centre = scaled(add(node.low, node.high), 0.5);
            let (away, reach) = (difference(centre, x), difference(node.high, centre));
            let squared = dot(away, away);
            if squared > FAR * FAR * dot(reach, reach) {
                let squared = f64::from(squared);
                total += f64::from(dot(node.dipole, away)) / (squared * squared.sqrt());
            } else if node.second == 0 {
                let within = &self.corners[node.begin as usize..node.end as usize];
                total += within.iter().map(|t| solid_angle(t, x)).sum::<f64>();
            } else {
                (stack[depth], stack[depth + 1]) = (node.second, index + 1);
                depth += 2;
            }
        }
        total / (4.0 * PI)
    }

    #[inline]
    fn on(&self, triangle: u32, x: [f32; 3]) -> Closest {
        let (point, part) = on_triangle(&self.corners[triangle as usize], x);
        let away = difference(x, point);
        Closest {
            triangle,
            point,
            squared: dot(away, away),
            part,
        }
    }
}

/// The solid angle under which a triangle is seen, positive from its inner side (Van Oosterom and Strackee,
/// 1983).
pub(super) fn solid_angle<T: Scalar>(corners: &[[T; 3]; 3], x: [T; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| difference(corner, x).map(T::into));
    let (la, lb, lc) = (length(a), length(b), length(c));
    let volume = dot(a, cross(b, c));
    2.0 * volume.atan2(la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
}

/// The squared distance of a place from a box.
#[inline]
fn to_box(node: &Node, x: [f32; 3]) -> f32 {
    let mut squared = 0.0;
    for (x, (low, high)) in x.into_iter().zip(node.low.into_iter().zip(node.high)) {
        let beyond = (low - x).max(x - high).max(0.0);
        squared += beyond * beyond;
    }
    squared
}

/// The point of a triangle closest to `p`.
#[inline]
fn on_triangle(&[a, b, c]: &[[f32; 3]; 3], p: [f32; 3]) -> ([f32; 3], Part) {
    let (ab, ac, ap) = (difference(b, a), difference(c, a), difference(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, Part::Corner(0));
    }
    let bp = difference(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, Part::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (add(a, scaled(ab, d1 / (d1 - d3))), Part::Edge(0));
    }
    let cp = difference(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, Part::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (add(a, scaled(ac, d2 / (d2 - d6))), Part::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    let (from_b, from_c) = (d4 - d3, d5 - d6);
    if va <= 0.0 && from_b >= 0.0 && from_c >= 0.0 {
        let along = scaled(difference(c, b), from_b / (from_b + from_c));
        return (add(b, along), Part::Edge(1));
    }
    let share = 1.0 / (va + vb + vc);
    let inner = add(scaled(ab, vb * share), scaled(ac, vc * share));
    (add(a, inner), Part::Face)
}

/// For each triangle the outward directions of its face, its three edges and its three corners.
fn pseudonormals(mesh: &Mesh<f32>, triangles: &[[u32; 3]]) -> Vec<[[f32; 3]; 7]> {
    let welded = weld(&mesh.vertices);
    let name = |index: u32| welded[index as usize];
    let faces: Vec<[f32; 3]> = triangles
        .iter()
        .map(|&t| super::linear::unit(mesh.area_vector(t)))
        .collect();
    let mut edges: FxHashMap<(u32, u32), [f32; 3]> = FxHashMap::default();
    let mut vertices: FxHashMap<u32, [f32; 3]> = FxHashMap::default();
    let undirected = |a: u32, b: u32| (a.min(b), a.max(b));
    for (triangle, &face) in triangles.iter().zip(&faces) {
        let corners = mesh.corners(*triangle);
        for k in 0..3 {
            let (here, next) = (name(triangle[k]), name(triangle[(k + 1) % 3]));
            let edge = edges.entry(undirected(here, next)).or_default();
            *edge = add(*edge, face);
            let to = |other: usize| difference(corners[(k + other) % 3], corners[k]);
            let (left, right) = (to(1), to(2));
            let angle = length(cross(left, right)).atan2(dot(left, right)) as f32;
            let corner = vertices.entry(here).or_default();
            *corner = add(*corner, scaled(face, angle));
        }
    }
    let of = |(triangle, face): (&[u32; 3], &[f32; 3])| {
        let [a, b, c] = triangle.map(name);
        let edge = |a, b| edges[&undirected(a, b)];
        let corner = |a| vertices[&a];
        [
            *face,
            edge(a, b),
            edge(b, c),
            edge(c, a),
            corner(a),
            corner(b),
            corner(c),
        ]
    };
    triangles.iter().zip(&faces).map(of).collect()
}

/// Adds the nodes of the triangles in `order`, which begin at `begin` in the order of the search, halving them
/// along the longest side of the box around their centres.
fn split(
    corners: &[[[f32; 3]; 3]],
    centres: &[[f32; 3]],
    order: &mut [u32],
    begin: usize,
    nodes: &mut Vec<Node>,
) {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    let (mut least, mut most) = (low, high);
    for &k in order.iter() {
        for axis in 0..3 {
            for corner in &corners[k as usize] {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
            least[axis] = least[axis].min(centres[k as usize][axis]);
            most[axis] = most[axis].max(centres[k as usize][axis]);
        }
    }
    let place = nodes.len();
    nodes.push(Node {
        low,
        high,
        begin: begin as u32,
        end: (begin + order.len()) as u32,
        second: 0,
        dipole: [0.0; 3],
    });
    if order.len() <= LEAF {
        return;
    }
    let side = |axis: &usize| most[*axis] - least[*axis];
    let axis = (0..3).max_by(|a, b| side(a).total_cmp(&side(b)));
    let axis = axis.expect("three axes");
    let half = order.len() / 2;
    let of = |k: u32| centres[k as usize][axis];
    // Ties are broken by the numbers, so that the search is the same on every run.
    order.select_nth_unstable_by(half, |&a, &b| of(a).total_cmp(&of(b)).then(a.cmp(&b)));
    let (lower, upper) = order.split_at_mut(half);
    split(corners, centres, lower, begin, nodes);
    nodes[place].second = nodes.len() as u32;
    split(corners, centres, upper, begin + half, nodes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::testing::{bumpy_sphere, cuboid, random_places};

    #[test]
    fn the_closest_point_is_that_found_by_exhaustion() {
        let mesh = bumpy_sphere(24);
        let search = TriangleSearch::new(&mesh).expect("triangles");
        let mut near = 0;
        for x in random_places(500, 1.0, 5) {
            let found = search.closest(x, near);
            let all = (0..search.corners.len() as u32).map(|k| search.on(k, x).squared);
            let least = all.fold(f32::INFINITY, f32::min);
            assert_eq!(found.squared, least, "at {x:?}");
            near = found.triangle;
        }
    }

    #[test]
    fn a_box_has_its_faces_edges_and_corners() {
        let mesh = cuboid([2.0; 3]).moved(|x| x.map(|part| part - 1.0));
        let search = TriangleSearch::new(&mesh).expect("triangles");
        for (x, distance, behind) in [
            ([0.2, 0.3, 1.5], 0.5, false),
            ([0.2, 0.3, 0.6], 0.4, true),
            ([1.3, 1.4, 0.1], 0.5, false),
            ([2.0, 2.0, 2.0], 3.0_f32.sqrt(), false),
            ([0.95, 0.95, 0.95], 0.05, true),
        ] {
            let found = search.closest(x, 0);
            assert!((found.squared.sqrt() - distance).abs() < 1e-6, "at {x:?}");
            assert_eq!(search.is_behind(&found, x), behind, "at {x:?}");
        }
    }

    #[test]
    fn the_winding_number_counts_overlapping_parts() {
        let mut mesh = bumpy_sphere(24);
        let other = mesh.moved(|x| [x[0] + 0.3, x[1], x[2]]);
        let search = TriangleSearch::new(&mesh).expect("triangles");
        for x in random_places(200, 0.8, 6) {
            let found = search.closest(x, 0);
            let inside = f64::from(u8::from(search.is_behind(&found, x)));
            // Far groups are dipoles: a few per cent.
            let winding = search.winding(x);
            assert!((winding - inside).abs() < 0.05, "at {x:?}: {winding}");
        }
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(other.vertices);
        let moved = other.triangles.iter().map(|t| t.map(|index| index + first));
        mesh.triangles.extend(moved);
        let search = TriangleSearch::new(&mesh).expect("triangles");
        for (x, times) in [
            ([0.15, 0.0, 0.0], 2.0),
            ([-0.3, 0.0, 0.0], 1.0),
            ([0.9, 0.0, 0.0], 0.0),
        ] {
            let winding = search.winding(x);
            assert!((winding - times).abs() < 0.05, "at {x:?}: {winding}");
        }
    }

    #[test]
    fn triangles_without_area_are_no_surface() {
        let flat = Mesh::new(
            vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]],
            vec![[0, 1, 2]],
        );
        assert!(TriangleSearch::new::<f64>(&flat).is_none());
    }
}
