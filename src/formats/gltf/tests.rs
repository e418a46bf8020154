//! Tests of the reader of glTF. The files are made by hand, or by the writer of this program.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::*;
use crate::formats::malformed::written;
use crate::gltf::{Material, Morphing, Part, Precision, Texture, morphing};

/// A GLB of JSON and bytes.
pub(crate) fn glb(root: &Value, bytes: &[u8]) -> Vec<u8> {
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = bytes.to_vec();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut file = b"glTF\x02\0\0\0".to_vec();
    let length = 12 + 8 + text.len() + 8 + bytes.len();
    file.extend((length as u32).to_le_bytes());
    for (kind, data) in [(b"JSON", text), (b"BIN\0", bytes)] {
        file.extend((data.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(data);
    }
    file
}

/// A square of two triangles: four float32 places, six indices of a byte, in one buffer of 54 bytes.
pub(crate) fn square() -> (Value, Vec<u8>) {
    let places: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bytes: Vec<u8> = places
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    bytes.extend([0, 1, 2, 0, 2, 3]);
    let root = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "square"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": 54}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 6},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"},
        ],
    });
    (root, bytes)
}

fn read(name: &str, bytes: &[u8]) -> Result<Shape, ShapeError> {
    written(name, bytes, crate::formats::read)
}

/// The square with its JSON changed.
fn changed(change: impl Fn(&mut Value)) -> Result<Shape, ShapeError> {
    let (mut root, bytes) = square();
    change(&mut root);
    read("square.glb", &glb(&root, &bytes))
}

fn message(change: impl Fn(&mut Value)) -> String {
    changed(change).expect_err("refused").to_string()
}

#[test]
fn bytes_are_found_in_the_chunk_in_the_text_and_beside_the_file() {
    let (mut root, bytes) = square();
    let inside = read("square.glb", &glb(&root, &bytes)).expect("chunk").mesh;
    assert_eq!(
        (inside.vertices.len(), inside.vertices[2]),
        (4, [1.0, 1.0, 0.0])
    );
    assert_eq!(inside.triangles, [[0, 1, 2], [0, 2, 3]]);
    let data = format!(
        "data:application/octet-stream;base64,{}",
        STANDARD.encode(&bytes)
    );
    root["buffers"][0]["uri"] = json!(data);
    assert_eq!(
        read("square.gltf", root.to_string().as_bytes())
            .expect("text")
            .mesh,
        inside
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("square one.bin"), &bytes).expect("written");
    root["buffers"][0]["uri"] = json!("square%20one.bin");
    let path = folder.path().join("square.gltf");
    std::fs::write(&path, root.to_string()).expect("written");
    assert_eq!(crate::formats::read(&path).expect("beside").mesh, inside);
    for (uri, problem) in [
        (
            "none.bin",
            "refers to \"none.bin\" beside it, which cannot be read",
        ),
        ("/dev/zero", "must be the name of a file beside this one"),
        (
            "https://example.org/a.bin",
            "must be the name of a file beside this one",
        ),
        ("data:,hello", "must be data in base64"),
    ] {
        root["buffers"][0]["uri"] = json!(uri);
        let text = read("square.gltf", root.to_string().as_bytes())
            .expect_err("refused")
            .to_string();
        assert!(text.contains(problem), "{text}");
    }
}

#[test]
fn nodes_place_their_meshes_and_a_mirror_keeps_triangles_outwards() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let shape = changed(|root| {
        root["nodes"] = json!([
            {"children": [1, 2], "translation": [0, 0, 10]},
            {"mesh": 0, "scale": [2, 3, 1], "rotation": [0, 0, half, half]},
            {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]},
        ]);
    });
    let mesh = shape.expect("read").mesh;
    // (1, 0, 0) scaled to (2, 0, 0), turned by 90 degrees about z, moved up.
    let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(
        close(mesh.vertices[1], [0.0, 2.0, 10.0]),
        "{:?}",
        mesh.vertices
    );
    assert!(
        close(mesh.vertices[5], [4.0, 0.0, 10.0]),
        "{:?}",
        mesh.vertices
    );
    assert_eq!(mesh.triangles[2..], [[4, 6, 5], [4, 7, 6]]);
    assert!((mesh.area() - 7.0).abs() < 1e-12);
}

#[test]
fn strips_and_fans_become_triangles_and_points_a_cloud() {
    let strip = changed(|root| {
        root["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}, "mode": 5});
    });
    assert_eq!(strip.expect("read").mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    let fan = changed(|root| {
        root["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}, "mode": 6});
    });
    assert_eq!(fan.expect("read").mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let points = message(|root| root["meshes"][0]["primitives"][0]["mode"] = json!(0));
    assert!(points.contains("4 points, at least 64 needed"), "{points}");
    let lines = message(|root| root["meshes"][0]["primitives"][0]["mode"] = json!(1));
    assert!(lines.contains("no triangles and no points"), "{lines}");
}

/// A moving square with a seam, its colours and its picture, as this program writes it.
fn textured(precision: Precision) -> (Vec<u8>, Vec<[f32; 2]>, Vec<[f32; 4]>) {
    let places = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]];
    let moved = places.iter().map(|[x, y, z]| [*x, *y, z + 1.0]).collect();
    let texture = vec![
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.25, 0.25],
        [0.5, 1.0],
        [0.0, 1.0],
    ];
    let colours = vec![[0.5, 0.25, 1.0, 1.0]; 6];
    let part = |name: &str, triangles| Part {
        name: Some(name.to_owned()),
        material: Some(0),
        triangles,
    };
    let picture = Texture {
        mime: "image/png",
        bytes: b"\x89PNG and so on".to_vec(),
    };
    let file = morphing(&Morphing {
        name: "square",
        times: &[0.0, 1.0],
        seconds: &[0.0, 2.0],
        positions: &[places, moved],
        origin: &[0, 1, 2, 0, 2, 3],
        parts: &[part("a", vec![[0, 1, 2]]), part("b", vec![[3, 4, 5]])],
        materials: &[Material {
            name: "skin".to_owned(),
            colour: [0.5, 0.25, 1.0, 0.75],
            texture: Some(picture),
        }],
        colours: Some(&colours),
        texture: Some(&texture),
        precision,
    });
    (file.expect("a file"), texture, colours)
}

#[test]
fn what_this_program_writes_comes_back_quantised_or_not_with_its_look() {
    for (precision, within) in [(Precision::Full, 1e-7), (Precision::Compact, 4e-5)] {
        let (file, texture, colours) = textured(precision);
        let (shape, look) = written("square.glb", &file, |path| {
            let shape = crate::formats::read(path).expect("read");
            let look = Appearance::read(&shape).expect("looks");
            (shape, look)
        });
        // Both parts share all vertices of the file: the corners at a seam are one vertex, with one normal.
        assert_eq!(shape.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        let right = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]];
        for (found, right) in shape
            .mesh
            .vertices
            .iter()
            .flatten()
            .zip(right.iter().flatten())
        {
            assert!(
                (found - right).abs() <= within,
                "{found} instead of {right}"
            );
        }
        assert!(shape.mesh.normals.is_some());
        // The writer gives each part all vertices, so they come once for each part.
        assert_eq!(look.origin, [0, 1, 2, 0, 2, 3, 0, 1, 2, 0, 2, 3]);
        let found = look.texture.expect("coordinates");
        for (found, right) in found[..6].iter().flatten().zip(texture.iter().flatten()) {
            assert!((found - right).abs() < 1e-6);
        }
        for (found, right) in look
            .colours
            .expect("colours")
            .iter()
            .flatten()
            .zip(colours.iter().flatten())
        {
            assert!((found - right).abs() < 1e-4, "{found} instead of {right}");
        }
        assert_eq!(look.parts[1].triangles, [[9, 10, 11]]);
        let [skin] = &look.materials[..] else {
            panic!("one material");
        };
        assert_eq!(
            (skin.name.as_str(), look.parts[1].material),
            ("skin", Some(0))
        );
        assert!(
            (skin.colour[1] - 0.25).abs() < 1e-6 && skin.colour[3] == 0.75,
            "{skin:?}"
        );
        assert_eq!(
            skin.texture.as_ref().map(|picture| &picture.bytes[..]),
            Some(&b"\x89PNG and so on"[..])
        );
    }
}

#[test]
fn coordinates_of_a_picture_are_moved_as_the_material_says() {
    let (mut root, mut bytes) = square();
    bytes.resize(56, 0);
    bytes.extend(
        [[0.5f32, 0.25]; 4]
            .iter()
            .flatten()
            .flat_map(|x| x.to_le_bytes()),
    );
    root["buffers"][0]["byteLength"] = json!(bytes.len());
    root["bufferViews"]
        .as_array_mut()
        .expect("views")
        .push(json!({"buffer": 0, "byteOffset": 56, "byteLength": 32}));
    let accessor = json!({"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"});
    root["accessors"]
        .as_array_mut()
        .expect("accessors")
        .push(accessor);
    root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(2);
    root["meshes"][0]["primitives"][0]["material"] = json!(0);
    let moved = json!({"offset": [0.5, 0], "scale": [2, 4], "rotation": std::f64::consts::FRAC_PI_2, "texCoord": 1});
    root["materials"] = json!([{"pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": moved}}}}]);
    let look = written("square.glb", &glb(&root, &bytes), |path| {
        Appearance::read(&crate::formats::read(path).expect("read")).expect("looks")
    });
    // Scaled to (1, 1), turned counter-clockwise to (1, -1), moved to (1.5, -1); up is down here.
    let [u, v] = look.texture.expect("coordinates")[0];
    assert!((u - 1.5).abs() < 1e-6 && (v - 2.0).abs() < 1e-6, "{u} {v}");
    assert_eq!(look.materials[0].texture, None, "there is no such picture");
}

#[test]
fn what_is_compressed_sparse_or_unknown_is_refused_with_a_cure() {
    let draco = "KHR_draco_mesh_compression";
    assert!(
        message(|root| root["extensionsRequired"] = json!([draco]))
            .contains("export it without compression")
    );
    let meshopt = json!(["EXT_meshopt_compression"]);
    assert!(
        message(|root| root["extensionsRequired"] = meshopt.clone())
            .contains("(EXT_meshopt_compression)")
    );
    assert!(
        message(|root| root["extensionsRequired"] = json!(["ACME_x"]))
            .contains("requires the extension ACME_x")
    );
    assert!(
        message(|root| root["accessors"][0]["sparse"] = json!({})).contains("accessors[0]: sparse")
    );
    let undone = |root: &mut Value| {
        let accessor = root["accessors"][0].as_object_mut().expect("one");
        accessor.remove("bufferView");
    };
    assert!(message(undone).contains("accessors[0]: it has no data"));
    assert!(
        message(|root| root["asset"]["version"] = json!("1.0"))
            .contains("version \"1.0\": must be 2.0")
    );
    let skinned =
        changed(|root| root["nodes"][0] = json!({"mesh": 0, "skin": 0, "translation": [9, 9, 9]}));
    let skinned = skinned.expect("read");
    assert!(
        skinned.notes[0].contains("skin is not applied"),
        "{:?}",
        skinned.notes
    );
    assert_eq!(skinned.mesh.vertices[0], [0.0; 3]);
}

#[test]
fn numbers_that_lie_are_named() {
    assert!(
        message(|root| root["accessors"][0]["count"] = json!(u64::MAX))
            .contains("accessors[0]: 18446744073709551615 values")
    );
    assert!(
        message(|root| root["accessors"][0]["count"] = json!(5))
            .contains("do not fit into the 48 bytes")
    );
    assert!(message(|root| root["bufferViews"][0]["byteStride"] = json!(0)).contains("0 apart"));
    assert!(
        message(|root| root["accessors"][0]["count"] = json!(-1))
            .contains("count -1: must be a whole number")
    );
    assert!(
        message(|root| root["accessors"][0]["componentType"] = json!(5124))
            .contains("componentType 5124")
    );
    assert!(
        message(|root| root["accessors"][0]["type"] = json!("VEC2"))
            .contains("type VEC2, must be VEC3")
    );
    assert!(
        message(|root| root["bufferViews"][0]["byteOffset"] = json!(u64::MAX))
            .contains("bufferViews[0] has")
    );
    assert!(
        message(|root| root["buffers"][0]["byteLength"] = json!(1000))
            .contains("56 bytes, 1000 needed")
    );
    assert!(
        message(|root| root["accessors"][0]["count"] = json!(3))
            .contains("index 5 is 3 (the primitive has 3")
    );
    assert!(
        message(|root| root["accessors"][1]["count"] = json!(5))
            .contains("5 corners: must be three")
    );
    assert!(
        message(|root| root["nodes"][0]["mesh"] = json!(7))
            .contains("meshes[7] does not exist (the file has 1)")
    );
    assert!(
        message(|root| root["nodes"][0]["children"] = json!([0]))
            .contains("nodes[0] has two parents")
    );
    assert!(
        message(|root| root["nodes"][0]["scale"] = json!([1, 2]))
            .contains("nodes[0].scale: must be 3 numbers")
    );
    let (root, bytes) = square();
    let whole = glb(&root, &bytes);
    let cut = read("a.glb", &whole[..whole.len() - 8])
        .expect_err("refused")
        .to_string();
    assert!(cut.contains("it is truncated"), "{cut}");
    assert!(
        read("a.gltf", b"{\"asset\":")
            .expect_err("refused")
            .to_string()
            .contains("its JSON: ")
    );
    assert!(read("a.gltf", "[".repeat(100_000).as_bytes()).is_err());
}
