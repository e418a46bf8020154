//! Pairs of vertices that are known to correspond: from a file (`pairs_file.rs`), or from a shared vertex order.

use rand::Rng;

use crate::formats::{Shape, ShapeError};

/// Known pairs: indices into the vertices of the source and of the target as shapes have them. Files have the numbers
/// of their own vertices, of which a shape may lack some.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Correspondences {
    /// `[source vertex, target vertex]` each.
    pub pairs: Vec<[u32; 2]>,
    /// How sure each pair is, 0 to 1; empty where no pair says.
    pub confidence: Vec<f32>,
    /// What was decided about the contents of their file, one sentence each.
    pub notes: Vec<String>,
}

impl Correspondences {
    /// No pair at all.
    pub(crate) fn none() -> Self {
        Self::default()
    }

    /// Every vertex of the source corresponds to the target's vertex of the same index.
    ///
    /// # Errors
    /// [`ShapeError::VertexCounts`] if the shapes have different numbers of vertices.
    pub fn same_vertices(source: &Shape, target: &Shape) -> Result<Self, ShapeError> {
        let (count, target_count) = (source.file_count(), target.file_count());
        if count != target_count {
            return Err(ShapeError::VertexCounts {
                source_path: source.path.clone(),
                source_vertices: count,
                target_path: target.path.clone(),
                target_vertices: target_count,
            });
        }
        let both = |number| {
            let pair = [source, target].map(|shape| shape.vertex_of_number(number));
            Some([pair[0]?, pair[1]?])
        };
        Ok(Self {
            pairs: (0..count as u32).filter_map(both).collect(),
            ..Self::default()
        })
    }

    /// So many of the pairs, drawn without replacement; all of them if there are no more.
    #[must_use]
    pub fn drawn(self, count: usize, rng: &mut impl Rng) -> Self {
        if count >= self.pairs.len() {
            return self;
        }
        let chosen = rand::seq::index::sample(rng, self.pairs.len(), count);
        let chosen: Vec<usize> = chosen.into_iter().collect();
        let sure = |&index: &usize| self.confidence.get(index).copied();
        Self {
            pairs: chosen.iter().map(|&index| self.pairs[index]).collect(),
            confidence: chosen.iter().filter_map(sure).collect(),
            notes: self.notes,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::path::Path;

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::geometry::Mesh;

    fn cloud(name: &str, count: usize) -> Shape {
        let vertices = (0..count).map(|i| [i as f64, 0.0, 0.0]).collect();
        Shape::at(Path::new(name), Mesh::new(vertices, Vec::new()))
    }

    #[test]
    fn shared_vertices_need_equal_counts_and_the_message_has_both() {
        let pairs = Correspondences::same_vertices(&cloud("a.ply", 3), &cloud("b.ply", 3));
        assert_eq!(pairs.expect("equal").pairs, [[0, 0], [1, 1], [2, 2]]);
        let refused = Correspondences::same_vertices(&cloud("a.ply", 3), &cloud("b.ply", 4));
        let text = refused.expect_err("unequal").to_string();
        assert!(text.contains("a.ply has 3 vertices, b.ply has 4"), "{text}");
    }

    #[test]
    fn drawing_takes_different_pairs_the_same_for_the_same_seed() {
        let all = Correspondences {
            pairs: (0..1000).map(|i| [i, 2 * i]).collect(),
            confidence: (0..1000).map(|i| i as f32 / 1000.0).collect(),
            ..Correspondences::default()
        };
        let draw = |count, seed| {
            let drawn = all
                .clone()
                .drawn(count, &mut ChaCha8Rng::seed_from_u64(seed));
            let own = |(pair, sure): (&[u32; 2], &f32)| *sure == pair[0] as f32 / 1000.0;
            assert_eq!(drawn.pairs.len(), drawn.confidence.len());
            assert!(drawn.pairs.iter().zip(&drawn.confidence).all(own));
            drawn.pairs
        };
        let drawn = draw(50, 5);
        assert_eq!(HashSet::<_>::from_iter(&drawn).len(), 50);
        assert!(
            drawn
                .iter()
                .all(|pair| pair[1] == 2 * pair[0] && pair[0] < 1000)
        );
        assert_eq!(drawn, draw(50, 5));
        assert_ne!(drawn, draw(50, 6));
        assert_eq!(draw(5000, 5), all.pairs);
    }
}
