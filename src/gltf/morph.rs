//! One mesh whose vertices move: morph targets, one for each time, on a timeline.
//!
//! The mesh itself is the first of the times. Target `k` holds what is added to positions and normals at time `k`.
//! The weights are 1 for one target and 0 for all others at each time, and linear in between.

use serde_json::{Value, json};

use super::SECONDS;
use super::builder::{Builder, GltfError, Precision, QUANTISED};
use crate::geometry::vertex_normals;

/// Triangles of one material.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Part {
    /// The name of its group in the file that it comes from, if it has one.
    pub name: Option<String>,
    /// Its material, a number in the list of them.
    pub material: Option<usize>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// What a surface is made of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Material {
    /// Its name.
    pub name: String,
    /// Red, green, blue and opacity, 0 to 1, as displays show them (sRGB).
    pub colour: [f32; 4],
    /// A picture that the texture coordinates refer to.
    pub texture: Option<Texture>,
}

/// A picture, as its file holds it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Texture {
    /// `image/png` or `image/jpeg`.
    pub mime: &'static str,
    /// The bytes of the file.
    pub bytes: Vec<u8>,
}

/// A mesh or a cloud that moves.
pub(crate) struct Morphing<'a> {
    /// Its name.
    pub name: &'a str,
    /// Ascending times, 0 to 1.
    pub times: &'a [f64],
    /// The positions at each of the times, `[times, vertices]`.
    pub positions: &'a [Vec<[f64; 3]>],
    /// For each vertex of the file that is written the vertex that it moves with: those along a seam of a
    /// texture occur twice.
    pub origin: &'a [u32],
    /// The triangles over the vertices that are written; a cloud has none.
    pub parts: &'a [Part],
    /// What the parts are made of.
    pub materials: &'a [Material],
    /// Colours of the vertices, if they have any, as displays show them (sRGB).
    pub colours: Option<&'a [[f32; 4]]>,
    /// Texture coordinates, if there are any; the second one points up.
    pub texture: Option<&'a [[f32; 2]]>,
    /// How numbers are stored.
    pub precision: Precision,
}

/// The colour of a surface that has none of its own (sRGB).
const PLAIN: [f32; 4] = [0.91, 0.54, 0.24, 1.0];

/// A GLB file of a mesh, or a cloud, that moves.
///
/// # Errors
/// [`GltfError::TooLarge`].
///
/// # Panics
/// If there is no time, or not a list of positions for each.
pub(crate) fn morphing(scene: &Morphing) -> Result<Vec<u8>, GltfError> {
    assert_eq!(
        scene.times.len(),
        scene.positions.len(),
        "one list for each time"
    );
    let mut builder = Builder::default();
    let frame = Frame::around(scene.positions, scene.precision);
    let shapes = Shapes::of(scene, &frame);
    let attributes = attributes(scene, &shapes, &mut builder);
    let targets = shapes.targets(scene.precision, &mut builder);
    let primitives = primitives(scene, &attributes, &targets, &mut builder);
    let mut mesh = json!({"name": scene.name, "primitives": primitives});
    let mut node = json!({"name": scene.name, "mesh": 0});
    frame.place(&mut node);
    let mut root = json!({"scene": 0, "scenes": [{"nodes": [0]}]});
    if !targets.is_empty() {
        mesh["weights"] = json!(vec![0.0; targets.len()]);
        let named = scene.times[1..].iter().map(|time| format!("t={time:.3}"));
        mesh["extras"] = json!({"targetNames": named.collect::<Vec<_>>()});
        root["animations"] = json!([animation(scene.times, &mut builder)]);
    }
    root["nodes"] = json!([node]);
    root["meshes"] = json!([mesh]);
    add_materials(scene, &mut root, &mut builder);
    require_quantised(scene.precision, &mut root);
    builder.finish(root)
}

/// States that positions are integers, where they are.
pub(super) fn require_quantised(precision: Precision, root: &mut Value) {
    if precision == Precision::Compact {
        root["extensionsUsed"] = json!([QUANTISED]);
        root["extensionsRequired"] = json!([QUANTISED]);
    }
}

/// Where the numbers of a file lie in the coordinates of the input.
pub(super) struct Frame {
    origin: [f64; 3],
    scale: f64,
}

/// Coordinates that are so many times larger than the shape are written relative to the shape: 32-bit numbers
/// would be too coarse.
const LARGEST_FOR_F32: f64 = 100.0;

impl Frame {
    /// That of all these positions.
    pub(super) fn around<'a>(
        positions: impl IntoIterator<Item = &'a Vec<[f64; 3]>>,
        precision: Precision,
    ) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for x in positions.into_iter().flatten() {
            for k in 0..3 {
                low[k] = low[k].min(x[k]);
                high[k] = high[k].max(x[k]);
            }
        }
        let span = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        let farthest = low
            .iter()
            .chain(&high)
            .fold(0.0, |a: f64, b| a.max(b.abs()));
        let is_empty = low[0] > high[0];
        if precision == Precision::Compact && !is_empty {
            let scale = if span > 0.0 { span } else { 1.0 };
            Self { origin: low, scale }
        } else if farthest > LARGEST_FOR_F32 * span && !is_empty {
            Self {
                origin: low,
                scale: 1.0,
            }
        } else {
            Self {
                origin: [0.0; 3],
                scale: 1.0,
            }
        }
    }

    /// A position in the numbers of the file.
    pub(super) fn apply(&self, x: [f64; 3]) -> [f32; 3] {
        [0, 1, 2].map(|k| ((x[k] - self.origin[k]) / self.scale) as f32)
    }

    /// Gives a node the way back.
    pub(super) fn place(&self, node: &mut Value) {
        if self.scale != 1.0 {
            node["scale"] = json!(vec![self.scale; 3]);
        }
        if self.origin != [0.0; 3] {
            node["translation"] = json!(self.origin);
        }
    }
}

/// Positions and normals at each time, in the numbers of the file.
struct Shapes {
    positions: Vec<Vec<[f32; 3]>>,
    /// None of a cloud.
    normals: Option<Vec<Vec<[f32; 3]>>>,
}

impl Shapes {
    fn of(scene: &Morphing, frame: &Frame) -> Self {
        let spread = |of: &[[f32; 3]]| -> Vec<[f32; 3]> {
            scene.origin.iter().map(|k| of[*k as usize]).collect()
        };
        // Over the vertices as they move together, so that a seam does not show.
        let triangles: Vec<[u32; 3]> = (scene.parts.iter().flat_map(|part| &part.triangles))
            .map(|corners| corners.map(|corner| scene.origin[corner as usize]))
            .collect();
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        for now in scene.positions {
            let placed: Vec<[f32; 3]> = now.iter().map(|x| frame.apply(*x)).collect();
            if !triangles.is_empty() {
                let all = vertex_normals(&placed, &triangles)
                    .into_iter()
                    .map(directed);
                normals.push(spread(&all.collect::<Vec<_>>()));
            }
            positions.push(spread(&placed));
        }
        let normals = (!triangles.is_empty()).then_some(normals);
        Self { positions, normals }
    }

    /// What is added at each time but the first.
    fn targets(&self, precision: Precision, builder: &mut Builder) -> Vec<Value> {
        let apart = |now: &[[f32; 3]], first: &[[f32; 3]]| -> Vec<[f32; 3]> {
            let apart = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|k| a[k] - b[k]);
            now.iter().zip(first).map(apart).collect()
        };
        let target = |k: usize| {
            let moved = apart(&self.positions[k], &self.positions[0]);
            let position = match precision {
                Precision::Full => builder.vectors(&moved, true),
                Precision::Compact => builder.unit_displacements(&moved),
            };
            let mut target = json!({"POSITION": position});
            if let Some(normals) = &self.normals {
                let turned = apart(&normals[k], &normals[0]);
                target["NORMAL"] = json!(match precision {
                    Precision::Full => builder.vectors(&turned, false),
                    Precision::Compact => builder.unit_normals(&turned),
                });
            }
            target
        };
        (1..self.positions.len()).map(target).collect()
    }
}

/// A normal, of any direction where it has none: the format allows no other length than 1.
pub(super) fn directed(normal: [f32; 3]) -> [f32; 3] {
    if normal == [0.0; 3] {
        [0.0, 0.0, 1.0]
    } else {
        normal
    }
}

/// What each vertex has at the first time.
fn attributes(scene: &Morphing, shapes: &Shapes, builder: &mut Builder) -> Value {
    let positions = &shapes.positions[0];
    let mut attributes = match scene.precision {
        Precision::Full => json!({"POSITION": builder.vectors(positions, true)}),
        Precision::Compact => json!({"POSITION": builder.unit_positions(positions)}),
    };
    if let Some(normals) = &shapes.normals {
        attributes["NORMAL"] = json!(match scene.precision {
            Precision::Full => builder.vectors(&normals[0], false),
            Precision::Compact => builder.unit_normals(&normals[0]),
        });
    }
    if let Some(colours) = scene.colours {
        let linear: Vec<[f32; 4]> = colours.iter().map(|colour| linear(*colour)).collect();
        attributes["COLOR_0"] = json!(builder.colours(&linear));
    }
    if let Some(texture) = scene.texture {
        // From the upper left corner of the picture here, from the lower left one in PLY and OBJ.
        let down: Vec<[f32; 2]> = texture.iter().map(|[u, v]| [*u, 1.0 - v]).collect();
        attributes["TEXCOORD_0"] = json!(builder.vectors(&down, false));
    }
    attributes
}

fn primitives(
    scene: &Morphing,
    attributes: &Value,
    targets: &[Value],
    builder: &mut Builder,
) -> Vec<Value> {
    let common = |material: usize| {
        let mut primitive = json!({"attributes": attributes, "material": material});
        if !targets.is_empty() {
            primitive["targets"] = json!(targets);
        }
        primitive
    };
    // The material without a name comes after those of the file.
    let plain = scene.materials.len();
    let filled = scene.parts.iter().filter(|part| !part.triangles.is_empty());
    let mut primitives: Vec<Value> = filled
        .map(|part| {
            let mut primitive = common(part.material.unwrap_or(plain));
            let indices = builder.triangles(&part.triangles, scene.origin.len());
            primitive["indices"] = json!(indices);
            if let Some(name) = &part.name {
                primitive["extras"] = json!({"group": name});
            }
            primitive
        })
        .collect();
    if primitives.is_empty() {
        let mut points = common(plain);
        points["mode"] = json!(0);
        primitives.push(points);
    }
    primitives
}

/// The weights of all targets over time.
fn animation(times: &[f64], builder: &mut Builder) -> Value {
    let seconds: Vec<f32> = times.iter().map(|time| (SECONDS * time) as f32).collect();
    let targets = times.len() - 1;
    let mut weights = vec![0.0; times.len() * targets];
    for k in 1..times.len() {
        weights[k * targets + k - 1] = 1.0;
    }
    let (input, output) = (
        builder.times(&seconds),
        builder.numbers(&weights, "SCALAR", 1),
    );
    json!({
        "name": "motion",
        "samplers": [{"input": input, "output": output, "interpolation": "LINEAR"}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
    })
}

fn add_materials(scene: &Morphing, root: &mut Value, builder: &mut Builder) {
    let (mut images, mut textures, mut materials) = (Vec::new(), Vec::new(), Vec::new());
    for material in scene.materials {
        let mut made = surface(&material.name, material.colour);
        if let (Some(texture), true) = (&material.texture, scene.texture.is_some()) {
            let view = builder.view(texture.bytes.iter().copied());
            images.push(json!({"mimeType": texture.mime, "bufferView": view}));
            textures.push(json!({"source": images.len() - 1, "sampler": 0}));
            let index = textures.len() - 1;
            made["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": index});
        }
        materials.push(made);
    }
    let is_coloured = scene.colours.is_some();
    if scene.parts.iter().any(|part| part.material.is_none()) || scene.parts.is_empty() {
        materials.push(surface(
            scene.name,
            if is_coloured { [1.0; 4] } else { PLAIN },
        ));
    }
    root["materials"] = json!(materials);
    if !images.is_empty() {
        root["images"] = json!(images);
        root["textures"] = json!(textures);
        root["samplers"] = json!([{"wrapS": 10497, "wrapT": 10497}]);
    }
}

/// A dull surface, seen from both sides.
pub(super) fn surface(name: &str, colour: [f32; 4]) -> Value {
    let mut material = json!({
        "name": name,
        "doubleSided": true,
        "pbrMetallicRoughness":
            {"baseColorFactor": linear(colour), "metallicFactor": 0.0, "roughnessFactor": 0.7},
    });
    if colour[3] < 1.0 {
        material["alphaMode"] = json!("BLEND");
    }
    material
}

/// From sRGB to linear light, in which glTF states colours (IEC 61966-2-1); opacity stays.
fn linear([r, g, b, opacity]: [f32; 4]) -> [f32; 4] {
    let one = |shown: f32| {
        let shown = shown.clamp(0.0, 1.0);
        match shown <= 0.04045 {
            true => shown / 12.92,
            false => ((shown + 0.055) / 1.055).powf(2.4),
        }
    };
    [one(r), one(g), one(b), opacity.clamp(0.0, 1.0)]
}

#[cfg(test)]
mod tests {
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
}
