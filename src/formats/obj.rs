//! Wavefront OBJ: `v` lines as vertices, `f` lines as polygons; groups, materials and texture
//! coordinates are passed over, so a file of many groups is one shape.
//!
//! The coordinates and normals are read here, line by line: tobj numbers vertices anew by their first
//! use in each group and drops those that no face uses, while correspondences and the carried mesh need
//! the file's own order; it also names no line in its errors, and refuses weights, comments and partial
//! colours after coordinates. The faces are tobj's to read: each vertex goes in with its number as its
//! position, so that the corners come back in the file's own numbers.
//!
//! A line that ends in a backslash goes on in the next one.

use std::borrow::Cow;
use std::path::Path;

use super::error::ShapeError;
use super::lines::{number_of, plain_text, shown};
use super::polygons;
use super::shape::{Shape, file_bytes};
use crate::geometry::Mesh;
use crate::geometry::linear::unit;

/// How OBJ counts, for messages.
const BASE: &str = " up to that line, counted from 1, or back from -1";

/// One corner of a face: positions in the file's lists of `v`, `vt` and `vn`, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Corner {
    /// Its vertex.
    pub vertex: u32,
    /// Its normal, if the face names one.
    pub normal: Option<u32>,
}

/// How many `v` and `vn` lines came before a line: what its negative indices count back from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counts {
    /// Lines of vertices.
    pub vertices: usize,
    /// Lines of normals.
    pub normals: usize,
}

/// The text of a file as it is read: one line for each statement, as many lines as in the file.
pub(super) fn text<'a>(path: &Path, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>, ShapeError> {
    let text = plain_text(path, bytes)?;
    let goes_on = |text: &[u8]| {
        let lines = text.split(|&byte| byte == b'\n');
        lines
            .into_iter()
            .any(|line| line.trim_ascii_end().ends_with(b"\\"))
    };
    if !goes_on(&text) {
        return Ok(text);
    }
    let mut joined = Vec::with_capacity(text.len());
    let mut owed = 0;
    for line in text.split_inclusive(|&byte| byte == b'\n') {
        let content = line.trim_ascii_end();
        // Not in a comment, which ends with its line.
        match content.strip_suffix(b"\\") {
            Some(begun) if !begun.contains(&b'#') => {
                joined.extend_from_slice(begun);
                joined.push(b' ');
                owed += 1;
            }
            _ => {
                joined.extend_from_slice(line);
                // So that the lines after it keep their numbers.
                joined.extend(std::iter::repeat_n(b'\n', std::mem::take(&mut owed)));
            }
        }
    }
    Ok(Cow::Owned(joined))
}

/// The lines of a file as keyword and the rest, without the comment.
pub(super) fn statements(bytes: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    bytes.split(|&byte| byte == b'\n').map(|line| {
        let end = line
            .iter()
            .position(|&byte| byte == b'#')
            .unwrap_or(line.len());
        let line = line[..end].trim_ascii();
        let keyword = line
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(line.len());
        line.split_at(keyword)
    })
}

/// The words of a statement; not UTF-8 shows as replacement characters and will not parse.
pub(super) fn words(rest: &[u8]) -> impl Iterator<Item = Cow<'_, str>> {
    let words = rest
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty());
    words.map(String::from_utf8_lossy)
}

/// Reads the geometry of an OBJ file.
pub(super) fn read(path: &Path) -> Result<Shape, ShapeError> {
    let bytes = file_bytes(path)?;
    let bytes = text(path, &bytes)?;
    let mut vertices = Vec::new();
    let mut vertex_normals = Vec::new();
    let mut polygons = Polygons::default();
    for (at, (keyword, rest)) in statements(&bytes).enumerate() {
        let here = |problem| ShapeError::line(path, at + 1, problem);
        match keyword {
            b"v" => vertices.push(parse_vector(rest).map_err(here)?),
            b"vn" => vertex_normals.push(unit(parse_vector(rest).map_err(here)?)),
            b"f" => {
                let counts = Counts {
                    vertices: vertices.len(),
                    normals: vertex_normals.len(),
                };
                polygons.push(rest, counts).map_err(here)?;
            }
            // No keyword is anything else; a file of another kind, or in another encoding, would lose lines in silence.
            other if !other.is_ascii() => {
                let shown = shown(&String::from_utf8_lossy(other));
                return Err(here(format!("{shown:?} is no keyword of OBJ")));
            }
            _ => {}
        }
    }
    if vertices.is_empty() {
        return Err(ShapeError::malformed(
            path,
            "no vertices (lines \"v x y z\"): not an OBJ file",
        ));
    }
    if let Some((face, index)) = polygons.beyond(vertices.len()) {
        let path = path.to_owned();
        // As the file gives it: counted from 1.
        let (index, vertices) = (i64::from(index) + 1, vertices.len());
        let base = ", counted from 1";
        return Err(ShapeError::IndexOutOfRange {
            path,
            face,
            index,
            vertices,
            base,
        });
    }
    let triangles = polygons
        .triangulated(&vertices)
        .map_err(|error| ShapeError::malformed(path, format!("its faces: {error}")))?;
    let normals = if triangles.is_empty() {
        // Without faces nothing else says which vertex a normal belongs to.
        (vertex_normals.len() == vertices.len()).then_some(vertex_normals)
    } else {
        polygons.normals_of_vertices(&vertex_normals, &triangles, vertices.len())
    };
    let mesh = Mesh {
        vertices,
        triangles,
        normals,
    };
    Ok(Shape::at(path, mesh))
}

/// The first three numbers of a line; what follows (weight, colour) is passed over.
fn parse_vector(rest: &[u8]) -> Result<[f64; 3], String> {
    let mut vector = [0.0; 3];
    let mut words = words(rest);
    for (axis, coordinate) in vector.iter_mut().enumerate() {
        let word = words
            .next()
            .ok_or_else(|| format!("{axis} coordinates, 3 needed"))?;
        *coordinate = number_of(&word)?;
    }
    Ok(vector)
}

/// Reads one corner `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative indices count back from the last
/// line before this one.
pub(super) fn parse_corner(word: &str, counts: Counts) -> Result<Corner, String> {
    let mut parts = word.split('/');
    let vertex = parts.next().unwrap_or_default();
    let normal = parts.nth(1).filter(|part| !part.is_empty());
    Ok(Corner {
        vertex: parse_index(vertex, counts.vertices, word)?,
        normal: normal
            .map(|part| parse_index(part, counts.normals, word))
            .transpose()?,
    })
}

/// An index counted from 1, or back from -1, as an index counted from 0.
fn parse_index(part: &str, count: usize, word: &str) -> Result<u32, String> {
    let index: i64 = part
        .parse()
        .map_err(|_unparsed| format!("{word:?} is not a corner of a face"))?;
    let from_zero = if index < 0 {
        index.checked_add_unsigned(count as u64)
    } else {
        Some(index - 1)
    };
    let found = from_zero.and_then(|index| u32::try_from(index).ok());
    found.ok_or_else(|| format!("face refers to {index} (the file has {count}{BASE})"))
}

/// What the `f` lines say.
#[derive(Default)]
struct Polygons {
    /// The faces again, with all corners counted from 1: what tobj reads.
    text: String,
    /// `[face, vertex]` with the greatest vertex.
    greatest: Option<(usize, u32)>,
    faces: usize,
    /// `(vertex, normal)` of every corner that names a normal.
    normals: Vec<(u32, u32)>,
}

impl Polygons {
    fn push(&mut self, rest: &[u8], counts: Counts) -> Result<(), String> {
        let mut corners = Vec::with_capacity(4);
        for word in words(rest) {
            let corner = parse_corner(&word, counts)?;
            if self
                .greatest
                .is_none_or(|(_, vertex)| vertex < corner.vertex)
            {
                self.greatest = Some((self.faces, corner.vertex));
            }
            self.normals
                .extend(corner.normal.map(|normal| (corner.vertex, normal)));
            corners.push(corner.vertex);
        }
        if corners.len() >= 3 {
            self.text.push('f');
            for vertex in corners {
                self.text.push_str(&format!(" {}", u64::from(vertex) + 1));
            }
            self.text.push('\n');
        }
        self.faces += 1;
        Ok(())
    }

    /// The polygons as triangles of the file's own vertex numbers.
    fn triangulated(&self, vertices: &[[f64; 3]]) -> Result<Vec<[u32; 3]>, tobj::LoadError> {
        if self.text.is_empty() {
            return Ok(Vec::new());
        }
        let mut numbered: String = (0..vertices.len())
            .map(|k| format!("v {k} 0 0\n"))
            .collect();
        numbered.push_str(&self.text);
        let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
        let options = tobj::LoadOptions::default();
        let (models, _) = tobj::load_obj_buf(&mut numbered.as_bytes(), &options, no_materials)?;
        let mut polygons = polygons::Polygons::default();
        for tobj::Mesh {
            positions,
            indices,
            face_arities,
            ..
        } in models.iter().map(|model| &model.mesh)
        {
            let numbers = indices.iter().map(|&k| positions[3 * k as usize] as u32);
            let numbers: Vec<u32> = numbers.collect();
            let mut rest = &numbers[..];
            // None are given where all faces are triangles.
            let mut arities = face_arities.iter().map(|&arity| arity as usize);
            while !rest.is_empty() {
                let (face, after) = rest.split_at(arities.next().unwrap_or(3));
                polygons.push(face);
                rest = after;
            }
        }
        Ok(polygons.triangles(vertices))
    }

    /// The face and vertex, if any, beyond this count: known only once all `v` lines are read.
    fn beyond(&self, vertices: usize) -> Option<(usize, u32)> {
        self.greatest
            .filter(|&(_, vertex)| vertex as usize >= vertices)
    }

    /// One normal per vertex, if every vertex in a face has exactly one.
    fn normals_of_vertices(
        &self,
        list: &[[f32; 3]],
        triangles: &[[u32; 3]],
        vertices: usize,
    ) -> Option<Vec<[f32; 3]>> {
        let mut found = vec![None; vertices];
        for &(vertex, normal) in &self.normals {
            let normal = list.get(normal as usize)?;
            if found[vertex as usize]
                .replace(normal)
                .is_some_and(|other| other != normal)
            {
                return None;
            }
        }
        let used = triangles.iter().flatten();
        if used
            .into_iter()
            .any(|&vertex| found[vertex as usize].is_none())
        {
            return None;
        }
        Some(
            found
                .into_iter()
                .map(|normal| normal.copied().unwrap_or_default())
                .collect(),
        )
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::formats;

    /// Two groups, a quad and a pentagon, negative indices, a comment, an unused vertex first.
    pub(crate) const HOUSE: &str = "\
# a house\nmtllib none.mtl\nv 9 9 9 # unused\nv 0 0 0 1.0\nv 1 0 0 0.5 0.5 0.5\r\nv 1 1 0\nv 0 1 0\n\
vt 0 0\nvn 0 0 2\ng wall\nusemtl stone\nf 2/1/1 3/1/1 4/1/1 5/1/1\ng gable\n\
v 0 1 1\nv .5 1 1.5e0\nv 1 1 1\nf -5//1 -4//1 -1 -2 -3\n";

    pub(crate) fn read_text(text: &str) -> Result<Shape, ShapeError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("house.OBJ");
        std::fs::write(&path, text).expect("written");
        formats::read(&path)
    }

    fn message(text: &str) -> String {
        read_text(text).expect_err("refused").to_string()
    }

    #[test]
    fn groups_become_one_shape_in_the_order_of_the_file() {
        let house = read_text(HOUSE).expect("read");
        assert_eq!(house.mesh.vertices.len(), 8);
        assert_eq!(house.mesh.vertices[0], [9.0; 3]);
        assert_eq!(house.mesh.vertices[6], [0.5, 1.0, 1.5]);
        let expected = [[1, 2, 3], [1, 3, 4], [3, 4, 7], [3, 7, 6], [3, 6, 5]];
        assert_eq!(house.mesh.triangles, expected);
        assert_eq!(house.mesh.normals, None, "not every vertex has one");
    }

    #[test]
    fn the_triangles_are_where_tobj_puts_them() {
        let options = tobj::LoadOptions {
            triangulate: true,
            ..Default::default()
        };
        let no_materials = |_: &Path| Ok(Default::default());
        // tobj refuses what the format allows after the coordinates: a weight, a comment, colours
        // of some vertices only.
        let text = ["v 0 0 0", "v 1 0 0", "v 9 9 9"]
            .iter()
            .fold(HOUSE.to_owned(), |text, v| {
                let at = text.find(v).expect("a line of the house");
                let end = at + text[at..].find('\n').expect("lines end");
                format!("{}{v}{}", &text[..at], &text[end..])
            });
        let (models, _) =
            tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials).expect("loaded");
        let mut theirs = Vec::new();
        for mesh in models.iter().map(|model| &model.mesh) {
            for &index in &mesh.indices {
                // tobj keeps float32 here; the house has only exact numbers.
                let at = 3 * index as usize;
                theirs.push([0, 1, 2].map(|axis| mesh.positions[at + axis]));
            }
        }
        let house = read_text(HOUSE).expect("read");
        let ours = house
            .mesh
            .triangles
            .iter()
            .flatten()
            .map(|&index| house.mesh.vertices[index as usize]);
        assert_eq!(ours.collect::<Vec<_>>(), theirs);
    }

    #[test]
    fn normals_are_kept_where_each_vertex_has_one() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 5\nvn 0 0 0\nf 1//1 2//2 3//1\n";
        let normals = read_text(text)
            .expect("read")
            .mesh
            .normals
            .expect("normals");
        assert_eq!(normals, [[0.0, 0.0, 1.0], [0.0; 3], [0.0, 0.0, 1.0]]);
        let two = text.replace("f 1//1 2//2 3//1", "f 1//1 2//2 3//1\nf 1//2 2//2 3//1");
        assert_eq!(read_text(&two).expect("read").mesh.normals, None);
    }

    #[test]
    fn malformed_lines_are_named() {
        assert!(message("v 0 0\n").contains("OBJ:1: 2 coordinates, 3 needed"));
        assert!(message("v 0 0 0\nv 1 x 0\n").contains("OBJ:2: \"x\" is not a number"));
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        assert!(
            message(&format!("{triangle}f 1 2 3.5\n")).contains("OBJ:4: \"3.5\" is not a corner")
        );
        assert!(message(&format!("{triangle}f 1 2 0\n")).contains("OBJ:4: face refers to 0"));
        assert!(message(&format!("{triangle}f 1 2 -4\n")).contains("OBJ:4: face refers to -4"));
        let beyond = message(&format!("{triangle}f 1 2 3\nf 1 2 7\n"));
        assert!(
            beyond.contains("face 1 refers to vertex 7 (the file has 3 vertices"),
            "{beyond}"
        );
        assert!(
            message(&format!("{triangle}f 1 2 3\n").replace("1 0 0", "NaN 0 0"))
                .contains("vertex 1 is at [NaN")
        );
        assert!(message("hello\n").contains("not an OBJ file"));
    }

    #[test]
    fn text_is_read_however_it_is_encoded_and_broken_into_lines() {
        let plain = read_text(HOUSE).expect("read").mesh;
        let joined = HOUSE.replace("v .5 1 1.5e0", "v \\\n .5 1\\\r\n1.5e0");
        let texts = [
            format!("\u{feff}{HOUSE}"),
            HOUSE.replace("\r\n", "\n").replace('\n', "\r"),
            joined.clone(),
        ];
        for text in texts {
            assert_eq!(read_text(&text).expect("read").mesh, plain, "{text:?}");
        }
        // Lines after a joined one keep their numbers.
        assert!(message(&joined.replace("v 1 1 1", "v 1 x 1")).contains("OBJ:18: \"x\""));
        let text = message(&HOUSE.replace("v 0 1 1\n", "\u{ff56} 0 1 1\n"));
        assert!(text.contains("is no keyword of OBJ"), "{text}");
    }

    #[test]
    fn a_polygon_with_a_notch_keeps_its_area() {
        let text = "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 2 3 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nf 1 2 3 4 5 6 7 8\n";
        let mesh = read_text(text).expect("read").mesh;
        assert_eq!((mesh.triangles.len(), mesh.area()), (6, 7.0));
    }
}
