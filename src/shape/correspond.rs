//! Pairs of vertices that are known to correspond: from a two-column file, or from a shared vertex
//! order.
//!
//! The file has `source_index,target_index` on each line, vertices counted from 0 in the order of
//! their files. A third number from 0 to 1 may follow, the confidence that `isomorph match` writes. A pair
//! without one has the confidence 1. Spaces around the numbers, empty lines, lines that start with `#` and one
//! line of column names before the first pair are passed over. A vertex may occur more than once.

use std::path::Path;

use rand::Rng;

use crate::formats::{Shape, ShapeError, file_length};

/// Known pairs: indices into the vertices of the source and of the target.
#[derive(Debug, Clone, PartialEq)]
pub struct Correspondences {
    /// `[source vertex, target vertex]` each.
    pub pairs: Vec<[u32; 2]>,
    /// How sure each pair is, 0 to 1; empty where no pair says.
    pub confidence: Vec<f32>,
}

impl Correspondences {
    /// Reads pairs of vertices of `source` and `target` from a CSV file of two columns, or three.
    ///
    /// # Errors
    /// The file and the line, where a line is not two whole numbers or a vertex does not exist;
    /// [`ShapeError::NoCorrespondences`] if it holds no pair at all.
    pub fn read_csv(path: &Path, source: &Shape, target: &Shape) -> Result<Self, ShapeError> {
        file_length(path)?;
        let unreadable = |reason| ShapeError::Unreadable {
            path: path.to_owned(),
            reason,
        };
        let bytes = std::fs::read(path).map_err(unreadable)?;
        Self::parse_csv(&String::from_utf8_lossy(&bytes), path, source, target)
    }

    /// The pairs in the text of such a file; `path` opens the messages.
    ///
    /// # Errors
    /// Those of [`Self::read_csv`], but for the file itself.
    pub(crate) fn parse_csv(
        text: &str,
        path: &Path,
        source: &Shape,
        target: &Shape,
    ) -> Result<Self, ShapeError> {
        let (mut pairs, mut confidence) = (Vec::new(), Vec::new());
        let mut names_allowed = true;
        for (at, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            if std::mem::take(&mut names_allowed) && line.starts_with(char::is_alphabetic) {
                continue;
            }
            let (pair, sure) = parse_pair(line).ok_or_else(|| {
                let shown: String = line.chars().take(60).collect();
                let allowed = "must be source_index,target_index, two whole numbers from 0 (and a \
                               confidence from 0 to 1, if any)";
                ShapeError::line(path, at + 1, format!("{shown:?}: {allowed}"))
            })?;
            for (index, shape) in pair.into_iter().zip([source, target]) {
                if index >= shape.mesh.vertices.len() as u64 {
                    let (count, name) = (shape.mesh.vertices.len(), shape.path.display());
                    let problem = format!(
                        "vertex {index} of {name} does not exist (it has {count}: 0 to {})",
                        count - 1
                    );
                    return Err(ShapeError::line(path, at + 1, problem));
                }
            }
            pairs.push(pair.map(|index| index as u32));
            confidence.push(sure);
        }
        if pairs.is_empty() {
            return Err(ShapeError::NoCorrespondences {
                path: path.to_owned(),
            });
        }
        let said = confidence.iter().any(Option::is_some);
        Ok(Self {
            pairs,
            confidence: if said {
                confidence
                    .into_iter()
                    .map(|sure| sure.unwrap_or(1.0))
                    .collect()
            } else {
                Vec::new()
            },
        })
    }

    /// No pair at all.
    pub(crate) fn none() -> Self {
        Self {
            pairs: Vec::new(),
            confidence: Vec::new(),
        }
    }

    /// Every vertex of the source corresponds to the target's vertex of the same index.
    ///
    /// # Errors
    /// [`ShapeError::VertexCounts`] if the shapes have different numbers of vertices.
    pub fn same_vertices(source: &Shape, target: &Shape) -> Result<Self, ShapeError> {
        if source.mesh.vertices.len() != target.mesh.vertices.len() {
            return Err(ShapeError::VertexCounts {
                source_path: source.path.clone(),
                source_vertices: source.mesh.vertices.len(),
                target_path: target.path.clone(),
                target_vertices: target.mesh.vertices.len(),
            });
        }
        Ok(Self {
            pairs: (0..source.mesh.vertices.len() as u32)
                .map(|index| [index; 2])
                .collect(),
            confidence: Vec::new(),
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
        }
    }
}

/// Two whole numbers separated by a comma, and perhaps a share of 1 after another.
fn parse_pair(line: &str) -> Option<([u64; 2], Option<f32>)> {
    let mut fields = line.split(',').map(str::trim);
    let pair = [fields.next()?.parse().ok()?, fields.next()?.parse().ok()?];
    let mut confidence = None;
    if let Some(given) = fields.next() {
        let given: f32 = given.parse().ok()?;
        confidence = Some((0.0..=1.0).contains(&given).then_some(given)?);
    }
    fields.next().is_none().then_some((pair, confidence))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::path::PathBuf;

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use proptest::prelude::*;

    use super::*;
    use crate::formats::malformed::{damage, read_damaged};
    use crate::geometry::Mesh;

    fn cloud(name: &str, count: usize) -> Shape {
        let vertices = (0..count).map(|i| [i as f64, 0.0, 0.0]).collect();
        Shape {
            path: PathBuf::from(name),
            mesh: Mesh::new(vertices, Vec::new()),
        }
    }

    fn read(text: &str) -> Result<Correspondences, ShapeError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("pairs.csv");
        std::fs::write(&path, text).expect("written");
        Correspondences::read_csv(&path, &cloud("a.ply", 100), &cloud("b.ply", 200))
    }

    fn message(text: &str) -> String {
        read(text).expect_err("refused").to_string()
    }

    #[test]
    fn names_comments_spaces_and_empty_lines_are_passed_over() {
        let text =
            "\u{feff}# made by hand\r\nsource, target\r\n 0 , 199 \r\n\r\n# more\r\n99,0\n0,199";
        assert_eq!(
            read(text).expect("read").pairs,
            [[0, 199], [99, 0], [0, 199]]
        );
    }

    #[test]
    fn a_confidence_may_follow_and_is_checked() {
        let text = "source_index,target_index,confidence\n0,199,0.75\n1,2,1\n3,4\n5,6,0\n";
        let found = read(text).expect("read");
        assert_eq!(found.pairs, [[0, 199], [1, 2], [3, 4], [5, 6]]);
        assert_eq!(found.confidence, [0.75, 1.0, 1.0, 0.0]);
        assert!(read("0,199\n1,2\n").expect("read").confidence.is_empty());
    }

    #[test]
    fn a_line_that_is_no_pair_is_named() {
        for bad in [
            "1",
            "1,2,-0.1",
            "1,2,nan",
            "1,2,0.5,0.5",
            "1,2,",
            "1;2",
            "1,2,3",
            "1,-2",
            "1,2.5",
            "one,two",
            "99999999999999999999,1",
        ] {
            let text = message(&format!("0,0\n{bad}\n"));
            assert!(
                text.contains("pairs.csv:2: ") && text.contains(bad),
                "{text}"
            );
        }
        // Column names are allowed once.
        assert!(message("source,target\nsource,target\n").contains("pairs.csv:2: "));
    }

    #[test]
    fn a_vertex_that_does_not_exist_is_named_with_its_shape_and_count() {
        let text = message("0,0\n\n100,5\n");
        assert!(text.contains("pairs.csv:3: vertex 100 of a.ply"), "{text}");
        assert!(text.contains("it has 100"), "{text}");
        assert!(message("5,200").contains("vertex 200 of b.ply"));
    }

    #[test]
    fn a_file_without_pairs_is_refused() {
        assert!(message("# none\nsource,target\n").contains("at least 1 needed"));
        assert!(message("").contains("empty"));
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

    proptest! {
        #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..Default::default() })]

        #[test]
        fn damaged_correspondences_are_read_or_refused(damage in damage()) {
            let vertices = (0..100).map(|i| [f64::from(i); 3]).collect();
            let path = "shape.ply".into();
            let shape = Shape { path, mesh: Mesh::new(vertices, Vec::new()) };
            let bytes = b"# pairs\nsource,target\n0,1\n 2 , 3\n99,99\n".to_vec();
            let read = |path: &Path| Correspondences::read_csv(path, &shape, &shape);
            let (result, _) = read_damaged("shape.csv", bytes, &damage, read);
            match result {
                Ok(found) => {
                    prop_assert!(!found.pairs.is_empty());
                    prop_assert!(found.pairs.iter().flatten().all(|&index| index < 100));
                }
                Err(error) => prop_assert!(!error.to_string().contains('\n'), "{}", error),
            }
        }
    }
}
