//! One mesh whose vertices move: morph targets, one for each time, on a timeline.
//!
//! The mesh itself is the first of the times. Target `k` holds what is added to positions and normals at time `k`.
//! The weights are 1 for one target and 0 for all others at each time, and linear in between.

use serde_json::{Value, json};

use super::builder::{Builder, GltfError, Precision, QUANTISED};
use super::frame::Frame;
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
    /// The times, as the shape keys are named.
    pub times: &'a [f64],
    /// When in the animation each is shown, in ascending seconds.
    pub seconds: &'a [f64],
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
        root["animations"] = json!([animation(scene.seconds, &mut builder)]);
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
fn animation(seconds: &[f64], builder: &mut Builder) -> Value {
    let seconds: Vec<f32> = seconds.iter().map(|second| *second as f32).collect();
    let targets = seconds.len() - 1;
    let mut weights = vec![0.0; seconds.len() * targets];
    for k in 1..seconds.len() {
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

/// The way back from [`linear`]: a colour as displays show it.
pub(crate) fn shown_colour([r, g, b, opacity]: [f32; 4]) -> [f32; 4] {
    let one = |linear: f32| {
        // In double precision, so that white stays 1.
        let linear = f64::from(linear.clamp(0.0, 1.0));
        let shown = match linear <= 0.003_130_8 {
            true => linear * 12.92,
            false => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
        };
        shown as f32
    };
    [one(r), one(g), one(b), opacity.clamp(0.0, 1.0)]
}

#[cfg(test)]
mod tests;
