//! The connected pieces of a surface, and filters that drop the small ones.
//!
//! Extraction keeps every piece; a filter is the user's choice.

use super::connected::Connected;
use super::edges::weld;
use super::linear::Scalar;
use super::mesh::Mesh;

/// A connected piece of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// Indices of its triangles in the mesh, ascending.
    pub triangles: Vec<usize>,
    /// Its area in squared units of the coordinates.
    pub area: f64,
}

impl<T: Scalar> Mesh<T> {
    /// The connected pieces, largest area first; triangles that share a vertex are connected.
    #[must_use]
    pub fn components(&self) -> Vec<Component> {
        let each_alone = (0..self.vertices.len() as u32).collect();
        self.components_of(each_alone)
    }

    /// The same with vertices at one place taken as one: files split them along the seams of textures.
    #[must_use]
    pub(crate) fn components_by_place(&self) -> Vec<Component> {
        self.components_of(weld(&self.vertices))
    }

    /// The pieces where vertices stand for each other as in [`Connected::new`].
    fn components_of(&self, stand_for: Vec<u32>) -> Vec<Component> {
        let mut sets = Connected::new(stand_for, &self.triangles);
        let mut piece_of_root = vec![None; self.vertices.len()];
        let mut pieces: Vec<Component> = Vec::new();
        for (i, &triangle) in self.triangles.iter().enumerate() {
            let root = sets.root(triangle[0]) as usize;
            let piece = *piece_of_root[root].get_or_insert_with(|| {
                pieces.push(Component {
                    triangles: Vec::new(),
                    area: 0.0,
                });
                pieces.len() - 1
            });
            pieces[piece].triangles.push(i);
            pieces[piece].area += self.triangle_area(triangle);
        }
        // Stable: pieces of equal area stay in the order of their first triangles.
        pieces.sort_by(|a, b| b.area.total_cmp(&a.area));
        pieces
    }

    /// The pieces that have at least `share` of the whole area, how many these are, and how many there were;
    /// 0 keeps all, more than 1 none.
    #[must_use]
    pub fn keep_at_least(self, share: f64) -> (Self, usize, usize) {
        let mut pieces = self.components();
        let all = pieces.len();
        let least = share * pieces.iter().map(|piece| piece.area).sum::<f64>();
        pieces.retain(|piece| piece.area >= least);
        if pieces.len() == all {
            return (self, all, all);
        }
        (self.only(&pieces), pieces.len(), all)
    }

    /// The mesh without vertices that no triangle uses; a point cloud stays as it is.
    #[must_use]
    pub fn only_used(&self) -> Self {
        match self.triangles.is_empty() {
            true => self.clone(),
            false => self.only(&self.components()),
        }
    }

    /// The mesh of some of its pieces, without vertices that no triangle uses; the order of
    /// vertices and triangles is kept.
    fn only(&self, pieces: &[Component]) -> Self {
        let mut kept: Vec<usize> = pieces
            .iter()
            .flat_map(|piece| &piece.triangles)
            .copied()
            .collect();
        kept.sort_unstable();
        let mut used = vec![false; self.vertices.len()];
        for vertex in kept.iter().flat_map(|&i| self.triangles[i]) {
            used[vertex as usize] = true;
        }
        let mut renumbered = vec![0; self.vertices.len()];
        let old: Vec<usize> = (0..self.vertices.len())
            .filter(|&vertex| used[vertex])
            .collect();
        for (new, &vertex) in old.iter().enumerate() {
            renumbered[vertex] = new as u32;
        }
        let renumber = |i: usize| self.triangles[i].map(|vertex| renumbered[vertex as usize]);
        Self {
            vertices: picked(&self.vertices, &old),
            triangles: kept.into_iter().map(renumber).collect(),
            normals: self.normals.as_ref().map(|all| picked(all, &old)),
        }
    }
}

fn picked<V: Copy>(all: &[V], which: &[usize]) -> Vec<V> {
    which.iter().map(|&k| all[k]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Right triangles with legs of these lengths, apart from each other, two vertices swapped
    /// in so that pieces are interleaved, and one vertex that nothing uses.
    fn scattered(legs: &[f32]) -> Mesh<f32> {
        let mut mesh = Mesh {
            vertices: vec![[9.0; 3]],
            ..Mesh::default()
        };
        for (i, &leg) in legs.iter().enumerate() {
            let (at, first) = (10.0 * i as f32, mesh.vertices.len() as u32);
            mesh.vertices
                .extend([[at, 0.0, 0.0], [at + leg, 0.0, 0.0], [at, leg, 0.0]]);
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        mesh.normals = Some(
            mesh.vertices
                .iter()
                .map(|&[x, _, _]| [0.0, x, 1.0])
                .collect(),
        );
        mesh
    }

    #[test]
    fn pieces_come_largest_first_with_their_areas() {
        let pieces = scattered(&[1.0, 3.0, 2.0]).components();
        let found: Vec<_> = pieces
            .iter()
            .map(|piece| (piece.triangles.clone(), piece.area))
            .collect();
        assert_eq!(found, [(vec![1], 4.5), (vec![2], 2.0), (vec![0], 0.5)]);
    }

    #[test]
    fn triangles_that_share_a_vertex_are_one_piece() {
        let mut mesh = scattered(&[1.0, 3.0, 2.0]);
        mesh.triangles.push([9, 4, 1]);
        assert_eq!(mesh.components().len(), 1);
    }

    #[test]
    fn pieces_that_meet_in_places_but_not_in_numbers_are_one_by_place() {
        let mut mesh = scattered(&[1.0, 1.0]);
        // The second triangle begins where the first one ends.
        mesh.vertices[4] = mesh.vertices[2];
        assert_eq!(mesh.components().len(), 2);
        assert_eq!(mesh.components_by_place().len(), 1);
    }

    #[test]
    fn filters_keep_order_and_normals_and_drop_unused_vertices() {
        let mesh = scattered(&[1.0, 3.0, 2.0]);
        // Areas 0.5, 4.5 and 2 of 7 in all.
        let (kept, count, all) = mesh.clone().keep_at_least(0.25);
        assert_eq!((count, all), (2, 3));
        assert_eq!(kept.triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(kept.vertices, mesh.vertices[4..]);
        assert_eq!(
            kept.normals.as_deref(),
            mesh.normals.as_ref().map(|normals| &normals[4..])
        );
        assert_eq!(mesh.clone().keep_at_least(0.0), (mesh.clone(), 3, 3));
        assert!(mesh.keep_at_least(1.1).0.triangles.is_empty());
    }

    #[test]
    fn an_empty_mesh_has_no_pieces() {
        assert!(Mesh::<f32>::default().components().is_empty());
        let kept = Mesh::<f32>::default().keep_at_least(0.1);
        assert_eq!(kept, (Mesh::<f32>::default(), 0, 0));
    }
}
