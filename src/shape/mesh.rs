//! Measures of a triangle mesh given as vertices and triples of indices, counter-clockwise as seen
//! from outside.
//!
//! Area of a triangle `|(b - a) x (c - a)| / 2`; signed volume of a closed mesh
//! `sum of a . (b x c) / 6` (divergence theorem), positive if the triangles are wound outwards.

use std::collections::HashMap;

/// Euclidean length.
pub(crate) fn length(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

/// Scalar product.
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The mean of places, summed relative to the first: far from the origin the sums would cancel.
///
/// # Panics
/// If there are none.
pub(crate) fn mean(places: impl Iterator<Item = [f64; 3]> + Clone) -> [f64; 3] {
    let mut first = places.clone();
    let origin = first.next().expect("a place");
    let count = (first.count() + 1) as f64;
    places.fold(origin, |mean, place| {
        let away = difference(place, origin);
        [0, 1, 2].map(|axis| mean[axis] + away[axis] / count)
    })
}

/// `a - b`.
pub(crate) fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Vector product.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The positions of a triangle's corners.
pub(crate) fn corners(vertices: &[[f64; 3]], triangle: [u32; 3]) -> [[f64; 3]; 3] {
    triangle.map(|index| vertices[index as usize])
}

/// The normal of a triangle, as long as twice its area.
pub(crate) fn area_vector(vertices: &[[f64; 3]], triangle: [u32; 3]) -> [f64; 3] {
    let [a, b, c] = corners(vertices, triangle);
    cross(difference(b, a), difference(c, a))
}

/// Total area of the triangles.
pub fn area(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    triangles
        .iter()
        .map(|&triangle| length(area_vector(vertices, triangle)) / 2.0)
        .sum()
}

/// Signed volume enclosed by a closed mesh: positive if its triangles are wound outwards. Of an
/// open mesh it is the volume of the cone to its first vertex, which means little.
pub fn signed_volume(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let Some(&origin) = vertices.first() else {
        return 0.0;
    };
    let six_volumes = triangles.iter().map(|&triangle| {
        // Relative to a vertex: far from the origin the terms would cancel in float64.
        let [a, b, c] = corners(vertices, triangle).map(|corner| difference(corner, origin));
        dot(a, cross(b, c))
    });
    six_volumes.sum::<f64>() / 6.0
}

/// Unit normals of the vertices: the mean of the normals of the triangles around each, weighted by
/// area; `[0, 0, 0]` for a vertex in no triangle.
pub fn vertex_normals(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0; 3]; vertices.len()];
    for &triangle in triangles {
        let normal = area_vector(vertices, triangle);
        for index in triangle {
            for axis in 0..3 {
                sums[index as usize][axis] += normal[axis];
            }
        }
    }
    sums.into_iter().map(super::unit).collect()
}

/// How the triangles of a mesh share their edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EdgeSharing {
    /// Edges of exactly one triangle: where the mesh is open.
    pub open: usize,
    /// Edges of two triangles that are wound against each other.
    pub inconsistent: usize,
    /// Edges of more than two triangles.
    pub branching: usize,
}

impl EdgeSharing {
    /// Counts the edges. Vertices at the same position are one vertex here: files split them where
    /// texture coordinates jump, which leaves no gap in the surface.
    pub fn of(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Self {
        // For each undirected edge: how many triangles run along it upwards and downwards.
        let welded = weld(vertices);
        let mut runs: HashMap<(u32, u32), [u32; 2]> = HashMap::with_capacity(triangles.len() * 2);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|index| welded[index as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let run = runs.entry((from.min(to), from.max(to))).or_default();
                run[usize::from(from > to)] += 1;
            }
        }
        let mut sharing = Self::default();
        for run in runs.into_values() {
            match run {
                [1, 1] => {}
                [1, 0] | [0, 1] => sharing.open += 1,
                [2, 0] | [0, 2] => sharing.inconsistent += 1,
                _ => sharing.branching += 1,
            }
        }
        sharing
    }

    /// Whether every edge is shared by exactly two triangles wound alike: the mesh has an inside.
    pub fn is_closed(&self) -> bool {
        *self == Self::default()
    }
}

/// For each vertex the first one at the same position.
pub(crate) fn weld(vertices: &[[f64; 3]]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(vertices.len());
    let indices = 0..u32::try_from(vertices.len()).expect("triangles index vertices by u32");
    // Adding zero makes -0.0 and 0.0 the same bits.
    let key = |index: u32| vertices[index as usize].map(|coordinate| (coordinate + 0.0).to_bits());
    indices
        .map(|index| *first.entry(key(index)).or_insert(index))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::testing::tetrahedron;

    #[test]
    fn a_corner_tetrahedron_has_its_area_and_volume_wherever_it_is() {
        for offset in [0.0, 5.0e5] {
            let (vertices, triangles) = tetrahedron(offset);
            // Three right triangles of 1/2 and one equilateral of side sqrt 2. The offset loses
            // log2(5e5) of 52 bits: 1e-9 is wide.
            let expected = 1.5 + 3f64.sqrt() / 2.0;
            assert!((area(&vertices, &triangles) - expected).abs() < 1e-9);
            assert!((signed_volume(&vertices, &triangles) - 1.0 / 6.0).abs() < 1e-9);
        }
    }

    #[test]
    fn turning_one_triangle_or_taking_it_away_shows_in_the_edges() {
        let (vertices, triangles) = tetrahedron(0.0);
        assert!(EdgeSharing::of(&vertices, &triangles).is_closed());
        let open = EdgeSharing::of(&vertices, &triangles[1..]);
        assert_eq!(
            open,
            EdgeSharing {
                open: 3,
                ..Default::default()
            }
        );
        let mut turned = triangles.clone();
        turned[0].swap(0, 1);
        let inconsistent = EdgeSharing::of(&vertices, &turned);
        assert_eq!(
            inconsistent,
            EdgeSharing {
                inconsistent: 3,
                ..Default::default()
            }
        );
        let mut doubled = triangles.clone();
        doubled.push(triangles[0]);
        assert_eq!(EdgeSharing::of(&vertices, &doubled).branching, 3);
    }

    #[test]
    fn vertices_split_along_a_seam_leave_the_mesh_closed() {
        let (mut vertices, mut triangles) = tetrahedron(0.0);
        let copy = vertices.len() as u32;
        let seam = triangles[0][0];
        vertices.push(vertices[seam as usize].map(|x| if x == 0.0 { -0.0 } else { x }));
        triangles[0][0] = copy;
        assert!(EdgeSharing::of(&vertices, &triangles).is_closed());
    }

    #[test]
    fn vertex_normals_are_weighted_by_area() {
        // At the first vertex two triangles meet: area 1 facing z, area 1/2 facing x.
        let vertices = [
            [0.0; 3],
            [2.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let normals = vertex_normals(&vertices, &[[0, 1, 2], [0, 3, 4]]);
        let expected = super::super::unit([1.0, 0.0, 2.0]);
        // Both are rounded to float32 once: equal to its epsilon.
        for axis in 0..3 {
            assert!(
                (normals[0][axis] - expected[axis]).abs() < 1e-6,
                "{:?}",
                normals[0]
            );
        }
        assert_eq!(normals[1], [0.0, 0.0, 1.0]);
    }
}
