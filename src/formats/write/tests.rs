//! Tests of the files that surfaces are written to.

use super::*;

/// A unit square of two triangles, `shift` along x from the origin.
fn square(shift: f64) -> Mesh<f64> {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    Mesh::new(
        corners.map(|[x, y]| [x + shift, y, 0.25]).to_vec(),
        vec![[0, 1, 2], [2, 1, 3]],
    )
}

fn with_normals() -> Mesh<f64> {
    Mesh {
        normals: Some(vec![[0.0, 0.0, 1.0]; 4]),
        ..square(0.0)
    }
}

fn written(surface: &Mesh<f64>, format: SurfaceFormat) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("out").with_extension(format.extension());
    write_surface(surface, &path, format).expect("a good surface");
    std::fs::read(path).expect("the file")
}

#[test]
fn a_binary_ply_holds_the_bytes_that_its_header_promises() {
    let surface = with_normals();
    let bytes = written(&surface, SurfaceFormat::Ply);
    let end = bytes
        .windows(11)
        .position(|window| window == b"end_header\n")
        .expect("a header");
    let header = std::str::from_utf8(&bytes[..end]).expect("ASCII");
    assert!(
        header.contains("element vertex 4\nproperty float x"),
        "{header}"
    );
    assert!(
        header.contains("element face 2\nproperty list uchar int vertex_indices"),
        "{header}"
    );
    let body = &bytes[end + 11..];
    assert_eq!(body.len(), 4 * 6 * 4 + 2 * (1 + 3 * 4));
    let second: Vec<f32> = body[24..48].chunks(4).map(f32_of).collect();
    assert_eq!(second, [1.0, 0.0, 0.25, 0.0, 0.0, 1.0]);
    assert_eq!(body[96 + 13..], [3, 2, 0, 0, 0, 1, 0, 0, 0, 3, 0, 0, 0]);
}

fn f32_of(bytes: &[u8]) -> f32 {
    f32::from_le_bytes(bytes.try_into().expect("four bytes"))
}

#[test]
fn ply_rs_reads_what_was_written() {
    let surface = square(0.0);
    let bytes = written(&surface, SurfaceFormat::Ply);
    let parser = ply_rs::parser::Parser::<ply_rs::ply::DefaultElement>::new();
    let ply = parser.read_ply(&mut &bytes[..]).expect("a PLY file");
    assert_eq!(ply.payload["vertex"].len(), 4);
    let list = ply_rs::ply::Property::ListInt(vec![2, 1, 3]);
    assert_eq!(ply.payload["face"][1]["vertex_indices"], list);
}

#[test]
fn an_obj_counts_from_one_and_names_its_normals() {
    let surface = with_normals();
    let text = String::from_utf8(written(&surface, SurfaceFormat::Obj)).expect("UTF-8");
    let lines: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(lines.len(), 4 + 4 + 2);
    assert_eq!(
        (lines[1], lines[4], lines[9]),
        ("v 1 0 0.25", "vn 0 0 1", "f 3//3 2//2 4//4")
    );
    let bare = square(0.0);
    let text = String::from_utf8(written(&bare, SurfaceFormat::Obj)).expect("UTF-8");
    assert!(text.ends_with("f 3 2 4\n"), "{text}");
}

#[test]
fn coordinates_far_from_the_origin_keep_their_detail() {
    let surface = square(4_500_000.125);
    let bytes = written(&surface, SurfaceFormat::Ply);
    let header = String::from_utf8_lossy(&bytes[..200]).into_owned();
    assert!(header.contains("property double x"), "{header}");
    let text = String::from_utf8(written(&surface, SurfaceFormat::Obj)).expect("UTF-8");
    assert!(text.contains("v 4500001.125 0 0.25\n"), "{text}");
    assert!(!needs_f64(&square(99.0).vertices) && needs_f64(&square(101.0).vertices));
}

#[test]
fn bad_surfaces_are_refused_and_leave_no_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("bad.ply");
    let refused = |surface: &Mesh<f64>| {
        let refused = write_surface(surface, &path, SurfaceFormat::Ply).expect_err("a bad surface");
        assert!(!path.exists());
        refused.to_string()
    };
    let mut bad = square(0.0);
    bad.triangles = vec![[0, 1, 2], [0, 1, 4]];
    let message = refused(&bad);
    assert!(
        message.contains("bad.ply: triangle 1 uses vertex 4: must be 0 to 3"),
        "{message}"
    );
    let mut bad = with_normals();
    bad.normals.as_mut().expect("normals").pop();
    let message = refused(&bad);
    assert!(message.contains("3 normals for 4 vertices"), "{message}");
    let mut bad = square(0.0);
    bad.vertices[2][1] = f64::NAN;
    let message = refused(&bad);
    assert!(
        message.contains("vertex 2 lies at [0.0, NaN, 0.25]"),
        "{message}"
    );
}
