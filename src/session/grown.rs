//! Runs to which key frames were appended: they go on from what is there, in the normalisation that they began with.

use std::path::PathBuf;

use isomorph_training::method::spline::is_solved;
use serde::{Deserialize, Serialize};

use super::checkpoint::{Checkpoint, CheckpointError};
use crate::error::{Error, Result};
use crate::recipe::Recipe;

/// Of so many steps one is made between new key frames.
const TURNS: usize = 2;

/// What a run has from before key frames were appended to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Grown {
    /// The first so many key frames decide the normalisation.
    pub frame: usize,
    /// So many were learned before.
    pub known: usize,
    /// Steps made before.
    pub step: usize,
}

impl Grown {
    /// Of a run with this recipe that goes on from a checkpoint; `None` if all of its key frames were there from the
    /// start. It is the checkpoint's own unless that is of fewer key frames.
    ///
    /// # Errors
    /// If the checkpoint's recipe does not parse, or what it says of itself cannot be.
    pub(crate) fn of(
        checkpoint: &Checkpoint,
        recipe: &Recipe,
    ) -> std::result::Result<Option<Self>, CheckpointError> {
        let before = checkpoint.recipe()?;
        let found = checkpoint.state.grown;
        let (known, all) = (before.data.keyframes.len(), recipe.data.keyframes.len());
        if let Some(Self {
            frame,
            known: first,
            step,
        }) = found
            && !(2 <= frame && frame <= first && first < known && step <= checkpoint.state.step)
        {
            let problem = format!("{first} of {known} key frames cannot be older than step {step}");
            return Err(checkpoint.damaged_state(problem));
        }
        if all == known || !recipe.data.continues(&before.data) {
            return Ok(found);
        }
        Ok(Some(Self {
            frame: found.map_or(known, |grown| grown.frame),
            known,
            step: checkpoint.state.step,
        }))
    }

    /// The last step of a run that goes on from here with the appended key frames of `after`.
    pub(crate) fn last_step(&self, before: &Recipe, last: Option<Self>, after: &Recipe) -> usize {
        let made = last.map_or(0, |grown| grown.step);
        // What learns anew takes the steps that it takes from the start.
        if is_solved(after) || self.known <= 2 {
            return self.step + after.training.steps.saturating_sub(made).max(1);
        }
        let (learned, share) = match last {
            Some(last) => (self.known - last.known, 1),
            None => (self.known - 1, TURNS),
        };
        let appended = after.data.keyframes.len() - self.known;
        let steps = before.training.steps.saturating_sub(made) * share * appended;
        self.step + steps.div_ceil(learned).max(1)
    }
}

/// Shapes that are appended to those of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Appended {
    /// Their files, in the order of their times.
    pub shapes: Vec<PathBuf>,
    /// Their times, in the run's own unit; without them each follows the one before as the run's last two do.
    pub times: Option<Vec<f64>>,
    /// What is known of the points from the shape before each of them to it, in the words of `data.correspondences`;
    /// without it, what is known between the run's last two.
    pub known: Option<String>,
}

impl Appended {
    /// Puts them into the recipe of the run.
    ///
    /// # Errors
    /// What [`Recipe::append`] refuses, and another number of times than shapes.
    pub(super) fn to(&self, recipe: &mut Recipe) -> Result<()> {
        let count = self.shapes.len();
        let times = match &self.times {
            Some(times) if times.len() == count => times.clone(),
            Some(times) => {
                let found = times.len();
                return Err(Error::usage(format!(
                    "{found} times for {count} shapes: give one for each"
                )));
            }
            None => following(recipe, count),
        };
        let shapes: Vec<_> = self.shapes.iter().zip(times).collect();
        Ok(recipe.append(&shapes, self.known.as_deref())?)
    }
}

/// Times after the last one of a recipe, as far apart as its last two.
fn following(recipe: &Recipe, count: usize) -> Vec<f64> {
    let [.., before, last] = &recipe.data.keyframes[..] else {
        unreachable!("a recipe has two key frames or more");
    };
    let apart = last.time - before.time;
    (1..=count).map(|k| last.time + k as f64 * apart).collect()
}

/// The key that says how many steps there are.
const STEPS: &str = "training.steps";

/// The key that chooses frames of a sequence.
const KEYS: &str = "data.keys";

/// Gives a recipe whose key frames go on after those of the checkpoint the steps of these, unless it or the `changes`
/// that were made to it say otherwise; whether its key frames go on.
///
/// # Errors
/// As of [`Grown::of`], and networks that have not learned the key frames before.
pub(super) fn begin(
    checkpoint: &Checkpoint,
    recipe: &mut Recipe,
    is_appended: bool,
    changes: &[String],
) -> Result<bool> {
    let last = checkpoint.state.grown;
    let Some(grown) = Grown::of(checkpoint, recipe)?.filter(|grown| Some(*grown) != last) else {
        return Ok(false);
    };
    let before = checkpoint.recipe()?;
    let (step, steps) = (checkpoint.state.step, before.training.steps);
    if step < steps && grown.known > 2 && !is_solved(recipe) {
        return Err(Error::usage(format!(
            "{}: step {step} of {steps}: the shapes before are not learned yet; resume the run to its end before others \
             are appended",
            checkpoint.path.display()
        )));
    }
    let changes_a = |what: &str| changes.iter().any(|change| change.trim().starts_with(what));
    // Other steps than the checkpoint's are those of an earlier try, or of a recipe that was edited.
    let is_first = is_appended || changes_a(KEYS);
    let is_same = recipe.training.steps == before.training.steps;
    if !changes_a(STEPS) && (is_first || is_same) {
        recipe.training.steps = grown.last_step(&before, last, recipe);
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe(preset: &str, keys: usize) -> Recipe {
        let shapes: Vec<_> = (0..keys).map(|k| (format!("/{k}.ply"), k as f64)).collect();
        let mut recipe = Recipe::through(&shapes).expect("key frames");
        let preset = format!("preset={preset}");
        recipe.with(&preset).expect("a preset");
        recipe
    }

    fn appended(recipe: &Recipe, count: usize) -> Recipe {
        let first = recipe.data.keyframes.len();
        let shapes: Vec<_> = (first..first + count)
            .map(|k| (format!("/{k}.ply"), k as f64))
            .collect();
        let mut longer = recipe.clone();
        longer.append(&shapes, None).expect("further ones");
        longer
    }

    #[test]
    fn networks_have_twice_the_steps_of_an_interval_for_each_that_is_new() {
        let seven = recipe("default", 7);
        assert_eq!(seven.training.steps, 4000);
        let nine = appended(&seven, 2);
        let grown = Grown {
            frame: 7,
            known: 7,
            step: 4000,
        };
        let last = grown.last_step(&seven, None, &nine);
        assert_eq!(last, 4000 + 2 * 1334 - 1);
        // And again, one more.
        let mut nine = nine;
        nine.training.steps = last;
        let ten = appended(&nine, 1);
        let again = Grown {
            frame: 7,
            known: 9,
            step: last,
        };
        assert_eq!(again.last_step(&nine, Some(grown), &ten), last + 1334);
    }

    #[test]
    fn what_learns_anew_has_the_steps_of_so_many_key_frames() {
        for (preset, steps) in [("instant", 10), ("default", 1333)] {
            let two = recipe(preset, 2);
            let three = appended(&two, 1);
            let step = two.training.steps;
            let grown = Grown {
                frame: 2,
                known: 2,
                step,
            };
            assert_eq!(
                grown.last_step(&two, None, &three),
                step + steps,
                "{preset}"
            );
        }
        let mut three = recipe("instant", 3);
        three.training.steps = 20;
        let before = Grown {
            frame: 2,
            known: 2,
            step: 10,
        };
        let grown = Grown {
            frame: 2,
            known: 3,
            step: 20,
        };
        assert_eq!(
            grown.last_step(&three, Some(before), &appended(&three, 1)),
            30
        );
    }
}
