//! Connected pieces of a mesh, and how much of its area is not on the largest.

use crate::geometry::connected::Connected;
use crate::geometry::{Mesh, weld};

/// How many pieces a mesh has and how its area is shared out among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pieces {
    /// How many there are.
    pub count: usize,
    /// Share of the area that is not on the largest one, 0 to 1.
    pub outside_largest: f64,
}

impl Pieces {
    /// Triangles that share a vertex, or two vertices at one position, are of one piece.
    pub(super) fn of(mesh: &Mesh<f64>) -> Self {
        let mut sets = Connected::new(weld(&mesh.vertices), &mesh.triangles);
        let mut areas: Vec<Option<f64>> = vec![None; mesh.vertices.len()];
        for &triangle in &mesh.triangles {
            let piece = &mut areas[sets.root(triangle[0]) as usize];
            *piece = Some(piece.unwrap_or(0.0) + mesh.triangle_area(triangle));
        }
        let areas: Vec<f64> = areas.into_iter().flatten().collect();
        let (total, largest) = areas
            .iter()
            .fold((0.0, 0.0_f64), |(total, largest), &area| {
                (total + area, largest.max(area))
            });
        Self {
            count: areas.len(),
            // A single piece is all of the area, without a rounding.
            outside_largest: match areas.len() {
                0 | 1 => 0.0,
                _ => 1.0 - largest / total,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Right triangles in the plane with legs of these lengths, ten apart.
    fn scattered(legs: &[f64]) -> Mesh<f64> {
        let corners = legs.iter().enumerate().flat_map(|(i, &leg)| {
            let x = 10.0 * i as f64;
            [[x, 0.0, 0.0], [x + leg, 0.0, 0.0], [x, leg, 0.0]]
        });
        let triangles = (0..legs.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        Mesh::new(corners.collect(), triangles.collect())
    }

    #[test]
    fn pieces_are_counted_and_the_area_beside_the_largest_is_shared_out() {
        let mut mesh = scattered(&[1.0, 3.0, 2.0]);
        // A vertex in no triangle is no piece.
        mesh.vertices.push([9.0; 3]);
        let pieces = Pieces::of(&mesh);
        assert_eq!(pieces.count, 3);
        // Areas 0.5, 4.5 and 2: exact but for the division.
        assert!((pieces.outside_largest - 2.5 / 7.0).abs() < 1e-15);
    }

    #[test]
    fn a_shared_vertex_or_a_shared_place_joins_two_pieces() {
        let mut mesh = scattered(&[1.0, 3.0, 2.0]);
        mesh.vertices[3] = mesh.vertices[1];
        let place = Pieces::of(&mesh);
        assert_eq!(place.count, 2);
        mesh.triangles.push([8, 4, 0]);
        let all = Pieces::of(&mesh);
        assert_eq!((all.count, all.outside_largest), (1, 0.0));
    }

    #[test]
    fn nothing_has_no_pieces() {
        assert_eq!(Pieces::of(&Mesh::default()).count, 0);
    }
}
