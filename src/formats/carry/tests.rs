//! Tests of carried files.

use super::*;

/// Writes the text, moves its vertices, and hands back the file that comes of it.
fn carried(name: &str, original: &[u8], positions: &[[f64; 3]]) -> Result<Vec<u8>, CarryError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, original).expect("written");
    let out = folder.path().join(format!("moved-{name}"));
    let result = rewrite_vertices(&path, positions, &out);
    assert_eq!(out.exists(), result.is_ok(), "whole or not at all");
    result.map(|()| std::fs::read(out).expect("read"))
}

/// The quad of the tests, standing up: x and z exchanged, so that its normal becomes +x.
const STANDING: [[f64; 3]; 4] = [
    [0.0; 3],
    [0.0, 0.0, -1.0],
    [0.0, 1.0, -1.0],
    [0.0, 1.0, 0.25],
];

const QUAD_PLY: &str = "ply\nformat ascii 1.0\ncomment TextureFile stone.png\nelement vertex 4\n\
    property float x\nproperty float y\nproperty double z\nproperty float nx\nproperty float ny\n\
    property float nz\nproperty uchar red\nproperty float s\nelement face 1\n\
    property list uchar int vertex_indices\nproperty list uchar float texcoord\n\
    element camera 1\nproperty double focus\nend_header\n\
    0 0 0 0 0 1 255 0.5\n1 0 0 0 0 1 254 0\n1 1 0 0 0 1 253 0\n0 1 0 0 0 1 252 1\n\
    4 0 1 2 3 2 0.25 0.75\n1.5\n";

#[test]
fn a_coloured_quad_keeps_everything_but_its_positions_and_normals() {
    let out = carried("quad.ply", QUAD_PLY.as_bytes(), &STANDING).expect("carried");
    let expected = QUAD_PLY
        .replace("0 0 0 0 0 1 255", "0 0 0 1 0 0 255")
        .replace("1 0 0 0 0 1 254", "0 0 -1 1 0 0 254")
        .replace("1 1 0 0 0 1 253", "0 1 -1 1 0 0 253")
        .replace("0 1 0 0 0 1 252", "0 1 0.25 1 0 0 252");
    let out = String::from_utf8(out).expect("ascii");
    // The writer ends ascii rows with a space.
    let lines = |text: &str| {
        text.lines()
            .map(|line| line.trim().to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(lines(&out), lines(&expected));
}

#[test]
fn a_binary_file_stays_binary_and_differs_only_in_its_vertices() {
    let header = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty double x\n\
        property double y\nproperty double z\nproperty uchar alpha\nelement face 1\n\
        property list uint ushort vertex_index\nproperty int part\nend_header\n";
    let file = |vertices: [[f64; 3]; 3]| {
        let mut bytes = header.as_bytes().to_vec();
        for vertex in vertices {
            vertex
                .iter()
                .for_each(|coordinate| bytes.extend(coordinate.to_be_bytes()));
            bytes.push(7);
        }
        bytes.extend(3u32.to_be_bytes());
        [0u16, 1, 2]
            .iter()
            .for_each(|corner| bytes.extend(corner.to_be_bytes()));
        bytes.extend((-5i32).to_be_bytes());
        bytes
    };
    let before = file([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let moved = [[5e5 + 0.1, -1e-9, 3.0], [2.0; 3], [0.1, 0.2, 0.3]];
    assert_eq!(
        carried("t.ply", &before, &moved).expect("carried"),
        file(moved)
    );
}

#[test]
fn whole_number_coordinates_become_doubles_and_normals_without_faces_go() {
    let mut text = String::from(
        "ply\nformat ascii 1.0\nelement vertex 64\nproperty int x\nproperty int y\n\
         property int z\nproperty float nx\nproperty float ny\nproperty float nz\nend_header\n",
    );
    (0..64).for_each(|i| text.push_str(&format!("{i} 0 0 0 0 1\n")));
    let moved: Vec<[f64; 3]> = (0..64).map(|i| [f64::from(i) + 0.5, 0.0, 0.0]).collect();
    let out = carried("c.ply", text.as_bytes(), &moved).expect("carried");
    let out = String::from_utf8(out).expect("ascii");
    assert!(
        out.contains("property double x") && !out.contains("nx"),
        "{out}"
    );
    assert!(out.trim_end().ends_with("63.5 0 0"), "{out}");
}

const QUAD_OBJ: &str = "# quad\r\nmtllib stone.mtl\no wall\nv 0 0 0 0.5 0.25 1\nv\t1 0 0 # corner\n\
    v 1 1 0\r\n  v 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nusemtl stone\ns off\n\
    f 1/1/1 2/2/1 3/3/1 4/4/1 # front\r\nf -4//1 -3//1 -2//1\nl 1 2";

#[test]
fn a_textured_obj_keeps_every_line_but_vertices_and_stale_normals() {
    let out = carried("quad.obj", QUAD_OBJ.as_bytes(), &STANDING).expect("carried");
    let expected = "# quad\r\nmtllib stone.mtl\no wall\nv 0 0 0 0.5 0.25 1\nv 0 0 -1 # corner\n\
        v 0 1 -1\r\nv 0 1 0.25\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl stone\ns off\n\
        f 1/1 2/2 3/3 4/4 # front\r\nf -4 -3 -2\nl 1 2";
    assert_eq!(String::from_utf8(out).expect("text"), expected);
}

#[test]
fn normals_of_vertices_are_reckoned_anew() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\n\
        f 1//1 2//2 3//3 4//4\n";
    let out = carried("quad.obj", text.as_bytes(), &STANDING).expect("carried");
    let out = String::from_utf8(out).expect("text");
    assert_eq!(out.matches("vn 1 0 0\n").count(), 4, "{out}");
    assert!(out.ends_with("f 1//1 2//2 3//3 4//4\n"), "{out}");
}

#[test]
fn what_is_not_utf8_passes_through_unharmed() {
    let text = b"# caf\xe9\ng t\xeate\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let out = carried("t.obj", text, &[[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let out = out.expect("carried");
    assert!(
        out.starts_with(b"# caf\xe9\ng t\xeate\nv 0 0 0\nv 2 0 0\n"),
        "{out:?}"
    );
}

#[test]
fn what_cannot_be_carried_is_refused_and_leaves_nothing() {
    let message = |positions: &[[f64; 3]]| {
        carried("quad.obj", QUAD_OBJ.as_bytes(), positions)
            .expect_err("refused")
            .to_string()
    };
    assert!(message(&STANDING[..3]).contains("quad.obj: 3 positions for 4 vertices"));
    let mut broken = STANDING;
    broken[2][1] = f64::INFINITY;
    assert!(message(&broken).contains("vertex 2 would move to"));
    let refused = rewrite_vertices(Path::new("a.PLY"), &[], Path::new("b.obj"));
    let text = refused.expect_err("another format").to_string();
    assert!(
        text.starts_with("b.obj: ") && text.ends_with(".ply"),
        "{text}"
    );
}

#[test]
fn a_file_can_be_carried_onto_itself() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("quad.ply");
    std::fs::write(&path, QUAD_PLY).expect("written");
    rewrite_vertices(&path, &STANDING, &path).expect("carried");
    assert_eq!(
        crate::formats::read(&path).expect("read").mesh.vertices,
        STANDING
    );
}

#[test]
fn other_formats_are_carried_as_ply() {
    let square = crate::formats::stl::tests::SQUARE;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("square.STL");
    std::fs::write(&path, square).expect("written");
    assert_eq!(carried_extension(&path), "ply");
    let out = folder.path().join("carried-000.ply");
    rewrite_vertices(&path, &STANDING, &out).expect("carried");
    let moved = crate::formats::read(&out).expect("read").mesh;
    assert_eq!(moved.vertices, STANDING);
    assert_eq!(moved.triangles, [[0, 1, 2], [0, 2, 3]]);
    let refused = rewrite_vertices(&path, &STANDING, &folder.path().join("a.stl"));
    let text = refused.expect_err("another format").to_string();
    assert!(text.ends_with("end the name in .ply"), "{text}");
}
