//! Nodes, meshes and primitives as one list of vertices and triangles.

use glam::{DMat3, DMat4, DQuat, DVec3};
use serde_json::Value;

use super::document::Document;
use super::look::{self, TextureOf};
use crate::formats::error::ShapeError;
use crate::geometry::linear::unit;
use crate::gltf::Part;

/// The most vertices and triangles that are read. A file can show one mesh any number of times, so that its length
/// does not limit them.
const MOST: usize = 1 << 27;

/// A vertex as the file states it, in the coordinates of the scene.
#[derive(Default)]
pub(super) struct Vertex {
    pub position: [f64; 3],
    pub normal: Option<[f32; 3]>,
    /// Red, green, blue and opacity, 0 to 1 (sRGB).
    pub colour: Option<[f32; 4]>,
    /// The second coordinate points up.
    pub texture: Option<[f32; 2]>,
}

/// What a file shows.
#[derive(Default)]
pub(super) struct Scene {
    pub vertices: Vec<Vertex>,
    /// Triangles by primitive.
    pub parts: Vec<Part>,
    pub notes: Vec<String>,
}

/// A primitive of a mesh, named for messages.
struct Primitive<'a> {
    value: &'a Value,
    name: String,
    vertices: usize,
}

impl Scene {
    /// Reads the default scene, with or without how it looks. Points count only where there are no triangles.
    ///
    /// # Errors
    /// Nodes that form no tree, and what primitives and their accessors are refused for.
    pub(super) fn read(document: &Document, with_look: bool) -> Result<Self, ShapeError> {
        let placed = placed_meshes(document)?;
        let mut scene = Self::default();
        if placed.iter().any(|placed| placed.has_skin) {
            let name = document.path.display();
            scene.notes.push(format!("{name}: its skin is not applied: the mesh is read as modelled, before bones move it"));
        }
        let mut only_points = Self::default();
        for placed in &placed {
            let mesh = document.element("meshes", placed.mesh)?;
            let primitives = mesh["primitives"].as_array().into_iter().flatten();
            for (k, value) in primitives.enumerate() {
                let name = format!("meshes[{}].primitives[{k}]", placed.mesh);
                let primitive = Primitive {
                    value,
                    name,
                    vertices: 0,
                };
                let into = match document.whole(value, "mode")?.unwrap_or(4) {
                    4..=6 => &mut scene,
                    0 => &mut only_points,
                    // Lines have no surface.
                    _ => continue,
                };
                into.add(document, primitive, placed, with_look)?;
            }
        }
        if scene.parts.iter().all(|part| part.triangles.is_empty()) {
            only_points.notes = scene.notes;
            scene = only_points;
        }
        if scene.vertices.is_empty() {
            return Err(
                document.malformed("its scene has no triangles and no points; check the export")
            );
        }
        Ok(scene)
    }

    /// Adds a primitive where its node places it.
    fn add(
        &mut self,
        document: &Document,
        mut primitive: Primitive,
        placed: &Placed,
        with_look: bool,
    ) -> Result<(), ShapeError> {
        let attributes = &primitive.value["attributes"];
        let Some(position) = document.whole(attributes, "POSITION")? else {
            return Ok(());
        };
        let positions = document.rows(position, &["VEC3"])?;
        primitive.vertices = positions.numbers.len() / 3;
        let mut vertices: Vec<Vertex> = (positions.vectors())
            .map(|position| Vertex {
                position: placed
                    .transform
                    .transform_point3(DVec3::from_array(position))
                    .to_array(),
                ..Vertex::default()
            })
            .collect();
        if let Some(accessor) = document.whole(attributes, "NORMAL")? {
            let turn = normal_matrix(&placed.transform);
            for (vertex, normal) in vertices
                .iter_mut()
                .zip(document.rows(accessor, &["VEC3"])?.vectors())
            {
                vertex.normal = Some(unit((turn * DVec3::from_array(normal)).to_array()));
            }
        }
        let material = document.whole(primitive.value, "material")?;
        if with_look {
            let texture = TextureOf::material(document, material);
            look::add(document, attributes, &texture, &mut vertices);
        }
        let first = self.vertices.len();
        let mut triangles = triangles(document, &primitive)?;
        let known: usize = self.parts.iter().map(|part| part.triangles.len()).sum();
        if first + vertices.len() > MOST || known + triangles.len() > MOST {
            return Err(document.malformed(format!(
                "its scene has more than {MOST} vertices or triangles"
            )));
        }
        // A mirror turns triangles around.
        let mirrored = placed.transform.determinant() < 0.0;
        for corners in &mut triangles {
            *corners = corners.map(|corner| corner + first as u32);
            if mirrored {
                corners.swap(1, 2);
            }
        }
        self.vertices.append(&mut vertices);
        self.parts.push(Part {
            name: placed.name.clone(),
            material: material.filter(|index| *index < document.count("materials")),
            triangles,
        });
        Ok(())
    }
}

/// The triangles of a primitive over its own vertices; none of points.
fn triangles(document: &Document, primitive: &Primitive) -> Result<Vec<[u32; 3]>, ShapeError> {
    let corners = match document.whole(primitive.value, "indices")? {
        Some(accessor) => document.indices(accessor, primitive.vertices)?,
        None => (0..primitive.vertices as u32).collect(),
    };
    let mode = document.whole(primitive.value, "mode")?.unwrap_or(4);
    Ok(match mode {
        4 => {
            let (triangles, rest) = corners.as_chunks::<3>();
            if !rest.is_empty() {
                let (name, count) = (&primitive.name, corners.len());
                return Err(document.malformed(format!(
                    "{name}: {count} corners: must be three for each triangle"
                )));
            }
            triangles.to_vec()
        }
        // A strip: each corner makes a triangle with the two before it, turned around every second time.
        5 => {
            let triples = corners.windows(3).enumerate();
            triples
                .map(|(k, c)| {
                    if k % 2 == 0 {
                        [c[0], c[1], c[2]]
                    } else {
                        [c[0], c[2], c[1]]
                    }
                })
                .collect()
        }
        6 => {
            let mut fan = Vec::new();
            crate::formats::polygons::push_fan(&mut fan, &corners);
            fan
        }
        _ => Vec::new(),
    })
}

/// What turns normals: the inverse transposed; nothing has a direction where a node is flat.
fn normal_matrix(transform: &DMat4) -> DMat3 {
    let turn = DMat3::from_mat4(*transform);
    if turn.determinant() == 0.0 {
        return DMat3::ZERO;
    }
    turn.inverse().transpose()
}

/// A mesh where a node shows it.
struct Placed {
    mesh: usize,
    transform: DMat4,
    name: Option<String>,
    has_skin: bool,
}

/// The meshes of the default scene, in the order of its nodes.
fn placed_meshes(document: &Document) -> Result<Vec<Placed>, ShapeError> {
    let mut placed = Vec::new();
    let mut seen = vec![false; document.count("nodes")];
    let mut open: Vec<(usize, DMat4)> = Vec::new();
    for root in roots(document)?.into_iter().rev() {
        open.push((root, DMat4::IDENTITY));
    }
    while let Some((index, parent)) = open.pop() {
        let node = document.element("nodes", index)?;
        if std::mem::replace(&mut seen[index], true) {
            return Err(document.malformed(format!(
                "nodes[{index}] has two parents, or is its own: malformed"
            )));
        }
        let transform = parent * local(document, node, index)?;
        if let Some(mesh) = document.whole(node, "mesh")? {
            let has_skin = node.get("skin").is_some();
            placed.push(Placed {
                mesh,
                // The bones of a skin replace the place of its node.
                transform: if has_skin { DMat4::IDENTITY } else { transform },
                name: node["name"].as_str().map(str::to_owned),
                has_skin,
            });
        }
        let children = numbers(document, &node["children"])?;
        open.extend(children.into_iter().rev().map(|child| (child, transform)));
    }
    Ok(placed)
}

/// The nodes that a scene begins with: those of the default scene, of the first, or all that are no children.
fn roots(document: &Document) -> Result<Vec<usize>, ShapeError> {
    if document.count("scenes") > 0 {
        let index = document.whole(document.root(), "scene")?.unwrap_or(0);
        return numbers(document, &document.element("scenes", index)?["nodes"]);
    }
    let mut is_root = vec![true; document.count("nodes")];
    for index in 0..is_root.len() {
        for child in numbers(document, &document.element("nodes", index)?["children"])? {
            if let Some(is_root) = is_root.get_mut(child) {
                *is_root = false;
            }
        }
    }
    Ok((0..is_root.len()).filter(|&index| is_root[index]).collect())
}

/// A list of nodes.
fn numbers(document: &Document, list: &Value) -> Result<Vec<usize>, ShapeError> {
    let all = list.as_array().into_iter().flatten();
    all.map(|value| {
        let found = value.as_u64().and_then(|found| usize::try_from(found).ok());
        found.ok_or_else(|| document.malformed("a node is named by something else than its number"))
    })
    .collect()
}

/// How a node places what is in it: by a matrix, or by scale, rotation and translation.
fn local(document: &Document, node: &Value, index: usize) -> Result<DMat4, ShapeError> {
    let floats = |key: &str, count: usize| -> Result<Option<Vec<f64>>, ShapeError> {
        let Some(value) = node.get(key) else {
            return Ok(None);
        };
        let all: Option<Vec<f64>> = value
            .as_array()
            .and_then(|all| all.iter().map(Value::as_f64).collect());
        let all = all.filter(|all| all.len() == count);
        let problem = format!("nodes[{index}].{key}: must be {count} numbers");
        all.map(Some).ok_or_else(|| document.malformed(problem))
    };
    if let Some(matrix) = floats("matrix", 16)? {
        return Ok(DMat4::from_cols_slice(&matrix));
    }
    let three = |key: &str, default: DVec3| {
        Ok::<_, ShapeError>(floats(key, 3)?.map_or(default, |all| DVec3::from_slice(&all)))
    };
    let turn = floats("rotation", 4)?.map_or(DQuat::IDENTITY, |all| DQuat::from_slice(&all));
    // Files round it; one of length 0 turns nothing.
    let turn = if turn.length_squared() > 0.0 {
        turn.normalize()
    } else {
        DQuat::IDENTITY
    };
    Ok(DMat4::from_scale_rotation_translation(
        three("scale", DVec3::ONE)?,
        turn,
        three("translation", DVec3::ZERO)?,
    ))
}
