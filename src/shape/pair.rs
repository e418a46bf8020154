//! Two files in, everything that training needs of them out: [`prepare`].
//!
//! A mesh is sampled by area, with the normals of its faces; a cloud is used as it is, with its own
//! normals or estimated ones. Whatever was decided about the data on the way is said in
//! [`Pair::notes`].

use std::path::PathBuf;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::correspond::Correspondences;
use super::normalise::Normalisation;
use super::normals::estimate_normals;
use super::sample::{point_at, sample_surface};
use crate::formats::{self, FEWEST_POINTS, Shape, ShapeError};
use crate::geometry::winding::is_inside_out;
use crate::geometry::{Bounds, EdgeSharing};

/// Where correspondences come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CorrespondenceSource {
    /// A two-column file of vertex indices.
    File(PathBuf),
    /// Vertex i of the source corresponds to vertex i of the target.
    SameVertices,
    /// These.
    Pairs(Correspondences),
    /// None are known.
    None,
}

/// Where normals come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NormalSource {
    /// The faces of a mesh, turned outwards; a cloud's own, or estimated if it has none.
    Auto,
    /// As the file gives them: faces as they are wound, normals of a cloud; an error without.
    Given,
    /// Estimated from the points in any case.
    Estimate,
    /// None.
    None,
}

/// What to make of which files: the data section of a recipe.
#[derive(Debug, Clone, PartialEq)]
pub struct DataOptions {
    /// The shape at time 0.
    pub source: PathBuf,
    /// The shape at time 1.
    pub target: PathBuf,
    /// Where pairs of corresponding points come from.
    pub correspondences: CorrespondenceSource,
    /// Points sampled on each mesh; a cloud is used as it is.
    pub points: usize,
    /// Correspondences used, as a fraction of the source's points, when that many are available.
    pub correspondence_fraction: f64,
    /// Where normals come from.
    pub normals: NormalSource,
    /// Names the samples that are drawn.
    pub seed: u64,
}

/// The points of one shape in normalised coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Cloud {
    /// Positions.
    pub points: Vec<[f32; 3]>,
    /// Unit normals, one per point.
    pub normals: Option<Vec<[f32; 3]>>,
}

/// Two shapes made ready for training.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The shape at time 0.
    pub source: Cloud,
    /// The shape at time 1.
    pub target: Cloud,
    /// Points of the source with the points of the target that they move to, normalised.
    pub correspondences: Vec<([f32; 3], [f32; 3])>,
    /// The way between the user's coordinates and these.
    pub normalisation: Normalisation,
    /// The box around both shapes, normalised.
    pub bounds: Bounds,
    /// What the user should be told about the data, one sentence each.
    pub notes: Vec<String>,
}

impl Pair {
    /// Two spheres of points of radius 0.28 with normals, the second 0.2 further along x, of which the
    /// first `known` points are known to correspond: shapes for measuring and testing that need no file.
    pub fn spheres(points: usize, known: usize) -> Self {
        let normals: Vec<[f32; 3]> = (0..points)
            .map(|k| {
                // A Fibonacci lattice: even, and the same everywhere.
                let z = 1.0 - (2 * k + 1) as f64 / points as f64;
                let (ring, angle) = ((1.0 - z * z).sqrt(), 2.399_963 * k as f64);
                [ring * angle.cos(), ring * angle.sin(), z].map(|c| c as f32)
            })
            .collect();
        let cloud = |offset: f32| Cloud {
            points: normals
                .iter()
                .map(|[x, y, z]| [0.28 * x + offset, 0.28 * y, 0.28 * z])
                .collect(),
            normals: Some(normals.clone()),
        };
        let (source, target) = (cloud(-0.1), cloud(0.1));
        let pairs = source.points.iter().copied();
        let pairs = pairs.zip(target.points.iter().copied());
        Self {
            correspondences: pairs.take(known).collect(),
            normalisation: Normalisation {
                centre: [0.0; 3],
                scale: 1.0,
            },
            bounds: Bounds::of(&source.points).union(&Bounds::of(&target.points)),
            notes: Vec::new(),
            source,
            target,
        }
    }
}

/// What is drawn at random; each has its own stream, so that no choice shifts another.
#[derive(Clone, Copy)]
enum Draw {
    Source,
    Target,
    Correspondences,
}

impl Draw {
    fn generator(self, seed: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(self as u64);
        rng
    }
}

/// Reads, normalises and samples both shapes and picks the correspondences.
///
/// The same options and files give the same pair.
///
/// # Errors
/// What [`formats::read`] and [`Correspondences`] refuse; fewer than [`FEWEST_POINTS`] points; a
/// fraction that leaves no correspondence; normals asked of a cloud that has none.
pub fn prepare(options: &DataOptions) -> Result<Pair, ShapeError> {
    if options.points < FEWEST_POINTS {
        return Err(ShapeError::Option {
            option: "points",
            found: options.points.to_string(),
            allowed: format!("{FEWEST_POINTS} or more"),
        });
    }
    let source = formats::read(&options.source)?;
    let target = formats::read(&options.target)?;
    let normalisation = Normalisation::joint(&[&source, &target])?;
    let correspondences = correspondences(options, &source, &target)?;
    let correspondences = correspondences
        .into_iter()
        .map(|(from, to)| (normalisation.apply(from), normalisation.apply(to)))
        .collect();
    let mut notes = Vec::new();
    let mut cloud = |shape: &Shape, draw: Draw| {
        let mut rng = draw.generator(options.seed);
        points_of(shape, options.points, options.normals, &mut rng, &mut notes).map(
            |(points, normals)| Cloud {
                points: points
                    .into_iter()
                    .map(|point| normalisation.apply(point))
                    .collect(),
                normals,
            },
        )
    };
    let source = cloud(&source, Draw::Source)?;
    let target = cloud(&target, Draw::Target)?;
    let bounds = Bounds::of(&source.points).union(&Bounds::of(&target.points));
    Ok(Pair {
        source,
        target,
        correspondences,
        normalisation,
        bounds,
        notes,
    })
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
        let samples = sample_surface(&shape.mesh, count, rng);
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
        // Not turned, as a closed mesh's are: of a cloud nobody knows whether it is closed.
        if let (NormalSource::Auto, Ok(normals)) = (wanted, &normals)
            && is_inside_out(&shape.mesh.vertices, normals)
        {
            notes.push(format!(
                "{name}: the file's normals point inwards on the whole: taken as they are; if the shape is \
                 closed, set data.normals = \"estimate\" or turn them"
            ));
        }
        (shape.mesh.vertices.clone(), normals.ok())
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
             triangles): its normals are taken as its triangles are wound"
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

/// Corresponding points in the user's coordinates.
type PointPairs = Vec<([f64; 3], [f64; 3])>;

/// The correspondences that the options ask for.
fn correspondences(
    options: &DataOptions,
    source: &Shape,
    target: &Shape,
) -> Result<PointPairs, ShapeError> {
    let available = match &options.correspondences {
        CorrespondenceSource::None => return Ok(Vec::new()),
        CorrespondenceSource::File(path) => Correspondences::read_csv(path, source, target)?,
        CorrespondenceSource::SameVertices => Correspondences::same_vertices(source, target)?,
        CorrespondenceSource::Pairs(known) => known.clone(),
    };
    let points = if source.is_mesh() {
        options.points
    } else {
        source.mesh.vertices.len()
    };
    // A fraction that is not a number gives 0, as does a negative one.
    let count = (points as f64 * options.correspondence_fraction).round() as usize;
    if count == 0 {
        return Err(ShapeError::Option {
            option: "correspondence-fraction",
            found: options.correspondence_fraction.to_string(),
            allowed: format!(
                "such that at least 1 of {points} points is used; for none set \
                 data.correspondences = \"none\""
            ),
        });
    }
    let mut rng = Draw::Correspondences.generator(options.seed);
    let shared = options.correspondences == CorrespondenceSource::SameVertices;
    if shared && source.is_mesh() && source.mesh.triangles == target.mesh.triangles {
        return Ok(surface_pairs(source, target, count, &mut rng));
    }
    let chosen = available.drawn(count, &mut rng).pairs.into_iter();
    let place = |[from, to]: [u32; 2]| {
        (
            source.mesh.vertices[from as usize],
            target.mesh.vertices[to as usize],
        )
    };
    Ok(chosen.map(place).collect())
}

/// Points at equal barycentric coordinates of two meshes that share their triangles, drawn by area
/// of the source.
fn surface_pairs(source: &Shape, target: &Shape, count: usize, rng: &mut ChaCha8Rng) -> PointPairs {
    let samples = sample_surface(&source.mesh, count, rng);
    let places = samples.faces.iter().zip(&samples.barycentric);
    let moved = places.map(|(&face, weights)| {
        let triangle = target.mesh.triangles[face as usize];
        point_at(&target.mesh, triangle, weights.map(f64::from))
    });
    samples.points.iter().copied().zip(moved).collect()
}

#[cfg(test)]
mod tests;
