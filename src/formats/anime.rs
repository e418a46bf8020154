//! Sequences of frames of one mesh: the `.anime` layout of DeformingThings4D.
//!
//! Little-endian and without a header: int32 frames, int32 vertices, int32 triangles; float32
//! vertices of frame 0; int32 triangles; float32 offsets of each later frame from frame 0. Every
//! frame has the same vertices in the same order.

use std::path::{Path, PathBuf};

use super::error::ShapeError;
use super::shape::{Shape, file_length};
use crate::geometry::Mesh;

/// Bytes before the vertices.
const HEADER: usize = 12;

/// Frames of one mesh, vertex by vertex.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sequence {
    /// Where it was read from.
    pub path: PathBuf,
    /// The vertices of each frame, all in the same order.
    pub frames: Vec<Vec<[f32; 3]>>,
    /// The triangles of every frame.
    pub triangles: Vec<[u32; 3]>,
}

impl Sequence {
    /// Reads all frames.
    ///
    /// # Errors
    /// One line: the file cannot be read, its length is not what its counts claim (checked before
    /// anything is allocated), a coordinate is not finite, a triangle refers to a vertex that does
    /// not exist.
    pub(crate) fn read(path: &Path) -> Result<Self, ShapeError> {
        let length = file_length(path)?;
        let malformed = |problem: String| ShapeError::malformed(path, problem);
        let unreadable = |reason| ShapeError::Unreadable {
            path: path.to_owned(),
            reason,
        };
        let mut file = std::fs::File::open(path).map_err(unreadable)?;
        let mut header = [0; HEADER];
        if length < HEADER as u64 {
            return Err(malformed(format!(
                "{length} bytes, at least {HEADER} needed"
            )));
        }
        std::io::Read::read_exact(&mut file, &mut header).map_err(unreadable)?;
        let [frames, vertices, triangles] = counts(&header).map_err(malformed)?;
        // Up to 12 * 2^62: u128 cannot overflow.
        let rows = frames as u128 * vertices as u128 + triangles as u128;
        let expected = HEADER as u128 + 12 * rows;
        if expected != u128::from(length) {
            return Err(malformed(format!(
                "{length} bytes, but {frames} frames of {vertices} vertices and {triangles} \
                 triangles take {expected}"
            )));
        }
        let mut payload = Vec::with_capacity(length as usize - HEADER);
        std::io::Read::read_to_end(&mut file, &mut payload).map_err(unreadable)?;
        let (rows, rest) = payload.as_chunks::<12>();
        if !rest.is_empty() || rows.len() as u128 * 12 + HEADER as u128 != expected {
            return Err(malformed("the file changed while it was read".to_owned()));
        }
        let triangles = parse_triangles(path, &rows[vertices..vertices + triangles], vertices)?;
        let frames = parse_frames(path, rows, vertices, triangles.len())?;
        Ok(Self {
            path: path.to_owned(),
            frames,
            triangles,
        })
    }

    /// One frame as a shape.
    ///
    /// # Errors
    /// [`ShapeError::Frame`] if there is no such frame, and what [`super::read`] refuses in any
    /// shape.
    pub(crate) fn shape(&self, frame: usize) -> Result<Shape, ShapeError> {
        let Some(vertices) = self.frames.get(frame) else {
            let last = self.frames.len() - 1;
            return Err(ShapeError::Frame {
                path: self.path.clone(),
                frame,
                last,
            });
        };
        Shape::at(&self.path, Mesh::of_points(vertices, &self.triangles)).checked()
    }
}

/// The numbers of frames, vertices and triangles, or which of them is impossible.
fn counts(header: &[u8; HEADER]) -> Result<[usize; 3], String> {
    let mut counts = [0; 3];
    let names = ["frames", "vertices", "triangles"];
    for ((count, name), bytes) in counts.iter_mut().zip(names).zip(header.as_chunks::<4>().0) {
        let claimed = i32::from_le_bytes(*bytes);
        *count = usize::try_from(claimed)
            .ok()
            .filter(|&count| count > 0)
            .ok_or_else(|| format!("the header claims {claimed} {name}: must be 1 or more"))?;
    }
    Ok(counts)
}

/// Rows of three int32 as triangles.
fn parse_triangles(
    path: &Path,
    rows: &[[u8; 12]],
    vertices: usize,
) -> Result<Vec<[u32; 3]>, ShapeError> {
    let mut triangles = Vec::with_capacity(rows.len());
    for (face, row) in rows.iter().enumerate() {
        let mut triangle = [0; 3];
        for (corner, bytes) in triangle.iter_mut().zip(row.as_chunks::<4>().0) {
            let index = i32::from_le_bytes(*bytes);
            *corner = u32::try_from(index)
                .ok()
                .filter(|&index| (index as usize) < vertices)
                .ok_or_else(|| ShapeError::IndexOutOfRange {
                    path: path.to_owned(),
                    face,
                    index: index.into(),
                    vertices,
                    base: "",
                })?;
        }
        triangles.push(triangle);
    }
    Ok(triangles)
}

/// Rows of three float32 as frames, offsets added to frame 0.
fn parse_frames(
    path: &Path,
    rows: &[[u8; 12]],
    vertices: usize,
    triangles: usize,
) -> Result<Vec<Vec<[f32; 3]>>, ShapeError> {
    let position = |row: &[u8; 12]| {
        let parts = row.as_chunks::<4>().0;
        [0, 1, 2].map(|axis| f32::from_le_bytes(parts[axis]))
    };
    let first: Vec<[f32; 3]> = rows[..vertices].iter().map(position).collect();
    let offsets = rows[vertices + triangles..].chunks_exact(vertices);
    let moved = offsets.map(|rows| {
        let pairs = first.iter().zip(rows.iter().map(position));
        pairs
            .map(|(at, by)| [0, 1, 2].map(|axis| at[axis] + by[axis]))
            .collect::<Vec<_>>()
    });
    let frames: Vec<Vec<[f32; 3]>> = std::iter::once(first.clone()).chain(moved).collect();
    for (frame, positions) in frames.iter().enumerate() {
        let infinite = |vertex: &[f32; 3]| vertex.iter().any(|coordinate| !coordinate.is_finite());
        if let Some(vertex) = positions.iter().position(infinite) {
            let value = positions[vertex];
            let problem = format!(
                "frame {frame}, vertex {vertex} is at {value:?}: coordinates must be finite numbers"
            );
            return Err(ShapeError::malformed(path, problem));
        }
    }
    Ok(frames)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geometry::testing::tetrahedron;

    /// A tetrahedron in two frames, the second moved by (0, 0, 0.5).
    pub(crate) fn two_frames() -> Vec<u8> {
        let Mesh {
            vertices,
            triangles,
            ..
        } = tetrahedron(0.0);
        let mut bytes = Vec::new();
        for count in [2, vertices.len() as i32, triangles.len() as i32] {
            bytes.extend(count.to_le_bytes());
        }
        bytes.extend(
            vertices
                .iter()
                .flatten()
                .flat_map(|&x| (x as f32).to_le_bytes()),
        );
        bytes.extend(
            triangles
                .iter()
                .flatten()
                .flat_map(|index| index.to_le_bytes()),
        );
        let offset = [0.0f32, 0.0, 0.5].map(f32::to_le_bytes).concat();
        bytes.extend(offset.repeat(vertices.len()));
        bytes
    }

    pub(crate) fn read_bytes(bytes: &[u8]) -> Result<Sequence, ShapeError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("move.anime");
        std::fs::write(&path, bytes).expect("written");
        Sequence::read(&path)
    }

    fn message(bytes: &[u8]) -> String {
        read_bytes(bytes).expect_err("refused").to_string()
    }

    #[test]
    fn frames_are_offsets_from_the_first() {
        let sequence = read_bytes(&two_frames()).expect("read");
        assert_eq!(sequence.frames.len(), 2);
        let shape = sequence.shape(1).expect("a frame");
        assert_eq!(shape.mesh.vertices[3], [0.0, 0.0, 1.5]);
        assert_eq!(shape.mesh.triangles, tetrahedron(0.0).triangles);
        let refused = sequence.shape(2).expect_err("no such frame").to_string();
        assert!(
            refused.contains("frame 2 (the sequence has frames 0 to 1)"),
            "{refused}"
        );
    }

    #[test]
    fn counts_that_do_not_fit_the_file_are_refused() {
        let whole = two_frames();
        assert!(message(&whole[..whole.len() - 1]).contains("2 frames of 4 vertices"));
        assert!(message(&whole[..7]).contains("7 bytes, at least 12"));
        assert!(message(&whole[..HEADER]).contains("12 bytes, but 2 frames"));
        let mut huge = whole.clone();
        huge[4..8].copy_from_slice(&i32::MAX.to_le_bytes());
        huge[0..4].copy_from_slice(&i32::MAX.to_le_bytes());
        assert!(message(&huge).contains("2147483647 frames of 2147483647 vertices"));
        for (at, claimed, name) in [(8, -4, "triangles"), (4, 0, "vertices"), (0, 0, "frames")] {
            let mut wrong = whole.clone();
            wrong[at..at + 4].copy_from_slice(&i32::to_le_bytes(claimed));
            let expected = format!("claims {claimed} {name}: must be 1 or more");
            assert!(message(&wrong).contains(&expected), "{expected}");
        }
    }

    #[test]
    fn a_bad_index_and_a_bad_coordinate_are_named() {
        // The tetrahedron has the vertices 0 to 3.
        for index in [-1, 4] {
            let mut bytes = two_frames();
            bytes[HEADER + 4 * 12..][..4].copy_from_slice(&i32::to_le_bytes(index));
            let expected = format!("face 0 refers to vertex {index}");
            assert!(message(&bytes).contains(&expected), "{index}");
        }
        let mut bytes = two_frames();
        let last = bytes.len() - 4;
        bytes[last..].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(message(&bytes).contains("frame 1, vertex 3"));
    }
}
