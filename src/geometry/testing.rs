//! Shapes that tests share.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::mesh::Mesh;

/// The corner of the unit cube, wound outwards, moved by `offset` along every axis.
pub(crate) fn tetrahedron(offset: f64) -> Mesh<f64> {
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let vertices = corners
        .map(|corner| corner.map(|x: f64| x + offset))
        .to_vec();
    Mesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
}

/// A box with these edges and a corner at the origin, wound outwards.
pub(crate) fn cuboid(edges: [f64; 3]) -> Mesh<f64> {
    let corner = |i: usize| [0, 1, 2].map(|axis| edges[axis] * (i >> axis & 1) as f64);
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let halves = |&[a, b, c, d]: &[u32; 4]| [[a, b, c], [a, c, d]];
    Mesh::new(
        (0..8).map(corner).collect(),
        faces.iter().flat_map(halves).collect(),
    )
}

/// Points uniform on the sphere of this radius about the origin.
pub(crate) fn sphere_cloud(count: usize, radius: f64, seed: u64) -> Vec<[f64; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut point = || {
        let (z, angle) = (
            rng.random_range(-1.0..1.0),
            rng.random_range(0.0..std::f64::consts::TAU),
        );
        let ring = f64::sqrt(1.0 - z * z);
        [
            radius * ring * f64::cos(angle),
            radius * ring * f64::sin(angle),
            radius * z,
        ]
    };
    (0..count).map(|_| point()).collect()
}

/// Points uniform on the torus about the z axis with these radii, and its outward normals there.
pub(crate) fn torus_cloud(
    count: usize,
    ring: f64,
    tube: f64,
    seed: u64,
) -> Vec<([f64; 3], [f64; 3])> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut points = Vec::with_capacity(count);
    while points.len() < count {
        let angle = rng.random_range(0.0..std::f64::consts::TAU);
        let around: f64 = rng.random_range(0.0..std::f64::consts::TAU);
        // The area element grows with the distance from the axis: draw and reject.
        if rng.random_range(0.0..ring + tube) < ring + tube * around.cos() {
            let (sin, cos) = f64::sin_cos(angle);
            let normal = [around.cos() * cos, around.cos() * sin, around.sin()];
            let centre = [ring * cos, ring * sin, 0.0];
            points.push((
                [0, 1, 2].map(|axis| centre[axis] + tube * normal[axis]),
                normal,
            ));
        }
    }
    points
}
