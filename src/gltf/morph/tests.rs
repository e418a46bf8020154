//! Animated files of one mesh, read back.

use super::super::testing::{Glb, approx};
use super::*;

/// A square of two triangles that turns about its first edge and moves to the right.
fn square(by: f64) -> Vec<[f64; 3]> {
    let (y, z) = (f64::cos(by), f64::sin(by));
    let corner = |u: f64, v: f64| [2.0 * u + by, v * y, v * z];
    vec![
        corner(0.0, 0.0),
        corner(1.0, 0.0),
        corner(1.0, 1.0),
        corner(0.0, 1.0),
    ]
}

const TIMES: [f64; 3] = [0.0, 0.25, 1.0];
const SECONDS: [f64; 3] = [0.0, 0.5, 2.0];

fn positions() -> Vec<Vec<[f64; 3]>> {
    TIMES.iter().map(|time| square(*time)).collect()
}

fn two_triangles() -> [Part; 1] {
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    [Part {
        triangles,
        ..Part::default()
    }]
}

fn with<'a>(
    precision: Precision,
    positions: &'a [Vec<[f64; 3]>],
    parts: &'a [Part],
    change: impl FnOnce(&mut Morphing<'a>),
) -> Glb {
    let mut scene = Morphing {
        name: "square",
        times: &TIMES[..positions.len()],
        seconds: &SECONDS[..positions.len()],
        positions,
        origin: &[0, 1, 2, 3],
        parts,
        materials: &[],
        colours: None,
        texture: None,
        precision,
    };
    change(&mut scene);
    Glb::read(&morphing(&scene).expect("small"))
}

/// The positions that a viewer shows at each time.
fn shown(glb: &Glb) -> Vec<Vec<[f64; 3]>> {
    let primitive = &glb.root["meshes"][0]["primitives"][0];
    let base = glb.vectors(&primitive["attributes"]["POSITION"]);
    let targets = primitive["targets"].as_array().cloned().unwrap_or_default();
    let node = &glb.root["nodes"][0];
    let place = |x: [f64; 3]| {
        [0, 1, 2].map(|k| {
            let scale = node["scale"][k].as_f64().unwrap_or(1.0);
            scale * x[k] + node["translation"][k].as_f64().unwrap_or(0.0)
        })
    };
    let mut all = vec![base.iter().map(|x| place(*x)).collect::<Vec<_>>()];
    for target in &targets {
        let by = glb.vectors(&target["POSITION"]);
        let sum = |(x, d): (&[f64; 3], &[f64; 3])| place([0, 1, 2].map(|k| x[k] + d[k]));
        all.push(base.iter().zip(&by).map(sum).collect());
    }
    all
}

#[test]
fn every_time_is_a_target_and_the_timeline_reaches_each_alone() {
    let glb = with(Precision::Full, &positions(), &two_triangles(), |_| ());
    // Rounding of numbers up to 3 to f32, twice.
    approx(&shown(&glb), &positions(), 1e-6);
    let mesh = &glb.root["meshes"][0];
    assert_eq!(mesh["extras"]["targetNames"], json!(["t=0.250", "t=1.000"]));
    let sampler = &glb.root["animations"][0]["samplers"][0];
    assert_eq!(glb.numbers(&sampler["input"]), [0.0, 0.5, 2.0]);
    assert_eq!(
        glb.numbers(&sampler["output"]),
        [0.0, 0.0, 1.0, 0.0, 0.0, 1.0]
    );
}

#[test]
fn normals_turn_with_the_surface() {
    let glb = with(Precision::Full, &positions(), &two_triangles(), |_| ());
    let primitive = &glb.root["meshes"][0]["primitives"][0];
    let base = glb.vectors(&primitive["attributes"]["NORMAL"]);
    let by = glb.vectors(&primitive["targets"][1]["NORMAL"]);
    for (normal, by) in base.iter().zip(&by) {
        let now = [0, 1, 2].map(|k| normal[k] + by[k]);
        approx(
            &[vec![now]],
            &[vec![[0.0, -f64::sin(1.0), f64::cos(1.0)]]],
            1e-6,
        );
    }
}

#[test]
fn compact_positions_are_off_by_less_than_a_step_of_sixteen_bits() {
    let glb = with(Precision::Compact, &positions(), &two_triangles(), |_| ());
    // Half a step of 1/65535 for the mesh and of 1/32767 for the target, of a box of 3.
    approx(
        &shown(&glb),
        &positions(),
        3.0 * (0.5 / 65535.0 + 0.5 / 32767.0) + 1e-6,
    );
    assert_eq!(glb.root["extensionsRequired"], json!([QUANTISED]));
}

#[test]
fn coordinates_of_maps_survive() {
    let far: Vec<Vec<[f64; 3]>> = (positions().into_iter())
        .map(|now| {
            now.into_iter()
                .map(|[x, y, z]| [x + 5e5, y + 5.2e6, z])
                .collect()
        })
        .collect();
    let glb = with(Precision::Full, &far, &two_triangles(), |_| ());
    approx(&shown(&glb), &far, 1e-6);
}

#[test]
fn one_time_is_a_mesh_that_stands_still() {
    let glb = with(Precision::Full, &positions()[..1], &two_triangles(), |_| ());
    assert!(glb.root.get("animations").is_none());
    assert!(
        glb.root["meshes"][0]["primitives"][0]
            .get("targets")
            .is_none()
    );
}

#[test]
fn a_cloud_is_points_without_normals() {
    let glb = with(Precision::Full, &positions(), &[], |_| ());
    let primitive = &glb.root["meshes"][0]["primitives"][0];
    assert_eq!(primitive["mode"], json!(0));
    assert!(primitive["attributes"].get("NORMAL").is_none());
}

#[test]
fn groups_colours_and_textures_go_along() {
    let parts = [
        Part {
            name: Some("left".into()),
            material: Some(0),
            triangles: vec![[0, 1, 2]],
        },
        Part {
            name: None,
            material: None,
            triangles: vec![[4, 2, 3]],
        },
    ];
    let material = Material {
        name: "skin".to_owned(),
        colour: [1.0, 0.5, 0.0, 0.5],
        texture: Some(Texture {
            mime: "image/png",
            bytes: vec![1, 2, 3],
        }),
    };
    let (materials, colours) = ([material], vec![[0.5, 1.0, 0.0, 1.0]; 5]);
    let texture = vec![[0.25, 1.0]; 5];
    let at = positions();
    let glb = with(Precision::Full, &at, &parts, |scene| {
        scene.origin = &[0, 1, 2, 3, 0];
        scene.materials = &materials;
        scene.colours = Some(&colours);
        scene.texture = Some(&texture);
    });
    let primitives = &glb.root["meshes"][0]["primitives"];
    assert_eq!(primitives[0]["extras"]["group"], json!("left"));
    assert_eq!(primitives[1]["material"], json!(1), "a plain one is added");
    let made = &glb.root["materials"][0];
    assert_eq!(
        (&made["name"], &made["alphaMode"]),
        (&json!("skin"), &json!("BLEND"))
    );
    let view = glb.root["images"][0]["bufferView"]
        .as_u64()
        .expect("a picture");
    assert_eq!(glb.view(view as usize), [1, 2, 3]);
    let at = &primitives[0]["attributes"];
    // 0.5 in sRGB is 0.214 in linear light.
    let colour = glb.rows(&at["COLOR_0"]);
    assert!(
        (colour[0][0] - 0.21404).abs() < 1e-4 && colour[0][1] == 1.0,
        "{colour:?}"
    );
    assert_eq!(glb.rows(&at["TEXCOORD_0"])[0], [0.25, 0.0], "from above");
    // The vertex that occurs twice lies in the same place twice.
    let shown = glb.vectors(&at["POSITION"]);
    assert_eq!(shown[0], shown[4]);
}
