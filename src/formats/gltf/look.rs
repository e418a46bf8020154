//! Colours, texture coordinates and materials. What cannot be read of them is left out: the motion needs none of it.

use serde_json::Value;

use super::document::Document;
use super::scene::Vertex;
use crate::formats::appearance::picture;
use crate::gltf::{Material, Texture, shown_colour};

/// Where a material has the coordinates of its picture, and what moves them (KHR_texture_transform).
pub(super) struct TextureOf {
    attribute: String,
    offset: [f64; 2],
    rotation: f64,
    scale: [f64; 2],
}

impl TextureOf {
    /// Those of a material; the first coordinates, unmoved, where it says nothing.
    pub(super) fn material(document: &Document, material: Option<usize>) -> Self {
        let material = material.and_then(|index| document.element("materials", index).ok());
        let picture = material.map_or(&Value::Null, |material| base(material, "baseColorTexture"));
        let moved = &picture["extensions"]["KHR_texture_transform"];
        let set = moved["texCoord"]
            .as_u64()
            .or_else(|| picture["texCoord"].as_u64());
        let pair =
            |key: &str, default: f64| [0, 1].map(|k| moved[key][k].as_f64().unwrap_or(default));
        Self {
            attribute: format!("TEXCOORD_{}", set.unwrap_or(0)),
            offset: pair("offset", 0.0),
            rotation: moved["rotation"].as_f64().unwrap_or(0.0),
            scale: pair("scale", 1.0),
        }
    }

    /// Coordinates of the file, from the upper left corner, as ours, from the lower left one.
    fn place(&self, [u, v]: [f64; 2]) -> [f32; 2] {
        let [u, v] = [u * self.scale[0], v * self.scale[1]];
        let (sine, cosine) = self.rotation.sin_cos();
        let u_moved = cosine * u + sine * v + self.offset[0];
        let v_moved = cosine * v - sine * u + self.offset[1];
        [u_moved as f32, (1.0 - v_moved) as f32]
    }
}

/// Adds colours and texture coordinates to the vertices of a primitive.
pub(super) fn add(
    document: &Document,
    attributes: &Value,
    of: &TextureOf,
    vertices: &mut [Vertex],
) {
    let rows = |name: &str, allowed: &[&str]| {
        let accessor = document.whole(attributes, name).ok()??;
        document.rows(accessor, allowed).ok()
    };
    if let Some(colours) = rows("COLOR_0", &["VEC3", "VEC4"]) {
        for (vertex, [r, g, b, opacity]) in vertices.iter_mut().zip(colours.vectors()) {
            let opacity = if colours.width == 4 { opacity } else { 1.0 };
            vertex.colour = Some(shown_colour([r, g, b, opacity].map(|part| part as f32)));
        }
    }
    if let Some(places) = rows(&of.attribute, &["VEC2"]) {
        for (vertex, place) in vertices.iter_mut().zip(places.vectors()) {
            vertex.texture = Some(of.place(place));
        }
    }
}

/// A key of the part of a material that says how light is reflected.
fn base<'a>(material: &'a Value, key: &str) -> &'a Value {
    &material["pbrMetallicRoughness"][key]
}

/// All materials of the file.
pub(super) fn materials(document: &Document) -> Vec<Material> {
    let all = document.root()["materials"]
        .as_array()
        .into_iter()
        .flatten()
        .enumerate();
    all.map(|(k, material)| {
        let factor = |part: usize| {
            base(material, "baseColorFactor")[part]
                .as_f64()
                .unwrap_or(1.0)
        };
        let name = material["name"].as_str().map(str::to_owned);
        Material {
            name: name.unwrap_or_else(|| format!("material {k}")),
            colour: shown_colour([0, 1, 2, 3].map(|part| factor(part) as f32)),
            texture: texture(document, base(material, "baseColorTexture")),
        }
    })
    .collect()
}

/// The picture of a material; none where it is of a kind that GLB does not hold.
fn texture(document: &Document, of: &Value) -> Option<Texture> {
    let index = document.whole(of, "index").ok()??;
    let texture = document.element("textures", index).ok()?;
    let image = document
        .element("images", document.whole(texture, "source").ok()??)
        .ok()?;
    let bytes = match image["uri"].as_str() {
        Some(uri) => document.fetch(uri).ok()?,
        None => document
            .view(document.whole(image, "bufferView").ok()??)
            .ok()?
            .0
            .to_vec(),
    };
    picture(bytes)
}
