//! How a shape looks, beside its geometry: colours of its vertices, texture coordinates, groups and materials.
//!
//! Where the file has none, or has them in another form, they are left out: none of it is needed for the motion.
//!
//! | file | what is read |
//! |---|---|
//! | PLY | `red green blue alpha`, texture coordinates `s t`, `u v` or `texture_u texture_v`, `comment TextureFile` |
//! | OBJ | colours after the coordinates, `vt`, `g` and `o`, `usemtl`; of `mtllib` `Kd`, `d` and `map_Kd` |
//! | glTF | `COLOR_0`, texture coordinates, names of nodes, base colours and their pictures |
//! | clouds in text | colours |

use std::collections::HashMap;
use std::path::Path;

use ply_rs::ply::{DefaultElement, Property};

use super::cloud::Cloud;
use super::error::ShapeError;
use super::gltf;
use super::obj::{self, Counts, parse_corner, statements, words};
use super::ply::PlyFile;
use super::polygons::Polygons;
use super::read::Format;
use super::shape::Shape;
use crate::gltf::{Material, Part, Texture};

/// How a shape looks. Vertices here are those of the file, except that one with several texture coordinates
/// occurs once for each.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Appearance {
    /// The file's vertex that each is.
    pub origin: Vec<u32>,
    /// Triangles by group and material.
    pub parts: Vec<Part>,
    /// What the parts are made of.
    pub materials: Vec<Material>,
    /// Red, green, blue and opacity, 0 to 1 (sRGB).
    pub colours: Option<Vec<[f32; 4]>>,
    /// Texture coordinates; the second one points up.
    pub texture: Option<Vec<[f32; 2]>>,
}

impl Appearance {
    /// Reads it from the file of a shape.
    ///
    /// # Errors
    /// A file that has changed since the shape was read.
    pub(crate) fn read(shape: &Shape) -> Result<Self, ShapeError> {
        let mut found = match Format::of(&shape.path) {
            Some(Format::Ply) => of_ply(shape)?,
            Some(Format::Obj) => of_obj(shape)?,
            Some(Format::Gltf) => gltf::appearance(shape)?,
            Some(Format::Cloud) => Self {
                colours: Cloud::read(&shape.path)?.colours,
                ..Self::plain(shape)
            },
            _ => Self::plain(shape),
        };
        // Of points that were left out nothing is shown.
        if let Some(kept) = &shape.kept {
            found.colours = found.colours.map(|all| kept.select(&all));
            found.texture = found.texture.map(|all| kept.select(&all));
        }
        Ok(found)
    }

    /// Nothing but the geometry.
    fn plain(shape: &Shape) -> Self {
        Self {
            origin: (0..shape.mesh.vertices.len() as u32).collect(),
            parts: vec![Part {
                triangles: shape.mesh.triangles.clone(),
                ..Part::default()
            }],
            ..Self::default()
        }
    }
}

/// Properties of a PLY vertex that hold a colour, and what is 1 in them.
const COLOUR: [&str; 3] = ["red", "green", "blue"];

/// Properties that hold texture coordinates, under the names in use.
const TEXTURE: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];

fn of_ply(shape: &Shape) -> Result<Appearance, ShapeError> {
    let mut file = PlyFile::open(&shape.path)?;
    let has = |name: &&str| {
        file.header.elements["vertex"]
            .properties
            .contains_key(*name)
    };
    let is_coloured = COLOUR.iter().all(has);
    let texture_names = TEXTURE.into_iter().find(|names| names.iter().all(has));
    let mut found = Appearance::plain(shape);
    if !is_coloured && texture_names.is_none() {
        return Ok(found);
    }
    let pictures = file.header.comments.iter();
    let picture = pictures.filter_map(|comment| comment.trim().strip_prefix("TextureFile"));
    let picture = picture.map(|name| name.trim().to_owned()).next();
    let (mut colours, mut texture) = (Vec::new(), Vec::new());
    file.for_each::<DefaultElement>(|element, _, row| {
        if element.name == "vertex" {
            let part = |name: &str| row.get(name).map_or((0.0, 1.0), number);
            let share = |name: &str| {
                let (value, one) = part(name);
                (value / one) as f32
            };
            if is_coloured {
                let opacity = if row.contains_key("alpha") {
                    share("alpha")
                } else {
                    1.0
                };
                let [r, g, b] = COLOUR.map(share);
                colours.push([r, g, b, opacity]);
            }
            texture.extend(texture_names.map(|names| names.map(|name| part(name).0 as f32)));
        }
        Ok(())
    })?;
    found.colours = is_coloured.then_some(colours);
    found.texture = texture_names.map(|_| texture);
    if let Some(texture) = picture.and_then(|name| texture_of(&shape.path, &name)) {
        found.materials.push(Material {
            name: "picture".to_owned(),
            colour: [1.0; 4],
            texture: Some(texture),
        });
        found.parts[0].material = Some(0);
    }
    Ok(found)
}

/// The number of a property, and what counts as 1 where it is a share.
fn number(property: &Property) -> (f64, f64) {
    match *property {
        Property::Char(value) => (f64::from(value), f64::from(i8::MAX)),
        Property::UChar(value) => (f64::from(value), f64::from(u8::MAX)),
        Property::Short(value) => (f64::from(value), f64::from(i16::MAX)),
        Property::UShort(value) => (f64::from(value), f64::from(u16::MAX)),
        Property::Int(value) => (f64::from(value), 255.0),
        Property::UInt(value) => (f64::from(value), 255.0),
        Property::Float(value) => (f64::from(value), 1.0),
        Property::Double(value) => (value, 1.0),
        _ => (0.0, 1.0),
    }
}

/// A picture beside a file; none if it is not there, or not of a kind that GLB holds.
fn texture_of(file: &Path, name: &str) -> Option<Texture> {
    let path = file.with_file_name(name.replace('\\', "/"));
    picture(std::fs::read(path).ok()?)
}

/// A picture by its first bytes; none if it is not of a kind that GLB holds.
pub(super) fn picture(bytes: Vec<u8>) -> Option<Texture> {
    let mime = match bytes.as_slice() {
        [0x89, b'P', b'N', b'G', ..] => "image/png",
        [0xff, 0xd8, 0xff, ..] => "image/jpeg",
        _ => return None,
    };
    Some(Texture { mime, bytes })
}

/// An OBJ file as it is read.
#[derive(Default)]
struct Obj {
    colours: Vec<Option<[f32; 4]>>,
    texture: Vec<[f32; 2]>,
    normals: usize,
    /// Vertex and texture coordinates of each vertex that is written.
    vertices: Vec<(u32, Option<u32>)>,
    numbers: HashMap<(u32, Option<u32>), u32>,
    parts: Vec<Part>,
    /// Names of materials in the order of their first use.
    used: Vec<String>,
    libraries: Vec<String>,
    group: Option<String>,
    material: Option<usize>,
    /// Of each part.
    polygons: Vec<Polygons>,
}

fn of_obj(shape: &Shape) -> Result<Appearance, ShapeError> {
    let bytes = std::fs::read(&shape.path).map_err(|reason| ShapeError::Unreadable {
        path: shape.path.clone(),
        reason,
    })?;
    let bytes = obj::text(&shape.path, &bytes)?;
    let mut obj = Obj::default();
    for (at, (keyword, rest)) in statements(&bytes).enumerate() {
        let whole = || String::from_utf8_lossy(rest).trim().to_owned();
        match keyword {
            b"v" => obj.colours.push(colour_after(rest)),
            b"vt" => obj.texture.push(pair(rest)),
            b"vn" => obj.normals += 1,
            b"g" | b"o" => obj.group = Some(whole()).filter(|name| !name.is_empty()),
            b"usemtl" => obj.choose(whole()),
            b"mtllib" => obj.libraries.push(whole()),
            b"f" => {
                let added = obj.add(rest);
                added.map_err(|problem| ShapeError::line(&shape.path, at + 1, problem))?;
            }
            _ => {}
        }
    }
    if obj.colours.len() != shape.file_count() {
        let problem = "it has changed since it was read";
        return Err(ShapeError::malformed(&shape.path, problem));
    }
    Ok(obj.finish(shape))
}

impl Obj {
    fn choose(&mut self, name: String) {
        let known = self.used.iter().position(|used| *used == name);
        self.material = Some(known.unwrap_or_else(|| {
            self.used.push(name);
            self.used.len() - 1
        }));
    }

    /// Adds a polygon to the part of its group and material.
    fn add(&mut self, rest: &[u8]) -> Result<(), String> {
        let counts = Counts {
            vertices: self.colours.len(),
            normals: self.normals,
        };
        let mut corners = Vec::with_capacity(4);
        for word in words(rest) {
            let vertex = parse_corner(&word, counts)?.vertex;
            let texture = word
                .split('/')
                .nth(1)
                .and_then(|part| self.texture_index(part));
            let next = self.vertices.len() as u32;
            let number = *self.numbers.entry((vertex, texture)).or_insert(next);
            if number == next {
                self.vertices.push((vertex, texture));
            }
            corners.push(number);
        }
        let is_part = |part: &Part| part.name == self.group && part.material == self.material;
        let at = match self.parts.iter().rposition(is_part) {
            Some(at) => at,
            None => {
                self.parts.push(Part {
                    name: self.group.clone(),
                    material: self.material,
                    triangles: Vec::new(),
                });
                self.polygons.push(Polygons::default());
                self.parts.len() - 1
            }
        };
        self.polygons[at].push(&corners);
        Ok(())
    }

    /// Counted from 1, or back from -1; none where there is no such line.
    fn texture_index(&self, part: &str) -> Option<u32> {
        let index: i64 = part.parse().ok()?;
        let count = self.texture.len() as i64;
        let from_zero = if index < 0 { count + index } else { index - 1 };
        let is_there = (0..count).contains(&from_zero);
        is_there.then(|| u32::try_from(from_zero).ok()).flatten()
    }

    fn finish(mut self, shape: &Shape) -> Appearance {
        let place = |k: u32| shape.mesh.vertices[self.vertices[k as usize].0 as usize];
        for (part, polygons) in self.parts.iter_mut().zip(&self.polygons) {
            part.triangles = polygons.triangles_at(place);
        }
        if self.vertices.is_empty() {
            let colours: Option<Vec<[f32; 4]>> = self.colours.into_iter().collect();
            return Appearance {
                colours,
                ..Appearance::plain(shape)
            };
        }
        let of_file: Option<Vec<[f32; 4]>> = self.colours.into_iter().collect();
        let colours = of_file.map(|all| {
            let of = |(vertex, _): &(u32, _)| all[*vertex as usize];
            self.vertices.iter().map(of).collect()
        });
        let is_textured = self.vertices.iter().any(|(_, texture)| texture.is_some());
        let texture = is_textured.then(|| {
            let of =
                |(_, at): &(u32, Option<u32>)| at.map_or([0.0; 2], |at| self.texture[at as usize]);
            self.vertices.iter().map(of).collect()
        });
        let mut known = HashMap::new();
        for name in &self.libraries {
            read_library(&shape.path.with_file_name(name), &mut known);
        }
        let material = |name: &String| known.remove(name).unwrap_or_else(|| plain_material(name));
        Appearance {
            origin: self.vertices.iter().map(|(vertex, _)| *vertex).collect(),
            parts: self.parts,
            materials: self.used.iter().map(material).collect(),
            colours,
            texture,
        }
    }
}

fn plain_material(name: &str) -> Material {
    Material {
        name: name.to_owned(),
        colour: [0.8, 0.8, 0.8, 1.0],
        texture: None,
    }
}

/// The fourth to sixth number of a line `v x y z r g b`.
fn colour_after(rest: &[u8]) -> Option<[f32; 4]> {
    let numbers: Vec<f32> = words(rest).filter_map(|word| word.parse().ok()).collect();
    match numbers[..] {
        [_, _, _, r, g, b, ..] => Some([r, g, b, 1.0]),
        _ => None,
    }
}

fn pair(rest: &[u8]) -> [f32; 2] {
    let mut numbers = words(rest).map(|word| word.parse().unwrap_or(0.0));
    [0; 2].map(|_| numbers.next().unwrap_or(0.0))
}

/// Adds the materials of a library; one that is not there has none.
fn read_library(path: &Path, known: &mut HashMap<String, Material>) {
    let Ok(bytes) = std::fs::read(path) else {
        return;
    };
    let mut now: Option<Material> = None;
    for (keyword, rest) in statements(&bytes) {
        let whole = || String::from_utf8_lossy(rest).trim().to_owned();
        if keyword == b"newmtl" {
            known.extend(now.take().map(|made| (made.name.clone(), made)));
            now = Some(plain_material(&whole()));
        }
        let Some(material) = &mut now else { continue };
        let mut numbers = words(rest).filter_map(|word| word.parse::<f32>().ok());
        match keyword {
            b"Kd" => {
                for part in &mut material.colour[..3] {
                    *part = numbers.next().unwrap_or(*part);
                }
            }
            b"d" => material.colour[3] = numbers.next().unwrap_or(1.0),
            // Options may come before the name, which is last.
            b"map_Kd" => {
                let name = words(rest).last().map(|word| word.into_owned());
                material.texture = name.and_then(|name| texture_of(path, &name));
            }
            _ => {}
        }
    }
    known.extend(now.map(|made| (made.name.clone(), made)));
}

#[cfg(test)]
mod tests;
