//! What is solved for instead of trained (`velocity.kind = "spline"`): a field of splines that carries the
//! shapes themselves.
//!
//! | file | what it holds |
//! |---|---|
//! | `mod.rs` | [`Solved`], which makes one step of Gauss-Newton where others make one of an optimiser |
//! | `motion.rs` | its field and solver, between two shapes or through more |
//! | `problem.rs` | from a recipe and key frames to what the solver takes |
//! | `carried.rs` | surfaces and motion of its field between two shapes |
//! | `sequence.rs` | the same through many key frames |
//! | `shapes.rs` | the shapes that it carries |
//! | `guide.rs` | the field as what networks learn first |
//! | `completed.rs` | what networks learn of a shape that is known in part |
//! | `stored.rs` | its part of a checkpoint |
//! | `arrays.rs` | the same as plain arrays, for other programs |
//!
//! The mathematics is in the package `isomorph-spline`, the distance of a shape in [`crate::shape`].

mod arrays;
mod carried;
mod completed;
mod guide;
mod motion;
mod problem;
mod sequence;
mod shapes;
mod stored;
#[cfg(test)]
mod tests;

use std::io;

use isomorph_spline::{Terms, Weights};
use isomorph_training::data::TrainingData;
use isomorph_training::deformation::Deformation;
use isomorph_training::engine::Trainer;
use isomorph_training::records::{RecordError, Records};
use isomorph_training::report::{Phase, Rates, TermReport};
use isomorph_training::weights::Weights as NetworkWeights;
use rayon::prelude::*;

pub(crate) use self::arrays::arrays;
use self::carried::CarriedShapes;
pub(crate) use self::completed::encloses;
use self::completed::{completed, has_whole_neighbour};
pub(crate) use self::guide::{Guidance, guide, sheet_thickness};
use self::motion::{AnySolver, Field};
use self::shapes::Shapes;
use crate::recipe::Recipe;
use crate::shape::{Keyframe, Keyframes, SolidParts, key_name};

/// A field of splines between shapes, solved for step by step.
pub(crate) struct Solved {
    motion: Motion,
    /// Steps done.
    step: usize,
    /// What the field carries; none before the checkpoint of a run that is only looked at is read.
    shapes: Option<Shapes>,
    /// Of key frames that are completed after the last step, if there are any.
    partial: Option<Box<(Recipe, Keyframes)>>,
}

/// Where the field is.
enum Motion {
    /// With what makes the steps.
    Sought(AnySolver),
    /// Of a checkpoint that is only looked at.
    Found(Field),
    /// Of one that is not read yet.
    Unread,
}

impl Solved {
    /// Before the first step.
    ///
    /// # Errors
    /// If a shape is neither a closed mesh nor has normals, or the solver refuses the problem.
    pub(crate) fn new(recipe: &Recipe, keyframes: &Keyframes) -> Result<Self, String> {
        let count = keyframes.keys.len();
        let parts: Result<Vec<SolidParts>, String> = keyframes
            .keys
            .par_iter()
            .enumerate()
            .map(|(k, key)| parts(key, &key_name(k, count)))
            .collect();
        let shapes = Shapes::of(parts?);
        let shapes = shapes.map_err(|k| format!("the {} has no area", key_name(k, count)))?;
        let solver = problem::solver(recipe, keyframes);
        let solver = solver.map_err(|error| format!("velocity.kind = \"spline\": {error}"))?;
        Ok(Self {
            motion: Motion::Sought(solver),
            step: 0,
            shapes: Some(shapes),
            partial: (count > 2 && (0..count).any(|k| has_whole_neighbour(&keyframes.keys, k)))
                .then(|| Box::new((recipe.clone(), keyframes.clone()))),
        })
    }

    /// Without shapes, to take those of a checkpoint.
    pub(crate) fn unset() -> Self {
        Self {
            motion: Motion::Unread,
            step: 0,
            shapes: None,
            partial: None,
        }
    }

    fn field(&self) -> Field {
        match &self.motion {
            Motion::Sought(solver) => solver.field(),
            Motion::Found(field) => field.clone(),
            Motion::Unread => unreachable!("{READ_FIRST}"),
        }
    }

    /// Completes key frames in the midst of others that are known in part, once the motion is found.
    fn complete(&mut self) {
        let Some(of) = &self.partial else { return };
        let Field::Sequence(field) = self.field() else {
            return;
        };
        let (recipe, keyframes) = &**of;
        let mut parts: Vec<SolidParts> = self.shapes().parts().into_iter().cloned().collect();
        // Splines blend two that are known in part.
        let is_wanted = |k: usize| has_whole_neighbour(&keyframes.keys, k);
        let (known, part) = (|k: usize| Some(parts[k].clone()), |s: usize| field.part(s));
        // A surface that is not found leaves the shape as it is: known in part.
        let found = completed(is_wanted, known, part, recipe, keyframes).unwrap_or_default();
        for (parts, cloud) in parts.iter_mut().zip(found) {
            if let Some(whole) = cloud.and_then(|cloud| SolidParts::of_cloud(&cloud)) {
                *parts = whole;
            }
        }
        if let Ok(shapes) = Shapes::of(parts) {
            self.shapes = Some(shapes);
        }
    }

    fn shapes(&self) -> &Shapes {
        self.shapes.as_ref().expect(READ_FIRST)
    }
}

/// Whoever makes a [`Solved`] without shapes restores it next.
const READ_FIRST: &str = "a run is looked at after its checkpoint is read";

impl Trainer for Solved {
    fn advance(&mut self, _: &TrainingData, step: usize, read: bool) -> Option<Vec<TermReport>> {
        let Motion::Sought(solver) = &mut self.motion else {
            unreachable!("a run that is only looked at is not trained");
        };
        let Weights {
            matching,
            on_surface,
            strain,
            divergence,
            screw,
        } = *solver.weights();
        let term = |name, weight: f64, raw: f64| TermReport {
            name,
            raw,
            weighted: weight * raw,
        };
        let steps = solver.steps();
        match solver.advance(step) {
            Ok(report) => {
                let Terms {
                    matching: matched,
                    on_surface: arrived,
                    strain: strained,
                    divergence: diverged,
                    screw: unsteady,
                } = report.terms;
                self.step = step + 1;
                if self.step == steps {
                    self.complete();
                }
                read.then(|| {
                    vec![
                        term("matching", matching, matched),
                        term("on-surface", on_surface, arrived),
                        term("strain", strain, strained),
                        term("divergence", divergence, diverged),
                        term("screw", screw, unsteady),
                    ]
                })
            }
            // Reported as every term that is no number: training stops.
            Err(_) => Some(vec![term("spline", 1.0, f64::NAN)]),
        }
    }

    fn wait(&self) {}

    fn phase(&self, _: usize) -> Phase {
        Phase::Motion
    }

    fn rates(&self, _: usize) -> Rates {
        Rates::default()
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        let count = self.field().coefficients().len();
        vec![("V (spline)", count)]
    }

    fn records(&self) -> io::Result<Records> {
        stored::records(&self.field(), self.step, self.shapes())
    }

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        let (field, step, parts) = stored::read(records)?;
        match &mut self.motion {
            Motion::Sought(solver) => {
                let resumed = solver.resume_from(field, step);
                let resumed = resumed.ok_or_else(stored::other_kind)?;
                resumed.map_err(|error| stored::misfit(&error))?;
                if step == solver.steps() && self.partial.is_some() {
                    // They are completed.
                    self.shapes = Some(stored::shapes(parts)?);
                }
            }
            motion => {
                self.shapes = Some(stored::shapes(parts)?);
                *motion = Motion::Found(field);
            }
        }
        self.step = step;
        Ok(())
    }

    /// Splines are solved for anew: that takes seconds, and the motion before is another one where it goes on.
    fn grow(&mut self, _: &Records, _: usize) -> Result<(), RecordError> {
        Ok(())
    }

    fn spare(&mut self, _: usize) {}

    /// It has no networks; [`arrays`] gives its splines and shapes.
    fn weights(&self) -> Option<NetworkWeights> {
        None
    }

    fn deformation(&self) -> Box<dyn Deformation> {
        match (self.field(), self.shapes().clone()) {
            (Field::Pair(field), Shapes::Pair(shapes)) => {
                Box::new(CarriedShapes::new(field, shapes, false))
            }
            (Field::Sequence(field), Shapes::Many(shapes)) => {
                Box::new(sequence::through(field, shapes))
            }
            (Field::Pairs(fields, times), Shapes::Many(shapes)) => {
                let of = move |s: usize| fields[s].clone();
                Box::new(sequence::in_turns(Box::new(of), times, shapes))
            }
            _ => unreachable!("there are as many shapes as key frames"),
        }
    }
}

fn parts(key: &Keyframe, name: &str) -> Result<SolidParts, String> {
    SolidParts::of(key).ok_or_else(|| {
        format!(
            "velocity.kind = \"spline\": the {name} is no closed mesh, and has no normals that close it; set \
             data.normals to \"auto\", or choose the preset \"quick\""
        )
    })
}
