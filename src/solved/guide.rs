//! The field of the preset `instant` as a guide: what the Velocity-Net of other presets learns first
//! (`training.guided-until`).

use std::sync::{Arc, Mutex, PoisonError};

use isomorph_spline::{SequenceField, SplineError, SplineField};
use isomorph_training::data::Guide;
use isomorph_training::key_times::KeyTimes;
use isomorph_training::method::{self, spline};

use super::completed::completed;
use super::motion::Field;
use super::problem::{options, solver};
use crate::recipe::{Recipe, RecipeError};
use crate::shape::{Keyframes, PointCloud, SolidParts};

/// A solved field between two shapes, and in how many steps its paths are followed.
struct SplineGuide {
    field: SplineField,
    trajectory_steps: usize,
}

impl Guide for SplineGuide {
    fn velocities(&self, places: &[[f32; 3]], times: &[f32]) -> Vec<[f32; 3]> {
        let jets = self.field.jets(places, times);
        jets.into_iter().map(|jet| jet.value).collect()
    }

    fn carried(&self, places: &[[f32; 3]], from: &[f32], to: &[f32]) -> Vec<[f32; 3]> {
        self.field
            .carry_each(places, from, to, self.trajectory_steps)
    }

    fn splines(&self) -> Option<&SplineField> {
        Some(&self.field)
    }
}

/// A solved field through many key frames, and in how many steps its paths are followed from one to the next.
struct SequenceGuide {
    field: SequenceField,
    times: KeyTimes,
    trajectory_steps: usize,
    /// The interval used last: the samples of a step lie in one.
    part: Mutex<Option<(usize, Arc<SplineField<f32, 2>>)>>,
}

impl SequenceGuide {
    fn within(&self, s: usize, time: f32) -> f32 {
        self.times.within(s, f64::from(time)) as f32
    }

    fn part(&self, s: usize) -> Arc<SplineField<f32, 2>> {
        let mut part = self.part.lock().unwrap_or_else(PoisonError::into_inner);
        match &*part {
            Some((known, field)) if *known == s => Arc::clone(field),
            _ => {
                let field = Arc::new(self.field.part(s));
                *part = Some((s, Arc::clone(&field)));
                field
            }
        }
    }

    /// What `of` gives for the rows of each interval, in their own order.
    fn by_interval(
        &self,
        middles: impl Iterator<Item = f32>,
        mut of: impl FnMut(usize, &[usize]) -> Vec<[f32; 3]>,
    ) -> Vec<[f32; 3]> {
        let intervals: Vec<usize> = middles
            .map(|time| self.times.interval(f64::from(time)))
            .collect();
        let mut out = vec![[0.0; 3]; intervals.len()];
        for s in 0..self.times.intervals() {
            let rows: Vec<usize> = (0..intervals.len())
                .filter(|k| intervals[*k] == s)
                .collect();
            if rows.is_empty() {
                continue;
            }
            for (row, found) in rows.iter().zip(of(s, &rows)) {
                out[*row] = found;
            }
        }
        out
    }
}

impl Guide for SequenceGuide {
    fn velocities(&self, places: &[[f32; 3]], times: &[f32]) -> Vec<[f32; 3]> {
        self.by_interval(times.iter().copied(), |s, rows| {
            let x: Vec<_> = rows.iter().map(|k| places[*k]).collect();
            let t: Vec<_> = rows.iter().map(|k| self.within(s, times[*k])).collect();
            let jets = self.part(s).jets(&x, &t).into_iter();
            let length = self.times.length(s) as f32;
            jets.map(|jet| jet.value.map(|v| v / length)).collect()
        })
    }

    fn carried(&self, places: &[[f32; 3]], from: &[f32], to: &[f32]) -> Vec<[f32; 3]> {
        let middles = from.iter().zip(to).map(|(from, to)| (from + to) / 2.0);
        self.by_interval(middles, |s, rows| {
            let x: Vec<_> = rows.iter().map(|k| places[*k]).collect();
            let times = |of: &[f32]| rows.iter().map(|k| self.within(s, of[*k])).collect();
            let (from, to): (Vec<_>, Vec<_>) = (times(from), times(to));
            let field = self.part(s);
            field.carry_each(&x, &from, &to, self.trajectory_steps)
        })
    }
}

/// What a field that is solved for gives to the training of networks.
pub(crate) struct Guidance {
    /// The field.
    pub guide: Arc<dyn Guide>,
    /// For each shape that is known in part, its points and those that complete it.
    pub completed: Vec<Option<PointCloud>>,
}

/// Keys of the steps, which the recipe's own say nothing of, between two shapes and through more.
const OF_STEPS: [[&str; 5]; 2] = [
    [
        "preset=instant",
        "velocity.kind=spline",
        "training.steps=18",
        "training.time-steps=3",
        "training.correspondence-batch=1000",
    ],
    [
        "preset=instant",
        "velocity.kind=spline",
        "training.steps=10",
        "training.time-steps=1",
        "training.correspondence-batch=1000",
    ],
];

/// Why no splines can stand in for the motion that a recipe asks for, if so.
fn misfit(recipe: &Recipe) -> Option<&'static str> {
    if method::starts_solved(recipe) {
        // What splines have no term for is trained for after them.
        None
    } else if !recipe.velocity.time_dependent {
        Some("splines depend on time, and velocity.time-dependent is false")
    } else if recipe.loss.smoothness > 0.0 {
        Some("splines have no term for loss.smoothness")
    } else if recipe.loss.strain_scale > 0.0 {
        Some("splines have no term for loss.strain-scale")
    } else {
        None
    }
}

/// The recipe with the preset `instant`.
fn as_solved(recipe: &Recipe) -> Result<Recipe, RecipeError> {
    let mut solved = recipe.clone();
    let many = usize::from(recipe.data.keyframes.len() > 2);
    solved.with_all(&OF_STEPS[many].map(str::to_owned))?;
    Ok(solved)
}

/// How thick an open sheet is, normalised: as the recipe says, or with networks as the splines have it that they learn
/// first. `None` where a method closes it by a cushion.
pub(crate) fn sheet_thickness(recipe: &Recipe) -> Option<f64> {
    if spline::is_solved(recipe) {
        return Some(spline::keys(recipe).sheet_thickness);
    }
    if !method::has_end_fields(recipe) {
        return None;
    }
    let solved = as_solved(recipe).ok()?;
    Some(spline::keys(&solved).sheet_thickness)
}

/// Solves for the field that the recipe would have with the preset `instant`: its own weights and seed are kept.
///
/// # Errors
/// A motion that splines do not have, what the solver refuses, or a surface that is not found: the reason, as a part
/// of a sentence.
pub(crate) fn guide(recipe: &Recipe, keyframes: &Keyframes) -> Result<Guidance, String> {
    if let Some(reason) = misfit(recipe) {
        return Err(reason.to_owned());
    }
    let solved = as_solved(recipe).map_err(|error| error.to_string())?;
    let trajectory_steps = 2 * options(&solved).trajectory_steps;
    let found: Result<Field, SplineError> = (|| {
        let mut solver = solver(&solved, keyframes)?;
        for step in 0..solver.steps() {
            solver.advance(step)?;
        }
        Ok(solver.field())
    })();
    let parts = |k: usize| SolidParts::of(&keyframes.keys[k]);
    match found.map_err(|error| error.to_string())? {
        Field::Pair(field) => Ok(Guidance {
            completed: completed(|_| true, parts, |_| field.clone(), recipe, keyframes)?,
            guide: Arc::new(SplineGuide {
                field,
                trajectory_steps,
            }),
        }),
        Field::Sequence(field) => Ok(Guidance {
            completed: completed(|_| true, parts, |s| field.part(s), recipe, keyframes)?,
            guide: Arc::new(SequenceGuide {
                times: KeyTimes::new(field.times().to_vec()),
                field,
                trajectory_steps,
                part: Mutex::default(),
            }),
        }),
        Field::Pairs(..) => unreachable!("the preset has one field through all key frames"),
    }
}
