//! OFF, the Object File Format of Geomview, as text: counts, vertices, polygons.
//!
//! The first line is `OFF`, with letters before it for what follows the coordinates of a vertex: `N` a normal, `C` a
//! colour, `ST` texture coordinates. The counts of vertices, faces and edges follow on that line or on the next; that
//! of edges may be missing. Each vertex and each face has a line of its own. Colours are passed over. A `#` begins
//! a comment.

use std::path::Path;

use super::error::ShapeError;
use super::lines::{lines, refuse_utf_16, shown, vector};
use super::polygons::Polygons;
use super::shape::{Shape, file_bytes};
use crate::geometry::Mesh;
use crate::geometry::linear::unit;

/// Reads the geometry of an OFF file.
pub(super) fn read(path: &Path) -> Result<Shape, ShapeError> {
    let bytes = file_bytes(path)?;
    refuse_utf_16(path, &bytes)?;
    let mut lines = Lines {
        path,
        count: bytes.split(|&byte| byte == b'\n').count(),
        lines: Box::new(lines(&bytes)),
    };
    let header = Header::read(&mut lines)?;
    let mut vertices = Vec::new();
    let mut normals = Vec::new();
    for index in 0..header.vertices {
        let (at, line) = lines.next("vertex", index, header.vertices)?;
        let words: Vec<&str> = line.split_whitespace().collect();
        vertices.push(vector(path, at, &words)?);
        if header.with_normals {
            normals.push(unit(vector(path, at, &words[3..])?));
        }
    }
    let mut polygons = Polygons::default();
    for index in 0..header.faces {
        let (at, line) = lines.next("face", index, header.faces)?;
        let corners = corners(path, at, &line, index, header.vertices)?;
        polygons.push(&corners);
    }
    if let Some((at, line)) = lines.content() {
        let Header {
            vertices, faces, ..
        } = header;
        let problem = format!(
            "{:?} comes after the {vertices} vertices and {faces} faces of the counts; correct the counts",
            shown(&line)
        );
        return Err(ShapeError::line(path, at, problem));
    }
    let mesh = Mesh {
        triangles: polygons.triangles(&vertices),
        vertices,
        normals: header.with_normals.then_some(normals),
    };
    Ok(Shape::at(path, mesh))
}

/// The lines of a file without comments.
struct Lines<'a> {
    path: &'a Path,
    /// How many lines the file has, for the place where it ends.
    count: usize,
    lines: Box<dyn Iterator<Item = (usize, std::borrow::Cow<'a, str>)> + 'a>,
}

impl Lines<'_> {
    /// The next line with something on it beside a comment.
    fn content(&mut self) -> Option<(usize, String)> {
        let uncommented = self.lines.by_ref().map(|(at, line)| {
            let text = line.split('#').next().unwrap_or_default().trim();
            (at, text.to_owned())
        });
        uncommented.into_iter().find(|(_, text)| !text.is_empty())
    }

    fn next(&mut self, name: &str, index: usize, of: usize) -> Result<(usize, String), ShapeError> {
        self.content().ok_or_else(|| {
            let problem = format!("the file ends before {name} {index} of {of}: it is truncated");
            ShapeError::line(self.path, self.count, problem)
        })
    }
}

/// What the first lines say.
struct Header {
    vertices: usize,
    faces: usize,
    with_normals: bool,
}

impl Header {
    fn read(lines: &mut Lines) -> Result<Self, ShapeError> {
        let path = lines.path;
        let foreign = || {
            let problem =
                "does not start with OFF, COFF, NOFF or CNOFF: not an OFF file that can be read";
            ShapeError::malformed(path, problem)
        };
        let (mut at, first) = lines.content().ok_or_else(foreign)?;
        // Some files have no space between the word and the counts.
        let word = first.find(|letter: char| letter.is_whitespace() || letter.is_ascii_digit());
        let (word, mut counts) = first.split_at(word.unwrap_or(first.len()));
        let kind = word.strip_suffix("OFF").ok_or_else(foreign)?;
        let (is_binary, kind) = (counts.trim() == "BINARY", kind.replacen("ST", "", 1));
        if is_binary || !["", "C", "N", "CN", "NC"].contains(&kind.as_str()) {
            let problem = format!(
                "{:?}: must be OFF, COFF, NOFF or CNOFF, in text",
                shown(&first)
            );
            return Err(ShapeError::line(path, at, problem));
        }
        let next;
        if counts.trim().is_empty() {
            (at, next) = lines.content().ok_or_else(|| {
                ShapeError::malformed(path, "the file ends before its counts: it is truncated")
            })?;
            counts = &next;
        }
        let numbers: Option<Vec<usize>> = (counts.split_whitespace())
            .map(|word| word.parse().ok())
            .collect();
        match numbers.as_deref() {
            Some(&[vertices, faces] | &[vertices, faces, _]) => Ok(Self {
                vertices,
                faces,
                with_normals: kind.contains('N'),
            }),
            _ => {
                let problem = format!(
                    "{:?}: must be the counts of vertices, faces and edges",
                    shown(counts)
                );
                Err(ShapeError::line(path, at, problem))
            }
        }
    }
}

/// The corners of a face: their number, each of them, and perhaps a colour.
fn corners(
    path: &Path,
    at: usize,
    line: &str,
    face: usize,
    vertices: usize,
) -> Result<Vec<u32>, ShapeError> {
    let mut words = line.split_whitespace();
    let count = words.next().and_then(|word| word.parse::<usize>().ok());
    let whole: Option<Vec<i64>> = words
        .take(count.unwrap_or(0))
        .map(|word| word.parse().ok())
        .collect();
    let whole = whole.filter(|corners| count == Some(corners.len()));
    let whole = whole.ok_or_else(|| {
        let problem = format!(
            "{:?}: must be a number of corners, and so many vertices",
            shown(line)
        );
        ShapeError::line(path, at, problem)
    })?;
    let inside = |index: i64| {
        let found = u32::try_from(index).ok();
        found
            .filter(|&found| (found as usize) < vertices)
            .ok_or_else(|| ShapeError::IndexOutOfRange {
                path: path.to_owned(),
                face,
                index,
                vertices,
                base: ", counted from 0",
            })
    };
    whole.into_iter().map(inside).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::formats::malformed::written;

    /// A pyramid with a quad, comments, and colours on faces as Geomview writes them.
    pub(crate) const PYRAMID: &str = "\
OFF # made by hand\n\n# counts\n5 5 8\n0 0 0\n2 0 0\n2 2e0 0 # a corner\n0 2 0\n1 1 1.5\n\
4  0 3 2 1  255 0 0\n3 0 1 4\n3 1 2 4 0.5 0.5 0.5 1\n3 2 3 4 7\n3 3 0 4\n";

    fn read(text: &str) -> Result<Shape, ShapeError> {
        written("pyramid.off", text.as_bytes(), crate::formats::read)
    }

    fn message(text: &str) -> String {
        read(text).expect_err("refused").to_string()
    }

    #[test]
    fn vertices_and_polygons_come_in_the_order_of_the_file() {
        let mesh = read(PYRAMID).expect("read").mesh;
        assert_eq!(mesh.vertices[4], [1.0, 1.0, 1.5]);
        assert_eq!(mesh.triangles[..3], [[0, 3, 2], [0, 2, 1], [0, 1, 4]]);
        assert_eq!((mesh.triangles.len(), mesh.normals), (6, None));
    }

    #[test]
    fn counts_may_stand_on_the_first_line_and_touch_the_word() {
        for header in [
            "OFF 5 5 8\n",
            "OFF5 5 8\n",
            "OFF\n5 5\n",
            "OFF\r\n5\t5 0\r\n",
        ] {
            let text = PYRAMID.replace("OFF # made by hand\n\n# counts\n5 5 8\n", header);
            let found = read(&text).expect(header).mesh;
            assert_eq!(found, read(PYRAMID).expect("read").mesh, "{header}");
        }
    }

    #[test]
    fn colours_are_passed_over_and_normals_kept() {
        // As MeshLab and CGAL write them.
        let triangle = "0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n3 0 1 2\n";
        let coloured = read(&format!("COFF\n3 1 0\n{triangle}")).expect("read");
        assert_eq!(coloured.mesh.vertices[1], [1.0, 0.0, 0.0]);
        assert_eq!(coloured.mesh.normals, None);
        let with = triangle.replace("255 0 0 255", "0 0 -2 9 9 9");
        let directed = read(&format!("CNOFF\n3 1 0\n{with}")).expect("read");
        assert_eq!(directed.mesh.normals, Some(vec![[0.0, 0.0, -1.0]; 3]));
        let texture = read(&format!("STCOFF\n3 1 0\n{triangle}")).expect("read");
        assert_eq!(texture.mesh.vertices.len(), 3);
    }

    #[test]
    fn malformed_lines_are_named() {
        let with = |from: &str, to: &str| message(&PYRAMID.replacen(from, to, 1));
        assert!(with("OFF", "hello").contains("not an OFF file"));
        assert!(
            with("OFF", "4OFF").contains("not an OFF file")
                || with("OFF", "4OFF").contains("off:1:")
        );
        assert!(with("OFF #", "OFF BINARY #").contains("off:1: \"OFF BINARY\""));
        assert!(with("5 5 8", "5 five").contains("off:4: \"5 five\": must be the counts"));
        assert!(with("5 5 8", "-5 5 8").contains("off:4: "));
        assert!(with("0 0 0", "0 zero 0").contains("off:5: \"zero\" is not a number"));
        assert!(with("0 0 0", "0 0").contains("off:5: 2 coordinates, 3 needed"));
        assert!(
            with("3 0 1 4", "3 0 1").contains("off:11: \"3 0 1\": must be a number of corners")
        );
        assert!(with("3 0 1 4", "3 0 1 5").contains("face 1 refers to vertex 5 (the file has 5"));
        assert!(with("3 0 1 4", "3 0 -1 4").contains("face 1 refers to vertex -1"));
    }

    #[test]
    fn wrong_counts_and_truncated_files_are_refused() {
        let with = |to: &str| message(&PYRAMID.replace("5 5 8", to));
        assert!(
            with("5 4 8").contains("off:14: \"3 3 0 4\" comes after the 5 vertices and 4 faces")
        );
        assert!(with("5 6 8").contains("ends before face 5 of 6: it is truncated"));
        assert!(with("18446744073709551615 5 8").contains("of 18446744073709551615"));
        assert!(with("99999999999999999999 5 8").contains("must be the counts"));
        assert!(message(&PYRAMID[..60]).contains("it is truncated"));
        assert!(message("OFF\n# nothing\n").contains("before its counts"));
    }
}
