//! PLY, ascii and binary of either byte order, meshes and clouds.
//!
//! Read element by element into a row that keeps only `x, y, z`, `nx, ny, nz` and `vertex_indices` (or
//! `vertex_index`); every other element and property is stepped over. The header and binary elements are
//! read by ply-rs. Before the payload is touched, the counts of the header are held against the
//! length of the file: a header cannot make us allocate more than its file could fill.
//!
//! | file | what it does |
//! |---|---|
//! | `head.rs` | the text of the header, however its lines end |
//! | `ascii.rs` | rows of numbers, however they are broken into lines |

mod ascii;
mod head;

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use ply_rs::parser::{ParseError, Parser, Reader};
use ply_rs::ply::{
    ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use self::ascii::AsciiRows;
use self::head::Head;
use super::error::ShapeError;
use super::polygons::Polygons;
use super::shape::{Shape, file_length};
use crate::geometry::Mesh;
use crate::geometry::linear::unit;

/// The names that hold a face's corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The element of Stanford's models that holds triangle strips.
const STRIPS: &str = "tristrips";

/// An opened file whose header is read and found possible.
pub(super) struct PlyFile<'a> {
    path: &'a Path,
    /// The header as the file has it.
    pub header: Header,
    payload: Payload,
}

/// What follows the header.
enum Payload {
    Binary(BufReader<File>),
    Ascii(AsciiRows),
}

impl<'a> PlyFile<'a> {
    /// Opens the file and reads its header.
    ///
    /// # Errors
    /// A file that cannot be read or is empty, a malformed header, or one whose counts need more
    /// bytes than the file has.
    pub(super) fn open(path: &'a Path) -> Result<Self, ShapeError> {
        let length = file_length(path)?;
        let unreadable = |reason| ShapeError::Unreadable {
            path: path.to_owned(),
            reason,
        };
        let file = File::open(path).map_err(unreadable)?;
        let mut reader = BufReader::with_capacity(1 << 16, file);
        let head = Head::read(path, &mut reader)?;
        let mut text = Reader::new(head.text.as_bytes());
        let header = Parser::<Row>::new().read_header(&mut text);
        let header = header.map_err(|error| {
            let problem = format!("header: {}", library_message(&error));
            match error.line() {
                Some(line) => ShapeError::line(path, head.line_in_file(line), problem),
                None => ShapeError::malformed(path, problem),
            }
        })?;
        check_counts(path, &header, length.saturating_sub(head.length))?;
        let payload = match header.encoding {
            Encoding::Ascii => {
                let mut bytes = Vec::new();
                reader.read_to_end(&mut bytes).map_err(unreadable)?;
                Payload::Ascii(AsciiRows::new(&bytes, head.lines + 1, &header))
            }
            _ => Payload::Binary(reader),
        };
        Ok(Self {
            path,
            header,
            payload,
        })
    }

    /// Reads every element in order and hands it over with its definition and index.
    ///
    /// # Errors
    /// A payload that ends early or does not parse, named by element and index, and in ascii files
    /// by line; and what `keep` returns.
    pub(super) fn for_each<E: PropertyAccess>(
        &mut self,
        mut keep: impl FnMut(&ElementDef, usize, E) -> Result<(), ShapeError>,
    ) -> Result<(), ShapeError> {
        let parser = Parser::<E>::new();
        let little = self.header.encoding == Encoding::BinaryLittleEndian;
        for element in self.header.elements.values() {
            for index in 0..element.count {
                let row = match &mut self.payload {
                    Payload::Ascii(rows) => rows.next(self.path, element, index)?,
                    Payload::Binary(bytes) => {
                        let row = if little {
                            parser.read_little_endian_element(bytes, element)
                        } else {
                            parser.read_big_endian_element(bytes, element)
                        };
                        row.map_err(|error| refusal(self.path, element, index, &error))?
                    }
                };
                keep(element, index, row)?;
            }
        }
        match &self.payload {
            Payload::Ascii(rows) => rows.check_end(self.path),
            Payload::Binary(_) => Ok(()),
        }
    }
}

/// What is wrong with one element of a binary file.
fn refusal(path: &Path, element: &ElementDef, index: usize, error: &ParseError) -> ShapeError {
    let (name, count) = (&element.name, element.count);
    let problem = if error.kind() == std::io::ErrorKind::UnexpectedEof {
        format!("the file ends within {name} {index} of {count}: it is truncated")
    } else {
        format!("{name} {index} of {count}: {}", library_message(error))
    };
    ShapeError::malformed(path, problem)
}

/// Reads the geometry of a PLY file.
pub(super) fn read(path: &Path) -> Result<Shape, ShapeError> {
    let mut file = PlyFile::open(path)?;
    let with_normals = check_elements(path, &file.header)?;
    let mut vertices = Vec::new();
    let mut normals = Vec::new();
    let mut polygons = Polygons::default();
    // Faces may come before the vertices, so their range is checked against the header's count.
    let count = file.header.elements["vertex"].count;
    let mut corners = Vec::new();
    file.for_each::<Row>(|element, index, row| {
        match element.name.as_str() {
            "vertex" => {
                vertices.push(row.position);
                if with_normals {
                    normals.push(unit(row.normal));
                }
            }
            name @ ("face" | STRIPS) => {
                let inside = |corner: i64| {
                    let found = u32::try_from(corner).ok();
                    let found = found.filter(|&at| (at as usize) < count);
                    found.ok_or_else(|| ShapeError::IndexOutOfRange {
                        path: path.to_owned(),
                        face: index,
                        index: corner,
                        vertices: count,
                        base: "",
                    })
                };
                // A strip ends at -1, and another begins.
                let ends = |corner: &i64| name == STRIPS && *corner == -1;
                for run in row.corners.split(ends) {
                    corners.clear();
                    for &corner in run {
                        corners.push(inside(corner)?);
                    }
                    match name {
                        STRIPS => polygons.push_strip(&corners),
                        _ => polygons.push(&corners),
                    }
                }
            }
            _ => {}
        }
        Ok(())
    })?;
    let normals = with_normals.then_some(normals);
    let mesh = Mesh {
        triangles: polygons.triangles(&vertices),
        vertices,
        normals,
    };
    Ok(Shape::at(path, mesh))
}

/// Whether the elements are those of a shape; true if its vertices have normals.
fn check_elements(path: &Path, header: &Header) -> Result<bool, ShapeError> {
    let scalar = |element: &ElementDef, name: &str| {
        element
            .properties
            .get(name)
            .is_some_and(|property| matches!(property.data_type, PropertyType::Scalar(_)))
    };
    let Some(vertex) = header.elements.get("vertex") else {
        return Err(ShapeError::malformed(
            path,
            "the header has no element vertex",
        ));
    };
    if let Some(missing) = ["x", "y", "z"]
        .into_iter()
        .find(|name| !scalar(vertex, name))
    {
        return Err(ShapeError::malformed(
            path,
            format!("the vertices have no property {missing}"),
        ));
    }
    for name in ["face", STRIPS] {
        let Some(face) = header.elements.get(name).filter(|face| face.count > 0) else {
            continue;
        };
        let list = |name: &&str| {
            let property = face.properties.get(*name);
            property.is_some_and(|found| matches!(found.data_type, PropertyType::List(..)))
        };
        if !CORNERS.iter().any(list) {
            let problem =
                format!("the element {name} has no property list vertex_indices (or vertex_index)");
            return Err(ShapeError::malformed(path, problem));
        }
    }
    Ok(["nx", "ny", "nz"]
        .into_iter()
        .all(|name| scalar(vertex, name)))
}

/// Refuses counts that the rest of the file cannot hold, before anything is allocated for them.
fn check_counts(path: &Path, header: &Header, length: u64) -> Result<(), ShapeError> {
    let mut needed = 0u128;
    for element in header.elements.values() {
        let least: u128 = match header.encoding {
            // A digit and a separator for each number; the last line may lack its end.
            Encoding::Ascii => 2 * element.properties.len() as u128,
            _ => element
                .properties
                .values()
                .map(|property| least_bytes(&property.data_type))
                .sum(),
        };
        // An element without properties takes no bytes, but must not take forever either.
        needed += element.count as u128 * least.max(1);
        if needed > u128::from(length) + 1 {
            let problem = format!(
                "the header claims {} of element {}, at least {needed} bytes, but {length} \
                 follow: it is truncated or malformed",
                element.count, element.name
            );
            return Err(ShapeError::malformed(path, problem));
        }
    }
    Ok(())
}

/// The least bytes that a binary property takes: of a list, its length.
fn least_bytes(kind: &PropertyType) -> u128 {
    let (PropertyType::Scalar(scalar) | PropertyType::List(scalar, _)) = kind;
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// The library's message in one line: what is wrong, and the text that is. It goes on over several,
/// and names the line, which we do ourselves.
fn library_message(error: &ParseError) -> String {
    let text = error.to_string();
    let text = match error.line() {
        Some(_) => text
            .split_once(": ")
            .map_or(text.as_str(), |(_, message)| message),
        None => &text,
    };
    let mut lines = text.lines();
    let problem = lines.next().unwrap_or_default().trim_end_matches('.');
    match lines
        .next()
        .and_then(|line| line.trim().strip_prefix("String: '"))
    {
        Some(quoted) => {
            let shown: String = quoted
                .trim_end_matches('\'')
                .trim()
                .chars()
                .take(60)
                .collect();
            format!("{problem} {shown:?}")
        }
        None => problem.to_owned(),
    }
}

/// The properties that a shape is made of; all others are dropped as they come.
struct Row {
    position: [f64; 3],
    normal: [f64; 3],
    corners: Vec<i64>,
}

impl Row {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        let (vector, axis) = match name {
            "x" => (&mut self.position, 0),
            "y" => (&mut self.position, 1),
            "z" => (&mut self.position, 2),
            "nx" => (&mut self.normal, 0),
            "ny" => (&mut self.normal, 1),
            "nz" => (&mut self.normal, 2),
            _ => return PropertyAccessResult::Ignored,
        };
        vector[axis] = value;
        PropertyAccessResult::Set
    }

    fn set_corners<T: Into<i64>>(&mut self, name: &str, values: Vec<T>) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.corners = values.into_iter().map(Into::into).collect();
        PropertyAccessResult::Set
    }
}

/// Implements setters that convert a number of each type without loss.
macro_rules! setters {
    ($($scalar:ident $list:ident $kind:ty),*) => {$(
        fn $scalar(&mut self, name: &str, value: $kind) -> PropertyAccessResult {
            self.set(name, value.into())
        }
        fn $list(&mut self, name: &str, values: Vec<$kind>) -> PropertyAccessResult {
            self.set_corners(name, values)
        }
    )*};
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Self {
            position: [0.0; 3],
            normal: [0.0; 3],
            corners: Vec::new(),
        }
    }
    setters!(
        set_char set_list_char i8, set_uchar set_list_uchar u8,
        set_short set_list_short i16, set_ushort set_list_ushort u16,
        set_int set_list_int i32, set_uint set_list_uint u32
    );
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value)
    }
}

#[cfg(test)]
pub(super) mod tests;
