//! The shapes of a recipe made ready, their pairs found first where the recipe asks for it.

use std::path::Path;

use isomorph_training::method::spline::is_solved;

use crate::error::Result;
use crate::event::{Event, Preparation};
use crate::formats::{self, Shape};
use crate::matching::{MatchOptions, Matching, match_shapes};
use crate::recipe::{self, Recipe};
use crate::session::folder::RunFolder;
use crate::shape::{
    self, CleanOptions, CorrespondenceSource, Correspondences, DataOptions, Keyframes, NormalSource,
};

/// Shapes ready for training.
pub(super) struct Prepared {
    pub keyframes: Keyframes,
    /// What matching found just now, which the run does not hold yet.
    found: Option<Matching>,
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
    let cleaned = |key: &recipe::KeyframeRecipe| {
        let shape = formats::read(&key.file)?;
        Ok(match &cleaning {
            Some(options) => shape.cleaned(options),
            None => shape,
        })
    };
    section.keyframes.iter().map(cleaned).collect()
}

/// Makes the shapes of a recipe ready. Pairs that are to be found are read from `stored` if that
/// file exists.
///
/// # Errors
/// What [`shape::prepare`] and [`match_shapes`] refuse.
pub(super) fn prepare(
    recipe: &Recipe,
    shapes: &[Shape],
    stored: Option<&Path>,
    emit: &mut dyn FnMut(&Event),
) -> Result<Prepared> {
    let mut between = Vec::with_capacity(recipe.data.between.len());
    let mut found = None;
    for (known, shapes) in recipe.data.between.iter().zip(shapes.windows(2)) {
        between.push(match known {
            recipe::Correspondences::None => CorrespondenceSource::None,
            recipe::Correspondences::SameVertices => CorrespondenceSource::SameVertices,
            recipe::Correspondences::File(path) => CorrespondenceSource::File(path.clone()),
            recipe::Correspondences::Match => {
                let (known, matching) = matched(recipe, shapes, stored, emit)?;
                found = matching;
                CorrespondenceSource::Pairs(known)
            }
        });
    }
    emit(&Event::Preparing(Preparation::Points));
    let keyframes = shape::prepare(shapes, &options(recipe, between))?;
    if is_solved(recipe) {
        emit(&Event::Preparing(Preparation::Distances));
    }
    Ok(Prepared { keyframes, found })
}

/// The pairs of two shapes: those of an earlier search if they are there, else found now.
fn matched(
    recipe: &Recipe,
    shapes: &[Shape],
    stored: Option<&Path>,
    emit: &mut dyn FnMut(&Event),
) -> Result<(Correspondences, Option<Matching>)> {
    let (source, target) = (&shapes[0], &shapes[1]);
    if let Some(path) = stored.filter(|path| path.is_file()) {
        return Ok((Correspondences::read(path, source, target)?, None));
    }
    let options = MatchOptions {
        points: recipe.data.points,
        seed: recipe.training.seed,
        ..MatchOptions::default()
    };
    let found = match_shapes(
        source,
        target,
        &Correspondences::none(),
        &options,
        &mut |stage, done, total| {
            emit(&Event::Matching { stage, done, total });
        },
    )?;
    Ok((found.correspondences(), Some(found)))
}

/// Makes the shapes of a recipe ready where only their points count: no pairs are read or found.
///
/// # Errors
/// What [`shape::prepare`] refuses.
pub(super) fn points_only(recipe: &Recipe) -> Result<Keyframes> {
    let shapes = read(recipe)?;
    let unknown = recipe.data.between.iter();
    let unknown = unknown.map(|_| CorrespondenceSource::None).collect();
    Ok(shape::prepare(&shapes, &options(recipe, unknown))?)
}

/// What a recipe says of its shapes.
fn options(recipe: &Recipe, between: Vec<CorrespondenceSource>) -> DataOptions {
    let section = &recipe.data;
    DataOptions {
        times: times(recipe),
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
        seed: recipe.training.seed,
    }
}

/// The times of the key frames, brought to 0 to 1.
fn times(recipe: &Recipe) -> Vec<f64> {
    let times: Vec<f64> = recipe.data.keyframes.iter().map(|key| key.time).collect();
    let (first, last) = (times[0], times[times.len() - 1]);
    times
        .iter()
        .map(|time| (time - first) / (last - first))
        .collect()
}

impl Keyframes {
    /// The shapes of a recipe as training samples them: their points and normals, normalised, with what was
    /// decided about them in [`Keyframes::notes`]. Pairs are found if the recipe says so.
    ///
    /// # Errors
    /// A shape that cannot be read or sampled, pairs that cannot be read or found.
    pub fn of(recipe: &Recipe) -> Result<Self> {
        let prepared = prepare(recipe, &read(recipe)?, None, &mut |_| {})?;
        Ok(prepared.keyframes)
    }
}

impl Prepared {
    /// Writes pairs that were found into the run, for whoever goes on with it, and gives what is to be
    /// reported of them.
    ///
    /// # Errors
    /// What the file system says; the message names the file.
    pub(super) fn keep(&self, run: &RunFolder) -> std::io::Result<Option<Event>> {
        let Some(found) = &self.found else {
            return Ok(None);
        };
        found.write_csv(&run.pairs())?;
        let (coverage, cycle) = (&found.coverage, &found.cycle.source);
        Ok(Some(Event::Matched {
            pairs: found.pairs.len(),
            coverage: [coverage.source, coverage.target],
            cycle: [cycle.median, cycle.quantile_95],
            seconds: found.seconds,
        }))
    }
}
