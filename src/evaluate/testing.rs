//! Meshes that the tests of this module share.

use std::collections::HashMap;

use crate::geometry::Mesh;
use crate::geometry::linear::length;

/// A unit square in the plane z = `height`.
pub(super) fn square(height: f64) -> Mesh<f64> {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    Mesh::new(
        corners.map(|[x, y]| [x, y, height]).to_vec(),
        vec![[0, 1, 2], [0, 2, 3]],
    )
}

/// The unit sphere about the origin: an octahedron whose triangles are split in four `splits`
/// times.
pub(super) fn sphere(splits: usize) -> Mesh<f64> {
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let mut vertex = [0.0; 3];
            vertex[axis] = sign;
            vertices.push(vertex);
        }
    }
    let octant = |[x, y, z]: [u32; 3]| {
        let corners = [x, 2 + y, 4 + z];
        // An odd number of mirrorings turns the winding.
        if (x + y + z) % 2 == 0 {
            corners
        } else {
            [corners[0], corners[2], corners[1]]
        }
    };
    let mut triangles: Vec<[u32; 3]> = (0..8)
        .map(|i| octant([i & 1, i >> 1 & 1, i >> 2 & 1]))
        .collect();
    for _ in 0..splits {
        let mut halfway: HashMap<(u32, u32), u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *halfway.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let (p, q) = (vertices[a as usize], vertices[b as usize]);
                let sum = [0, 1, 2].map(|axis| p[axis] + q[axis]);
                vertices.push(sum.map(|x| x / length(sum)));
                vertices.len() as u32 - 1
            })
        };
        let split = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(split).collect();
    }
    Mesh::new(vertices, triangles)
}
