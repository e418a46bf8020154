//! The surfaces of a run as files: at any times, in any resolution, with a picture of them.

use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::clock::Clock;
use super::log::RunLog;
use super::prepare;
use super::stop::StopFlag;
use super::trained::Trained;
use crate::error::{Error, Result};
use crate::event::Event;
use crate::formats::SurfaceFormat;
use crate::picture;
use crate::recipe::Recipe;
use crate::surface::frames::{CarriedSource, Frame, FrameOptions, OutputFormat, write_frames};

/// What to write.
#[derive(Clone, Debug, PartialEq)]
pub struct ExtractOptions {
    /// The times, from that of the first shape to that of the last ([`Trained::span`]).
    pub times: Vec<f64>,
    /// When each is shown in an animation, in seconds; without it at an even pace, in 2 seconds for two shapes and a
    /// second from each of more shapes to the next.
    pub seconds: Option<Vec<f64>>,
    /// Cells of the grid along the longest side of the box.
    pub resolution: usize,
    /// The kind of the files.
    pub format: OutputFormat,
    /// Whether `animation.png` is written too: a moving picture of the surfaces.
    pub film: bool,
    /// Whether each vertex of a surface says how far to believe it: in a PLY as the properties `quality` (how far
    /// the surface is from those of the ends, carried to its time) and `round_trip` (how far a point misses
    /// itself that is carried to an end and back), in the shapes' unit; in glTF as `_DISAGREEMENT` and
    /// `_ROUND_TRIP`. OBJ holds no such numbers.
    pub trust: bool,
    /// Distances from the surface at which layers are written as well, negative inside, in the shapes' unit;
    /// for files of one time each.
    pub layers: Vec<f64>,
    /// Whether the source's own vertices are carried along as well.
    pub carry: bool,
    /// The key frame whose vertices are carried, counted from 0; the source is the first.
    pub carry_from: usize,
    /// Pieces with less than this share of a surface's area are left out.
    pub smallest_component: f64,
    /// Where the files go; the run's own `meshes` folder without it.
    pub folder: Option<PathBuf>,
}

impl ExtractOptions {
    /// What the recipe asks for at the end of training.
    pub fn of(recipe: &Recipe) -> Self {
        Self {
            times: result_times(recipe),
            seconds: None,
            resolution: recipe.result.resolution,
            format: OutputFormat::Frames(SurfaceFormat::Ply),
            film: false,
            trust: false,
            layers: Vec::new(),
            carry: false,
            carry_from: 0,
            smallest_component: recipe.result.smallest_component,
            folder: None,
        }
    }

    /// Refuses what no extraction can be.
    fn check(&self) -> Result<()> {
        if !(0.0..=1.0).contains(&self.smallest_component) {
            return Err(Error::usage(format!(
                "smallest component {}: must be 0 to 1 (0 keeps every piece)",
                self.smallest_component
            )));
        }
        let infinite = |offset: &&f64| !offset.is_finite();
        if let Some(offset) = self.layers.iter().find(infinite) {
            return Err(Error::usage(format!(
                "layer {offset}: must be a finite length"
            )));
        }
        if !self.layers.is_empty() && !matches!(self.format, OutputFormat::Frames(_)) {
            let text = "layers: an animation has none; take the format ply or obj";
            return Err(Error::usage(text.to_owned()));
        }
        if self.trust && self.format == OutputFormat::Frames(SurfaceFormat::Obj) {
            let text = "trust: OBJ holds no numbers for vertices; take the format ply or glb";
            return Err(Error::usage(text.to_owned()));
        }
        Ok(())
    }
}

/// How long an animation of two shapes runs, if nothing else is asked for.
const SECONDS: f64 = 2.0;

/// The most key frames whose surfaces all belong to the result.
const SHOWN_KEYS: usize = 32;

/// The times of the result: `result.frames` even ones, and those of the key frames where there are more than two.
fn result_times(recipe: &Recipe) -> Vec<f64> {
    let clock = Clock::of(recipe);
    let units = even_times(recipe.result.frames).into_iter();
    let mut times: Vec<f64> = units.map(|unit| clock.own(unit)).collect();
    let keys = &recipe.data.keyframes;
    if (3..=SHOWN_KEYS).contains(&keys.len()) && !times.is_empty() {
        // A key frame takes the place of an even time that is nearly the same.
        let near = 0.01 * clock.length();
        times.retain(|time| keys.iter().all(|key| (key.time - time).abs() > near));
        times.extend(keys.iter().map(|key| key.time));
        times.sort_by(f64::total_cmp);
    }
    times
}

/// Evenly spaced times from 0 to 1.
pub fn even_times(frames: usize) -> Vec<f64> {
    match frames {
        1 => vec![0.0],
        _ => (0..frames)
            .map(|k| k as f64 / (frames - 1) as f64)
            .collect(),
    }
}

impl Trained {
    /// Writes surfaces, `frames.json` that lists them, and `preview.png` that shows them; returns the path
    /// of `frames.json`.
    ///
    /// # Errors
    /// Of kind [`Interruption`](crate::ErrorKind::Interruption) if the stop flag was set; else what keeps a
    /// surface from being found or written.
    pub fn extract(
        &self,
        options: &ExtractOptions,
        stop: &StopFlag,
        mut on_event: impl FnMut(&Event),
    ) -> Result<PathBuf> {
        self.folder().check_output()?;
        let mut log = RunLog::open(self.folder().path(), Some(usize::MAX))?;
        self.extract_into(options, stop, &mut log, &mut on_event)?;
        Ok(self.output(options).join("frames.json"))
    }

    /// When each surface is shown in an animation.
    fn seconds(&self, options: &ExtractOptions) -> Result<Vec<f64>> {
        let Some(seconds) = &options.seconds else {
            let intervals = self.recipe().data.keyframes.len() - 1;
            let all = SECONDS.max(intervals as f64);
            let units = options.times.iter().map(|time| self.clock().unit(*time));
            return units.map(|unit| Ok(all * unit?)).collect();
        };
        if seconds.len() == options.times.len() {
            return Ok(seconds.clone());
        }
        Err(Error::usage(format!(
            "{} seconds for {} times: give one for each",
            seconds.len(),
            options.times.len()
        )))
    }

    /// Where the files go.
    fn output(&self, options: &ExtractOptions) -> PathBuf {
        let folder = options.folder.clone();
        folder.unwrap_or_else(|| self.folder().meshes())
    }

    /// The file of a key frame, whose vertices are carried; a frame of a sequence is written as a file into `held`.
    fn carried_key(&self, k: usize, held: &mut Option<TempDir>) -> Result<CarriedSource> {
        let keys = &self.recipe().data.keyframes;
        let key = keys.get(k).ok_or_else(|| {
            Error::usage(format!(
                "key frame {k}: the run has {}, counted from 0",
                keys.len()
            ))
        })?;
        let file = match key.frame {
            None => key.file.clone(),
            Some(frame) => {
                let stem = key.file.file_stem().unwrap_or_default().to_string_lossy();
                let folder = held.insert(tempfile::tempdir()?);
                let file = folder.path().join(format!("{stem}-{frame}.ply"));
                prepare::shape_of(key, &mut None)?.write(&file)?;
                file
            }
        };
        let time = self.clock().unit(key.time)?;
        Ok(CarriedSource { file, time })
    }

    /// Writes surfaces and returns them.
    pub(super) fn extract_into(
        &self,
        options: &ExtractOptions,
        stop: &StopFlag,
        log: &mut RunLog,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Vec<Frame>> {
        options.check()?;
        let clock = self.clock();
        let times: Result<Vec<f64>> = options.times.iter().map(|t| clock.unit(*t)).collect();
        // Where a frame of a sequence stands as a file while it is carried.
        let mut held = None;
        let frame_options = FrameOptions {
            times: times?,
            names: options.times.clone(),
            seconds: self.seconds(options)?,
            keys: self.key_units(),
            resolution: options.resolution,
            format: options.format,
            trust: options.trust,
            layers: options.layers.clone(),
            carry: match options.carry {
                true => Some(self.carried_key(options.carry_from, &mut held)?),
                false => None,
            },
            smallest_component: options.smallest_component,
            folder: self.output(options),
        };
        let mut emit = |event: Event| {
            on_event(&event);
            log.record(&event)
        };
        emit(Event::Extracting {
            frames: options.times.len(),
        })?;
        let frames = write_frames(self.learned(), &frame_options, |frame| {
            emit(extracted(frame, &frame_options))?;
            if let Some(trust) = frame.trust {
                let time = frame.entry.time;
                emit(Event::Trusted { time, trust })?;
            }
            Ok(!stop.is_set())
        })?;
        if frames.len() < options.times.len() {
            return Err(Error::interruption(format!(
                "stopped after {} of {} surfaces",
                frames.len(),
                options.times.len()
            )));
        }
        emit(Event::Drawing)?;
        let film = options.film.then_some(&frame_options.seconds[..]);
        show(&frames, &frame_options.folder, film)?;
        Ok(frames)
    }
}

fn extracted(frame: &Frame, options: &FrameOptions) -> Event {
    Event::Extracted {
        time: frame.entry.time,
        path: options.folder.join(&frame.entry.surface),
        vertices: frame.mesh.vertices.len(),
        triangles: frame.mesh.triangles.len(),
        components: frame.components,
        left_out: frame.left_out,
        consistency: frame.entry.consistency,
        touches_box: frame.touches_box,
    }
}

/// At most this many surfaces fit side by side and can still be told apart.
const SHOWN: usize = 9;

/// A surface as pictures take it.
fn drawn(frame: &Frame) -> picture::Frame<'_> {
    picture::Frame {
        vertices: &frame.mesh.vertices,
        triangles: &frame.mesh.triangles,
        time: frame.time as f32,
        named: frame.entry.time,
    }
}

/// `preview.png`: up to nine of the frames, evenly chosen; and `animation.png`, all of them in turn, if `film` says in
/// which second each is shown.
pub(super) fn show(frames: &[Frame], folder: &Path, film: Option<&[f64]>) -> io::Result<()> {
    let filled = |frame: &&Frame| !frame.mesh.triangles.is_empty();
    let view = picture::View::default();
    let count = frames.len().min(SHOWN);
    let chosen = (0..count).map(|k| match count {
        1 => &frames[0],
        _ => &frames[k * (frames.len() - 1) / (count - 1)],
    });
    let panels: Vec<_> = chosen.filter(filled).map(drawn).collect();
    if !panels.is_empty() {
        let path = folder.join("preview.png");
        picture::strip(&panels, &view, &path).map_err(io::Error::other)?;
    }
    let Some(seconds) = film else {
        return Ok(());
    };
    let shown = frames.iter().zip(seconds);
    let mut all: Vec<_> = shown.filter(|(frame, _)| filled(frame)).collect();
    if !all.is_empty() {
        all.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let seconds: Vec<f32> = all.iter().map(|(_, second)| **second as f32).collect();
        let all: Vec<_> = all.into_iter().map(|(frame, _)| drawn(frame)).collect();
        let path = folder.join("animation.png");
        picture::film(&all, &seconds, &view, &path).map_err(io::Error::other)?;
    }
    Ok(())
}
