//! Tests of the reader of numpy's arrays. `scripts/` has none for them: the bytes here follow numpy.lib.format, and
//! files of numpy itself were read too.

use std::io::Write;

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::*;
use crate::formats::malformed::written;

/// A file of an array as numpy writes it: a header padded to 64 bytes.
pub(crate) fn npy(descr: &str, by_columns: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if by_columns { "True" } else { "False" };
    let mut header =
        format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

/// An archive of arrays, deflated or not.
pub(crate) fn npz(arrays: &[(&str, Vec<u8>)], deflated: bool) -> Vec<u8> {
    let mut writer = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let method = if deflated {
        zip::CompressionMethod::Deflated
    } else {
        zip::CompressionMethod::Stored
    };
    for (name, bytes) in arrays {
        // As numpy does, whatever the size.
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .large_file(true);
        writer
            .start_file(format!("{name}.npy"), options)
            .expect("an entry");
        writer.write_all(bytes).expect("in memory");
    }
    writer.finish().expect("in memory").into_inner()
}

/// 64 points on a curve, numbers that all types hold exactly.
pub(crate) fn curve() -> Vec<[f64; 3]> {
    (0..64u32)
        .map(|k| [k, k % 7, 100 - k].map(f64::from))
        .collect()
}

fn flat<const N: usize>(points: &[[f64; 3]], number: impl Fn(f64) -> [u8; N]) -> Vec<u8> {
    points.iter().flatten().flat_map(|x| number(*x)).collect()
}

fn read(name: &str, bytes: &[u8]) -> Result<Shape, ShapeError> {
    written(name, bytes, crate::formats::read)
}

fn message(name: &str, bytes: &[u8]) -> String {
    read(name, bytes).expect_err("refused").to_string()
}

#[test]
fn numbers_of_every_type_and_byte_order_are_read() {
    let (points, shape) = (curve(), "(64, 3)");
    for (descr, data) in [
        ("<f2", flat(&points, |x| f16_of(x).to_le_bytes())),
        (">f2", flat(&points, |x| f16_of(x).to_be_bytes())),
        ("<f4", flat(&points, |x| (x as f32).to_le_bytes())),
        (">f4", flat(&points, |x| (x as f32).to_be_bytes())),
        ("<f8", flat(&points, f64::to_le_bytes)),
        (">f8", flat(&points, f64::to_be_bytes)),
        ("|i1", flat(&points, |x| (x as i8).to_le_bytes())),
        ("|u1", flat(&points, |x| (x as u8).to_le_bytes())),
        (">i2", flat(&points, |x| (x as i16).to_be_bytes())),
        ("<u4", flat(&points, |x| (x as u32).to_le_bytes())),
        (">i8", flat(&points, |x| (x as i64).to_be_bytes())),
    ] {
        let shape = read("a.NPY", &npy(descr, false, shape, &data)).expect(descr);
        assert_eq!(shape.mesh.vertices, points, "{descr}");
    }
    let negative = flat(&points, |x| (-x as i32).to_be_bytes());
    let shape = read("a.npy", &npy(">i4", false, shape, &negative)).expect("read");
    assert_eq!(shape.mesh.vertices[63], [-63.0, 0.0, -37.0]);
}

/// The half-precision number that is a whole one.
fn f16_of(x: f64) -> u16 {
    half::f16::from_f64(x).to_bits()
}

#[test]
fn columns_may_come_first_and_six_of_them_hold_normals() {
    let points = curve();
    let mut columns = Vec::new();
    for axis in 0..3 {
        columns.extend(points.iter().flat_map(|point| point[axis].to_le_bytes()));
    }
    let shape = read("a.npy", &npy("<f8", true, "(64, 3)", &columns)).expect("read");
    assert_eq!(shape.mesh.vertices, points);
    let six: Vec<u8> = (points.iter())
        .flat_map(|point| [*point, [0.0, 0.0, 2.0]])
        .flat_map(|row| flat(&[row], f64::to_le_bytes))
        .collect();
    let shape = read("a.npy", &npy("<f8", false, "(64, 6)", &six)).expect("read");
    assert_eq!(shape.mesh.vertices, points);
    assert_eq!(shape.mesh.normals, Some(vec![[0.0, 0.0, 1.0]; 64]));
}

/// An archive of a pyramid of quad and triangles under these names.
pub(crate) fn pyramid(points: &str, faces: &str, deflated: bool) -> Vec<u8> {
    let places = [
        [0.0; 3],
        [2.0, 0.0, 0.0],
        [2.0, 2.0, 0.0],
        [0.0, 2.0, 0.0],
        [1.0; 3],
    ];
    let corners: [i64; 12] = [0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4];
    let corners: Vec<u8> = corners
        .iter()
        .flat_map(|corner| corner.to_le_bytes())
        .collect();
    npz(
        &[
            ("unused", npy("<U3", false, "()", &[0; 12])),
            (
                points,
                npy("<f8", false, "(5, 3)", &flat(&places, f64::to_le_bytes)),
            ),
            (faces, npy("<i8", false, "(4, 3)", &corners)),
        ],
        deflated,
    )
}

#[test]
fn an_archive_gives_a_mesh_stored_or_deflated() {
    for (points, faces, deflated) in [("points", "triangles", true), ("Vertices", "FACES", false)] {
        let mesh = read("a.npz", &pyramid(points, faces, deflated))
            .expect("read")
            .mesh;
        assert_eq!((mesh.vertices[4], mesh.normals), ([1.0; 3], None));
        assert_eq!(mesh.triangles, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]);
    }
    let one = npz(
        &[(
            "arr_0",
            npy("<f8", false, "(64, 3)", &flat(&curve(), f64::to_le_bytes)),
        )],
        true,
    );
    assert_eq!(read("a.npz", &one).expect("read").mesh.vertices, curve());
    let array = || npy("<f8", false, "(64, 3)", &flat(&curve(), f64::to_le_bytes));
    let with = npz(&[("points", array()), ("normals", array())], true);
    let normals = read("a.npz", &with)
        .expect("read")
        .mesh
        .normals
        .expect("normals");
    assert_eq!(normals[0], [0.0, 0.0, 1.0]);
}

#[test]
fn headers_that_lie_are_refused_before_memory_is_taken() {
    let data = flat(&curve(), f64::to_le_bytes);
    for shape in [
        "(100000000000, 3)",
        "(18446744073709551615, 3)",
        "(6148914691236517206, 3)",
        "(99999999999999999999, 3)",
        "(65, 3)",
        "(63, 3)",
        "(-1, 3)",
    ] {
        for (name, bytes) in [
            ("a.npy", npy("<f8", false, shape, &data)),
            (
                "a.npz",
                npz(&[("points", npy("<f8", false, shape, &data))], true),
            ),
        ] {
            let text = message(name, &bytes);
            assert!(text.contains("shape"), "{text}");
        }
    }
    // A header of which nothing follows, and one of brackets.
    let mut long = b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec();
    long.extend([b'('; 1000]);
    assert!(message("a.npy", &long).contains("4294967295 bytes"));
    assert!(
        message("a.npy", &npy(&"(".repeat(30_000), false, "(64, 3)", &data)).contains("type (0")
    );
}

#[test]
fn what_is_no_array_of_numbers_is_named() {
    let data = flat(&curve(), f64::to_le_bytes);
    let of = |descr: &str, shape: &str| message("a.npy", &npy(descr, false, shape, &data));
    assert!(
        of("<c16", "(32, 3)").contains("a.npy: numbers of type c16: must be f2"),
        "{}",
        of("<c16", "(32, 3)")
    );
    assert!(of("|O", "(64, 3)").contains("type O0"));
    assert!(of("<f8", "(3, 64)").contains("shape (3, 64): must be (n, 3)"));
    assert!(of("<f8", "(192,)").contains("shape (192,): must be (n, 3)"));
    assert!(message("a.npy", b"hello there").contains("does not start as an array of numpy"));
    assert!(message("a.npz", b"hello there").contains("a.npz: "));
    assert!(
        message("a.npz", &pyramid("places", "faces", true))
            .contains("(it has: unused, places, faces)")
    );
    let beyond = npz(
        &[
            ("points", npy("<f8", false, "(64, 3)", &data)),
            (
                "faces",
                npy(
                    "<i4",
                    false,
                    "(1, 3)",
                    &[0u8, 0, 0, 0, 1, 0, 0, 0, 64, 0, 0, 0],
                ),
            ),
        ],
        true,
    );
    let text = message("a.npz", &beyond);
    assert!(
        text.contains("array \"faces\": face 0 refers to vertex 64 (there are 64"),
        "{text}"
    );
}
