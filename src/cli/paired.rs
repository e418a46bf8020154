//! The two shapes of a recipe made ready, their pairs found first where the recipe asks for it.

use std::path::Path;

use anyhow::Result;

use crate::learner::event::Event;
use crate::learner::settings;
use crate::matching::{MatchOptions, Matching, match_shapes};
use crate::recipe::{self, Recipe};
use crate::report::Verbosity;
use crate::run_directory::RunDirectory;
use crate::shape::{self, Correspondences, Pair};

/// Shapes ready for training.
pub(super) struct Prepared {
    pub pair: Pair,
    /// What matching found just now, which the run does not hold yet.
    found: Option<Matching>,
}

/// Makes the shapes of a recipe ready. Pairs that are to be found are read from `stored` if that
/// file exists.
///
/// # Errors
/// What [`shape::prepare`] and [`match_shapes`] refuse.
pub(super) fn prepare(
    recipe: &Recipe,
    stored: Option<&Path>,
    verbosity: Verbosity,
) -> Result<Prepared> {
    if recipe.data.correspondences != recipe::Correspondences::Match {
        let pair = shape::prepare(&settings::data(recipe, None))?;
        return Ok(Prepared { pair, found: None });
    }
    let source = shape::read(&recipe.data.source)?;
    let target = shape::read(&recipe.data.target)?;
    let (known, found) = match stored.filter(|path| path.is_file()) {
        Some(path) => (Correspondences::read_csv(path, &source, &target)?, None),
        None => {
            if verbosity == Verbosity::Normal {
                // There is no run yet whose reporter could say so, and it takes half a minute.
                eprintln!("finding pairs of the two shapes");
            }
            let options = MatchOptions {
                points: recipe.data.points,
                seed: recipe.training.seed,
                ..MatchOptions::default()
            };
            let found = match_shapes(&source, &target, &options)?;
            (found.correspondences(), Some(found))
        }
    };
    let pair = shape::prepare(&settings::data(recipe, Some(known)))?;
    Ok(Prepared { pair, found })
}

impl Prepared {
    /// Writes pairs that were found into the run, for whoever goes on with it, and says what is to
    /// be reported of them.
    ///
    /// # Errors
    /// What the file system says; the message names the file.
    pub(super) fn keep(&self, run: &RunDirectory) -> std::io::Result<Option<Event>> {
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
