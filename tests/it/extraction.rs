//! `extract`: surfaces in another format and place, and the input's own vertices carried along.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::mesh::Mesh;
use crate::support::ply::{self, Ply};
use crate::support::run::frames;
use crate::support::workplace::{Workplace, names, turn};

/// A few steps: what is extracted is then near the sphere that the fields start from, and a surface like any
/// other.
const KEYS: &[&str] = &[
    "training.steps = 10",
    "training.log-every = 4",
    "checkpoint.every = 5",
];

#[test]
fn extraction_writes_obj_where_it_is_told_to() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let run = place.train("run", &[]);
    let extract = [
        "extract",
        "run",
        "--quiet",
        "--times",
        "1,0",
        "--resolution",
        "32",
    ];
    place
        .isomorph(&[&extract[..], &["--format", "obj", "-o", "deep/out"]].concat())
        .succeeded();
    assert!(!run.path("meshes").exists(), "the run is left alone");
    let frames = frames(&place.path("deep/out"));
    assert_eq!(
        frames.iter().map(|frame| frame.time).collect::<Vec<_>>(),
        [1.0, 0.0]
    );
    place
        .isomorph(&[&extract[..], &["-o", "ply"]].concat())
        .succeeded();
    for (k, frame) in frames.iter().enumerate() {
        let text = fs::read_to_string(&frame.surface).expect("an OBJ file");
        let count = |kind: &str| text.lines().filter(|line| line.starts_with(kind)).count();
        let same = Ply::read(&place.path(&format!("ply/surface-00{k}.ply"))).mesh();
        assert_eq!(
            (count("v "), count("f ")),
            (same.vertices.len(), same.triangles.len())
        );
        assert_eq!(count("vn "), count("v "));
    }
}

/// Rows of a PLY with colours: position, texture coordinate, colour.
fn coloured_rows(mesh: &Mesh) -> Vec<String> {
    let row = |(k, x): (usize, &[f64; 3])| {
        format!(
            "{} {} 0.25 {} {} 7",
            ply::words(*x),
            k as f64 / 1024.0,
            k % 256,
            k / 256
        )
    };
    mesh.vertices.iter().enumerate().map(row).collect()
}

#[test]
fn a_carried_mesh_keeps_faces_order_colours_and_texture_coordinates() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let sphere = Mesh::sphere(1.0, 3);
    let properties = ["double x", "double y", "double z", "float s", "float t"];
    let colours = ["uchar red", "uchar green", "uchar blue"];
    let properties = [&properties[..], &colours].concat();
    let text = ply::text_of(&properties, &coloured_rows(&sphere), &sphere.triangles);
    place.write("source.ply", &text);
    place.train("run", &[]);
    let extract = [
        "extract",
        "run",
        "--quiet",
        "--times",
        "0,1",
        "--resolution",
        "32",
    ];
    place
        .isomorph(&[&extract[..], &["--carry", "-o", "out"]].concat())
        .succeeded();
    let given = Ply::read(&place.path("source.ply"));
    let carried = frames(&place.path("out")).into_iter();
    let carried: Vec<Ply> = carried
        .map(|frame| Ply::read(&frame.carried.expect("--carry was given")))
        .collect();
    for file in &carried {
        assert_eq!(file.properties, given.properties);
        assert_eq!(file.triangles, given.triangles);
        for name in ["s", "t", "red", "green", "blue"] {
            assert_eq!(file.column(name), given.column(name), "{name}");
        }
    }
    assert_eq!(carried[0].rows, given.rows, "time 0 is the input itself");
    assert_ne!(carried[1].column("x"), given.column("x"), "time 1 is not");
}

#[test]
fn a_carried_obj_keeps_every_line_but_those_of_its_vertices() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    let sphere = Mesh::sphere(1.0, 3);
    let mut text = String::from("# by hand\nmtllib skin.mtl\no ball\n");
    for x in &sphere.vertices {
        text.push_str(&format!(
            "v {}\nvt {} {}\n",
            ply::words(*x),
            x[0].abs(),
            x[1].abs()
        ));
    }
    text.push_str("usemtl skin\n");
    for triangle in &sphere.triangles {
        let [a, b, c] = triangle.map(|index| index + 1);
        text.push_str(&format!("f {a}/{a} {b}/{b} {c}/{c}\n"));
    }
    place.write("source.obj", &text);
    place.train("run", &["--set", "data.source=source.obj"]);
    let extract = [
        "extract",
        "run",
        "--quiet",
        "--times",
        "1",
        "--resolution",
        "32",
    ];
    place
        .isomorph(&[&extract[..], &["--carry", "-o", "out"]].concat())
        .succeeded();
    let carried = fs::read_to_string(place.path("out/carried-000.obj")).expect("a carried mesh");
    let moved = carried.lines().zip(text.lines()).filter(|(found, given)| {
        let both = found.starts_with("v ") && given.starts_with("v ");
        assert!(both || found == given, "{found:?} instead of {given:?}");
        both && found != given
    });
    assert!(
        moved.count() > sphere.vertices.len() / 2,
        "hardly a vertex moves"
    );
    assert_eq!(carried.lines().count(), text.lines().count());
}

#[test]
fn an_animation_is_one_file_for_all_times_and_takes_the_place_of_the_others() {
    let _turn = turn();
    let place = Workplace::tiny(KEYS);
    place.train("run", &[]);
    let extract = [
        "extract",
        "run",
        "--quiet",
        "--resolution",
        "32",
        "-o",
        "out",
    ];
    let times = ["--times", "0,0.25,1", "--carry"];
    place.isomorph(&[&extract[..], &times].concat()).succeeded();
    let glb = ["--format", "glb"];
    place
        .isomorph(&[&extract[..], &times, &glb].concat())
        .succeeded();
    let left = ["carried.glb", "frames.json", "preview.png", "surface.glb"];
    assert_eq!(names(&place.path("out")), left, "no file of before");
    for frame in frames(&place.path("out")) {
        assert!(frame.surface.ends_with("surface.glb"), "{frame:?}");
        assert!(
            frame
                .carried
                .is_some_and(|file| file.ends_with("carried.glb"))
        );
    }
    let carried = described(&place.path("out/carried.glb"));
    let primitive = &carried["meshes"][0]["primitives"][0];
    assert_eq!(primitive["targets"].as_array().map(Vec::len), Some(2));
    let count = |accessor: &Value| {
        let index = accessor.as_u64().expect("an accessor") as usize;
        carried["accessors"][index]["count"].as_u64()
    };
    let sphere = Mesh::sphere(1.0, 3);
    let vertices = Some(sphere.vertices.len() as u64);
    assert_eq!(count(&primitive["attributes"]["POSITION"]), vertices);
    assert_eq!(
        count(&primitive["indices"]),
        Some(3 * sphere.triangles.len() as u64)
    );
    let surfaces = described(&place.path("out/surface.glb"));
    assert_eq!(surfaces["meshes"].as_array().map(Vec::len), Some(3));
    let full = fs::metadata(place.path("out/surface.glb"))
        .expect("a file")
        .len();
    place
        .isomorph(&[&extract[..], &times, &glb, &["--compact"]].concat())
        .succeeded();
    let compact = fs::metadata(place.path("out/surface.glb"))
        .expect("a file")
        .len();
    assert!(compact < full * 3 / 4, "{compact} of {full} bytes");
    let ended = place.isomorph(&[&extract[..], &["--compact"]].concat());
    ended.refused(2, &["--compact", "--format glb"]);
}

/// The JSON of a GLB file.
fn described(path: &Path) -> Value {
    let bytes = fs::read(path).expect("a file");
    assert_eq!((&bytes[..4], &bytes[16..20]), (&b"glTF"[..], &b"JSON"[..]));
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).expect("JSON")
}
