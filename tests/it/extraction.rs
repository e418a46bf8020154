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

#[test]
fn points_of_any_file_go_with_the_motion_and_the_rest_of_the_file_stays() {
    let _turn = turn();
    let place = instant();
    place.write("line.obj", "# a line\nv 1 0 0\nv 0 0 1\nv 30 0 0\nl 1 2\n");
    let warp = ["warp", "run", "--points", "line.obj", "-o", "moved.obj"];
    let ended = place.isomorph(&warp).succeeded();
    assert!(
        ended.stdout.contains("3 points moved from time 0 to 1"),
        "{ended:?}"
    );
    assert!(
        ended.stdout.contains("warning: 1 of them lie outside"),
        "{ended:?}"
    );
    let text = fs::read_to_string(place.path("moved.obj")).expect("a file");
    let rows = |text: &str| -> Vec<Vec<f64>> {
        let lines = text.lines().filter_map(|line| line.strip_prefix("v "));
        lines
            .map(|line| {
                line.split(' ')
                    .map(|word| word.parse().expect("a number"))
                    .collect()
            })
            .collect()
    };
    let moved = rows(&text);
    // The sphere moves by 1 along x.
    for (found, wanted) in moved.iter().zip([[2.0, 0.0, 0.0], [1.0, 0.0, 1.0]]) {
        for (a, b) in found.iter().zip(wanted) {
            assert!((a - b).abs() < 0.02, "{text}");
        }
    }
    assert!(
        text.contains("# a line") && text.contains("l 1 2"),
        "{text}"
    );
    // There and back, and not at all.
    let back = [
        "warp",
        "run",
        "--points",
        "moved.obj",
        "--from",
        "1",
        "--to",
        "0",
    ];
    place
        .isomorph(&[&back[..], &["-o", "back.obj"]].concat())
        .succeeded();
    let back = rows(&fs::read_to_string(place.path("back.obj")).expect("a file"));
    assert!((back[0][0] - 1.0).abs() < 1e-4, "{back:?}");
    // As text and as an array of numpy.
    for out in ["points.xyz", "points.npy"] {
        let warp = ["warp", "run", "--points", "line.obj", "-o", out];
        place.isomorph(&warp).succeeded();
    }
    let text = fs::read_to_string(place.path("points.xyz")).expect("a file");
    let row = |row: &[f64]| row.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let wanted: Vec<String> = moved.iter().map(|point| row(point)).collect();
    assert_eq!(text.lines().collect::<Vec<_>>(), wanted);
    let array = fs::read(place.path("points.npy")).expect("a file");
    let header = array.len() - 3 * 3 * 8;
    assert_eq!(header % 64, 0);
    assert!(String::from_utf8_lossy(&array[..header]).contains("'shape': (3, 3, )"));
    let numbers: Vec<f64> = array[header..]
        .as_chunks::<8>()
        .0
        .iter()
        .map(|bytes| f64::from_le_bytes(*bytes))
        .collect();
    assert_eq!(numbers, moved.concat());
    let late = [
        "warp", "run", "--points", "line.obj", "--to", "1.5", "-o", "x.obj",
    ];
    place
        .isomorph(&late)
        .refused(2, &["time 1.5: must be 0 to 1"]);
    let other = ["warp", "run", "--points", "line.obj", "-o", "x.stp"];
    place.isomorph(&other).refused(1, &["x.stp"]);
}

/// A sphere that moves by its radius, solved for, as `run`.
fn instant() -> Workplace {
    let sphere = Mesh::sphere(1.0, 3);
    let target = sphere.clone().map(|x| [x[0] + 1.0, x[1], x[2]]);
    let place = Workplace::with_pair(&sphere, &target, &[]);
    let small = [
        "--set",
        "preset=instant",
        "--set",
        "spline.band=3000",
        "--set",
        "data.points=3000",
    ];
    place.train("run", &[&small[..], &["--set", "result.frames=0"]].concat());
    place
}

#[test]
fn the_map_sends_each_vertex_where_it_goes_and_is_taken_as_pairs() {
    let _turn = turn();
    let place = instant();
    let ended = place.isomorph(&["map", "run", "-o", "map.csv"]).succeeded();
    assert!(
        ended
            .stdout
            .contains("target      100.0 % of its vertices are reached"),
        "{ended:?}"
    );
    let text = fs::read_to_string(place.path("map.csv")).expect("a file");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("source_index,target_index,confidence"));
    for (k, line) in lines.enumerate() {
        let [source, target, confidence] = line.split(',').collect::<Vec<_>>()[..] else {
            panic!("{line}");
        };
        assert_eq!((source, target), (&*k.to_string(), &*k.to_string()));
        let confidence: f64 = confidence.parse().expect("a number");
        assert!(confidence > 0.9 && confidence <= 1.0, "{line}");
    }
    let again = [
        "--set",
        "data.correspondences=map.csv",
        "--set",
        "training.steps=2",
    ];
    place.train(
        "again",
        &[&again[..], &["--set", "result.frames=0"]].concat(),
    );
}

#[test]
fn layers_and_trust_stand_beside_the_surface() {
    let _turn = turn();
    let place = instant();
    let extract = "extract run --times 0 --resolution 48 --trust --layers -0.1,0.2 -o out --json";
    let words: Vec<&str> = extract.split_whitespace().collect();
    let ended = place.isomorph(&words).succeeded();
    let events: Vec<Value> = ended
        .stdout
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let trusted = events.iter().find(|event| event["event"] == "trusted");
    let trusted = trusted.expect("a line about trust");
    assert!(
        trusted["quantile_95"].as_f64().expect("a length") < 0.01,
        "{trusted}"
    );
    let wanted = [
        "frames.json",
        "layer-000-0.ply",
        "layer-000-1.ply",
        "preview.png",
        "surface-000.ply",
    ];
    assert_eq!(names(&place.path("out")), wanted);
    let surface = Ply::read(&place.path("out/surface-000.ply"));
    let names = ["x", "y", "z", "nx", "ny", "nz", "quality", "round_trip"];
    assert_eq!(surface.properties, names);
    assert!(
        surface
            .rows
            .iter()
            .all(|row| row[6] >= 0.0 && row[6] < 0.02 && row[7] < 0.01)
    );
    // At time 0 the sphere is where it was read, and a layer a larger or a smaller one.
    for (file, radius) in [("layer-000-0.ply", 0.9), ("layer-000-1.ply", 1.2)] {
        let layer = Ply::read(&place.path("out").join(file));
        for row in &layer.rows {
            let found = (row[0] * row[0] + row[1] * row[1] + row[2] * row[2]).sqrt();
            assert!((found - radius).abs() < 0.02, "{file}: {found}");
        }
    }
    let refused = [
        "extract", "run", "--layers", "0.1", "--format", "glb", "--quiet",
    ];
    place
        .isomorph(&refused)
        .refused(2, &["an animation has none"]);
    let deep = [
        "extract", "run", "--times", "0", "--layers", "-1.5", "--quiet",
    ];
    place
        .isomorph(&deep)
        .refused(1, &["layer -1.5", "nearer to the surface"]);
}
