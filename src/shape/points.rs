//! The points, normals and closed mesh of one shape, in the user's coordinates.

use rand_chacha::ChaCha8Rng;

use super::exposed::sample_exposed;
use super::normals::estimate_normals;
use super::sides::{self, Sides};
use crate::formats::{Shape, ShapeError};
use crate::geometry::winding::is_inside_out;
use crate::geometry::{EdgeSharing, Mesh};

/// Where normals come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NormalSource {
    /// The faces of a mesh, turned outwards; a cloud's own, or estimated if it has none.
    Auto,
    /// As the file gives them: faces as they are wound, normals of a cloud; an error without.
    Given,
    /// Estimated from the points in any case.
    Estimate,
    /// None.
    None,
}

/// The mesh of a shape if it is closed, wound outwards unless its own winding is to be kept.
pub(super) fn closed(shape: &Shape, wanted: NormalSource) -> Option<Mesh<f64>> {
    if !shape.is_mesh() || !EdgeSharing::of(&shape.mesh).is_closed() {
        return None;
    }
    let mut mesh = shape.mesh.clone();
    if mesh.volume() < 0.0 && wanted != NormalSource::Given {
        mesh.triangles
            .iter_mut()
            .for_each(|triangle| triangle.swap(1, 2));
    }
    Some(mesh)
}

/// Points in the user's coordinates, and their normals unless none are wanted.
type Points = (Vec<[f64; 3]>, Option<Vec<[f32; 3]>>);

/// The points of a shape: so many samples of a mesh, the vertices of a cloud.
pub(crate) fn points_of(
    shape: &Shape,
    count: usize,
    wanted: NormalSource,
    rng: &mut ChaCha8Rng,
    notes: &mut Vec<String>,
) -> Result<Points, ShapeError> {
    let name = shape.path.display();
    let (points, given) = if shape.is_mesh() {
        let (samples, hidden) = sample_exposed(&shape.mesh, count, rng);
        if hidden > 0.0 {
            notes.push(format!(
                "{name}: {:.1} % of the surface lies inside other parts of the mesh, and is left out",
                100.0 * hidden
            ));
        }
        let normals = match wanted {
            NormalSource::Auto => outward(shape, samples.normals, notes),
            _ => Some(samples.normals),
        };
        (samples.points, normals)
    } else {
        let normals = usable_normals(shape);
        if let (NormalSource::Given, Err(problem)) = (wanted, &normals) {
            return Err(ShapeError::Normals {
                path: shape.path.clone(),
                problem: problem.clone(),
            });
        }
        if let (NormalSource::Auto, Err(problem)) = (wanted, &normals) {
            notes.push(format!("{name}: {problem}: estimated from its points"));
        }
        let normals = match (wanted, normals) {
            (NormalSource::Auto, Ok(normals)) => Some(sided(shape, normals, notes)),
            (_, normals) => normals.ok(),
        };
        (shape.mesh.vertices.clone(), normals)
    };
    let normals = match wanted {
        NormalSource::None => None,
        NormalSource::Estimate => Some(estimate_normals(&points).normals),
        NormalSource::Auto | NormalSource::Given => {
            Some(given.unwrap_or_else(|| estimate_normals(&points).normals))
        }
    };
    Ok((points, normals))
}

/// A cloud's own normals, turned where the cloud clearly shows that they point inwards.
fn sided(shape: &Shape, normals: Vec<[f32; 3]>, notes: &mut Vec<String>) -> Vec<[f32; 3]> {
    let (points, name) = (&shape.mesh.vertices, shape.path.display());
    let Some(Sides {
        normals,
        flipped,
        mixed,
        agreement,
    }) = sides::turned(points, &normals)
    else {
        if is_inside_out(points, &normals) {
            notes.push(format!(
                "{name}: the file's normals point inwards on the whole, and are used as they are; if the \
                 shape is closed, set data.normals = \"estimate\" or flip them"
            ));
        }
        return normals;
    };
    let all = points.len();
    if flipped > 0 {
        notes.push(format!(
            "{name}: the file's normals point inwards at {flipped} of {all} points: turned over"
        ));
    }
    if mixed > 0 {
        notes.push(format!(
            "{name}: the file's normals point in and out ({:.0} % out): turned outwards one by one at {mixed} of {all} \
             points; data.normals = \"given\" takes them as they are",
            100.0 * agreement
        ));
    }
    normals
}

/// A cloud's own normals, or why they do not serve.
fn usable_normals(shape: &Shape) -> Result<Vec<[f32; 3]>, String> {
    let normals = shape
        .mesh
        .normals
        .as_ref()
        .ok_or("the file has no normals")?;
    match normals.iter().filter(|&normal| normal == &[0.0; 3]).count() {
        0 => Ok(normals.clone()),
        lost => Err(format!(
            "{lost} of {} normals have no direction",
            normals.len()
        )),
    }
}

/// Face normals of samples, turned outwards; none if the mesh is not wound consistently.
fn outward(
    shape: &Shape,
    mut normals: Vec<[f32; 3]>,
    notes: &mut Vec<String>,
) -> Option<Vec<[f32; 3]>> {
    let name = shape.path.display();
    let sharing = EdgeSharing::of(&shape.mesh);
    if sharing.inconsistent > 0 {
        let edges = sharing.inconsistent;
        notes.push(format!(
            "{name}: triangles are wound against each other at {edges} edges: normals estimated \
             from the sampled points"
        ));
        return None;
    }
    if !sharing.is_closed() {
        let EdgeSharing {
            open, branching, ..
        } = sharing;
        notes.push(format!(
            "{name}: the mesh is not closed ({open} open edges, {branching} of more than two \
             triangles): its normals follow the winding of its triangles"
        ));
    } else if shape.mesh.volume() < 0.0 {
        notes.push(format!(
            "{name}: triangles are wound inwards: normals flipped"
        ));
        normals
            .iter_mut()
            .flatten()
            .for_each(|coordinate| *coordinate = -*coordinate);
    }
    Some(normals)
}
