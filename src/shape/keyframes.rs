//! Shapes in, everything that training needs of them out: [`prepare`].
//!
//! A mesh is sampled by area, with the normals of its faces; a cloud is used as it is, with its own
//! normals or estimated ones. Whatever was decided about the data on the way is said in
//! [`Keyframes::notes`].

use std::borrow::Cow;
use std::path::PathBuf;

use isomorph_training::data::PointPair;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::border;
use super::coordinates::{Coordinates, Placements};
use super::correspond::Correspondences;
use super::mismatch;
use super::normalise::Normalisation;
use super::points::{NormalSource, closed, points_of};
use super::sample::{point_at, sample_surface};
use crate::formats::{FEWEST_POINTS, Shape, ShapeError};
use crate::geometry::{Bounds, Mesh, turned_outwards};

/// Where correspondences come from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum CorrespondenceSource {
    /// A file of pairs, of a map, or of points in all key frames.
    File(PathBuf),
    /// Vertex i of the source corresponds to vertex i of the target.
    SameVertices,
    /// These.
    Pairs(Correspondences),
    /// None are known.
    None,
}

/// What to make of which shapes: the data section of a recipe.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DataOptions {
    /// The times of the key frames, ascending from 0 to 1; at least two.
    pub times: Vec<f64>,
    /// Where pairs of corresponding points come from: entry `k` from key frame `k` to the one after it.
    pub between: Vec<CorrespondenceSource>,
    /// Points sampled on each mesh; a cloud is used as it is.
    pub points: usize,
    /// Correspondences used between two key frames, as a fraction of the earlier one's points, when that
    /// many are available.
    pub correspondence_fraction: f64,
    /// Where normals come from.
    pub normals: NormalSource,
    /// Whether pairs may mirror a shape.
    pub mirrored: bool,
    /// The thickness of open sheets, normalised, where shapes themselves are carried. None of it, or 0, where they are
    /// closed by a cushion.
    pub sheets: Option<f64>,
    /// The way to normalised coordinates, where it is given.
    pub normalisation: Option<Normalisation>,
    /// Names the samples that are drawn.
    pub seed: u64,
}

/// The points of one shape in normalised coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCloud {
    /// Positions.
    pub points: Vec<[f32; 3]>,
    /// Unit normals, one per point.
    pub normals: Option<Vec<[f32; 3]>>,
}

/// A shape at its time, as points.
#[derive(Debug, Clone, PartialEq)]
pub struct Keyframe {
    /// Its time, 0 to 1.
    pub time: f64,
    /// Its points, normalised.
    pub cloud: PointCloud,
    /// The shape itself, normalised and wound outwards, if it is a closed mesh.
    pub(crate) mesh: Option<Mesh<f32>>,
    /// Whether each point lies at the border of what is known of the shape; empty where nothing is missing.
    pub(crate) border: Vec<bool>,
    /// The shape itself if it is an open sheet that has a thickness.
    pub(crate) sheet: Option<Sheet>,
}

/// A mesh that encloses nothing, normalised, and how thick it is taken to be.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sheet {
    pub mesh: Mesh<f32>,
    pub thickness: f32,
}

/// What messages call shape `k` of `count`.
pub(crate) fn key_name(k: usize, count: usize) -> String {
    match (k, count) {
        (0, 2) => "source".to_owned(),
        (1, 2) => "target".to_owned(),
        _ => format!("key frame {k}"),
    }
}

/// Two or more shapes at their times, made ready for training.
#[derive(Debug, Clone, PartialEq)]
pub struct Keyframes {
    /// The key frames, in the order of their times.
    pub keys: Vec<Keyframe>,
    /// Points with the points that they move to, normalised: entry `k` from key frame `k` to the next.
    pub between: Vec<Vec<PointPair>>,
    /// How sure each of these pairs is, 0 to 1; entry `k` is empty where the pairs of that interval do not say.
    pub confidence: Vec<Vec<f32>>,
    /// The way between the user's coordinates and these.
    pub normalisation: Normalisation,
    /// Where the shapes lie if they were laid onto each other.
    pub(crate) placements: Placements,
    /// The box around all of them, normalised.
    pub bounds: Bounds,
    /// What was decided about the data, one sentence each.
    pub notes: Vec<String>,
}

impl Keyframes {
    /// How many correspondences are known in all.
    pub fn pair_count(&self) -> usize {
        self.between.iter().map(Vec::len).sum()
    }

    /// The way between the user's coordinates and those of the points, at any time.
    pub(crate) fn coordinates(&self) -> Coordinates {
        Coordinates {
            normalisation: self.normalisation,
            placements: self.placements.clone(),
        }
    }

    /// The points of a key frame where its file has them, normalised as if nothing were laid onto anything.
    pub(crate) fn given_points(&self, k: usize) -> Cow<'_, [[f32; 3]]> {
        let key = &self.keys[k];
        if self.placements.is_empty() {
            return Cow::Borrowed(&key.cloud.points);
        }
        let place = self.coordinates().at(key.time);
        let given = key.cloud.points.iter();
        Cow::Owned(
            given
                .map(|x| self.normalisation.apply(place.invert(*x)))
                .collect(),
        )
    }
}

/// How many key frames there are, and how many a table is about that was there before others were appended: those from
/// the first on between which what is known is the same as from key frame `k` to the next. All, if these are not among
/// them.
pub(crate) fn columns<T: PartialEq>(between: &[T], k: usize) -> [usize; 2] {
    let all = between.len() + 1;
    let of_first = between.iter().take_while(|known| **known == between[0]);
    match of_first.count() {
        // Two key frames have pairs, and no table.
        count if k < count && count > 1 => [all, count + 1],
        _ => [all; 2],
    }
}

/// What is drawn at random; each has its own stream, so that no choice shifts another. The numbers are those
/// of two shapes from the first release on: they stay, so that a seed keeps its samples.
#[derive(Clone, Copy)]
pub(super) enum Draw {
    /// Of the key frame with this number.
    Points(usize),
    /// Of what completes the key frame with this number.
    Completing(usize),
    /// From the key frame with this number to the next.
    Correspondences(usize),
}

/// The most key frames whose points have streams of their own below those of training.
const STREAMS: u64 = 1 << 40;

impl Draw {
    pub(super) fn generator(self, seed: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(match self {
            Self::Points(key @ 0..=1) => key as u64,
            Self::Correspondences(0) => 2,
            Self::Completing(key @ 0..=1) => 3 + key as u64,
            // Far above the streams of training.
            Self::Points(key) => u64::MAX - STREAMS + key as u64,
            Self::Correspondences(key) => u64::MAX - 2 * STREAMS + key as u64,
            Self::Completing(key) => u64::MAX - 3 * STREAMS + key as u64,
        });
        rng
    }
}

/// Normalises and samples the shapes, one for each time of the options, and picks the correspondences.
///
/// The same options and shapes give the same key frames.
///
/// # Errors
/// What [`Correspondences`] refuses; fewer than [`FEWEST_POINTS`] points; a fraction that leaves no
/// correspondence; normals taken from a cloud that has none.
///
/// # Panics
/// If there is not one shape for each time, or not one source of correspondences between each two.
pub(crate) fn prepare(shapes: &[Shape], options: &DataOptions) -> Result<Keyframes, ShapeError> {
    assert_eq!(shapes.len(), options.times.len(), "a shape for each time");
    assert_eq!(shapes.len(), options.between.len() + 1, "a source between");
    if options.points < FEWEST_POINTS {
        return Err(ShapeError::Option {
            option: "points",
            found: options.points.to_string(),
            allowed: format!("{FEWEST_POINTS} or more"),
        });
    }
    let mut notes = Vec::new();
    let shapes: Vec<Cow<'_, Shape>> = shapes
        .iter()
        .map(|shape| wound_outwards(shape, options.normals, &mut notes))
        .collect();
    // Once: that of a cloud takes the neighbours of all points.
    let areas: Vec<f64> = shapes
        .iter()
        .map(|shape| shape.area())
        .collect::<Result<_, _>>()?;
    let all: Vec<&Shape> = shapes.iter().map(Cow::as_ref).collect();
    let normalisation = options.normalisation;
    let normalisation = normalisation.unwrap_or_else(|| Normalisation::of_areas(&all, &areas));
    let mut between: Vec<Vec<PointPair>> = Vec::with_capacity(options.between.len());
    let mut confidence = Vec::with_capacity(options.between.len());
    let mut fit_mirrors = Vec::with_capacity(options.between.len());
    for (two, areas) in all.windows(2).zip(areas.windows(2)) {
        let two = [two[0], two[1]];
        notes.extend(mismatch::sizes(two, [areas[0], areas[1]]));
        notes.extend(mismatch::distance(two));
    }
    for (k, source) in options.between.iter().enumerate() {
        // Vertices of equal number, and lines of one file, are the same points throughout a sequence: a draw for all
        // intervals.
        let is_file = matches!(source, CorrespondenceSource::File(_));
        let is_shared = is_file && options.between.iter().all(|other| other == source);
        let same = *source == CorrespondenceSource::SameVertices || is_shared;
        let draw = Draw::Correspondences(if same { 0 } else { k });
        let rng = draw.generator(options.seed);
        let known = correspondences(
            options,
            (k, source),
            [shapes[k].as_ref(), shapes[k + 1].as_ref()],
            (k > 0).then(|| shapes[0].as_ref()),
            rng,
            &mut notes,
        )?;
        fit_mirrors.push(mismatch::are_mirrored(&known.places));
        let place = |(from, to)| (normalisation.apply(from), normalisation.apply(to));
        between.push(known.places.into_iter().map(place).collect());
        confidence.push(known.confidence);
    }
    let mut keys = Vec::with_capacity(shapes.len());
    for (k, shape) in shapes.iter().enumerate() {
        keys.push(key_frame(k, shape, options, &normalisation, &mut notes)?);
    }
    for (k, pairs) in between.iter_mut().enumerate() {
        // Normals as they are given need not be on one side.
        let are_outward = matches!(options.normals, NormalSource::Auto | NormalSource::Estimate);
        let clouds = are_outward.then(|| [&keys[k].cloud, &keys[k + 1].cloud]);
        if options.mirrored || !mismatch::is_mirror(fit_mirrors[k], pairs, clouds) {
            continue;
        }
        let error = mirrored([&shapes[k], &shapes[k + 1]]);
        // Pairs that nobody gave do not stop a motion that others lead.
        let is_found = matches!(options.between[k], CorrespondenceSource::Pairs(_));
        if !is_found || keys.len() == 2 {
            return Err(error);
        }
        pairs.clear();
        confidence[k].clear();
        notes.push(format!(
            "from key frame {k} to key frame {} the surfaces alone lead, without the pairs that were found: {error}",
            k + 1
        ));
    }
    let boxes = keys.iter().map(|key| Bounds::of(&key.cloud.points));
    let bounds = boxes.reduce(|all, next| all.union(&next));
    Ok(Keyframes {
        bounds: bounds.expect("at least two key frames"),
        keys,
        between,
        confidence,
        normalisation,
        placements: Placements::default(),
        notes,
    })
}

/// The key frame of this number: its points with their normals, and what is known of the shape beside.
fn key_frame(
    k: usize,
    shape: &Shape,
    options: &DataOptions,
    normalisation: &Normalisation,
    notes: &mut Vec<String>,
) -> Result<Keyframe, ShapeError> {
    let mut rng = Draw::Points(k).generator(options.seed);
    notes.extend(shape.notes.iter().cloned());
    let thickness = options.sheets.filter(|thickness| *thickness > 0.0);
    let is_sheet = mismatch::is_sheet(shape);
    if is_sheet {
        notes.push(mismatch::of_sheet(
            shape,
            thickness.map(|own| own / normalisation.scale),
        ));
    }
    let (points, normals) = points_of(shape, options.points, options.normals, &mut rng, notes)?;
    let points = points.into_iter().map(|point| normalisation.apply(point));
    let cloud = PointCloud {
        points: points.collect(),
        normals,
    };
    let mesh = closed(shape, options.normals).map(|mesh| mesh.moved(|x| normalisation.apply(x)));
    let border = match (&mesh, &cloud.normals) {
        (None, Some(normals)) => border::points_at(&cloud.points, normals),
        _ => Vec::new(),
    };
    let sheet = thickness.filter(|_| is_sheet).map(|thickness| Sheet {
        mesh: shape.mesh.moved(|x| normalisation.apply(x)),
        thickness: thickness as f32,
    });
    Ok(Keyframe {
        time: options.times[k],
        cloud,
        mesh,
        border,
        sheet,
    })
}

fn mirrored([source, target]: [&Shape; 2]) -> ShapeError {
    ShapeError::Mirrored {
        source_path: source.path.clone(),
        target_path: target.path.clone(),
    }
}

/// A mesh with all of its pieces wound outwards, unless its own winding is to be kept.
pub(crate) fn wound_outwards<'a>(
    shape: &'a Shape,
    normals: NormalSource,
    notes: &mut Vec<String>,
) -> Cow<'a, Shape> {
    let keeps_winding = matches!(normals, NormalSource::Given | NormalSource::None);
    let turned = if keeps_winding || !shape.is_mesh() {
        None
    } else {
        turned_outwards(&shape.mesh)
    };
    let Some(turned) = turned else {
        return Cow::Borrowed(shape);
    };
    let name = shape.path.display();
    if turned.against > 0 {
        let (count, all) = (turned.against, turned.triangles.len());
        notes.push(format!(
            "{name}: {count} of {all} triangles are wound against the rest: turned"
        ));
    }
    if turned.whole {
        notes.push(format!(
            "{name}: triangles are wound inwards: normals flipped"
        ));
    }
    if turned.pieces > 0 {
        let count = turned.pieces;
        notes.push(format!(
            "{name}: {count} closed parts are wound inwards: turned"
        ));
    }
    let mut shape = shape.clone();
    shape.mesh.triangles = turned.triangles;
    Cow::Owned(shape)
}

/// Corresponding points.
#[derive(Default)]
struct PointPairs {
    /// In the user's coordinates.
    places: Vec<([f64; 3], [f64; 3])>,
    /// How sure each is; empty where they do not say.
    confidence: Vec<f32>,
}

/// The correspondences of two shapes, key frame `k` and the next, that the options ask for.
fn correspondences(
    options: &DataOptions,
    (k, from): (usize, &CorrespondenceSource),
    [source, target]: [&Shape; 2],
    first: Option<&Shape>,
    mut rng: ChaCha8Rng,
    notes: &mut Vec<String>,
) -> Result<PointPairs, ShapeError> {
    let available = match from {
        CorrespondenceSource::None => return Ok(PointPairs::default()),
        CorrespondenceSource::File(path) => {
            Correspondences::read_between(path, k, columns(&options.between, k), [source, target])?
        }
        CorrespondenceSource::SameVertices => Correspondences::same_vertices(source, target)?,
        CorrespondenceSource::Pairs(known) => known.clone(),
    };
    notes.extend(available.notes.iter().cloned());
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
    let shared = *from == CorrespondenceSource::SameVertices;
    if shared && source.is_mesh() && source.mesh.triangles == target.mesh.triangles {
        let first = first.filter(|first| first.mesh.triangles == source.mesh.triangles);
        return Ok(surface_pairs(first, source, target, count, &mut rng));
    }
    let chosen = available.drawn(count, &mut rng);
    let place = |[from, to]: [u32; 2]| {
        (
            source.mesh.vertices[from as usize],
            target.mesh.vertices[to as usize],
        )
    };
    Ok(PointPairs {
        places: chosen.pairs.into_iter().map(place).collect(),
        confidence: chosen.confidence,
    })
}

/// Points at equal barycentric coordinates of two meshes that share their triangles, drawn by area of the source,
/// or of the first of a sequence: the same points throughout.
fn surface_pairs(
    first: Option<&Shape>,
    source: &Shape,
    target: &Shape,
    count: usize,
    rng: &mut ChaCha8Rng,
) -> PointPairs {
    let samples = sample_surface(&first.unwrap_or(source).mesh, count, rng);
    let on = |mesh: &Mesh<f64>| -> Vec<[f64; 3]> {
        let places = samples.faces.iter().zip(&samples.barycentric);
        let place = |(&face, weights): (&u32, &[f32; 3])| {
            point_at(mesh, mesh.triangles[face as usize], weights.map(f64::from))
        };
        places.map(place).collect()
    };
    let start = match first {
        None => samples.points.clone(),
        Some(_) => on(&source.mesh),
    };
    PointPairs {
        places: start.into_iter().zip(on(&target.mesh)).collect(),
        confidence: Vec::new(),
    }
}

#[cfg(test)]
mod tests;
