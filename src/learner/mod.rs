//! The learner: the loop that trains a method, from the first step or from a checkpoint.
//!
//! | file | what it holds |
//! |---|---|
//! | `method/` | what is trained: our method and those that it is compared with |
//! | `settings.rs` | the recipe in the model's types |
//! | `schedule.rs` | our method's phases, ramp and learning rates by step |
//! | `batch.rs` | the samples of a step, on the host, and their equal parts |
//! | `posed.rs` | the objective of a part, its terms and its gradients |
//! | `motion.rs` | what a step asks of `V`: trajectories, matching, priors |
//! | `step.rs` | the objective of a step with `f(x, t)` in one network, on the device |
//! | `flow_step.rs` | the same with two end fields that the flow carries |
//! | `optimiser.rs` | Adam with a limited gradient |
//! | `checkpoint.rs` | whole checkpoints or none |
//! | `event.rs` | what the loop reports |
//! | `flop.rs` | what a step costs |
//! | `memory.rs` | the process's peak memory |
//!
//! The learner prints nothing and knows no terminal: it emits [`Event`]s, which [`crate::report`] renders.

pub mod batch;
pub mod checkpoint;
pub mod event;
pub mod flop;
pub mod flow_step;
pub mod memory;
pub mod method;
pub mod motion;
mod optimiser;
pub mod posed;
pub mod schedule;
pub mod settings;
pub mod step;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use burn::tensor::backend::Backend;
use isomorph_model::TrainBackend;

use crate::recipe::{Change, MethodName, Recipe};
use crate::shape::Pair;
use crate::workers::Workers;
use batch::Part;
use checkpoint::{Checkpoint, CheckpointError, State};
use event::{Event, StepReport, TermReport};
use method::{Method, TrainingData};
use posed::Slopes;

/// Why training stopped before its last step.
#[derive(Debug, thiserror::Error)]
pub enum LearnerError {
    /// A term of the objective is not a number any more.
    #[error(
        "step {step}: the {term} term is {value}; {last}; try a smaller training.learning-rate"
    )]
    NotFinite {
        /// The step, counted from 1.
        step: usize,
        /// The first such term.
        term: &'static str,
        /// What it is.
        value: f64,
        /// Where the last good checkpoint is.
        last: String,
    },
    /// The method needs what the shapes do not have.
    #[error("{0}")]
    Missing(String),
    /// The networks of the recipe are not those of the checkpoint.
    #[error("{0}")]
    OtherNetworks(String),
    /// The shapes are not those of the checkpoint.
    #[error(
        "{0}: the shapes are not those that this run was started with (their joint size or place differs); restore the files, or start a new run with `isomorph train`"
    )]
    OtherShapes(PathBuf),
    /// A checkpoint could not be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// An event could not be recorded.
    #[error("{0}")]
    Record(#[from] std::io::Error),
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All steps are done.
    Finished,
    /// Stopped on request; a checkpoint holds everything up to here.
    Interrupted,
}

/// A method, its data, and where training stands.
pub struct Learner<B: TrainBackend> {
    recipe: Recipe,
    data: TrainingData,
    device: B::Device,
    method: Box<dyn Method<B>>,
    step: usize,
    seconds: f64,
}

impl<B: TrainBackend> Learner<B> {
    /// A learner before its first step.
    ///
    /// # Errors
    /// [`LearnerError::Missing`] if the recipe's method needs normals or correspondences and there are
    /// none.
    pub fn new(recipe: Recipe, pair: Pair, device: B::Device) -> Result<Self, LearnerError> {
        method::check(&recipe, &pair).map_err(LearnerError::Missing)?;
        Ok(Self {
            method: method::build(&recipe, &pair.bounds, &device),
            data: TrainingData::new(pair),
            step: 0,
            seconds: 0.0,
            recipe,
            device,
        })
    }

    /// A learner that goes on from a checkpoint.
    ///
    /// # Errors
    /// [`LearnerError::OtherNetworks`] if a network section differs, with both values;
    /// [`LearnerError::OtherShapes`]; [`LearnerError::Checkpoint`] if the checkpoint is damaged.
    pub fn resume(
        recipe: Recipe,
        pair: Pair,
        device: B::Device,
        checkpoint: &Checkpoint,
    ) -> Result<Self, LearnerError> {
        fits(checkpoint, &recipe, &pair)?;
        let mut learner = Self::new(recipe, pair, device)?;
        learner.method.restore(checkpoint)?;
        learner.step = checkpoint.state.step;
        learner.seconds = checkpoint.state.seconds;
        Ok(learner)
    }

    /// What is trained, as it stands.
    pub fn method(&self) -> &dyn Method<B> {
        &*self.method
    }

    /// Steps done.
    pub fn step_count(&self) -> usize {
        self.step
    }

    /// Seconds of training so far, over all resumes.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Trains to the last step, or until `stop` is set, and leaves a checkpoint either way.
    ///
    /// # Errors
    /// [`LearnerError`]; the checkpoints written so far stay.
    pub fn run(
        &mut self,
        checkpoints: &Path,
        stop: &AtomicBool,
        emit: &mut dyn FnMut(Event) -> std::io::Result<()>,
    ) -> Result<Outcome, LearnerError> {
        checkpoint::sweep(checkpoints);
        emit(self.started())?;
        let steps = self.recipe.training.steps;
        let (before, clock) = (self.seconds, Instant::now());
        let mut saved = self.step > 0;
        let mut phase = None;
        while self.step < steps {
            let entered = self.method.phase(self.step);
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
    pub fn advance(&mut self, read: bool) -> Option<Vec<TermReport>> {
        let parts = self.method.parts();
        let (method, data, step) = (&*self.method, &self.data, self.step);
        let done = Workers::shared().map(parts, |index| {
            let part = Part { index, of: parts };
            method.objective(data, step, part).solve(parts, read)
        });
        let (reports, gradients): (Vec<_>, Vec<_>) = done.into_iter().unzip();
        self.method.descend(step, &mut Slopes::new(gradients));
        self.step += 1;
        read.then(|| posed::mean_of(&reports))
    }

    fn is_logged(&self, done: usize) -> bool {
        let training = &self.recipe.training;
        done == 1 || done.is_multiple_of(training.log_every) || done == training.steps
    }

    fn checkpoint_is_due(&self, done: usize) -> bool {
        done.is_multiple_of(self.recipe.checkpoint.every) || done == self.recipe.training.steps
    }

    /// Reports the terms of the step just made, or stops at one that is not finite.
    fn report(
        &self,
        terms: Vec<TermReport>,
        checkpoints: &Path,
        emit: &mut dyn FnMut(Event) -> std::io::Result<()>,
    ) -> Result<(), LearnerError> {
        let wrong = terms.iter().find(|term| !term.raw.is_finite()).cloned();
        let made = self.step - 1;
        let rates = self.method.rates(made);
        let report = StepReport {
            step: self.step,
            steps: self.recipe.training.steps,
            phase: self.method.phase(made),
            seconds: self.seconds,
            total: terms.iter().map(|term| term.weighted).sum(),
            terms,
            learning_rate: rates.implicit,
            velocity_learning_rate: rates.velocity,
            peak_memory_bytes: memory::peak_memory_bytes(),
        };
        emit(Event::Step(report))?;
        let Some(term) = wrong else { return Ok(()) };
        let last = match checkpoint::list(checkpoints).last() {
            Some((step, _)) => format!("last good checkpoint step-{step:06}"),
            None => "no checkpoint was written before".to_owned(),
        };
        Err(LearnerError::NotFinite {
            step: self.step,
            term: term.name,
            value: term.raw,
            last,
        })
    }

    /// Writes a checkpoint of the present state.
    fn save(
        &self,
        checkpoints: &Path,
        emit: &mut dyn FnMut(Event) -> std::io::Result<()>,
    ) -> Result<(), LearnerError> {
        let files = self.method.records().map_err(LearnerError::Record)?;
        let keep = self.recipe.checkpoint.keep;
        let path = checkpoint::save(checkpoints, self.state(), files, keep)?;
        emit(Event::Checkpoint {
            step: self.step,
            path,
        })?;
        Ok(())
    }

    fn state(&self) -> State {
        let recipe = &self.recipe;
        let networks = format!(
            "{:?} {:?} {:?}",
            recipe.method, recipe.implicit, recipe.velocity
        );
        State {
            format_version: checkpoint::FORMAT_VERSION,
            isomorph_version: env!("CARGO_PKG_VERSION").to_owned(),
            burn_version: checkpoint::BURN_VERSION.to_owned(),
            step: self.step,
            seconds: self.seconds,
            seed: recipe.training.seed,
            backend: B::InnerBackend::name(&self.device),
            network_digest: format!("{:08x}", crc32fast::hash(networks.as_bytes())),
            normalisation: self.data.pair.normalisation,
            bounds: self.data.pair.bounds,
            recipe: recipe.to_toml(),
            files: Default::default(),
        }
    }

    fn started(&self) -> Event {
        let pair = &self.data.pair;
        Event::Started {
            backend: B::InnerBackend::name(&self.device),
            device: format!("{:?}", self.device),
            steps: self.recipe.training.steps,
            first_step: self.step,
            networks: self.method.networks(),
            source_points: pair.source.points.len(),
            target_points: pair.target.points.len(),
            correspondences: pair.correspondences.len(),
        }
    }
}

/// Whether training can go on from a checkpoint with this recipe and these shapes.
///
/// # Errors
/// [`LearnerError::OtherNetworks`], [`LearnerError::OtherShapes`], and [`LearnerError::Checkpoint`] if the
/// checkpoint's recipe no longer parses.
pub fn fits(checkpoint: &Checkpoint, recipe: &Recipe, pair: &Pair) -> Result<(), LearnerError> {
    if let Some(change) = fixed_change(&checkpoint.recipe()?, recipe) {
        let why = if change.is_of_a_network() {
            "a trained network cannot change its shape".to_owned()
        } else {
            format!(
                "{} shares its steps out, so their number is fixed",
                recipe.method.name
            )
        };
        return Err(LearnerError::OtherNetworks(format!(
            "{}: {} is {} in the checkpoint and {} in the recipe: {why}; restore the value, or \
             start a new run with `isomorph train`",
            checkpoint.path.display(),
            change.key,
            change.before,
            change.after
        )));
    }
    if checkpoint.state.normalisation != pair.normalisation {
        return Err(LearnerError::OtherShapes(checkpoint.path.clone()));
    }
    Ok(())
}

/// The first change that a run cannot take once it has begun: one of its networks, or of the number of
/// steps where the method shares them out among what it trains one after the other.
fn fixed_change(before: &Recipe, after: &Recipe) -> Option<Change> {
    let shares_steps = matches!(
        before.method.name,
        MethodName::Nise | MethodName::NiseVelocity | MethodName::Nfgp
    );
    let is_fixed = |change: &Change| {
        change.is_of_a_network() || (shares_steps && change.key == "training.steps")
    };
    before.changes(after).into_iter().find(is_fixed)
}

#[cfg(test)]
mod tests;
