//! The shapes of a recipe made ready, their pairs found first where the recipe asks for it.

use std::collections::BTreeMap;

use isomorph_training::method::spline::is_solved;

use super::align::{Aligned, aligned};
use super::chain::Chain;
use crate::error::Result;
use crate::event::{Event, Preparation};
use crate::formats::{self, Sequence, Shape};
use crate::matching::Matching;
use crate::recipe::{self, Recipe};
use crate::session::folder::RunFolder;
use crate::shape::{
    self, CleanOptions, Coordinates, CorrespondenceSource, DataOptions, Keyframes, NormalSource,
    Normalisation, Placements,
};
use crate::solved::sheet_thickness;

/// Shapes ready for training.
pub(super) struct Prepared {
    pub keyframes: Keyframes,
    /// What matching found just now, which the run does not hold yet, by the interval.
    found: BTreeMap<usize, Matching>,
    intervals: usize,
}

/// Reads the shapes of a recipe, cleaned as it says.
///
/// # Errors
/// What [`formats::read`] refuses.
pub(super) fn read(recipe: &Recipe) -> Result<Vec<Shape>> {
    let section = &recipe.data;
    let cleaning = (section.clean == recipe::Cleaning::Auto).then_some(CleanOptions {
        strays: section.clean_strays,
        part: section.clean_part,
    });
    // Read once, however many of its frames are key frames.
    let mut sequence: Option<Sequence> = None;
    let mut shapes = Vec::with_capacity(section.keyframes.len());
    for key in &section.keyframes {
        let shape = shape_of(key, &mut sequence)?;
        shapes.push(match &cleaning {
            Some(options) => shape.cleaned(options),
            None => shape,
        });
    }
    Ok(shapes)
}

/// The shape of a key frame, as its file has it.
///
/// # Errors
/// What [`formats::read`] and [`Sequence`] refuse.
pub(super) fn shape_of(
    key: &recipe::KeyframeRecipe,
    sequence: &mut Option<Sequence>,
) -> Result<Shape> {
    let Some(frame) = key.frame else {
        return Ok(formats::read(&key.file)?);
    };
    let read = match sequence.take() {
        Some(read) if read.path == key.file => read,
        _ => Sequence::read(&key.file)?,
    };
    let mut shape = sequence.insert(read).shape(frame)?;
    // Messages name the frame.
    shape.path = format!("{} frame {frame}", key.file.display()).into();
    Ok(shape)
}

/// Makes the shapes of a recipe ready. Pairs that are to be found are read from `stored` if that
/// file exists. If `frame` is given, the first so many shapes decide the normalisation.
///
/// # Errors
/// What [`shape::prepare`] and [`Chain::new`] refuse.
pub(super) fn prepare(
    recipe: &Recipe,
    shapes: &[Shape],
    stored: Option<&RunFolder>,
    frame: Option<usize>,
    emit: &mut dyn FnMut(&Event),
) -> Result<Prepared> {
    let Aligned {
        shapes,
        to_files,
        notes,
    } = aligned(recipe, shapes)?;
    let shapes = &shapes[..];
    let Chain {
        between,
        found,
        notes: alone,
    } = Chain::new(recipe, shapes, stored, emit)?;
    emit(&Event::Preparing(Preparation::Points));
    let first = frame.map(|count| &shapes[..count.min(shapes.len())]);
    let first = first.map(|shapes| Normalisation::joint(&shapes.iter().collect::<Vec<_>>()));
    let options = options(recipe, between, first.transpose()?);
    let mut keyframes = shape::prepare(shapes, &options)?;
    if !to_files.is_empty() {
        let centre = keyframes.normalisation.centre;
        keyframes.placements = Placements::new(&to_files, &options.times, centre);
    }
    keyframes.notes.extend(notes);
    keyframes.notes.extend(alone);
    if is_solved(recipe) {
        emit(&Event::Preparing(Preparation::Distances));
    }
    Ok(Prepared {
        keyframes,
        found,
        intervals: recipe.data.between.len(),
    })
}

/// Makes the shapes of a recipe ready where only their points count: no pairs are read or found. They lie on each other
/// as they did in training.
///
/// # Errors
/// What [`shape::prepare`] refuses.
pub(super) fn points_only(recipe: &Recipe, coordinates: &Coordinates) -> Result<Keyframes> {
    let unknown = recipe.data.between.iter();
    let unknown = unknown.map(|_| CorrespondenceSource::None).collect();
    let options = options(recipe, unknown, Some(coordinates.normalisation));
    let shapes = read(recipe)?.into_iter().zip(&options.times);
    let laid = shapes.map(|(shape, time)| match coordinates.at(*time).to_file {
        Some(to_file) => shape.laid_by(&to_file.inverse()),
        None => shape,
    });
    let mut keyframes = shape::prepare(&laid.collect::<Vec<_>>(), &options)?;
    keyframes.placements = coordinates.placements.clone();
    Ok(keyframes)
}

/// What a recipe says of its shapes.
fn options(
    recipe: &Recipe,
    between: Vec<CorrespondenceSource>,
    normalisation: Option<Normalisation>,
) -> DataOptions {
    let section = &recipe.data;
    DataOptions {
        times: section.unit_times(),
        between,
        points: section.points,
        correspondence_fraction: section.correspondence_fraction,
        normals: match section.normals {
            recipe::NormalSource::Auto => NormalSource::Auto,
            recipe::NormalSource::Given => NormalSource::Given,
            recipe::NormalSource::Estimate => NormalSource::Estimate,
            recipe::NormalSource::None => NormalSource::None,
        },
        mirrored: section.mirrored,
        sheets: sheet_thickness(recipe),
        normalisation,
        seed: recipe.training.seed,
    }
}

impl Keyframes {
    /// The shapes of a recipe as training samples them: their points and normals, normalised, with what was
    /// decided about them in [`Keyframes::notes`]. Pairs are found if the recipe says so.
    ///
    /// # Errors
    /// A shape that cannot be read or sampled, pairs that cannot be read or found.
    pub fn of(recipe: &Recipe) -> Result<Self> {
        let prepared = prepare(recipe, &read(recipe)?, None, None, &mut |_| {})?;
        Ok(prepared.keyframes)
    }
}

impl Prepared {
    /// Writes pairs that were found into the run, for whoever goes on with it, and gives what is to be
    /// reported of them.
    ///
    /// # Errors
    /// What the file system says; the message names the file.
    pub(super) fn keep(&self, run: &RunFolder) -> std::io::Result<Vec<Event>> {
        let mut events = Vec::with_capacity(self.found.len());
        for (k, found) in &self.found {
            found.write_csv(&run.pairs(*k, self.intervals))?;
            let (coverage, cycle) = (&found.coverage, &found.cycle.source);
            events.push(Event::Matched {
                interval: [*k, self.intervals],
                pairs: found.pairs.len(),
                coverage: [coverage.source, coverage.target],
                cycle: [cycle.median, cycle.quantile_95],
                seconds: found.seconds,
            });
        }
        Ok(events)
    }
}
