//! What is known from each key frame to the next: pairs that are given, and those that are found first.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::Result;
use crate::event::Event;
use crate::formats::Shape;
use crate::matching::{MatchError, MatchOptions, Matching, match_shapes};
use crate::recipe::{self, Recipe};
use crate::session::folder::RunFolder;
use crate::shape::{CorrespondenceSource, Correspondences};

/// What is known from each key frame to the next.
pub(super) struct Chain {
    pub between: Vec<CorrespondenceSource>,
    /// What matching found just now, by the interval.
    pub found: BTreeMap<usize, Matching>,
    /// What is said of intervals without pairs.
    pub notes: Vec<String>,
}

impl Chain {
    /// The pairs that a recipe names, and those that are to be found, which are read from `stored` if they were found
    /// before. An interval of several in which none are found is left to the surfaces, with a note.
    ///
    /// # Errors
    /// Pairs that cannot be read; what [`match_shapes`] refuses; no pairs where nothing else leads through the shapes.
    pub(super) fn new(
        recipe: &Recipe,
        shapes: &[Shape],
        stored: Option<&RunFolder>,
        emit: &mut dyn FnMut(&Event),
    ) -> Result<Self> {
        let intervals = recipe.data.between.len();
        let mut chain = Self {
            between: Vec::with_capacity(intervals),
            found: BTreeMap::new(),
            notes: Vec::new(),
        };
        let mut missed = None;
        for (k, known) in recipe.data.between.iter().enumerate() {
            let source = match known {
                recipe::Correspondences::None => CorrespondenceSource::None,
                recipe::Correspondences::SameVertices => CorrespondenceSource::SameVertices,
                recipe::Correspondences::File(path) => CorrespondenceSource::File(path.clone()),
                recipe::Correspondences::Match => {
                    let two = [&shapes[k], &shapes[k + 1]];
                    let stored = stored.map(|run| run.found_pairs(k, intervals));
                    match matched(recipe, two, [k, intervals], stored.as_deref(), emit)? {
                        Ok((pairs, matching)) => {
                            chain.found.extend(matching.map(|matching| (k, matching)));
                            CorrespondenceSource::Pairs(pairs)
                        }
                        Err(none) => {
                            chain.notes.push(left_alone(k, &none));
                            missed.get_or_insert(none);
                            CorrespondenceSource::None
                        }
                    }
                }
            };
            chain.between.push(source);
        }
        let leads = |source: &CorrespondenceSource| *source != CorrespondenceSource::None;
        match missed {
            Some(none) if !chain.between.iter().any(leads) => Err(none.into()),
            _ => Ok(chain),
        }
    }
}

/// What is said of an interval in which no pairs are found.
fn left_alone(k: usize, why: &MatchError) -> String {
    format!(
        "from key frame {k} to key frame {} the surfaces alone lead, without pairs: {why}",
        k + 1
    )
}

/// The pairs of two shapes: those of an earlier search if they are there, else found now. The inner error is
/// [`MatchError::NoPairs`].
fn matched(
    recipe: &Recipe,
    [source, target]: [&Shape; 2],
    interval: [usize; 2],
    stored: Option<&Path>,
    emit: &mut dyn FnMut(&Event),
) -> Result<std::result::Result<(Correspondences, Option<Matching>), MatchError>> {
    if let Some(path) = stored.filter(|path| path.is_file()) {
        return Ok(Ok((Correspondences::read(path, source, target)?, None)));
    }
    let options = MatchOptions {
        points: recipe.data.points,
        seed: recipe.training.seed,
        ..MatchOptions::default()
    };
    let mut report = |stage, done, total| {
        emit(&Event::Matching {
            stage,
            done,
            total,
            interval,
        });
    };
    match match_shapes(
        source,
        target,
        &Correspondences::none(),
        &options,
        &mut report,
    ) {
        Ok(found) => Ok(Ok((found.correspondences(), Some(found)))),
        Err(none @ MatchError::NoPairs { .. }) => Ok(Err(none)),
        Err(other) => Err(other.into()),
    }
}
