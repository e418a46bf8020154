//! The learner: the loop that trains both networks, from the first step or from a checkpoint.
//!
//! | file | what it holds |
//! |---|---|
//! | `settings.rs` | the recipe in the model's types |
//! | `schedule.rs` | phases, ramp and learning rates by step |
//! | `batch.rs` | the samples of a step, on the host |
//! | `step.rs` | the objective of a step, on the device |
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
pub mod memory;
mod optimiser;
pub mod schedule;
pub mod settings;
pub mod step;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use burn::module::{AutodiffModule, Module};
use burn::optim::Optimizer;
use burn::tensor::backend::Backend;
use isomorph_model::{ImplicitNet, Objective, TrainBackend, VelocityNet};

use crate::recipe::Recipe;
use crate::shape::Pair;
use batch::BatchSizes;
use checkpoint::{Checkpoint, CheckpointError, Part, State};
use event::{Event, Phase, StepReport, TermReport};
use optimiser::AdamOf;
use schedule::Schedule;
use settings::Settings;
use step::Step;

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

/// Both networks, their optimisers, and where training stands.
pub struct Learner<B: TrainBackend> {
    recipe: Recipe,
    settings: Settings,
    schedule: Schedule,
    pair: Pair,
    sizes: BatchSizes,
    device: B::Device,
    implicit: ImplicitNet<B>,
    velocity: VelocityNet<B>,
    implicit_optimiser: AdamOf<ImplicitNet<B>, B>,
    velocity_optimiser: AdamOf<VelocityNet<B>, B>,
    step: usize,
    seconds: f64,
}

impl<B: TrainBackend> Learner<B> {
    /// A learner before its first step.
    pub fn new(recipe: Recipe, pair: Pair, device: B::Device) -> Self {
        let settings = Settings::new(&recipe);
        let seed = settings.training.seed;
        Self {
            schedule: Schedule::new(&settings.training),
            sizes: BatchSizes::new(&settings.training, pair.correspondences.len()),
            implicit: settings.implicit.init(seed, &device),
            velocity: settings.velocity.init(seed.wrapping_add(1), &device),
            implicit_optimiser: optimiser::adam(),
            velocity_optimiser: optimiser::adam(),
            step: 0,
            seconds: 0.0,
            recipe,
            settings,
            pair,
            device,
        }
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
        let changes = checkpoint.recipe()?.changes(&recipe);
        if let Some(change) = changes.iter().find(|change| change.is_of_a_network()) {
            return Err(LearnerError::OtherNetworks(format!(
                "{}: {} is {} in the checkpoint and {} in the recipe: a trained network cannot \
                 change its shape; restore the value, or start a new run with `isomorph train`",
                checkpoint.path.display(),
                change.key,
                change.before,
                change.after
            )));
        }
        if checkpoint.state.normalisation != pair.normalisation {
            return Err(LearnerError::OtherShapes(checkpoint.path.clone()));
        }
        let mut learner = Self::new(recipe, pair, device);
        let device = &learner.device;
        let implicit = checkpoint.load::<B, _>(Part::Implicit, device)?;
        let velocity = checkpoint.load::<B, _>(Part::Velocity, device)?;
        let implicit_state = checkpoint.load::<B, _>(Part::ImplicitOptimiser, device)?;
        let velocity_state = checkpoint.load::<B, _>(Part::VelocityOptimiser, device)?;
        learner.implicit = learner.implicit.load_record(implicit);
        learner.velocity = learner.velocity.load_record(velocity);
        learner.implicit_optimiser = learner.implicit_optimiser.load_record(implicit_state);
        learner.velocity_optimiser = learner.velocity_optimiser.load_record(velocity_state);
        learner.step = checkpoint.state.step;
        learner.seconds = checkpoint.state.seconds;
        Ok(learner)
    }

    /// The trained Implicit-Net, for values.
    pub fn implicit(&self) -> ImplicitNet<B::InnerBackend> {
        self.implicit.valid()
    }

    /// The trained Velocity-Net, for values.
    pub fn velocity(&self) -> VelocityNet<B::InnerBackend> {
        self.velocity.valid()
    }

    /// Steps done.
    pub fn step_count(&self) -> usize {
        self.step
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
        let steps = self.settings.training.steps;
        let (before, clock) = (self.seconds, Instant::now());
        let mut saved = self.step > 0;
        let mut phase = None;
        while self.step < steps {
            if phase != Some(self.schedule.phase(self.step)) {
                phase = Some(self.schedule.phase(self.step));
                emit(Event::PhaseEntered {
                    phase: self.schedule.phase(self.step),
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
        let phase = self.schedule.phase(self.step);
        let batch = batch::draw(&self.pair, &self.settings.training, self.sizes, self.step);
        let step = Step {
            settings: &self.settings,
            sizes: self.sizes,
            phase,
            ramp: self.schedule.ramp(self.step),
            f: &self.implicit,
            v: &self.velocity,
            device: &self.device,
        };
        let objective = step.objective(&batch);
        let report = read.then(|| term_reports(&objective));
        if let Some(total) = objective.total() {
            self.descend(phase, &mut total.backward());
        }
        self.step += 1;
        report
    }

    /// Moves the networks that train in this phase against their gradients.
    fn descend(&mut self, phase: Phase, gradients: &mut B::Gradients) {
        let clip = self.settings.training.clip;
        if phase != Phase::WarmUp {
            let rate = self.schedule.implicit_rate(self.step);
            let net = self.implicit.clone();
            let optimiser = &mut self.implicit_optimiser;
            self.implicit = optimiser::advance(optimiser, net, gradients, rate, clip);
        }
        if phase != Phase::ImplicitOnly {
            let rate = self.schedule.velocity_rate(self.step);
            let net = self.velocity.clone();
            let optimiser = &mut self.velocity_optimiser;
            self.velocity = optimiser::advance(optimiser, net, gradients, rate, clip);
        }
    }

    fn is_logged(&self, done: usize) -> bool {
        let training = &self.settings.training;
        done == 1 || done.is_multiple_of(training.log_every) || done == training.steps
    }

    fn checkpoint_is_due(&self, done: usize) -> bool {
        done.is_multiple_of(self.recipe.checkpoint.every) || done == self.settings.training.steps
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
        let report = StepReport {
            step: self.step,
            steps: self.settings.training.steps,
            phase: self.schedule.phase(made),
            seconds: self.seconds,
            total: terms.iter().map(|term| term.weighted).sum(),
            terms,
            learning_rate: self.schedule.implicit_rate(made),
            velocity_learning_rate: self.schedule.velocity_rate(made),
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
        let encoded = || {
            Ok(vec![
                (
                    Part::Implicit,
                    checkpoint::encode::<B>(self.implicit.clone().into_record())?,
                ),
                (
                    Part::Velocity,
                    checkpoint::encode::<B>(self.velocity.clone().into_record())?,
                ),
                (
                    Part::ImplicitOptimiser,
                    checkpoint::encode::<B>(self.implicit_optimiser.to_record())?,
                ),
                (
                    Part::VelocityOptimiser,
                    checkpoint::encode::<B>(self.velocity_optimiser.to_record())?,
                ),
            ])
        };
        let parts = encoded().map_err(LearnerError::Record)?;
        let keep = self.recipe.checkpoint.keep;
        let path = checkpoint::save(checkpoints, self.state(), parts, keep)?;
        emit(Event::Checkpoint {
            step: self.step,
            path,
        })?;
        Ok(())
    }

    fn state(&self) -> State {
        let networks = format!("{:?} {:?}", self.settings.implicit, self.settings.velocity);
        State {
            format_version: checkpoint::FORMAT_VERSION,
            isomorph_version: env!("CARGO_PKG_VERSION").to_owned(),
            burn_version: checkpoint::BURN_VERSION.to_owned(),
            step: self.step,
            seconds: self.seconds,
            seed: self.settings.training.seed,
            backend: B::InnerBackend::name(&self.device),
            network_digest: format!("{:08x}", crc32fast::hash(networks.as_bytes())),
            normalisation: self.pair.normalisation,
            bounds: self.pair.bounds,
            recipe: self.recipe.to_toml(),
            files: Default::default(),
        }
    }

    fn started(&self) -> Event {
        Event::Started {
            backend: B::InnerBackend::name(&self.device),
            device: format!("{:?}", self.device),
            steps: self.settings.training.steps,
            first_step: self.step,
            implicit_parameters: self.implicit.num_params(),
            velocity_parameters: self.velocity.num_params(),
            source_points: self.pair.source.points.len(),
            target_points: self.pair.target.points.len(),
            correspondences: self.pair.correspondences.len(),
        }
    }
}

/// Reads the terms of an objective back to the host.
fn term_reports<B: Backend>(objective: &Objective<B>) -> Vec<TermReport> {
    let terms = objective.terms().iter().zip(objective.read());
    terms
        .map(|(term, raw)| TermReport {
            name: term.name,
            raw,
            weighted: raw * term.weight,
        })
        .collect()
}

#[cfg(test)]
mod tests;
