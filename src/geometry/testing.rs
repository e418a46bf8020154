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

/// Meshes as one, side by side or in each other.
pub(crate) fn together(meshes: &[Mesh<f64>]) -> Mesh<f64> {
    let mut all = Mesh::default();
    for mesh in meshes {
        let first = all.vertices.len() as u32;
        all.vertices.extend(&mesh.vertices);
        let named = mesh
            .triangles
            .iter()
            .map(|t| t.map(|vertex| vertex + first));
        all.triangles.extend(named);
    }
    all
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

/// A closed mesh like a sphere of radius 0.4 with bumps of a tenth of that: `2 n` vertices around, `n` rings.
pub(crate) fn bumpy_sphere(n: u32) -> Mesh<f64> {
    let around = 2 * n;
    let at = |ring: u32, k: u32| {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(n);
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(around);
        let radius = 0.4 * (1.0 + 0.1 * (3.0 * angle).sin() * (4.0 * polar).sin() * polar.sin());
        [
            radius * polar.sin() * angle.cos(),
            radius * polar.sin() * angle.sin(),
            radius * polar.cos(),
        ]
    };
    let mut vertices = vec![at(0, 0)];
    vertices.extend((1..n).flat_map(|ring| (0..around).map(move |k| at(ring, k))));
    vertices.push(at(n, 0));
    let last = vertices.len() as u32 - 1;
    let name = |ring: u32, k: u32| match ring {
        0 => 0,
        _ if ring == n => last,
        _ => 1 + (ring - 1) * around + k % around,
    };
    let mut triangles = Vec::new();
    for ring in 0..n {
        for k in 0..around {
            let [a, b, c, d] = [
                name(ring, k),
                name(ring + 1, k),
                name(ring + 1, k + 1),
                name(ring, k + 1),
            ];
            triangles.extend(
                [[a, b, c], [a, c, d]]
                    .into_iter()
                    .filter(|[x, y, z]| x != y && y != z && z != x),
            );
        }
    }
    Mesh::new(vertices, triangles)
}

/// Places uniform in the cube of this half side about the origin.
pub(crate) fn random_places(count: usize, half: f32, seed: u64) -> Vec<[f32; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut place = || [(); 3].map(|()| rng.random_range(-half..half));
    (0..count).map(|_| place()).collect()
}
