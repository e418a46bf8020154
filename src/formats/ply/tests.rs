//! Tests of the PLY reader.

use std::fmt::Write as _;

use super::*;
use crate::formats;

/// What a writer may choose.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    Ascii,
    Little,
    Big,
}

/// A pyramid: four triangles over a quad, with normals, a colour and an element of no use to us.
pub(crate) fn pyramid(kind: Kind) -> Vec<u8> {
    let format = match kind {
        Kind::Ascii => "ascii",
        Kind::Little => "binary_little_endian",
        Kind::Big => "binary_big_endian",
    };
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment made by hand\nelement camera 1\nproperty double focus\n\
         element vertex 5\nproperty float x\nproperty float y\nproperty double z\n\
         property uchar red\nproperty float nx\nproperty float ny\nproperty float nz\n\
         element face 5\nproperty list uchar int vertex_indices\nproperty short flag\nend_header\n"
    )
    .into_bytes();
    let vertices: [[f64; 3]; 5] = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 2.0, 0.0],
        [0.0, 2.0, 0.0],
        [1.0; 3],
    ];
    let faces: [&[i32]; 5] = [
        &[0, 3, 2, 1],
        &[0, 1, 4],
        &[1, 2, 4],
        &[2, 3, 4],
        &[3, 0, 4],
    ];
    if let Kind::Ascii = kind {
        let mut text = String::from("1.5e0\n");
        for [x, y, z] in vertices {
            writeln!(text, "{x} {y} {z} 255 0 0 -2E0").expect("a string grows");
        }
        for face in faces {
            let corners: Vec<String> = face.iter().map(i32::to_string).collect();
            writeln!(text, "{} {} -1", face.len(), corners.join(" ")).expect("a string grows");
        }
        bytes.extend(text.into_bytes());
        return bytes;
    }
    // Written as big-endian numbers, turned around for the other order.
    let mut put = |number: &[u8]| match kind {
        Kind::Big => bytes.extend(number),
        _ => bytes.extend(number.iter().rev()),
    };
    put(&1.5f64.to_be_bytes());
    for [x, y, z] in vertices {
        put(&(x as f32).to_be_bytes());
        put(&(y as f32).to_be_bytes());
        put(&z.to_be_bytes());
        put(&[255]);
        [0.0f32, 0.0, -2.0]
            .iter()
            .for_each(|normal| put(&normal.to_be_bytes()));
    }
    for face in faces {
        put(&[face.len() as u8]);
        face.iter().for_each(|corner| put(&corner.to_be_bytes()));
        put(&(-1i16).to_be_bytes());
    }
    bytes
}

pub(crate) fn read_bytes(bytes: &[u8]) -> Result<Shape, ShapeError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("shape.ply");
    std::fs::write(&path, bytes).expect("written");
    formats::read(&path)
}

fn message(bytes: &[u8]) -> String {
    let text = read_bytes(bytes).expect_err("refused").to_string();
    assert!(!text.contains('\n'), "one line: {text}");
    text
}

/// The ascii pyramid with one piece of text exchanged.
fn changed(from: &str, to: &str) -> Vec<u8> {
    let text = String::from_utf8(pyramid(Kind::Ascii)).expect("ascii");
    assert!(text.contains(from), "the test replaces something");
    text.replacen(from, to, 1).into_bytes()
}

#[test]
fn every_encoding_gives_the_same_shape_and_polygons_become_fans() {
    for kind in [Kind::Ascii, Kind::Little, Kind::Big] {
        let shape = read_bytes(&pyramid(kind)).expect("read");
        assert_eq!(shape.mesh.vertices[2], [2.0, 2.0, 0.0]);
        assert_eq!(shape.mesh.vertices[4], [1.0; 3]);
        let fans = [
            [0, 3, 2],
            [0, 2, 1],
            [0, 1, 4],
            [1, 2, 4],
            [2, 3, 4],
            [3, 0, 4],
        ];
        assert_eq!(shape.mesh.triangles, fans, "{kind:?}");
        assert_eq!(
            shape.mesh.normals,
            Some(vec![[0.0, 0.0, -1.0]; 5]),
            "made unit length"
        );
    }
}

#[test]
fn a_cloud_has_no_triangles_and_normals_only_if_the_file_has() {
    let mut text = String::from(
        "ply\r\nformat ascii 1.0\r\nelement vertex 64\r\nproperty double x\r\n\
         property double y\r\nproperty double z\r\nend_header\r\n",
    );
    (0..64).for_each(|i| writeln!(text, "500000.123456789 {i} {}.0015\r", i * i).expect("grows"));
    let cloud = read_bytes(text.as_bytes()).expect("read");
    assert_eq!(
        (
            cloud.mesh.vertices.len(),
            cloud.is_mesh(),
            cloud.mesh.normals
        ),
        (64, false, None)
    );
    assert_eq!(
        cloud.mesh.vertices[63],
        [500_000.123_456_789, 63.0, 3969.0015]
    );
}

#[test]
fn a_truncated_file_is_refused_wherever_it_ends() {
    for kind in [Kind::Ascii, Kind::Little, Kind::Big] {
        let whole = pyramid(kind);
        // Up to the last byte: without its line end the ascii file is whole.
        let last = whole.len() - if let Kind::Ascii = kind { 3 } else { 1 };
        for length in 1..=last {
            assert!(
                read_bytes(&whole[..length]).is_err(),
                "{kind:?} cut at {length}"
            );
        }
        let text = message(&whole[..last]);
        let named = "the file ends within face 4 of 5: it is truncated";
        assert!(text.contains(named), "{text}");
    }
}

#[test]
fn a_header_that_claims_too_much_is_refused_before_it_costs_anything() {
    let claims = |count: &str| {
        message(&changed(
            "element vertex 5",
            &format!("element vertex {count}"),
        ))
    };
    assert!(claims("4294967295").contains("claims 4294967295 of element vertex"));
    assert!(claims("18446744073709551615").contains("claims 18446744073709551615"));
    // More than 64 bits: ply-rs 0.1.3 panics here.
    assert!(claims("99999999999999999999999").contains("shape.ply:6: header"));
    // Nothing to read per element: only its count could make it endless.
    let empty = "element nothing 9999999999999\nelement vertex 5";
    assert!(message(&changed("element vertex 5", empty)).contains("element nothing"));
}

#[test]
fn a_bad_header_is_refused_with_its_line() {
    assert!(message(b"solid stl\n").contains("not a PLY file"));
    let text = message(&changed("property float x", "property flot x"));
    assert!(
        text.ends_with("shape.ply:7: header: Couldn't parse line \"property flot x\""),
        "{text}"
    );
    assert!(message(&changed("format ascii 1.0\n", "")).contains("header"));
    assert!(message(&changed("property float x", "property float u")).contains("no property x"));
    assert!(message(&changed("element vertex", "element vortex")).contains("no element vertex"));
    assert!(message(&changed("vertex_indices", "corners")).contains("no property list vertex_ind"));
    let list = "property list uchar float x";
    assert!(message(&changed("property float x", list)).contains("no property x"));
}

#[test]
fn a_bad_face_or_vertex_is_named() {
    let text = message(&changed("3 1 2 4 -1", "3 1 2 5 -1"));
    assert!(
        text.contains("face 2 refers to vertex 5 (the file has 5 vertices)"),
        "{text}"
    );
    assert!(message(&changed("3 1 2 4 -1", "3 1 -2 4 -1")).contains("refers to vertex -2"));
    let text = message(&changed("2 2 0 255", "2 nan 0 255"));
    assert!(text.contains("vertex 2 is at [2.0, NaN, 0.0]"), "{text}");
    let text = message(&changed("2 2 0 255", "2 x 0 255"));
    assert!(
        text.contains("shape.ply:21: vertex 2: \"x\" is not a number: must be numbers for x y z"),
        "{text}"
    );
    let text = message(&changed("3 1 2 4 -1", "-3 1 2 4 -1"));
    assert!(
        text.contains("face 2: \"-3\" is not a whole number"),
        "{text}"
    );
    // Binary numbers can be NaN; the fifth vertex ends 5 faces before the end.
    let mut bytes = pyramid(Kind::Little);
    let faces = 19 + 4 * 15;
    let vertex = bytes.len() - faces - 29;
    bytes[vertex..vertex + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(message(&bytes).contains("vertex 4 is at [NaN, 1.0, 1.0]"));
}

#[test]
fn a_negative_list_length_is_refused() {
    let text = String::from_utf8(pyramid(Kind::Ascii)).expect("ascii");
    let header = text
        .split_inclusive("end_header\n")
        .next()
        .expect("a header");
    let header = header
        .replace("ascii", "binary_big_endian")
        .replace("list uchar", "list char");
    let body = &pyramid(Kind::Big)[pyramid(Kind::Big).len() - (8 + 5 * 29 + 19 + 4 * 15)..];
    let mut bytes = [header.as_bytes(), body].concat();
    let first_face = bytes.len() - (19 + 4 * 15);
    bytes[first_face] = 0xff;
    let text = message(&bytes);
    assert!(
        text.contains("face 0 of 5: List length cannot be negative"),
        "{text}"
    );
}

#[test]
fn a_normal_without_direction_is_read_as_zero() {
    let shape = read_bytes(&changed("255 0 0 -2E0", "255 0 0 0")).expect("read");
    assert_eq!(shape.mesh.normals.expect("normals")[0], [0.0; 3]);
}

/// The ascii pyramid with something done to its text.
fn rewritten(how: impl Fn(&str) -> String) -> Vec<u8> {
    how(&String::from_utf8(pyramid(Kind::Ascii)).expect("ascii")).into_bytes()
}

#[test]
fn headers_and_rows_are_read_however_their_lines_end() {
    let plain = read_bytes(&pyramid(Kind::Ascii)).expect("read").mesh;
    let body = |text: &str, how: &dyn Fn(&str) -> String| {
        let (header, rows) = text.split_once("end_header\n").expect("a header");
        format!("{header}end_header\n{}", how(rows))
    };
    let texts = [
        rewritten(|text| format!("\u{feff}{text}")),
        rewritten(|text| text.replacen("ply", "PLY", 1)),
        rewritten(|text| text.replace('\n', "\r")),
        rewritten(|text| text.replace('\n', "\r\n")),
        rewritten(|text| text.replace('\n', "\n\n")),
        rewritten(|text| body(text, &|rows| format!("\u{feff}{rows}"))),
        // All rows on one line; a number on each.
        rewritten(|text| body(text, &|rows| rows.replace('\n', " "))),
        rewritten(|text| body(text, &|rows| rows.replace(' ', "\n"))),
    ];
    for text in texts {
        let read = read_bytes(&text).map(|shape| shape.mesh);
        let read = read.map_err(|error| format!("{error}: {}", String::from_utf8_lossy(&text)));
        assert_eq!(read, Ok(plain.clone()));
    }
    // The header of old programs before binary numbers, whose bytes may be line ends.
    for kind in [Kind::Little, Kind::Big] {
        let bytes = pyramid(kind);
        let end = bytes
            .windows(11)
            .position(|word| word == b"end_header\n")
            .expect("a header")
            + 11;
        let header = String::from_utf8(bytes[..end].to_vec())
            .expect("ascii")
            .replace('\n', "\r");
        let old = [header.as_bytes(), &bytes[end..]].concat();
        assert_eq!(read_bytes(&old).expect("read").mesh, plain);
    }
    let utf_16: Vec<u8> = "\u{feff}ply\n"
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    assert!(message(&utf_16).ends_with("the text is in UTF-16: save it as UTF-8"));
}

#[test]
fn rows_longer_than_the_header_says_are_refused() {
    let longer = rewritten(|text| text.replace(" 255 0 0 -2E0", " 255 0 0 -2E0 7 8"));
    let text = message(&longer);
    assert!(
        text.contains("shape.ply:19: vertex 0: 9 numbers, but the header has 7 for x y z red"),
        "{text}"
    );
    let more = rewritten(|text| {
        let (header, rows) = text.split_once("end_header\n").expect("a header");
        format!("{header}end_header\n{} 5", rows.replace('\n', " "))
    });
    assert!(
        message(&more).contains("\"5\" comes after the last row"),
        "{}",
        message(&more)
    );
}

#[test]
fn triangle_strips_become_triangles() {
    let strips = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
                  element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
                  0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 1\n8 0 1 2 3 -1 2 3 4\n";
    let mesh = read_bytes(strips.as_bytes()).expect("read").mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
    assert!(
        message(strips.replace("1 2 3 -1", "1 2 9 -1").as_bytes()).contains("refers to vertex 9")
    );
}

#[test]
fn points_of_a_cloud_without_a_place_are_left_out() {
    let mut text = String::from(
        "ply\nformat ascii 1.0\nelement vertex 70\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
    );
    for k in 0..70 {
        let row = match k {
            3 => "nan nan nan".to_owned(),
            4 => "-nan(ind) -nan(ind) -nan(ind)".to_owned(),
            5 => "-inf inf 1.#INF".to_owned(),
            _ => format!("{k} {} 1", k % 7),
        };
        writeln!(text, "{row}").expect("grows");
    }
    let cloud = read_bytes(text.as_bytes()).expect("read");
    assert_eq!(cloud.mesh.vertices.len(), 67);
    assert_eq!(cloud.number_in_file(3), 6);
    assert!(
        cloud.notes[0].contains("3 of 70 points have no place"),
        "{}",
        cloud.notes[0]
    );
}
