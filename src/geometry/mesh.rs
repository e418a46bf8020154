//! Triangles over shared vertices, and their measures.
//!
//! Area of a triangle `|(b - a) x (c - a)| / 2`; signed volume of a closed mesh
//! `sum of a . (b x c) / 6` (divergence theorem), positive if the triangles are wound outwards.

use super::linear::{Scalar, add, cross, difference, dot, length, unit};

/// Triangles over shared vertices; a point cloud if there are no triangles.
///
/// `Mesh<f64>` is in the user's coordinates, so that georeferenced ones survive, or holds reckoned
/// positions; `Mesh<f32>` is what a network gave, normalised.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh<T> {
    /// Vertex positions.
    pub vertices: Vec<[T; 3]>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals, one per vertex, where they are known; `[0, 0, 0]` where one has no direction.
    pub normals: Option<Vec<[f32; 3]>>,
}

impl<T: Scalar> Mesh<T> {
    /// A mesh without normals.
    pub fn new(vertices: Vec<[T; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            vertices,
            triangles,
            normals: None,
        }
    }

    /// The triangles over vertices that are elsewhere, without normals, which would no longer hold.
    #[must_use]
    pub fn moved<U: Scalar>(&self, to: impl Fn([T; 3]) -> [U; 3]) -> Mesh<U> {
        Mesh::new(
            self.vertices.iter().map(|&vertex| to(vertex)).collect(),
            self.triangles.clone(),
        )
    }

    /// The positions of a triangle's corners.
    ///
    /// # Panics
    /// If it names a vertex that is not there; so do all measures below.
    #[must_use]
    pub fn corners(&self, triangle: [u32; 3]) -> [[f64; 3]; 3] {
        corners(&self.vertices, triangle)
    }

    /// Along a triangle's normal, as long as twice its area.
    #[must_use]
    pub fn area_vector(&self, triangle: [u32; 3]) -> [f64; 3] {
        area_vector(self.corners(triangle))
    }

    /// The area of one triangle.
    #[must_use]
    pub fn triangle_area(&self, triangle: [u32; 3]) -> f64 {
        length(self.area_vector(triangle)) / 2.0
    }

    /// The sum of the triangle areas, in squared units of the coordinates.
    #[must_use]
    pub fn area(&self) -> f64 {
        let triangles = self.triangles.iter();
        triangles
            .map(|&triangle| self.triangle_area(triangle))
            .sum()
    }

    /// The signed volume that a closed mesh encloses: positive if its triangles are wound outwards. Of an
    /// open mesh it is the volume of the cone to its first vertex, which means little.
    #[must_use]
    pub fn volume(&self) -> f64 {
        // Relative to a vertex of the mesh: far from the origin the terms would cancel badly.
        let origin = self
            .vertices
            .first()
            .map_or([0.0; 3], |&vertex| vertex.map(T::into));
        let six_volumes = self.triangles.iter().map(|&triangle| {
            let [a, b, c] = self
                .corners(triangle)
                .map(|corner| difference(corner, origin));
            dot(a, cross(b, c))
        });
        six_volumes.sum::<f64>() / 6.0
    }

    /// Whether every edge lies in exactly two triangles that run along it in opposite directions, vertices
    /// taken by their numbers; `EdgeSharing` takes them by their places.
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

    /// Unit normals of the vertices, from the triangles, weighted by area: see `vertex_normals`.
    #[must_use]
    pub fn vertex_normals(&self) -> Vec<[f32; 3]> {
        vertex_normals(&self.vertices, &self.triangles)
    }

    fn directed_edges(&self) -> Vec<(u32, u32)> {
        self.triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .collect()
    }
}

impl Mesh<f64> {
    /// Positions in float32 as a mesh in float64, without normals.
    pub fn of_points(points: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let wide = |point: &[f32; 3]| point.map(f64::from);
        Self::new(points.iter().map(wide).collect(), triangles.to_vec())
    }
}

/// Unit normals of vertices: the mean of the normals of the triangles around each, weighted by area;
/// `[0, 0, 0]` for a vertex without area around it.
///
/// # Panics
/// If a triangle names a vertex that is not there.
#[must_use]
pub(crate) fn vertex_normals<T: Scalar>(
    vertices: &[[T; 3]],
    triangles: &[[u32; 3]],
) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0; 3]; vertices.len()];
    for &triangle in triangles {
        // As long as twice the area: the sum is weighted by it without more ado.
        let normal = area_vector(corners(vertices, triangle));
        for vertex in triangle {
            let sum = &mut sums[vertex as usize];
            *sum = add(*sum, normal);
        }
    }
    sums.into_iter().map(unit).collect()
}

fn corners<T: Scalar>(vertices: &[[T; 3]], triangle: [u32; 3]) -> [[f64; 3]; 3] {
    triangle.map(|vertex| vertices[vertex as usize].map(T::into))
}

fn area_vector([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    cross(difference(b, a), difference(c, a))
}

#[cfg(test)]
mod tests;
