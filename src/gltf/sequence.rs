//! One mesh for each time, shown in turn: a node each, whose scale is 1 while it is shown and 0 otherwise.
//!
//! A mesh is shown while its time is the nearest, so that it runs along with [`super::morphing`].

use serde_json::{Value, json};

use super::builder::{Builder, GltfError, Precision};
use super::frame::Frame;
use super::morph::{directed, require_quantised, surface};

/// A mesh at one time.
pub(crate) struct Still {
    /// Its time, as it is noted.
    pub time: f64,
    /// When in the animation it is shown, in seconds.
    pub second: f64,
    /// Positions.
    pub vertices: Vec<[f64; 3]>,
    /// Unit normals, one for each vertex.
    pub normals: Vec<[f32; 3]>,
    /// Counter-clockwise seen from outside; a surface may have none.
    pub triangles: Vec<[u32; 3]>,
    /// Numbers for each vertex, under names that begin with `_`, as glTF asks of those of an application.
    pub attributes: Vec<(&'static str, Vec<f32>)>,
}

/// The colour of the surfaces (sRGB).
const COLOUR: [f32; 4] = [0.36, 0.62, 0.85, 1.0];

/// A GLB file of meshes at ascending times.
///
/// # Errors
/// [`GltfError::TooLarge`].
pub(crate) fn in_turn(stills: &[Still], precision: Precision) -> Result<Vec<u8>, GltfError> {
    let mut builder = Builder::default();
    let frame = Frame::around(stills.iter().map(|still| &still.vertices), precision);
    let (mut nodes, mut meshes) = (Vec::new(), Vec::new());
    for (k, still) in stills.iter().enumerate() {
        let name = format!("surface-{k:03}");
        let extras = json!({"time": still.time});
        let mut shape = json!({"name": name});
        frame.place(&mut shape);
        if !still.triangles.is_empty() {
            shape["mesh"] = json!(meshes.len());
            meshes.push(mesh(&name, still, &frame, precision, &mut builder));
        }
        // The node around it is the one that is shown and hidden.
        let shown = if k == 0 { 1.0 } else { 0.0 };
        nodes.push(shape);
        let child = nodes.len() - 1;
        nodes.push(json!(
            {"name": format!("{name} shown"), "children": [child], "scale": vec![shown; 3], "extras": extras}
        ));
    }
    if nodes.is_empty() {
        nodes.extend([json!({"name": "nothing"}), json!({"children": [0]})]);
    }
    let shown: Vec<usize> = (0..nodes.len()).skip(1).step_by(2).collect();
    let mut root = json!({"scene": 0, "scenes": [{"nodes": shown}], "nodes": nodes});
    if !meshes.is_empty() {
        root["meshes"] = json!(meshes);
        root["materials"] = json!([surface("surface", COLOUR)]);
        require_quantised(precision, &mut root);
    }
    if stills.len() > 1 {
        root["animations"] = json!([animation(stills, &shown, &mut builder)]);
    }
    builder.finish(root)
}

fn mesh(
    name: &str,
    still: &Still,
    frame: &Frame,
    precision: Precision,
    builder: &mut Builder,
) -> Value {
    let positions: Vec<[f32; 3]> = still.vertices.iter().map(|x| frame.apply(*x)).collect();
    let normals: Vec<[f32; 3]> = still.normals.iter().map(|n| directed(*n)).collect();
    let mut attributes = match precision {
        Precision::Full => json!({
            "POSITION": builder.vectors(&positions, true),
            "NORMAL": builder.vectors(&normals, false),
        }),
        Precision::Compact => json!({
            "POSITION": builder.unit_positions(&positions),
            "NORMAL": builder.unit_normals(&normals),
        }),
    };
    for (name, values) in &still.attributes {
        attributes[*name] = json!(builder.numbers(values, "SCALAR", 1));
    }
    let indices = builder.triangles(&still.triangles, positions.len());
    json!({
        "name": name,
        "primitives": [{"attributes": attributes, "indices": indices, "material": 0}],
    })
}

/// Shows each mesh from half-way to the one before until half-way to the one after.
fn animation(stills: &[Still], nodes: &[usize], builder: &mut Builder) -> Value {
    let moments: Vec<f64> = stills.iter().map(|still| still.second).collect();
    let half_way = moments.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0);
    let ends = [moments[0], moments[moments.len() - 1]];
    let seconds: Vec<f32> = ([ends[0]].into_iter().chain(half_way).chain([ends[1]]))
        .map(|second| second as f32)
        .collect();
    let input = builder.times(&seconds);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (k, node) in nodes.iter().enumerate() {
        let shown = |key: usize| {
            if key.min(nodes.len() - 1) == k {
                [1.0; 3]
            } else {
                [0.0; 3]
            }
        };
        let scales: Vec<f32> = (0..=nodes.len()).flat_map(shown).collect();
        let output = builder.numbers(&scales, "VEC3", 3);
        samplers.push(json!({"input": input, "output": output, "interpolation": "STEP"}));
        channels.push(json!({"sampler": k, "target": {"node": node, "path": "scale"}}));
    }
    json!({"name": "surfaces", "samplers": samplers, "channels": channels})
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Glb, approx};
    use super::*;

    fn still(time: f64, vertices: usize) -> Still {
        let corner = |k: usize| [k as f64, (k * k) as f64, time];
        Still {
            time,
            second: 2.0 * time,
            vertices: (0..vertices).map(corner).collect(),
            normals: vec![[0.0, 0.0, 1.0]; vertices],
            triangles: (2..vertices as u32).map(|k| [0, k - 1, k]).collect(),
            attributes: vec![("_ROUND_TRIP", (0..vertices).map(|k| k as f32).collect())],
        }
    }

    #[test]
    fn each_is_shown_while_its_time_is_the_nearest() {
        let stills = [still(0.0, 3), still(0.5, 4), still(1.0, 5)];
        let glb = Glb::read(&in_turn(&stills, Precision::Full).expect("small"));
        let animation = &glb.root["animations"][0];
        let sampler = |k: usize| &animation["samplers"][k];
        assert_eq!(glb.numbers(&sampler(0)["input"]), [0.0, 0.5, 1.5, 2.0]);
        let shown = |k: usize| -> Vec<f64> {
            let scales = glb.vectors(&sampler(k)["output"]);
            scales.iter().map(|scale| scale[0]).collect()
        };
        assert_eq!(shown(0), [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(shown(1), [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(shown(2), [0.0, 0.0, 1.0, 1.0]);
        for (k, still) in stills.iter().enumerate() {
            let primitive = &glb.root["meshes"][k]["primitives"][0];
            let found = glb.vectors(&primitive["attributes"]["POSITION"]);
            approx(&[found], std::slice::from_ref(&still.vertices), 1e-6);
            let trips = glb.numbers(&primitive["attributes"]["_ROUND_TRIP"]);
            assert_eq!(trips.len(), still.vertices.len());
            assert_eq!(trips[2], 2.0);
            let corners = glb.numbers(&primitive["indices"]);
            assert_eq!(corners.len(), 3 * still.triangles.len());
        }
    }

    #[test]
    fn a_time_without_a_surface_shows_nothing_and_none_at_all_is_a_file_too() {
        let stills = [still(0.0, 3), still(1.0, 0)];
        let glb = Glb::read(&in_turn(&stills, Precision::Compact).expect("small"));
        assert_eq!(glb.root["meshes"].as_array().map(Vec::len), Some(1));
        assert!(glb.root["nodes"][2].get("mesh").is_none());
        for stills in [&[][..], &[still(0.5, 0)][..]] {
            Glb::read(&in_turn(stills, Precision::Full).expect("small"));
        }
    }
}
