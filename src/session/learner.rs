//! The loop that trains a method, from the first step or from a checkpoint, on whichever backend.

mod error;
mod fits;
mod guided;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use isomorph_training::data::TrainingData;
use isomorph_training::engine::{Engine, Trainer};
use isomorph_training::method;
use isomorph_training::records::BURN_VERSION;

pub(crate) use self::error::LearnerError;
use self::fits::fits;
use self::guided::{guided, unguided};
use super::checkpoint::{self, Checkpoint, State};
use super::grown::Grown;
use super::{not_finite, self_test};
use crate::event::{Event, StepReport, TermReport};
use crate::memory;
use crate::recipe::Recipe;
use crate::shape::{Coordinates, Keyframes};
use crate::solved::{Solved, encloses, guide};

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All steps are done.
    Finished,
    /// Stopped on request; a checkpoint holds everything up to here.
    Interrupted,
}

/// What stands for the backend of a field that is solved for.
const SOLVER: &str = "the spline solver";

/// A method, its data, and where training stands.
pub(crate) struct Learner {
    recipe: Recipe,
    data: TrainingData,
    /// Points of each key frame, and known correspondences between them.
    given: (Vec<usize>, usize),
    coordinates: Coordinates,
    trainer: Box<dyn Trainer>,
    backend: String,
    device: String,
    /// Steps done. The trainer counts from the last time that key frames were appended.
    step: usize,
    /// What is there from before key frames were appended.
    grown: Option<Grown>,
    seconds: f64,
    /// What was decided other than the recipe says.
    notes: Vec<String>,
}

impl Learner {
    /// A learner before its first step.
    ///
    /// # Errors
    /// [`LearnerError::Missing`] if the recipe's method needs normals or correspondences and there are
    /// none; [`LearnerError::NotHere`].
    pub(crate) fn new(
        recipe: Recipe,
        keyframes: &Keyframes,
        engine: &dyn Engine,
    ) -> Result<Self, LearnerError> {
        Self::at(0, None, recipe, keyframes, engine)
    }

    /// A learner with the networks as they are made, for the steps from this one on.
    fn at(
        step: usize,
        grown: Option<Grown>,
        recipe: Recipe,
        keyframes: &Keyframes,
        engine: &dyn Engine,
    ) -> Result<Self, LearnerError> {
        let mut data = keyframes.training_data();
        method::check(&recipe, &data).map_err(LearnerError::Missing)?;
        let mut notes = Vec::new();
        // What is trained by, where it is not what the recipe says.
        let mut networks = recipe.clone();
        let before = grown.map_or(0, |grown| grown.step);
        networks.training.steps = recipe.training.steps.saturating_sub(before).max(1);
        let points = data.keys.iter().map(|key| key.points.len());
        let given = (points.collect(), data.pair_count());
        let is_guided = method::is_guided(&networks, step - before);
        let is_partial = !keyframes.keys.iter().all(encloses);
        if is_guided || method::has_end_fields(&recipe) && is_partial {
            match guide(&recipe, keyframes) {
                Ok(found) => notes.extend(guided(&mut data, found, keyframes, is_guided)),
                Err(reason) if method::starts_solved(&recipe) => {
                    return Err(LearnerError::Unsolved(reason));
                }
                Err(reason) => {
                    networks.training.guided_until = 0.0;
                    notes.extend(unguided(&reason, is_guided, is_partial));
                }
            }
        }
        let is_solved = method::spline::is_solved(&recipe);
        if is_solved {
            // No samples are drawn from them.
            data.keys.clear();
            data.between.clear();
        }
        let mut trainer: Box<dyn Trainer> = if is_solved {
            let solved = Solved::new(&networks, keyframes).map_err(LearnerError::Unsolved)?;
            Box::new(solved)
        } else {
            engine.method(&networks, &data.bounds)?
        };
        if let Some(guide) = &data.guide {
            trainer.take(&**guide);
        }
        notes.extend(self_test::before_training(engine, &recipe)?);
        // A solver of our own, which no backend takes part in.
        let (backend, device) = match is_solved {
            true => (SOLVER.to_owned(), "CPU".to_owned()),
            false => (engine.backend(), engine.device()),
        };
        Ok(Self {
            trainer,
            coordinates: keyframes.coordinates(),
            backend,
            device,
            given,
            data,
            step,
            grown,
            seconds: 0.0,
            recipe,
            notes,
        })
    }

    /// A learner that goes on from a checkpoint.
    ///
    /// # Errors
    /// [`LearnerError::OtherNetworks`] if a network section differs, with both values;
    /// [`LearnerError::OtherShapes`]; [`LearnerError::Checkpoint`] if the checkpoint is damaged.
    pub(crate) fn resume(
        recipe: Recipe,
        keyframes: &Keyframes,
        engine: &dyn Engine,
        checkpoint: &Checkpoint,
    ) -> Result<Self, LearnerError> {
        fits(checkpoint, &recipe, keyframes)?;
        let grown = Grown::of(checkpoint, &recipe)?;
        let mut learner = Self::at(checkpoint.state.step, grown, recipe, keyframes, engine)?;
        let (trainer, records) = (&mut learner.trainer, checkpoint.records()?);
        let taken = match grown {
            Some(new) if grown != checkpoint.state.grown => trainer.grow(&records, new.known),
            Some(grown) => {
                trainer.spare(grown.known);
                trainer.restore(&records)
            }
            None => trainer.restore(&records),
        };
        taken.map_err(|error| checkpoint.damaged(error))?;
        learner.seconds = checkpoint.state.seconds;
        Ok(learner)
    }

    /// What is trained, as it stands.
    pub(crate) fn trainer(&self) -> &dyn Trainer {
        &*self.trainer
    }

    /// The step that the trainer makes next, as it counts.
    fn own_step(&self, step: usize) -> usize {
        step - self.grown.map_or(0, |grown| grown.step)
    }

    /// Seconds of training so far, over all resumes.
    pub(crate) fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Trains to the last step, or until `stop` is set, and leaves a checkpoint either way.
    ///
    /// # Errors
    /// [`LearnerError`]; the checkpoints written so far stay.
    pub(crate) fn run(
        &mut self,
        checkpoints: &Path,
        stop: &AtomicBool,
        emit: &mut dyn FnMut(Event) -> std::io::Result<()>,
    ) -> Result<Outcome, LearnerError> {
        self.run_with(checkpoints, stop, emit, &mut |_| Ok(()))
    }

    /// [`Self::run`] that shows what is learned so far each `result.preview-every` steps, by `preview`: where that
    /// fails, a note has its reason.
    ///
    /// # Errors
    /// Those of [`Self::run`].
    pub(crate) fn run_with(
        &mut self,
        checkpoints: &Path,
        stop: &AtomicBool,
        emit: &mut dyn FnMut(Event) -> std::io::Result<()>,
        preview: &mut dyn FnMut(&dyn Trainer) -> Result<(), String>,
    ) -> Result<Outcome, LearnerError> {
        checkpoint::sweep(checkpoints, self.recipe.checkpoint.keep);
        emit(self.started())?;
        for note in self.notes.drain(..) {
            emit(Event::Note(note))?;
        }
        let steps = self.recipe.training.steps;
        let (before, clock) = (self.seconds, Instant::now());
        let mut saved = self.step > 0;
        let mut phase = None;
        while self.step < steps {
            let entered = self.trainer.phase(self.own_step(self.step));
            if phase != Some(entered) {
                phase = Some(entered);
                emit(Event::PhaseEntered {
                    phase: entered,
                    step: self.step,
                })?;
            }
            let due = self.checkpoint_is_due(self.step + 1);
            let logged = due || self.is_logged(self.step + 1);
            let report = self.advance(logged);
            self.seconds = before + clock.elapsed().as_secs_f64();
            emit(Event::Tick { step: self.step })?;
            if let Some(terms) = report {
                self.report(terms, checkpoints, emit)?;
            }
            saved = due;
            if due {
                self.save(checkpoints, emit)?;
            }
            if self.preview_is_due()
                && let Err(reason) = preview(self.trainer())
            {
                emit(Event::Note(format!(
                    "no preview after step {}: {reason}",
                    self.step
                )))?;
            }
            if stop.load(Ordering::Relaxed) && self.step < steps {
                if !saved {
                    self.save(checkpoints, emit)?;
                }
                emit(Event::Interrupted { step: self.step })?;
                return Ok(Outcome::Interrupted);
            }
        }
        if !saved {
            self.save(checkpoints, emit)?;
        }
        emit(Event::Finished {
            step: self.step,
            seconds: self.seconds,
        })?;
        Ok(Outcome::Finished)
    }

    /// One step of the optimisers; the unweighted terms with their weights if `read` asks for them.
    pub(crate) fn advance(&mut self, read: bool) -> Option<Vec<TermReport>> {
        let own = self.own_step(self.step);
        let report = self.trainer.advance(&self.data, own, read);
        self.step += 1;
        report
    }

    fn is_logged(&self, done: usize) -> bool {
        let training = &self.recipe.training;
        done == 1 || done.is_multiple_of(training.log_every) || done == training.steps
    }

    fn checkpoint_is_due(&self, done: usize) -> bool {
        done.is_multiple_of(self.recipe.checkpoint.every) || done == self.recipe.training.steps
    }

    /// The last step has its surfaces instead.
    fn preview_is_due(&self) -> bool {
        let every = self.recipe.result.preview_every;
        every > 0 && self.step.is_multiple_of(every) && self.step < self.recipe.training.steps
    }

    /// Reports the terms of the step just made, or stops at one that is not finite.
    fn report(
        &self,
        terms: Vec<TermReport>,
        checkpoints: &Path,
        emit: &mut dyn FnMut(Event) -> std::io::Result<()>,
    ) -> Result<(), LearnerError> {
        let wrong = terms.iter().find(|term| !term.raw.is_finite()).cloned();
        let made = self.own_step(self.step - 1);
        let rates = self.trainer.rates(made);
        let report = StepReport {
            step: self.step,
            steps: self.recipe.training.steps,
            phase: self.trainer.phase(made),
            seconds: self.seconds,
            total: terms.iter().map(|term| term.weighted).sum(),
            terms,
            learning_rate: rates.implicit,
            velocity_learning_rate: rates.velocity,
            peak_memory_bytes: memory::peak_memory_bytes(),
        };
        emit(Event::Step(report))?;
        let Some(term) = wrong else { return Ok(()) };
        if method::spline::is_solved(&self.recipe) {
            return Err(LearnerError::Unsolved(format!(
                "step {}: the solver found no motion; look for points or pairs far from the rest, or take the \
                 preset \"quick\"",
                self.step
            )));
        }
        let mut what = format!("the {} term is {}", term.name, term.raw);
        let deformation = self.trainer.deformation();
        if let Some(place) = not_finite::place(&*deformation, &self.data.keys, &self.coordinates) {
            what += "; ";
            what += &place;
        }
        Err(self.not_finite(what, checkpoints))
    }

    fn not_finite(&self, what: String, checkpoints: &Path) -> LearnerError {
        LearnerError::NotFinite {
            step: self.step,
            what,
            last: match checkpoint::list(checkpoints).last() {
                Some((step, _)) => format!("last good checkpoint step-{step:06}"),
                None => "no checkpoint was written before".to_owned(),
            },
        }
    }

    /// Writes a checkpoint of the present state, whose weights are numbers: a good one.
    fn save(
        &self,
        checkpoints: &Path,
        emit: &mut dyn FnMut(Event) -> std::io::Result<()>,
    ) -> Result<(), LearnerError> {
        let files = self.trainer.records()?;
        // The terms were read before the weights were moved.
        if !method::spline::is_solved(&self.recipe)
            && let Some(file) = files.not_finite()
        {
            let what = format!("{file} would hold numbers that are not finite");
            return Err(self.not_finite(what, checkpoints));
        }
        let keep = self.recipe.checkpoint.keep;
        let path = checkpoint::save(checkpoints, self.state(), files, keep)?;
        emit(Event::Checkpoint {
            step: self.step,
            path,
        })?;
        Ok(())
    }

    fn state(&self) -> State {
        State {
            format_version: checkpoint::FORMAT_VERSION,
            isomorph_version: env!("CARGO_PKG_VERSION").to_owned(),
            burn_version: BURN_VERSION.to_owned(),
            step: self.step,
            seconds: self.seconds,
            seed: self.recipe.training.seed,
            backend: self.backend.clone(),
            normalisation: self.coordinates.normalisation,
            placements: self.coordinates.placements.clone(),
            bounds: self.data.bounds,
            grown: self.grown,
            recipe: self.recipe.to_toml(),
            files: Default::default(),
        }
    }

    fn started(&self) -> Event {
        Event::Started {
            backend: self.backend.clone(),
            device: self.device.clone(),
            steps: self.recipe.training.steps,
            first_step: self.step,
            networks: self.trainer.networks(),
            points: self.given.0.clone(),
            correspondences: self.given.1,
        }
    }
}

#[cfg(test)]
#[path = "learner_tests.rs"]
mod tests;
