//! The colours, textures, groups and materials of small files.

use super::*;
use crate::formats;

fn read(files: &[(&str, &[u8])]) -> Appearance {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("written");
    }
    let shape = formats::read(&folder.path().join(files[0].0)).expect("a shape");
    Appearance::read(&shape).expect("what it looks like")
}

#[test]
fn an_obj_gives_groups_materials_and_a_vertex_for_each_texture_coordinate() {
    let obj = "mtllib skin.mtl\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\n\
        vt 0 0\nvt 1 0\nvt 1 1\nvt .5 .5\ng left\nusemtl skin\nf 1/1 2/2 3/3\n\
        g right\nusemtl bare\nf 1/4 3/-2 -1/-1\n";
    let library = "newmtl skin\nKd 0.5 0.25 1\nd 0.5\nmap_Kd -clamp on skin.png\n";
    let picture = b"\x89PNG and so on";
    let found = read(&[
        ("shape.obj", obj.as_bytes()),
        ("skin.mtl", library.as_bytes()),
        ("skin.png", picture),
    ]);
    assert_eq!(
        found.origin,
        [0, 1, 2, 0, 3],
        "vertex 0 has two coordinates"
    );
    let texture = found.texture.expect("coordinates");
    assert_eq!(
        (texture[0], texture[3], texture[4]),
        ([0.0; 2], [0.5; 2], [0.5; 2])
    );
    assert_eq!(found.colours.expect("colours")[3], [1.0, 0.0, 0.0, 1.0]);
    let parts: Vec<_> = (found.parts.iter())
        .map(|part| (part.name.as_deref(), part.material, &part.triangles[..]))
        .collect();
    assert_eq!(
        parts,
        [
            (Some("left"), Some(0), &[[0, 1, 2]][..]),
            (Some("right"), Some(1), &[[3, 2, 4]][..])
        ]
    );
    let [skin, bare] = &found.materials[..] else {
        panic!("two materials");
    };
    assert_eq!(
        (skin.name.as_str(), skin.colour),
        ("skin", [0.5, 0.25, 1.0, 0.5])
    );
    assert_eq!(
        skin.texture.as_ref().map(|texture| texture.mime),
        Some("image/png")
    );
    assert_eq!((bare.name.as_str(), &bare.texture), ("bare", &None));
}

#[test]
fn a_ply_gives_colours_and_texture_coordinates() {
    let ply = "ply\nformat ascii 1.0\ncomment TextureFile none.png\nelement vertex 3\n\
        property float x\nproperty float y\nproperty float z\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\nproperty float s\nproperty float t\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 255 0 51 0.5 1\n1 0 0 0 0 0 0 0\n0 1 0 0 0 0 0 0\n3 0 1 2\n";
    let found = read(&[("shape.ply", ply.as_bytes())]);
    assert_eq!(found.colours.expect("colours")[0], [1.0, 0.0, 0.2, 1.0]);
    assert_eq!(found.texture.expect("coordinates")[0], [0.5, 1.0]);
    assert_eq!(found.parts[0].triangles, [[0, 1, 2]]);
    assert!(found.materials.is_empty(), "its picture is not there");
}

#[test]
fn a_shape_without_any_is_its_geometry() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 3 1 2\n";
    let found = read(&[("shape.obj", obj.as_bytes())]);
    assert_eq!(found.origin, [2, 0, 1]);
    assert_eq!(found.parts[0].triangles, [[0, 1, 2]]);
    assert_eq!((found.colours, found.texture), (None, None));
}

#[test]
fn a_cloud_in_text_gives_its_colours_and_an_stl_nothing() {
    let cloud = crate::formats::cloud::tests::helix(|[x, y, z], _| format!("{x},{y},{z},255,51,0"));
    let found = read(&[("cloud.csv", cloud.as_bytes())]);
    assert_eq!(found.colours.expect("colours")[63], [1.0, 0.2, 0.0, 1.0]);
    let square = crate::formats::stl::tests::SQUARE;
    let found = read(&[("square.stl", square.as_bytes())]);
    assert_eq!((found.origin.len(), found.colours), (4, None));
    assert_eq!(found.parts[0].triangles, [[0, 1, 2], [0, 2, 3]]);
}
