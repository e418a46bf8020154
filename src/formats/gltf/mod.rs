//! glTF 2.0, as `.gltf` and as `.glb`: the triangles of all meshes of the scene, where its nodes place them.
//!
//! | file | what it does |
//! |---|---|
//! | `document.rs` | the container: JSON, and the bytes within it, beside it or in it as text |
//! | `accessor.rs` | numbers out of these bytes, of any type of the format |
//! | `scene.rs` | nodes, meshes and primitives as one list of vertices and triangles |
//! | `look.rs` | colours, texture coordinates and materials |
//!
//! The format states a vertex anew for each normal and texture coordinate. As a shape, vertices at the same place are
//! one, numbered in the order of their first use; how it looks keeps them apart. Coordinates are those of the file:
//! y points up, and nothing is turned. Animations are passed over. A mesh with a skin is read as it was modelled,
//! before bones move it, and a note says so.
//!
//! Source: the glTF 2.0 specification of the Khronos Group, with KHR_mesh_quantization and KHR_texture_transform. The
//! crate `gltf` is not used: it refuses quantised files, and had no release since 2024.

mod accessor;
mod document;
mod look;
mod scene;
#[cfg(test)]
pub(super) mod tests;

use std::path::Path;

use self::document::Document;
use self::scene::Scene;
use super::appearance::Appearance;
use super::error::ShapeError;
use super::shape::Shape;
use super::weld::{Weld, has_area};
use crate::geometry::Mesh;
use crate::geometry::linear::dot;

/// The cosine between two normals that count as the same: 2.5 degrees, above what 8 bits round away.
const SAME_NORMAL: f32 = 0.999;

/// Reads the geometry of a glTF file.
pub(super) fn read(path: &Path) -> Result<Shape, ShapeError> {
    let document = Document::open(path)?;
    let scene = Scene::read(&document, false)?;
    let mut weld = Weld::default();
    let numbers: Vec<u32> = (scene.vertices.iter())
        .map(|vertex| weld.number(vertex.position))
        .collect();
    let of = |corners: &[u32; 3]| corners.map(|corner| numbers[corner as usize]);
    let triangles = scene.parts.iter().flat_map(|part| &part.triangles);
    let mesh = Mesh {
        triangles: triangles.map(of).filter(has_area).collect(),
        normals: normals(&scene, &numbers, weld.vertices.len()),
        vertices: weld.vertices,
    };
    Ok(Shape {
        notes: scene.notes,
        ..Shape::at(path, mesh)
    })
}

/// A normal for each place, if all vertices there have the same.
fn normals(scene: &Scene, numbers: &[u32], places: usize) -> Option<Vec<[f32; 3]>> {
    let mut found = vec![None; places];
    for (vertex, &number) in scene.vertices.iter().zip(numbers) {
        let normal = vertex.normal?;
        let known = found[number as usize].get_or_insert(normal);
        if dot(*known, normal) < SAME_NORMAL {
            return None;
        }
    }
    found.into_iter().collect()
}

/// How the shape of a glTF file looks.
///
/// # Errors
/// A file that has changed since the shape was read.
pub(super) fn appearance(shape: &Shape) -> Result<Appearance, ShapeError> {
    let document = Document::open(&shape.path)?;
    let scene = Scene::read(&document, true)?;
    let mut weld = Weld::default();
    let vertices = &scene.vertices;
    let origin = vertices
        .iter()
        .map(|vertex| weld.number(vertex.position))
        .collect();
    if weld.vertices.len() != shape.mesh.vertices.len() {
        let problem = "it has changed since it was read";
        return Err(ShapeError::malformed(&shape.path, problem));
    }
    let colours = vertices.iter().any(|vertex| vertex.colour.is_some());
    let texture = vertices.iter().any(|vertex| vertex.texture.is_some());
    let all = vertices.iter();
    Ok(Appearance {
        origin,
        materials: look::materials(&document),
        colours: colours.then(|| {
            all.clone()
                .map(|vertex| vertex.colour.unwrap_or([1.0; 4]))
                .collect()
        }),
        texture: texture.then(|| {
            all.map(|vertex| vertex.texture.unwrap_or_default())
                .collect()
        }),
        parts: scene.parts,
    })
}
