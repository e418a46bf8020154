//! Sequences of one mesh whose vertices move, as the files that `evaluate` and `compare` read.

use std::fs;

use super::mesh::{Mesh, Point};
use super::ply;
use super::workplace::Workplace;

/// The frames, all with the same triangles.
#[derive(Clone, Debug)]
pub(crate) struct Sequence(pub(crate) Vec<Mesh>);

impl Sequence {
    /// A mesh that moves along x by `way`, in `frames - 1` even steps.
    pub(crate) fn moving(mesh: &Mesh, way: f64, frames: usize) -> Self {
        let frame = |k: usize| {
            let gone = way * k as f64 / (frames - 1) as f64;
            mesh.clone().map(|x| [x[0] + gone, x[1], x[2]])
        };
        Self((0..frames).map(frame).collect())
    }

    /// The sphere of `Workplace::tiny` from its source, frame 0, to its target, frame 4. Its coordinates
    /// are whole multiples of 1/1024, so that they and their differences are exact in every file.
    pub(crate) fn tiny() -> Self {
        let rounded = |x: Point| x.map(|part| (part * 1024.0).round() / 1024.0);
        Self::moving(&Mesh::sphere(1.0, 3).map(rounded), 1.0, 5)
    }

    /// Every frame with every vertex moved.
    pub(crate) fn map(self, move_to: impl Fn(Point) -> Point) -> Self {
        let frames = self.0.into_iter();
        Self(frames.map(|frame| frame.map(&move_to)).collect())
    }

    /// Writes a folder of PLY meshes; more than ten have names that sort as text in another order.
    pub(crate) fn write_folder(&self, place: &Workplace, name: &str) {
        fs::create_dir_all(place.path(name)).expect("a folder");
        for (k, frame) in self.0.iter().enumerate() {
            place.write(&format!("{name}/frame-{k}.ply"), ply::text(frame));
        }
    }

    /// The bytes of a `.anime` file: counts, the vertices of frame 0, triangles, and the way of every
    /// vertex from frame 0 to each later frame; little-endian, 32 bits each.
    pub(crate) fn anime(&self) -> Vec<u8> {
        let first = &self.0[0];
        let counts = [self.0.len(), first.vertices.len(), first.triangles.len()];
        let mut bytes: Vec<u8> = Vec::new();
        bytes.extend(
            counts
                .iter()
                .flat_map(|count| (*count as i32).to_le_bytes()),
        );
        let float = |part: f64| (part as f32).to_le_bytes();
        bytes.extend(
            first
                .vertices
                .iter()
                .flatten()
                .flat_map(|part| float(*part)),
        );
        bytes.extend(
            first
                .triangles
                .iter()
                .flatten()
                .flat_map(|index| index.to_le_bytes()),
        );
        for frame in &self.0[1..] {
            let parts = frame.vertices.iter().flatten();
            let ways = parts.zip(first.vertices.iter().flatten());
            bytes.extend(ways.flat_map(|(to, from)| float(to - from)));
        }
        bytes
    }
}

#[test]
fn coordinates_of_the_tiny_sequence_are_exact_in_32_bits() {
    for frame in Sequence::tiny().0 {
        let parts = frame.vertices.iter().flatten();
        assert!(parts.clone().all(|part| f64::from(*part as f32) == *part));
        // 3 frames and a header: more than one number is tested.
        assert!(parts.count() == 3 * 258);
    }
}
