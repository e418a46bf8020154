//! Shapes and correspondences that are wrong: one line that says where and what, exit status 1, and no run
//! is begun.

use std::fs;

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::workplace::Workplace;

/// A bad shape as the source is refused by `train` and by `info`, and no run is begun.
#[track_caller]
fn source_is_refused(content: impl AsRef<[u8]>, parts: &[&str]) {
    let place = Workplace::tiny(&[]);
    place.write("source.ply", content);
    let before = place.names();
    place
        .isomorph(&["train", "recipe.toml", "--run", "run"])
        .refused(1, parts);
    place.isomorph(&["info", "source.ply"]).refused(1, parts);
    assert_eq!(place.names(), before, "something is left behind");
}

/// A binary PLY with a header and as many bytes as it is given.
fn binary(vertices: u64, body: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\n\
         property float y\nproperty float z\nend_header\n"
    );
    [header.as_bytes(), body].concat()
}

#[test]
fn a_missing_shape_is_named() {
    let place = Workplace::tiny(&[]);
    fs::remove_file(place.path("target.ply")).expect("a file");
    let before = place.names();
    let parts = ["target.ply: cannot be read", "No such file"];
    place
        .isomorph(&["train", "recipe.toml", "--run", "run"])
        .refused(1, &parts);
    place
        .isomorph(&["init", "source.ply", "target.ply"])
        .refused(1, &parts);
    assert_eq!(place.names(), before);
}

#[test]
fn an_empty_shape_is_named() {
    source_is_refused("", &["source.ply: the file is empty"]);
}

#[test]
fn a_shape_with_a_coordinate_that_is_no_number_is_refused_with_the_vertex() {
    let mut mesh = Mesh::sphere(1.0, 3);
    mesh.vertices[17][1] = f64::NAN;
    source_is_refused(
        ply::text(&mesh),
        &["source.ply: vertex 17 is at ", "NaN", "finite"],
    );
    mesh.vertices[17][1] = f64::INFINITY;
    source_is_refused(
        ply::text(&mesh),
        &["source.ply: vertex 17 is at ", "inf", "finite"],
    );
}

#[test]
fn a_face_that_refers_to_no_vertex_is_refused_with_the_vertex() {
    let mut mesh = Mesh::sphere(1.0, 3);
    let count = mesh.vertices.len();
    mesh.triangles[5][2] = count as u32;
    let vertex = format!("face 5 refers to vertex {count}");
    source_is_refused(
        ply::text(&mesh),
        &["source.ply: ", &vertex, &format!("has {count} vertices")],
    );
}

#[test]
fn a_truncated_binary_shape_is_refused() {
    // 100 vertices of 12 bytes are announced, 99 and a half are there.
    source_is_refused(binary(100, &[63; 1194]), &["source.ply: ", "100"]);
}

#[test]
fn a_header_that_claims_four_billion_vertices_is_refused_at_once_and_without_the_memory() {
    let started = std::time::Instant::now();
    source_is_refused(
        binary(4_000_000_000, &[63; 1200]),
        &["source.ply: ", "4000000000"],
    );
    source_is_refused(binary(u64::MAX, &[63; 1200]), &["source.ply: "]);
    // Room for so many would be 100 GB; each refusal takes milliseconds.
    assert!(started.elapsed().as_secs() < 10, "{:?}", started.elapsed());
}

#[test]
fn a_cloud_of_too_few_points_is_refused_with_their_number() {
    let points = &Mesh::sphere(1.0, 1).vertices;
    let found = format!("source.ply: {} points, at least 64 needed", points.len());
    source_is_refused(ply::cloud(points), &[&found]);
}

#[test]
fn bad_correspondences_are_refused_with_the_line() {
    let cases: &[(&str, &[&str])] = &[
        ("", &["pairs.csv: the file is empty"]),
        (
            "# nothing\nsource,target\n",
            &["pairs.csv: no correspondences, at least 1 needed"],
        ),
        (
            "0,0\n1,one\n",
            &["pairs.csv:2: ", "1,one", "two whole numbers"],
        ),
        (
            "0,0\n0,258\n",
            &["pairs.csv:2: vertex 258 of ", "target.ply", "it has 258"],
        ),
        (
            "258,0\n",
            &["pairs.csv:1: vertex 258 of ", "source.ply", "it has 258"],
        ),
        ("0,0\n-1,5\n", &["pairs.csv:2: ", "-1,5"]),
    ];
    for (content, parts) in cases {
        let place = Workplace::tiny(&[]);
        place.write("pairs.csv", content);
        let set = "data.correspondences=pairs.csv";
        let before = place.names();
        place
            .isomorph(&["train", "recipe.toml", "--run", "run", "--set", set])
            .refused(1, parts);
        assert_eq!(place.names(), before, "{content:?} leaves something behind");
    }
}

#[test]
fn shapes_of_different_vertex_counts_do_not_share_their_vertices() {
    let place = Workplace::with_pair(&Mesh::sphere(1.0, 3), &Mesh::sphere(1.0, 2), &[]);
    let set = "data.correspondences=same-vertices";
    let parts = ["same-vertices", "258 vertices", "66"];
    place
        .isomorph(&["train", "recipe.toml", "--run", "run", "--set", set])
        .refused(1, &parts);
    assert!(!place.path("run").exists());
}

#[test]
fn malformed_files_of_other_formats_are_refused_with_the_place() {
    let cases: &[(&str, &[u8], &[&str])] = &[
        (
            "a.stl",
            &[7; 200],
            &["a.stl: its header claims 117901063 triangles"],
        ),
        ("a.stl", b"solid a\nfacet\n", &["a.stl: ", "truncated"]),
        (
            "a.off",
            b"OFF\n3 1 0\n0 0 0\n",
            &["a.off:4: ", "vertex 1 of 3", "truncated"],
        ),
        (
            "a.xyz",
            b"1 2 3\n1 2\n",
            &["a.xyz:2: \"1 2\": 2 columns, 3"],
        ),
        (
            "a.csv",
            b"1,5;2,5;3,5\n",
            &["a.csv:1: \"1,5\" is not a number"],
        ),
        (
            "a.npy",
            b"\x93NUMPY\x02\0\xff\xff\xff\xff",
            &["a.npy: ", "4294967295 bytes"],
        ),
        ("a.npz", b"PK\x03\x04", &["a.npz: ", "archive"]),
        (
            "a.glb",
            b"glTF\x02\0\0\0\xff\xff\xff\xff",
            &["a.glb: ", "truncated"],
        ),
        (
            "a.gltf",
            b"{\"asset\": {\"version\": \"2.0\"}",
            &["a.gltf: its JSON: "],
        ),
        (
            "a.step",
            b"hello",
            &[
                "a.step: unknown kind of shape",
                ".ply, .obj, .stl, .off, .glb",
            ],
        ),
    ];
    for (name, content, parts) in cases {
        let place = Workplace::tiny(&[]);
        place.write(name, content);
        place.isomorph(&["info", name]).refused(1, parts);
    }
}
