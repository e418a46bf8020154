//! Surfaces: the zero set of a learned field as triangles, and what is done with them.
//!
//! | file | what it holds |
//! |---|---|
//! | `extract.rs` | the zero set of a field that is known only by its values at points |
//! | `search.rs` | which grid nodes need a value: scan, descend, follow the surface |
//! | `lattice.rs` | the values found so far, stored only where there are any |
//! | `cell.rs` | the closed loops in which a surface crosses one cell, and their triangles |
//! | `polygonise.rs` | cells joined into one mesh with shared vertices |
//! | `components.rs` | connected pieces and filters that drop the small ones |
//! | `flow_map.rs` | a field that a flow carries, the flow followed at few points |
//! | `agreement.rs` | whether a method's surfaces and its motion say the same |
//! | `learned.rs` | what was learned: its surface at a time, where its motion takes points |
//! | `frames.rs` | the surfaces of chosen times, as files |
//! | `carry.rs` | the input file again, its vertices moved |
//! | `write.rs` | PLY and OBJ files |
//!
//! A field is negative inside; triangles wind counter-clockwise seen from outside, so normals
//! point outwards and the volume of a closed surface is positive.

mod agreement;
pub mod carry;
mod cell;
pub mod components;
pub mod extract;
mod flow_map;
pub mod frames;
mod lattice;
mod polygonise;
mod search;
pub mod learned;
pub mod write;

/// Triangles over shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Vertex positions.
    pub vertices: Vec<[f32; 3]>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals, one per vertex, where somebody has set them.
    pub normals: Option<Vec<[f32; 3]>>,
}

impl SurfaceMesh {
    /// The sum of the triangle areas, in squared units of the coordinates.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.triangles
            .iter()
            .map(|&triangle| self.triangle_area(triangle))
            .sum()
    }

    /// The signed volume `1/6 Σ a·(b × c)`: positive for a closed surface whose normals point
    /// outwards; without meaning for an open one.
    #[must_use]
    pub fn volume(&self) -> f64 {
        // Relative to a vertex of the mesh: far from the origin the terms would cancel badly.
        let origin = self
            .vertices
            .first()
            .map_or([0.0; 3], |&vertex| vertex.map(f64::from));
        let sixfold = |&triangle: &[u32; 3]| {
            let [a, b, c] = self
                .corners(triangle)
                .map(|corner| subtract(corner, origin));
            dot(a, cross(b, c))
        };
        self.triangles.iter().map(sixfold).sum::<f64>() / 6.0
    }

    /// Whether every edge lies in exactly two triangles that run along it in opposite directions.
    ///
    /// An empty mesh is not closed.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        let mut directed = self.directed_edges();
        directed.sort_unstable();
        let unique = directed.windows(2).all(|pair| pair[0] != pair[1]);
        let returned = |&(from, to): &(u32, u32)| directed.binary_search(&(to, from)).is_ok();
        !directed.is_empty() && unique && directed.iter().all(returned)
    }

    /// `V - E + F` over the vertices in use: 2 for each sphere, 0 for a torus, 2 - 2g for genus g.
    #[must_use]
    pub fn euler_characteristic(&self) -> i64 {
        let undirected = |(from, to): (u32, u32)| (from.min(to), from.max(to));
        let mut edges: Vec<_> = self.directed_edges().into_iter().map(undirected).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut used: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        used.len() as i64 - edges.len() as i64 + self.triangles.len() as i64
    }

    /// Unit vertex normals: the sum of the normals of the surrounding triangles, each by its area.
    ///
    /// A vertex without area around it gets zero.
    #[must_use]
    pub fn area_weighted_normals(&self) -> Vec<[f32; 3]> {
        area_weighted_normals(&self.vertices, &self.triangles)
    }

    fn triangle_area(&self, triangle: [u32; 3]) -> f64 {
        let twice_area = normal_by_area(self.corners(triangle));
        dot(twice_area, twice_area).sqrt() / 2.0
    }

    fn corners(&self, triangle: [u32; 3]) -> [[f64; 3]; 3] {
        corners(&self.vertices, triangle)
    }

    fn directed_edges(&self) -> Vec<(u32, u32)> {
        self.triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .collect()
    }
}

/// [`SurfaceMesh::area_weighted_normals`] of borrowed vertices and triangles.
///
/// # Panics
/// If a triangle names a vertex that is not there.
#[must_use]
pub fn area_weighted_normals(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0_f64; 3]; vertices.len()];
    for &triangle in triangles {
        let twice_area = normal_by_area(corners(vertices, triangle));
        for vertex in triangle {
            let sum = &mut sums[vertex as usize];
            *sum = std::array::from_fn(|axis| sum[axis] + twice_area[axis]);
        }
    }
    let unit = |sum: [f64; 3]| {
        let length = dot(sum, sum).sqrt();
        sum.map(|part| {
            if length > 0.0 {
                (part / length) as f32
            } else {
                0.0
            }
        })
    };
    sums.into_iter().map(unit).collect()
}

fn corners(vertices: &[[f32; 3]], triangle: [u32; 3]) -> [[f64; 3]; 3] {
    triangle.map(|vertex| vertices[vertex as usize].map(f64::from))
}

/// Along a triangle's normal, as long as twice its area.
fn normal_by_area([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    cross(subtract(b, a), subtract(c, a))
}

fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tetrahedron on the origin and the three unit vectors, `shift` away from there.
    fn tetrahedron(shift: f32) -> SurfaceMesh {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        SurfaceMesh {
            vertices: corners
                .map(|corner: [f32; 3]| corner.map(|part| part + shift))
                .to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            normals: None,
        }
    }

    #[test]
    fn a_tetrahedron_has_the_area_volume_and_topology_of_the_textbook() {
        // Coordinates of 1000 and more are multiples of 6e-5 in f32, but these are whole numbers.
        for shift in [0.0, 1000.0] {
            let mesh = tetrahedron(shift);
            let area = 1.5 + 3.0_f64.sqrt() / 2.0;
            // f64 arithmetic on exact coordinates: rounding only.
            assert!((mesh.area() - area).abs() < 1e-12, "{}", mesh.area());
            assert!(
                (mesh.volume() - 1.0 / 6.0).abs() < 1e-12,
                "{}",
                mesh.volume()
            );
            assert!(mesh.is_closed());
            assert_eq!(mesh.euler_characteristic(), 2);
        }
    }

    #[test]
    fn an_open_or_twisted_or_empty_mesh_is_not_closed() {
        let mut open = tetrahedron(0.0);
        open.triangles.pop();
        assert!(!open.is_closed(), "a face is missing");
        let mut twisted = tetrahedron(0.0);
        twisted.triangles[0] = [0, 1, 2];
        assert!(!twisted.is_closed(), "a face is wound the other way");
        let mut doubled = tetrahedron(0.0);
        doubled.triangles.extend_from_within(..);
        assert!(!doubled.is_closed(), "every edge lies in four triangles");
        assert!(!SurfaceMesh::default().is_closed(), "nothing is not closed");
    }

    #[test]
    fn turning_a_mesh_inside_out_changes_the_sign_of_its_volume() {
        let mut mesh = tetrahedron(0.0);
        mesh.triangles
            .iter_mut()
            .for_each(|triangle| triangle.swap(0, 1));
        assert!(
            (mesh.volume() + 1.0 / 6.0).abs() < 1e-12,
            "{}",
            mesh.volume()
        );
        assert!(mesh.is_closed());
    }

    #[test]
    fn normals_at_a_corner_are_the_mean_of_its_faces_by_area() {
        let normals = tetrahedron(0.0).area_weighted_normals();
        let third = 1.0 / 3.0_f32.sqrt();
        for part in normals[0] {
            // Three equal faces meet at the origin: the mean points along -(1, 1, 1). f32 rounding.
            assert!((part + third).abs() < 1e-6, "{part}");
        }
        // At (1, 0, 0): -z, -y and (1, 1, 1) by twice their areas sum to (1, 0, 0).
        assert_eq!(normals[1], [1.0, 0.0, 0.0]);
    }
}
