//! Property tests: whatever happens to a file, the readers say Ok or Err, never panic, and never
//! hold more than the file could fill.

use std::path::Path;

use proptest::prelude::*;

use super::{Sequence, Shape, ShapeError};

/// What can happen to a file.
#[derive(Debug, Clone)]
pub(crate) enum Damage {
    Cut(prop::sample::Index),
    Byte(prop::sample::Index, u8),
    Insert(prop::sample::Index, Vec<u8>),
    Remove(prop::sample::Index, usize),
    /// A number of the text becomes another: counts, indices, coordinates.
    Number(prop::sample::Index, String),
}

impl Damage {
    fn apply(&self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        match self {
            Self::Cut(at) => bytes.truncate(at.index(bytes.len())),
            Self::Byte(at, value) => {
                let at = at.index(bytes.len());
                bytes[at] = *value;
            }
            Self::Insert(at, more) => {
                let at = at.index(bytes.len());
                bytes.splice(at..at, more.iter().copied());
            }
            Self::Remove(at, length) => {
                let at = at.index(bytes.len());
                bytes.drain(at..bytes.len().min(at + length));
            }
            Self::Number(which, text) => {
                let digit = |at: &usize| bytes[*at].is_ascii_digit();
                let digits: Vec<usize> = (0..bytes.len()).filter(digit).collect();
                if !digits.is_empty() {
                    let at = digits[which.index(digits.len())];
                    bytes.splice(at..=at, text.bytes());
                }
            }
        }
    }
}

pub(crate) fn damage() -> impl Strategy<Value = Vec<Damage>> {
    let index = any::<prop::sample::Index>;
    let number = prop::sample::select(vec![
        "-1",
        "0",
        "255",
        "4294967295",
        "18446744073709551615",
        "99999999999999999999",
        "1e400",
        "nan",
        "-inf",
        "1e999999999",
        "0x10",
        "",
        " ",
        "\n",
        "1.",
        ".5",
    ]);
    let one = prop_oneof![
        index().prop_map(Damage::Cut),
        (index(), any::<u8>()).prop_map(|(at, value)| Damage::Byte(at, value)),
        (index(), any::<Vec<u8>>()).prop_map(|(at, more)| Damage::Insert(at, more)),
        (index(), 1usize..40).prop_map(|(at, length)| Damage::Remove(at, length)),
        (index(), number).prop_map(|(at, text)| Damage::Number(at, text.to_owned())),
    ];
    prop::collection::vec(one, 1..4)
}

/// How often each reader is tried: `PROPTEST_CASES`, and a thousand times at least.
fn cases() -> u32 {
    ProptestConfig::default().cases.max(1000)
}

/// Writes a file of this name and reads it.
pub(crate) fn written<T>(name: &str, bytes: &[u8], read: impl Fn(&Path) -> T) -> T {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    read(&path)
}

/// Damages a file of this name, reads it, and hands back what came of it with the file's length.
pub(crate) fn read_damaged<T>(
    name: &str,
    mut bytes: Vec<u8>,
    damage: &[Damage],
    read: impl Fn(&Path) -> Result<T, ShapeError>,
) -> (Result<T, ShapeError>, usize) {
    damage.iter().for_each(|damage| damage.apply(&mut bytes));
    (written(name, &bytes, read), bytes.len())
}

/// An error is one line that names the file; a shape is sound and no larger than its file allows.
fn check(result: Result<Shape, ShapeError>, length: usize) -> Result<(), TestCaseError> {
    match result {
        Err(error) => {
            let text = error.to_string();
            prop_assert!(text.contains("shape.") && !text.contains('\n'), "{}", text);
        }
        Ok(shape) => {
            let count = shape.mesh.vertices.len();
            // A vertex takes at least "v 0 0 0", a triangle of a fan at least one index.
            prop_assert!(count <= length && shape.mesh.triangles.len() <= length);
            prop_assert!(shape.mesh.vertices.iter().flatten().all(|x| x.is_finite()));
            prop_assert!(
                shape
                    .mesh
                    .triangles
                    .iter()
                    .flatten()
                    .all(|&at| (at as usize) < count)
            );
            prop_assert!(
                shape
                    .mesh
                    .normals
                    .is_none_or(|normals| normals.len() == count)
            );
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..Default::default() })]

    #[test]
    fn a_damaged_ply_is_read_or_refused(which in 0..3usize, damage in damage()) {
        use super::ply::tests::{Kind, pyramid};
        let bytes = pyramid([Kind::Ascii, Kind::Little, Kind::Big][which]);
        let (result, length) = read_damaged("shape.ply", bytes, &damage, super::read);
        check(result, length)?;
    }

    #[test]
    fn a_damaged_obj_is_read_or_refused(damage in damage()) {
        let bytes = super::obj::tests::HOUSE.as_bytes().to_vec();
        let (result, length) = read_damaged("shape.obj", bytes, &damage, super::read);
        check(result, length)?;
    }

    #[test]
    fn a_damaged_stl_is_read_or_refused(is_binary in any::<bool>(), damage in damage()) {
        use super::stl::tests::{SQUARE, binary_square};
        let bytes = if is_binary { binary_square("") } else { SQUARE.as_bytes().to_vec() };
        let (result, length) = read_damaged("shape.stl", bytes, &damage, super::read);
        check(result, length)?;
    }

    #[test]
    fn a_damaged_off_is_read_or_refused(damage in damage()) {
        let bytes = super::off::tests::PYRAMID.as_bytes().to_vec();
        let (result, length) = read_damaged("shape.off", bytes, &damage, super::read);
        check(result, length)?;
    }

    #[test]
    fn a_damaged_cloud_is_read_or_refused(count in any::<bool>(), damage in damage()) {
        let text = super::cloud::tests::helix(|[x, y, z], [a, b, c]| format!("{x} {y} {z} 1 {a} {b} {c}"));
        let text = if count { format!("64\n{text}") } else { text };
        let (result, length) = read_damaged("shape.pts", text.into_bytes(), &damage, super::read);
        check(result, length)?;
    }

    #[test]
    fn a_damaged_glb_is_read_or_refused(as_text in any::<bool>(), damage in damage()) {
        use super::gltf::tests::{glb, square};
        use base64::Engine as _;
        let (mut root, bytes) = square();
        let (name, file) = if as_text {
            let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
            root["buffers"][0]["uri"] = format!("data:;base64,{data}").into();
            ("shape.gltf", root.to_string().into_bytes())
        } else {
            ("shape.glb", glb(&root, &bytes))
        };
        let (result, length) = read_damaged(name, file, &damage, super::read);
        check(result, length)?;
    }

    #[test]
    fn a_damaged_array_is_read_or_refused(which in 0..3usize, damage in damage()) {
        use super::npy::tests::{curve, npy, pyramid};
        let (name, file) = match which {
            0 => {
                let data = curve().into_iter().flatten().flat_map(f64::to_le_bytes);
                ("shape.npy", npy("<f8", true, "(64, 3)", &data.collect::<Vec<_>>()))
            }
            _ => ("shape.npz", pyramid("points", "faces", which == 1)),
        };
        let (result, length) = read_damaged(name, file, &damage, super::read);
        check(result, length)?;
    }

    #[test]
    fn a_damaged_sequence_is_read_or_refused(damage in damage()) {
        let bytes = super::anime::tests::two_frames();
        let (result, length) = read_damaged("shape.anime", bytes, &damage, Sequence::read);
        if let Ok(sequence) = &result {
            let rows = sequence.frames.iter().map(Vec::len).sum::<usize>();
            prop_assert!(12 * (rows + sequence.triangles.len()) + 12 == length);
        }
        check(result.and_then(|sequence| sequence.shape(0)), length)?;
    }
}
