//! How the triangles of a mesh share their edges, vertices at one place being one vertex.

use rustc_hash::FxHashMap;

use super::linear::Scalar;
use super::mesh::Mesh;

/// How the triangles of a mesh share their edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct EdgeSharing {
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
    pub(crate) fn of<T: Scalar>(mesh: &Mesh<T>) -> Self {
        // For each undirected edge: how many triangles run along it upwards and downwards.
        let welded = weld(&mesh.vertices);
        let mut runs: FxHashMap<(u32, u32), [u32; 2]> = FxHashMap::default();
        runs.reserve(mesh.triangles.len() * 2);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|index| welded[index as usize]);
            // Without area it hides no gap and makes none.
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
    pub(crate) fn is_closed(&self) -> bool {
        *self == Self::default()
    }
}

/// For each vertex the first one at the same position.
///
/// # Panics
/// If there are 2^32 vertices or more.
pub(crate) fn weld<T: Scalar>(vertices: &[[T; 3]]) -> Vec<u32> {
    let mut first = FxHashMap::default();
    first.reserve(vertices.len());
    let indices = 0..u32::try_from(vertices.len()).expect("triangles index vertices by u32");
    // Adding zero makes -0.0 and 0.0 the same bits.
    let key = |index: u32| vertices[index as usize].map(|part| (part.into() + 0.0_f64).to_bits());
    indices
        .map(|index| *first.entry(key(index)).or_insert(index))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::testing::tetrahedron;

    #[test]
    fn turning_one_triangle_or_taking_it_away_shows_in_the_edges() {
        let mesh = tetrahedron(0.0);
        assert!(EdgeSharing::of(&mesh).is_closed());
        let mut open = mesh.clone();
        open.triangles.remove(0);
        let open = EdgeSharing::of(&open);
        assert_eq!(
            open,
            EdgeSharing {
                open: 3,
                ..Default::default()
            }
        );
        let mut turned = mesh.clone();
        turned.triangles[0].swap(0, 1);
        let inconsistent = EdgeSharing::of(&turned);
        assert_eq!(
            inconsistent,
            EdgeSharing {
                inconsistent: 3,
                ..Default::default()
            }
        );
        let mut doubled = mesh.clone();
        doubled.triangles.push(mesh.triangles[0]);
        assert_eq!(EdgeSharing::of(&doubled).branching, 3);
    }

    #[test]
    fn vertices_split_along_a_seam_leave_the_mesh_closed() {
        let mut mesh = tetrahedron(0.0);
        let copy = mesh.vertices.len() as u32;
        let seam = mesh.vertices[mesh.triangles[0][0] as usize];
        mesh.vertices
            .push(seam.map(|x| if x == 0.0 { -0.0 } else { x }));
        mesh.triangles[0][0] = copy;
        assert!(
            !mesh.is_closed(),
            "by the numbers of its vertices it is open"
        );
        assert!(EdgeSharing::of(&mesh).is_closed());
    }
}
