//! Triangles turned so that a mesh has its outside out, each piece by itself.
//!
//! Across an edge of two triangles the winding of one says that of the other. So each piece that hangs together by
//! such edges has two windings, of which the one with more area is meant. A closed piece is then turned outwards,
//! unless it lies inside another: there it is the wall of a hollow.

use std::f64::consts::PI;

use rustc_hash::FxHashMap;

use super::edges::weld;
use super::linear::{cross, difference, dot};
use super::mesh::Mesh;
use super::triangles::solid_angle;

/// What was turned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Turned {
    /// The triangles, wound anew.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles that were wound against the rest of their piece.
    pub against: usize,
    /// Closed pieces that were wound inwards as a whole.
    pub pieces: usize,
    /// Whether all that is closed was wound inwards, so that the whole mesh was turned.
    pub whole: bool,
}

/// The most work that is spent on finding out what lies inside of what: pieces times triangles.
const MOST_WORK: usize = 200_000_000;

/// A piece that hangs together by edges of two triangles.
struct Piece {
    triangles: Vec<u32>,
    /// Whether all of its edges have two triangles.
    is_closed: bool,
}

/// The triangles of a mesh with all pieces wound consistently and outwards; `None` where they are.
///
/// Pieces that have but one side, such as a Moebius strip, stay as they are.
pub(crate) fn turned_outwards(mesh: &Mesh<f64>) -> Option<Turned> {
    let links = Links::of(mesh);
    let mut turn = vec![false; mesh.triangles.len()];
    let pieces = pieces(mesh, &links, &mut turn);
    let against = turn.iter().filter(|turn| **turn).count();
    let volume = |piece: &Piece, turn: &[bool]| {
        let origin = mesh.vertices[mesh.triangles[piece.triangles[0] as usize][0] as usize];
        let six = piece.triangles.iter().map(|&t| {
            let [a, b, c] = corners(mesh, t).map(|corner| difference(corner, origin));
            let six = dot(a, cross(b, c));
            if turn[t as usize] { -six } else { six }
        });
        six.sum::<f64>()
    };
    let closed: Vec<&Piece> = pieces.iter().filter(|piece| piece.is_closed).collect();
    let mut volumes: Vec<f64> = closed.iter().map(|piece| volume(piece, &turn)).collect();
    let mut flip = |piece: &Piece| {
        piece
            .triangles
            .iter()
            .for_each(|&t| turn[t as usize] ^= true);
    };
    let whole = volumes.iter().sum::<f64>() < 0.0;
    if whole {
        closed.iter().for_each(|piece| flip(piece));
        volumes.iter_mut().for_each(|volume| *volume = -*volume);
    }
    let inwards = || (0..closed.len()).filter(|k| volumes[*k] < 0.0);
    let work = inwards().count() * mesh.triangles.len();
    let is_hollow = |k: usize| work <= MOST_WORK && inside_of(mesh, &closed, k) % 2 == 1;
    let wrong: Vec<usize> = inwards().filter(|k| !is_hollow(*k)).collect();
    wrong.iter().for_each(|k| flip(closed[*k]));
    if turn.iter().all(|turn| !turn) {
        return None;
    }
    let wound = |(&[a, b, c], turn): (&[u32; 3], &bool)| if *turn { [a, c, b] } else { [a, b, c] };
    Some(Turned {
        triangles: mesh.triangles.iter().zip(&turn).map(wound).collect(),
        against,
        pieces: wrong.len(),
        whole,
    })
}

/// A side of a triangle: the triangle, which of its sides, and whether it runs from the lower vertex to the higher.
type Side = (u32, u8, bool);

/// Which triangles share an edge with which.
struct Links {
    /// For each side of each triangle, the triangle beyond, and whether it is wound alike; none beyond an edge of one
    /// triangle or of more than two.
    beyond: Vec<[Option<(u32, bool)>; 3]>,
    /// Whether a triangle has an area at all.
    has_area: Vec<bool>,
}

impl Links {
    fn of(mesh: &Mesh<f64>) -> Self {
        let welded = weld(&mesh.vertices);
        let count = mesh.triangles.len();
        // For each edge its first two sides, and how many there are.
        let mut edges: FxHashMap<(u32, u32), ([Side; 2], u32)> = FxHashMap::default();
        edges.reserve(count * 2);
        let mut has_area = vec![true; count];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|vertex| welded[vertex as usize]);
            if a == b || b == c || c == a {
                has_area[t] = false;
                continue;
            }
            for (side, (from, to)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
                let entry = edges.entry((from.min(to), from.max(to))).or_default();
                if let Some(place) = entry.0.get_mut(entry.1 as usize) {
                    *place = (t as u32, side as u8, from < to);
                }
                entry.1 += 1;
            }
        }
        let mut beyond = vec![[None; 3]; count];
        for ([one, other], sides) in edges.into_values() {
            if sides == 2 {
                // Wound alike, two triangles run along their edge in opposite directions.
                let alike = one.2 != other.2;
                beyond[one.0 as usize][one.1 as usize] = Some((other.0, alike));
                beyond[other.0 as usize][other.1 as usize] = Some((one.0, alike));
            }
        }
        Self { beyond, has_area }
    }
}

/// The pieces; marks the triangles of each that are to be turned so that all are wound as most of the area is.
fn pieces(mesh: &Mesh<f64>, links: &Links, turn: &mut [bool]) -> Vec<Piece> {
    let mut found = Vec::new();
    let mut seen = vec![false; mesh.triangles.len()];
    for start in 0..mesh.triangles.len() {
        if seen[start] || !links.has_area[start] {
            continue;
        }
        seen[start] = true;
        let mut piece = Piece {
            triangles: vec![start as u32],
            is_closed: true,
        };
        let (mut next, mut has_two_sides) = (0, true);
        while let Some(&t) = piece.triangles.get(next) {
            next += 1;
            for link in links.beyond[t as usize] {
                let Some((other, alike)) = link else {
                    piece.is_closed = false;
                    continue;
                };
                // Alike, both are turned or neither is.
                let wanted = if alike {
                    turn[t as usize]
                } else {
                    !turn[t as usize]
                };
                if seen[other as usize] {
                    has_two_sides &= turn[other as usize] == wanted;
                } else {
                    seen[other as usize] = true;
                    turn[other as usize] = wanted;
                    piece.triangles.push(other);
                }
            }
        }
        let area = |turned: bool| {
            let those = piece
                .triangles
                .iter()
                .filter(|t| turn[**t as usize] == turned);
            those
                .map(|&t| mesh.triangle_area(mesh.triangles[t as usize]))
                .sum::<f64>()
        };
        let invert = has_two_sides && area(true) > area(false);
        for &t in &piece.triangles {
            let turn = &mut turn[t as usize];
            *turn = has_two_sides && (*turn != invert);
        }
        piece.is_closed &= has_two_sides;
        found.push(piece);
    }
    found
}

fn corners(mesh: &Mesh<f64>, triangle: u32) -> [[f64; 3]; 3] {
    mesh.corners(mesh.triangles[triangle as usize])
}

/// How many of the closed pieces piece `k` lies inside of.
fn inside_of(mesh: &Mesh<f64>, closed: &[&Piece], k: usize) -> usize {
    let [a, b, c] = corners(mesh, closed[k].triangles[0]);
    let place = [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
    let others = closed.iter().enumerate().filter(|(other, _)| *other != k);
    let around = |piece: &Piece| {
        let angles = piece.triangles.iter();
        let sum: f64 = angles.map(|&t| solid_angle(&corners(mesh, t), place)).sum();
        // A whole sphere, in either winding.
        sum.abs() > 2.0 * PI
    };
    others.filter(|(_, piece)| around(piece)).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::EdgeSharing;
    use crate::geometry::testing::{bumpy_sphere, cuboid, together};

    fn flipped(mut mesh: Mesh<f64>) -> Mesh<f64> {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mesh
    }

    fn scaled(mesh: &Mesh<f64>, by: f64, along: f64) -> Mesh<f64> {
        mesh.moved(|[x, y, z]| [by * x + along, by * y, by * z])
    }

    /// The mesh as it is turned.
    fn turned(mesh: &Mesh<f64>) -> (Mesh<f64>, Turned) {
        let turned = turned_outwards(mesh).expect("something to turn");
        (
            Mesh::new(mesh.vertices.clone(), turned.triangles.clone()),
            turned,
        )
    }

    #[test]
    fn what_is_wound_outwards_stays() {
        let ball = bumpy_sphere(12);
        let hollow = together(&[ball.clone(), flipped(scaled(&ball, 0.5, 0.0))]);
        let two = together(&[ball.clone(), scaled(&ball, 0.5, 3.0)]);
        let overlapping = together(&[ball.clone(), scaled(&ball, 1.0, 0.3)]);
        let within = together(&[ball.clone(), scaled(&ball, 0.3, 0.0)]);
        for mesh in [ball, hollow, two, overlapping, within] {
            assert_eq!(turned_outwards(&mesh), None);
        }
    }

    #[test]
    fn a_part_wound_inwards_is_turned_and_the_wall_of_a_hollow_is_not() {
        let ball = bumpy_sphere(12);
        let apart = together(&[ball.clone(), flipped(scaled(&ball, 0.8, 3.0))]);
        let (mesh, how) = turned(&apart);
        assert_eq!((how.pieces, how.against, how.whole), (1, 0, false));
        assert!(
            (mesh.volume() - 1.512 * ball.volume()).abs() < 1e-9,
            "1 and 0.8 cubed"
        );
        // The hollow ball, the whole of it wound the wrong way.
        let hollow = flipped(together(&[ball.clone(), flipped(scaled(&ball, 0.5, 0.0))]));
        let (mesh, how) = turned(&hollow);
        assert!(how.whole && how.pieces == 0);
        assert!((mesh.volume() - 0.875 * ball.volume()).abs() < 1e-9);
    }

    #[test]
    fn triangles_wound_against_the_rest_are_turned_also_where_the_mesh_is_open() {
        let mut ball = bumpy_sphere(12);
        let right = ball.clone();
        ball.triangles[7].swap(0, 1);
        ball.triangles[30].swap(1, 2);
        let (mesh, how) = turned(&ball);
        assert_eq!((how.against, how.pieces, how.whole), (2, 0, false));
        assert!(
            EdgeSharing::of(&mesh).is_closed() && (mesh.volume() - right.volume()).abs() < 1e-12
        );
        let mut sheet = right;
        sheet.triangles.truncate(100);
        sheet.triangles[50].swap(0, 1);
        let (mesh, how) = turned(&sheet);
        assert_eq!(how.against, 1);
        assert_eq!(EdgeSharing::of(&mesh).inconsistent, 0);
    }

    #[test]
    fn a_box_inside_out_far_from_the_origin_is_turned() {
        let far = flipped(cuboid([1.0, 2.0, 3.0])).moved(|[x, y, z]| [x + 5e5, y - 5e6, z]);
        let (mesh, how) = turned(&far);
        assert!(how.whole && (mesh.volume() - 6.0).abs() < 1e-6);
    }

    #[test]
    fn a_strip_with_one_side_stays_as_it_is() {
        // Six quads around, the last joined with a twist.
        let place = |k: u32| {
            [
                f64::from(k / 2).cos(),
                f64::from(k / 2).sin(),
                f64::from(k % 2),
            ]
        };
        let vertices = (0..12).map(place).collect();
        let mut triangles = Vec::new();
        for k in 0..6_u32 {
            let [a, b] = [2 * k, 2 * k + 1];
            let [c, d] = if k == 5 { [1, 0] } else { [a + 2, b + 2] };
            triangles.extend([[a, c, b], [b, c, d]]);
        }
        assert_eq!(turned_outwards(&Mesh::new(vertices, triangles)), None);
    }
}
