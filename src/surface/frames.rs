//! The surfaces of a trained run at chosen times, as files: the zero set of `f(., t)` with normals from
//! `grad f`, and the input mesh's own vertices carried along `V`.
//!
//! Everything is written in the user's coordinates. `frames.json` lists the files:
//! `[{"time": t, "surface": "surface-000.ply", "slope_error": 0.02, "consistency": 0.001,
//! "round_trip": 1e-7, "carried": "carried-000.ply"}, …]`.

use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::animation;
use super::error::{FramesError, no_motion};
use super::layers::{LayerEntry, write_layers};
use super::learned::{Found, Learned};
use super::trust::{Trust, TrustMap};
use crate::atomic::{sweep, write_atomically};
use crate::cubes::Grid;
use crate::formats::{
    self, Shape, SurfaceFormat, carried_extension, rewrite_vertices, write_surface_with,
};
use crate::geometry::Mesh;
use crate::geometry::linear::is_finite;
use crate::gltf::{self, Precision, Still};

/// The files that surfaces, and carried vertices, are written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputFormat {
    /// One file for each time: `surface-000.ply` and so on.
    Frames(SurfaceFormat),
    /// One animated file for all times: `surface.glb`, and `carried.glb`.
    Animation(Precision),
}

impl OutputFormat {
    /// The file of the surface at the `k`-th time.
    fn surface(self, k: usize) -> String {
        match self {
            Self::Frames(format) => format!("surface-{k:03}.{}", format.extension()),
            Self::Animation(_) => animation::SURFACE.to_owned(),
        }
    }
}

/// What to write.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FrameOptions {
    /// The times, in `[0, 1]`, in the order of the files.
    pub times: Vec<f64>,
    /// The same in the user's unit, as they are listed.
    pub names: Vec<f64>,
    /// When each is shown in an animation, in seconds.
    pub seconds: Vec<f64>,
    /// The times of the key frames, in `[0, 1]`, if there are more than two.
    pub keys: Vec<f64>,
    /// Cells along the longest side of the box.
    pub resolution: usize,
    /// The kind of the files.
    pub format: OutputFormat,
    /// Whether each vertex of a surface says how far to believe it.
    pub trust: bool,
    /// Distances from the surface, in the user's unit, at which layers are written as well.
    pub layers: Vec<f64>,
    /// The mesh or cloud whose vertices are carried too, if any.
    pub carry: Option<CarriedSource>,
    /// Pieces with less than this share of a surface's area are left out; 0 keeps all.
    pub smallest_component: f64,
    /// The folder that the files go to.
    pub folder: PathBuf,
}

/// A shape whose vertices are carried.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CarriedSource {
    /// Its file.
    pub file: PathBuf,
    /// When it is where the file says, in `[0, 1]`.
    pub time: f64,
}

/// One entry of `frames.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FrameEntry {
    /// The time, in the user's unit.
    pub time: f64,
    /// The key frame of this time, counted from 0, where there are more than two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub key: Option<usize>,
    /// The surface's file, relative to `frames.json`.
    pub surface: String,
    /// The mean of `||grad f| - 1|` over the surface's vertices: how far f is from a distance there;
    /// none where the surface is not the zero set of a field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slope_error: Option<f64>,
    /// The mean distance from this surface, carried to either end, to the surface there, normalised: 0
    /// where surface and motion say the same; none without a field or a motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub consistency: Option<f64>,
    /// The mean distance by which points of it miss themselves that are carried to either end and back,
    /// normalised.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub round_trip: Option<f64>,
    /// The carried mesh's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub carried: Option<String>,
    /// Layers beside the surface.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<LayerEntry>,
}

impl FrameEntry {
    /// The files that it names.
    fn files(&self) -> impl Iterator<Item = &str> {
        let layers = self.layers.iter().map(|layer| &layer.surface);
        [Some(&self.surface), self.carried.as_ref()]
            .into_iter()
            .flatten()
            .chain(layers)
            .map(String::as_str)
    }
}

/// A surface that has been written.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    /// Its entry in `frames.json`.
    pub entry: FrameEntry,
    /// The time, in `[0, 1]`.
    pub time: f64,
    /// The surface in normalised coordinates.
    pub mesh: Mesh<f32>,
    /// Connected pieces.
    pub components: usize,
    /// Pieces that were too small to be kept.
    pub left_out: usize,
    /// Whether it reaches the box, and so may be open there.
    pub touches_box: bool,
    /// How far to believe it, where that was asked for and can be said.
    pub trust: Option<Trust>,
}

impl Frame {
    /// A surface that was found, with its measures; it names no files yet.
    pub(crate) fn measured(
        learned: &Learned,
        found: Found,
        time: f64,
        slope_error: Option<f64>,
    ) -> Result<Self, FramesError> {
        let agreement = learned.agreement(&found.mesh.vertices, time)?;
        Ok(Self {
            time,
            entry: FrameEntry {
                time,
                key: None,
                surface: String::new(),
                slope_error,
                consistency: agreement.map(|found| found.consistency),
                round_trip: agreement.map(|found| found.round_trip),
                carried: None,
                layers: Vec::new(),
            },
            mesh: found.mesh,
            components: found.components,
            left_out: found.left_out,
            touches_box: found.touches_box,
            trust: None,
        })
    }
}

/// Writes the frames and `frames.json`; `done` is told of each and may stop the work by returning false.
///
/// Files of an earlier extraction in the same folder that the new `frames.json` does not list are deleted.
///
/// # Errors
/// [`FramesError`]. `frames.json` is removed first and written last, so a folder with one is complete.
pub(crate) fn write_frames(
    learned: &Learned,
    options: &FrameOptions,
    mut done: impl FnMut(&Frame) -> io::Result<bool>,
) -> Result<Vec<Frame>, FramesError> {
    if options.carry.is_some() && learned.deformation.motion().is_none() {
        return Err(no_motion());
    }
    let grid = Grid::new(learned.bounds.min, learned.bounds.max, options.resolution)?;
    let listing = options.folder.join("frames.json");
    let earlier = take_listing(&listing)?;
    let carried = match &options.carry {
        Some(source) => carry(learned, source, options)?,
        None => vec![None; options.times.len()],
    };
    sweep(&options.folder);
    let mut frames = Vec::new();
    let mut stills = Vec::new();
    for (k, carried) in carried.into_iter().enumerate() {
        let frame = write_frame(learned, options, &grid, k, carried, &mut stills)?;
        let go_on = done(&frame)?;
        frames.push(frame);
        if !go_on && frames.len() < options.times.len() {
            return Ok(frames);
        }
    }
    if let OutputFormat::Animation(precision) = options.format {
        animation::write_surfaces(stills, precision, &options.folder)?;
    }
    let entries: Vec<&FrameEntry> = frames.iter().map(|frame| &frame.entry).collect();
    let text = serde_json::to_string_pretty(&entries).map_err(io::Error::other)?;
    write_atomically(&listing, |out| out.write_all(text.as_bytes()))?;
    let kept: Vec<&str> = entries.iter().flat_map(|entry| entry.files()).collect();
    for stale in earlier
        .iter()
        .flat_map(FrameEntry::files)
        .filter(|file| !kept.contains(file))
    {
        // Deleted or moved by the user meanwhile: nothing is missing then.
        let _ = std::fs::remove_file(options.folder.join(stale));
    }
    Ok(frames)
}

/// Reads and removes the listing of an earlier extraction; none, or not ours, is an empty one.
fn take_listing(listing: &Path) -> io::Result<Vec<FrameEntry>> {
    let Ok(text) = std::fs::read_to_string(listing) else {
        return Ok(Vec::new());
    };
    std::fs::remove_file(listing)?;
    let mut entries: Vec<FrameEntry> = serde_json::from_str(&text).unwrap_or_default();
    // Names alone: a listing that someone edited deletes nothing outside its folder.
    entries.retain(|entry| entry.files().all(|file| !file.contains(['/', '\\'])));
    Ok(entries)
}

/// Extracts frame `k`, and writes it, or keeps it for the file of all frames.
fn write_frame(
    learned: &Learned,
    options: &FrameOptions,
    grid: &Grid,
    k: usize,
    carried: Option<String>,
    stills: &mut Vec<Still>,
) -> Result<Frame, FramesError> {
    let time = options.times[k];
    let surface = options.format.surface(k);
    let found = learned.surface_at(grid, time, options.smallest_component, &mut |_| {})?;
    let mesh = &found.mesh;
    let (normals, slope_error) = learned.normals(mesh, time);
    let place = learned.coordinates.at(time);
    let normals = place.invert_normals(normals);
    let mut placed = mesh.moved(|x| place.invert(x));
    let map = match options.trust {
        true => TrustMap::of(learned, mesh, time)?,
        false => None,
    };
    let map = map.as_ref();
    let trust = map.and_then(|map| map.summary(&placed.vertices));
    match options.format {
        OutputFormat::Frames(format) => {
            placed.normals = Some(normals);
            let attributes = map.map(TrustMap::for_ply);
            let attributes = attributes.as_ref().map_or(&[][..], |both| &both[..]);
            let path = options.folder.join(&surface);
            write_surface_with(&placed, attributes, &path, format)?;
        }
        OutputFormat::Animation(_) => stills.push(Still {
            time: options.names[k],
            second: options.seconds[k],
            vertices: placed.vertices,
            normals,
            triangles: placed.triangles,
            attributes: map.map_or_else(Vec::new, TrustMap::for_gltf),
        }),
    }
    let mut frame = Frame::measured(learned, found, time, slope_error)?;
    frame.trust = trust;
    frame.entry.time = options.names[k];
    frame.entry.key = options.keys.iter().position(|key| *key == time);
    frame.entry.surface = surface;
    frame.entry.carried = carried;
    frame.entry.layers = write_layers(learned, options, grid, k)?;
    Ok(frame)
}

/// Carries the vertices of a shape through all times and writes them; the name of the file for each time.
fn carry(
    learned: &Learned,
    source: &CarriedSource,
    options: &FrameOptions,
) -> Result<Vec<Option<String>>, FramesError> {
    let CarriedSource { file, time } = source;
    // An animation has no vertices without a place, a file keeps them.
    let shape = match options.format {
        OutputFormat::Animation(precision) => {
            let shape = formats::read(file)?;
            let (vertices, times) = (shape.mesh.vertices.len(), options.times.len());
            gltf::check_size(vertices, times, shape.is_mesh(), precision)?;
            shape
        }
        OutputFormat::Frames(_) => formats::read_any(file)?,
    };
    let mut order: Vec<usize> = (0..options.times.len()).collect();
    order.sort_by(|a, b| options.times[*a].total_cmp(&options.times[*b]));
    let times: Vec<f64> = order.iter().map(|k| options.times[*k]).collect();
    let path = carried_vertices(learned, &shape, *time, &times)?;
    if let OutputFormat::Animation(precision) = options.format {
        let moment = |k: &usize| [options.names[*k], options.seconds[*k]];
        let moments: Vec<[f64; 2]> = order.iter().map(moment).collect();
        animation::write_carried(&shape, &moments, path, precision, &options.folder)?;
        return Ok(vec![Some(animation::CARRIED.to_owned()); times.len()]);
    }
    let extension = carried_extension(file);
    let mut names = vec![None; options.times.len()];
    for (k, moved) in order.into_iter().zip(path) {
        let name = format!("carried-{k:03}.{extension}");
        rewrite_vertices(file, &moved, &options.folder.join(&name))?;
        names[k] = Some(name);
    }
    Ok(names)
}

/// The vertices of a shape of time `from` at each of `times`, which ascend, in the coordinates of the shape.
///
/// # Errors
/// [`FramesError::NoMotion`].
pub(crate) fn carried_vertices(
    learned: &Learned,
    shape: &Shape,
    from: f64,
    times: &[f64],
) -> Result<Vec<Vec<[f64; 3]>>, FramesError> {
    let vertices = &shape.mesh.vertices;
    let there = learned.coordinates.at(from);
    // What has no place stays without: it is not moved.
    let place = |x: &[f64; 3]| match is_finite(x) {
        true => there.apply(*x),
        false => [0.0; 3],
    };
    let start: Vec<[f32; 3]> = vertices.iter().map(place).collect();
    let path = learned.path_from(&start, from, times)?;
    // The displacement is added to the vertex as it was read, so that time 0 gives the input back.
    let placed = |(now, time): (Vec<[f32; 3]>, &f64)| {
        let place = learned.coordinates.at(*time);
        (vertices.iter().zip(start.iter().zip(&now)))
            .map(|(vertex, (start, now))| there.displaced(*vertex, [*start, *now], &place))
            .collect()
    };
    Ok(path.into_iter().zip(times).map(placed).collect())
}
