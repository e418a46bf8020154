//! STL, binary and ascii: triangles with their corners written out. Equal corners are one vertex, numbered in the
//! order of their first use; the normals of the triangles follow from their corners and are passed over.
//!
//! A file is binary if its length is the one that its count of triangles demands. All solids of an ascii file are one
//! shape, as the groups of an OBJ file are.
//!
//! The crate `stl_io` is not used: of several solids it reads the first alone, it takes a first line `solid` without
//! a name for binary, it passes over triangles beyond a count that is too small, and it names no line.

use std::path::Path;

use super::error::ShapeError;
use super::lines::{lines, shown, vector};
use super::shape::{Shape, file_bytes};
use super::weld::{Weld, has_area};
use crate::geometry::Mesh;

/// The bytes before the first triangle of a binary file: 80 of any text, and the count.
const HEADER: usize = 84;

/// The bytes of a triangle: a normal and three corners as float32, and two bytes of attributes.
const TRIANGLE: usize = 50;

/// Where the corners of a triangle begin, behind its normal.
const CORNERS: usize = 12;

/// Reads the geometry of an STL file.
pub(super) fn read(path: &Path) -> Result<Shape, ShapeError> {
    let bytes = file_bytes(path)?;
    let corners = if is_ascii(&bytes) {
        ascii(path, &bytes)?
    } else {
        binary(path, &bytes)?
    };
    if corners.is_empty() {
        return Err(ShapeError::malformed(
            path,
            "no triangles; check the export",
        ));
    }
    let mut weld = Weld::default();
    let triangles = corners.into_iter();
    let triangles = triangles.map(|corners| corners.map(|place| weld.number(place)));
    let triangles = triangles.filter(has_area).collect();
    Ok(Shape::at(path, Mesh::new(weld.vertices, triangles)))
}

/// How many triangles a binary file claims, and the bytes that it then has.
fn claimed(bytes: &[u8]) -> Option<(u32, u64)> {
    let count = *bytes.get(HEADER - 4..)?.first_chunk()?;
    let count = u32::from_le_bytes(count);
    Some((count, (HEADER as u64) + u64::from(count) * TRIANGLE as u64))
}

/// Text that begins with `solid`. Binary files may begin so too, but have the length of their count, or zeros among
/// their first bytes.
fn is_ascii(bytes: &[u8]) -> bool {
    let fits = claimed(bytes).is_some_and(|(_, length)| length == bytes.len() as u64);
    let start = &bytes[..bytes.len().min(512)];
    let word = start.trim_ascii_start().first_chunk::<5>();
    !fits && !start.contains(&0) && word.is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

fn binary(path: &Path, bytes: &[u8]) -> Result<Vec<[[f64; 3]; 3]>, ShapeError> {
    let found = bytes.len() as u64;
    match claimed(bytes) {
        Some((_, length)) if length == found => {}
        Some((count, length)) => {
            let problem = format!(
                "its header claims {count} triangles, {length} bytes, but it has {found}: it is truncated, or not \
                 an STL file"
            );
            return Err(ShapeError::malformed(path, problem));
        }
        None => {
            let problem = format!(
                "{found} bytes: neither \"solid\" nor the {HEADER} bytes before the first triangle: not an STL file"
            );
            return Err(ShapeError::malformed(path, problem));
        }
    }
    let triangles = bytes[HEADER..].as_chunks::<TRIANGLE>().0.iter();
    let corners = triangles.map(|triangle| {
        [0, 1, 2].map(|corner| {
            [0, 1, 2].map(|axis| {
                let at = CORNERS + 12 * corner + 4 * axis;
                let number = [0, 1, 2, 3].map(|byte| triangle[at + byte]);
                f64::from(f32::from_le_bytes(number))
            })
        })
    });
    Ok(corners.collect())
}

fn ascii(path: &Path, bytes: &[u8]) -> Result<Vec<[[f64; 3]; 3]>, ShapeError> {
    let mut triangles = Vec::new();
    // The corners of the facet that is open.
    let mut facet: Option<Vec<[f64; 3]>> = None;
    let mut in_solid = false;
    for (at, line) in lines(bytes) {
        let wrong = |problem: String| Err(ShapeError::line(path, at, problem));
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match (words[0].to_ascii_lowercase().as_str(), &mut facet) {
            ("solid", None) => in_solid = true,
            ("endsolid", None) => in_solid = false,
            ("facet", None) => facet = Some(Vec::with_capacity(3)),
            ("outer" | "endloop", Some(_)) => {}
            ("vertex", Some(corners)) => corners.push(vector(path, at, &words[1..])?),
            ("endfacet", Some(corners)) => {
                let Ok(corners) = <[[f64; 3]; 3]>::try_from(corners.as_slice()) else {
                    return wrong(format!("a facet of {} vertices, 3 needed", corners.len()));
                };
                triangles.push(corners);
                facet = None;
            }
            (_, Some(_)) => {
                let allowed = "allowed within a facet: outer loop, vertex, endloop, endfacet";
                return wrong(format!("{:?} ({allowed})", shown(&line)));
            }
            (_, None) => {
                let allowed = "allowed between facets: facet, endsolid, solid";
                return wrong(format!("{:?} ({allowed})", shown(&line)));
            }
        }
    }
    if facet.is_some() || in_solid {
        let missing = if facet.is_some() {
            "endfacet"
        } else {
            "endsolid"
        };
        let count = triangles.len();
        let problem = format!("it ends after {count} triangles without {missing}: it is truncated");
        return Err(ShapeError::malformed(path, problem));
    }
    Ok(triangles)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::formats::malformed::written;

    /// Two triangles of a square, as MeshLab writes them.
    pub(crate) const SQUARE: &str = "\
solid vcg\n  facet normal 0.000000e+00 0.000000e+00 1.000000e+00\n    outer loop\n\
      vertex  0.000000e+00 0.000000e+00 0.000000e+00\n      vertex  1.000000e+00 0.000000e+00 0.000000e+00\n\
      vertex  1.000000e+00 1.000000e+00 0.000000e+00\n    endloop\n  endfacet\n\
  facet normal 0.000000e+00 0.000000e+00 1.000000e+00\n    outer loop\n\
      vertex  0.000000e+00 0.000000e+00 0.000000e+00\n      vertex  1.000000e+00 1.000000e+00 0.000000e+00\n\
      vertex  -0.000000e+00 1.000000e+00 0.000000e+00\n    endloop\n  endfacet\nendsolid vcg\n";

    /// The same in binary, under a header that begins with the given text, as some programs write it.
    pub(crate) fn binary_square(header: &str) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        bytes.resize(80, 0);
        bytes.extend(2u32.to_le_bytes());
        let places: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        for corners in [[0, 1, 2], [0, 2, 3]] {
            bytes.extend([0.0f32, 0.0, 1.0].into_iter().flat_map(f32::to_le_bytes));
            let corners = corners.into_iter().flat_map(|corner: usize| places[corner]);
            bytes.extend(corners.flat_map(f32::to_le_bytes));
            bytes.extend([0; 2]);
        }
        bytes
    }

    fn read(bytes: &[u8]) -> Result<Shape, ShapeError> {
        written("square.STL", bytes, crate::formats::read)
    }

    fn message(text: &str) -> String {
        read(text.as_bytes()).expect_err("refused").to_string()
    }

    fn is_square(shape: &Shape) {
        let mesh = &shape.mesh;
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.vertices[2..], [[1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!((mesh.vertices.len(), mesh.area()), (4, 1.0));
    }

    #[test]
    fn equal_corners_are_one_vertex_in_ascii_and_binary() {
        is_square(&read(SQUARE.as_bytes()).expect("ascii"));
        is_square(
            &read(SQUARE.to_uppercase().replace('\n', "\r\n").as_bytes()).expect("upper case"),
        );
        is_square(&read(&binary_square("made by hand")).expect("binary"));
        // What SolidWorks and others write, and a header of spaces.
        is_square(&read(&binary_square("solid part")).expect("binary"));
        is_square(&read(&binary_square(&format!("{:80}", "solid"))).expect("binary"));
    }

    #[test]
    fn all_solids_of_a_file_are_one_shape_named_or_not() {
        let second = SQUARE.replace("0.000000e+00\n", "3.5\n").replace("vcg", "");
        let shape = read(format!("{SQUARE}\n{second}").as_bytes()).expect("read");
        assert_eq!(
            (shape.mesh.vertices.len(), shape.mesh.triangles.len()),
            (8, 4)
        );
        assert_eq!(shape.mesh.vertices[7], [0.0, 1.0, 3.5]);
    }

    #[test]
    fn double_precision_of_the_text_is_kept_and_flat_triangles_go() {
        let text = SQUARE.replace("1.000000e+00 1.000000e+00", "500000.123456 1");
        let shape = read(text.as_bytes()).expect("read");
        assert_eq!(shape.mesh.vertices[2][0], 500_000.123_456);
        let flat = SQUARE.replacen("1.000000e+00 1.000000e+00", "1.0 0.0", 1);
        assert_eq!(read(flat.as_bytes()).expect("read").mesh.triangles.len(), 1);
    }

    #[test]
    fn wrong_counts_and_truncated_files_are_refused() {
        for (count, cut) in [(3u32, 0), (1, 0), (u32::MAX, 0), (2, 1), (2, 50)] {
            let mut bytes = binary_square("made by hand");
            bytes[80..84].copy_from_slice(&count.to_le_bytes());
            bytes.truncate(bytes.len() - cut);
            let text = read(&bytes).expect_err("refused").to_string();
            assert!(
                text.contains(&format!("claims {count} triangles")),
                "{text}"
            );
            assert!(text.contains(&format!("it has {}", 184 - cut)), "{text}");
        }
        assert!(
            read(&[7; 40])
                .expect_err("refused")
                .to_string()
                .contains("40 bytes")
        );
        let cut = message(&SQUARE[..SQUARE.len() - 14]);
        assert!(cut.contains("after 2 triangles without endsolid"), "{cut}");
        assert!(
            message(&SQUARE[..SQUARE.find("    endloop").expect("one")])
                .contains("without endfacet")
        );
    }

    #[test]
    fn malformed_lines_are_named() {
        let with = |from: &str, to: &str| message(&SQUARE.replacen(from, to, 1));
        assert!(with("1.000000e+00 0.0", "one 0.0").contains("STL:5: \"one\" is not a number"));
        assert!(with("vertex", "vertexes").contains("STL:4: \"vertexes"));
        assert!(with("    endloop\n  endfacet", "    endloop").contains("STL:8: \"facet normal"));
        let two = with("      vertex  1.000000e+00 0.000000e+00 0.000000e+00\n", "");
        assert!(
            two.contains("STL:7: a facet of 2 vertices, 3 needed"),
            "{two}"
        );
        assert!(with(" 1.000000e+00 0.000000e+00\n    endloop", "\n").contains("1 coordinates, 3"));
        assert!(with("1.000000e+00 0.000000e+00 0", "inf 0 0").contains("vertex 1 is at [inf"));
        assert!(message("solid\nendsolid\n").contains("no triangles"));
    }
}
