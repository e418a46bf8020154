//! PLY files, written as text and read as text or little-endian binary. The program's own reader has no
//! part in it, so that a mistake there cannot hide itself.

use std::fmt::Write;
use std::path::Path;

use super::mesh::{Mesh, Point};

/// What a file holds: all numbers of its vertices by property, and its triangles.
#[derive(Debug)]
pub(crate) struct Ply {
    pub(crate) properties: Vec<String>,
    /// One row per vertex, one number per property.
    pub(crate) rows: Vec<Vec<f64>>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Ply {
    /// Reads a file whose faces, if any, are triangles and their only property.
    pub(crate) fn read(path: &Path) -> Self {
        let bytes =
            std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let end = b"end_header\n";
        let at = bytes.windows(end.len()).position(|window| window == end);
        let (header, body) = bytes.split_at(at.expect("a header with an end") + end.len());
        let header = std::str::from_utf8(header).expect("a header of text");
        let mut lines = header
            .lines()
            .map(|line| line.split(' ').collect::<Vec<_>>());
        assert_eq!(lines.next(), Some(vec!["ply"]), "{}", path.display());
        let (mut counts, mut properties, mut binary) = ([0, 0], Vec::new(), false);
        let mut types = Vec::new();
        for words in lines {
            match words[..] {
                ["format", format, _] => binary = format == "binary_little_endian",
                ["element", "vertex", count] => counts[0] = count.parse().expect("a count"),
                ["element", "face", count] => counts[1] = count.parse().expect("a count"),
                ["property", "list", "uchar", "int", _] => {}
                ["property", kind, name] => {
                    types.push(kind.to_owned());
                    properties.push(name.to_owned());
                }
                ["comment", ..] | ["end_header"] => {}
                _ => panic!("{}: unknown header line {words:?}", path.display()),
            }
        }
        let mut numbers = Numbers { body, binary };
        let row = |numbers: &mut Numbers| types.iter().map(|kind| numbers.next(kind)).collect();
        let rows = (0..counts[0]).map(|_| row(&mut numbers)).collect();
        let triangles = (0..counts[1]).map(|_| {
            assert_eq!(
                numbers.next("uchar"),
                3.0,
                "{}: not a triangle",
                path.display()
            );
            std::array::from_fn(|_| numbers.next("int") as u32)
        });
        let triangles = triangles.collect();
        assert!(
            numbers.body.trim_ascii().is_empty(),
            "{}: more than it says",
            path.display()
        );
        Self {
            properties,
            rows,
            triangles,
        }
    }

    /// A property of every vertex.
    pub(crate) fn column(&self, name: &str) -> Vec<f64> {
        let at = self.properties.iter().position(|known| known == name);
        let at = at.unwrap_or_else(|| panic!("no property {name} among {:?}", self.properties));
        self.rows.iter().map(|row| row[at]).collect()
    }

    /// Positions and triangles.
    pub(crate) fn mesh(&self) -> Mesh {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.column(axis));
        let vertices = (0..x.len()).map(|k| [x[k], y[k], z[k]]).collect();
        Mesh {
            vertices,
            triangles: self.triangles.clone(),
        }
    }
}

struct Numbers<'a> {
    body: &'a [u8],
    binary: bool,
}

impl Numbers<'_> {
    fn next(&mut self, kind: &str) -> f64 {
        if !self.binary {
            let text = self.body.trim_ascii_start();
            let end = text
                .iter()
                .position(u8::is_ascii_whitespace)
                .unwrap_or(text.len());
            self.body = &text[end..];
            let word = std::str::from_utf8(&text[..end]).expect("text");
            // Different texts may mean the same 32-bit number.
            let number = match kind {
                "float" => word.parse::<f32>().map(f64::from),
                _ => word.parse(),
            };
            return number.unwrap_or_else(|_| panic!("{word:?}: not a number"));
        }
        match kind {
            "uchar" => f64::from(self.take::<1>()[0]),
            "int" => f64::from(i32::from_le_bytes(self.take())),
            "float" => f64::from(f32::from_le_bytes(self.take())),
            "double" => f64::from_bits(u64::from_le_bytes(self.take())),
            _ => panic!("{kind}: not a type that the tests read"),
        }
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (bytes, rest) = self
            .body
            .split_first_chunk()
            .expect("as many bytes as the header says");
        self.body = rest;
        *bytes
    }
}

/// A mesh as text.
pub(crate) fn text(mesh: &Mesh) -> String {
    let rows: Vec<String> = mesh.vertices.iter().map(|x| words(*x)).collect();
    text_of(&["float x", "float y", "float z"], &rows, &mesh.triangles)
}

/// A cloud of points as text.
pub(crate) fn cloud(points: &[Point]) -> String {
    text(&Mesh {
        vertices: points.to_vec(),
        triangles: Vec::new(),
    })
}

/// Vertex rows and triangles as text, with the properties of the vertices as they stand in the header.
pub(crate) fn text_of(properties: &[&str], rows: &[String], triangles: &[[u32; 3]]) -> String {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", rows.len());
    for property in properties {
        writeln!(text, "property {property}").expect("strings take all text");
    }
    if !triangles.is_empty() {
        let face = "property list uchar int vertex_indices";
        writeln!(text, "element face {}\n{face}", triangles.len()).expect("strings take all text");
    }
    text.push_str("end_header\n");
    for row in rows {
        writeln!(text, "{row}").expect("strings take all text");
    }
    for [a, b, c] in triangles {
        writeln!(text, "3 {a} {b} {c}").expect("strings take all text");
    }
    text
}

/// Numbers as the words of a line.
pub(crate) fn words(x: Point) -> String {
    x.map(|part| part.to_string()).join(" ")
}
