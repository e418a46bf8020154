//! What is solved for instead of trained (`velocity.kind = "spline"`): a field of splines that carries the
//! shapes themselves.
//!
//! | file | what it holds |
//! |---|---|
//! | `mod.rs` | [`Solved`], which makes one step of Gauss-Newton where others make one of an optimiser |
//! | `carried.rs` | surfaces and motion of its field |
//! | `guide.rs` | the field as what a network learns first |
//! | `stored.rs` | its part of a checkpoint |
//!
//! The mathematics is in the package `isomorph-spline`, the distance of a shape in [`crate::shape`].

mod carried;
mod guide;
mod stored;
#[cfg(test)]
mod tests;

use std::io;
use std::sync::Arc;

use isomorph_spline::{
    Cloud, Options, Pairs, Problem, Solver, SplineField, Terms, TimeBasis, Weights,
};
use isomorph_training::data::TrainingData;
use isomorph_training::deformation::Deformation;
use isomorph_training::engine::Trainer;
use isomorph_training::method::spline;
use isomorph_training::records::{RecordError, Records};
use isomorph_training::report::{Phase, Rates, TermReport};
use isomorph_training::weights::Weights as NetworkWeights;

use self::carried::CarriedShapes;
pub(crate) use self::guide::guide;
use crate::recipe::Recipe;
use crate::shape::{Keyframe, Keyframes, Solid, SolidParts};

/// A field of splines between two shapes, solved for step by step.
pub(crate) struct Solved {
    motion: Motion,
    /// Steps done.
    step: usize,
    /// What the field carries; none before the checkpoint of a run that is only looked at is read.
    shapes: Option<Arc<[Solid; 2]>>,
}

/// Where the field is.
enum Motion {
    /// With what makes the steps.
    Sought(Box<Solver>),
    /// Of a checkpoint that is only looked at.
    Found(SplineField),
    /// Of one that is not read yet.
    Unread,
}

/// Least weight of the strain: without any the field would be free between the samples.
const LEAST_STRAIN: f64 = 1e-3;

impl Solved {
    /// Before the first step.
    ///
    /// # Errors
    /// If a shape is neither a closed mesh nor has normals, or the solver refuses the problem.
    pub(crate) fn new(recipe: &Recipe, keyframes: &Keyframes) -> Result<Self, String> {
        let [first, last] = &keyframes.keys[..] else {
            return Err(format!(
                "velocity.kind = \"spline\": takes two shapes, not {}",
                keyframes.keys.len()
            ));
        };
        // Arranging the triangles of one shape takes one core.
        let (source, target) = rayon::join(|| solid(first, "source"), || solid(last, "target"));
        let (source, target) = (source?, target?);
        let solver = Solver::new(problem(recipe, keyframes), weights(recipe), options(recipe));
        let solver = solver.map_err(|error| format!("velocity.kind = \"spline\": {error}"))?;
        Ok(Self {
            motion: Motion::Sought(Box::new(solver)),
            step: 0,
            shapes: Some(Arc::new([source, target])),
        })
    }

    /// Without shapes, to take those of a checkpoint.
    pub(crate) fn unset() -> Self {
        Self {
            motion: Motion::Unread,
            step: 0,
            shapes: None,
        }
    }

    fn field(&self) -> &SplineField {
        match &self.motion {
            Motion::Sought(solver) => solver.field(),
            Motion::Found(field) => field,
            Motion::Unread => unreachable!("{READ_FIRST}"),
        }
    }

    fn shapes(&self) -> &Arc<[Solid; 2]> {
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
        stored::records(self.field(), self.step, self.shapes())
    }

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        let (field, step, parts) = stored::read(records)?;
        match &mut self.motion {
            Motion::Sought(solver) => {
                let resumed = solver.resume_from(field, step);
                resumed.map_err(|error| stored::misfit(&error))?;
            }
            motion => {
                self.shapes = Some(Arc::new(stored::shapes(parts)?));
                *motion = Motion::Found(field);
            }
        }
        self.step = step;
        Ok(())
    }

    /// Not yet: they would be of splines, and the shapes.
    fn weights(&self) -> Option<NetworkWeights> {
        None
    }

    fn deformation(&self) -> Box<dyn Deformation> {
        let shapes = Arc::clone(self.shapes());
        Box::new(CarriedShapes::new(self.field().clone(), shapes))
    }
}

fn solid(key: &Keyframe, name: &str) -> Result<Solid, String> {
    let parts = SolidParts::of(key).ok_or_else(|| {
        format!(
            "velocity.kind = \"spline\": the {name} is no closed mesh, and has no normals that close it; set \
             data.normals to \"auto\", or choose the preset \"quick\""
        )
    })?;
    let solid = Solid::new(parts);
    solid.ok_or_else(|| format!("the {name} has no area"))
}

fn problem(recipe: &Recipe, keyframes: &Keyframes) -> Problem {
    let cloud = |k: usize| {
        let cloud = &keyframes.keys[k].cloud;
        Cloud {
            points: cloud.points.clone(),
            normals: cloud.normals.clone(),
            border: keyframes.keys[k].border.clone(),
        }
    };
    // At most so many, evenly chosen: they come in no order that means anything.
    let known = &keyframes.between[0];
    let apart = known
        .len()
        .div_ceil(recipe.training.correspondence_batch)
        .max(1);
    let (source, target) = known.iter().step_by(apart).copied().unzip();
    let confidence = &keyframes.confidence[0];
    Problem {
        shapes: [cloud(0), cloud(1)],
        pairs: Pairs {
            source,
            target,
            confidence: confidence.iter().step_by(apart).copied().collect(),
        },
    }
}

fn weights(recipe: &Recipe) -> Weights {
    let loss = &recipe.loss;
    Weights {
        matching: loss.matching,
        on_surface: loss.on_surface,
        strain: loss.strain.max(LEAST_STRAIN),
        divergence: loss.divergence,
        screw: loss.screw,
    }
}

fn options(recipe: &Recipe) -> Options {
    let (keys, training) = (spline::keys(recipe), &recipe.training);
    let steps = steps_of_levels(training.steps, &keys.coarse_shares);
    Options {
        // Of the first level; each further one halves it.
        spacing: keys.spacing * 2.0_f64.powi(steps.len() as i32 - 1),
        steps,
        time: match recipe.velocity.time_dependent {
            true => TimeBasis::Linear,
            false => TimeBasis::Constant,
        },
        trajectory_steps: training.time_steps,
        band: keys.band,
        band_spread: training.band_widths.clone(),
        surface_samples: keys.surface_samples,
        robust_scale: keys.robust,
        iterations: keys.iterations,
        tolerance: keys.tolerance,
        seed: training.seed,
        ..Options::default()
    }
}

/// Steps of each level of the grid, the coarsest first; levels without any are left out.
fn steps_of_levels(steps: usize, coarse_shares: &[f64]) -> Vec<usize> {
    let mut left = steps;
    let mut levels: Vec<usize> = coarse_shares
        .iter()
        .map(|share| {
            // The last level has a step at least.
            let taken = (left as f64 * share).round().min(left as f64 - 1.0) as usize;
            left -= taken;
            taken
        })
        .collect();
    levels.push(left);
    levels.retain(|steps| *steps > 0);
    levels
}
