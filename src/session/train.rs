//! A run in training, from its recipe or from its newest checkpoint.

mod begun;

use std::cell::Cell;
use std::path::{Path, PathBuf};

use isomorph_training::engine::{Engine, Trainer};

use self::begun::Begun;
use super::against_input;
use super::checkpoint::{Checkpoint, CheckpointError};
use super::folder::RunFolder;
use super::grown::{self, Appended};
use super::learned;
use super::learner::{LearnerError, Outcome};
use super::log::RunLog;
use super::memory_need::{MemoryNeed, exceeded};
use super::prepare;
use super::state::FAILED;
use super::stop::StopFlag;
use super::trained::Trained;
use crate::atomic::write_atomically;
use crate::backend::Backend;
use crate::error::{Error, ErrorKind, Result};
use crate::event::Event;
use crate::formats::{Shape, SurfaceFormat};
use crate::gltf::Precision;
use crate::recipe::Recipe;
use crate::session::extract::ExtractOptions;
use crate::surface::animations_in;
use crate::surface::frames::OutputFormat;

/// A run that is about to be trained: a recipe, its shapes, a folder and a backend.
///
/// # Examples
/// Two shapes to a surface half-way between them:
/// ```
/// use isomorph::{Backend, Recipe, Session, Shape};
///
/// # fn sphere(x: f64) -> Shape {
/// #     let points = (0..500).map(|k| {
/// #         let z = 1.0 - (2 * k + 1) as f64 / 500.0;
/// #         let (ring, angle) = ((1.0 - z * z).sqrt(), 2.399_963 * k as f64);
/// #         [x + ring * angle.cos(), ring * angle.sin(), z]
/// #     });
/// #     Shape::cloud(points.collect())
/// # }
/// # fn main() -> Result<(), isomorph::Error> {
/// # let place = tempfile::tempdir().expect("a temporary folder");
/// # let (a, b) = (place.path().join("a.ply"), place.path().join("b.ply"));
/// # sphere(0.0).write(&a)?;
/// # sphere(0.5).write(&b)?;
/// let mut recipe = Recipe::between(&a, &b)?;
/// for key in ["preset=quick", "data.correspondences=same-vertices", "result.frames=0"] {
///     recipe.with(key)?;
/// }
/// # for key in ["training.steps=4", "training.batch=100", "implicit.width=8", "velocity.width=8"] {
/// #     recipe.with(key)?;
/// # }
/// let mut session = Session::prepare(recipe, place.path().join("run"), Backend::Flex)?;
/// let trained = session.train(|event| eprintln!("{event}"))?;
/// let surface = trained.surface(0.5, 48)?;
/// println!("{} triangles", surface.mesh.triangles.len());
/// # Ok(())
/// # }
/// ```
pub struct Session {
    recipe: Recipe,
    shapes: Vec<Shape>,
    folder: PathBuf,
    start: Start,
    engine: Box<dyn Engine>,
    stop: StopFlag,
    output: Output,
    /// Bytes of memory that it may take.
    memory_limit: Option<u64>,
}

/// What is written of the surfaces at the end of training.
#[derive(Clone, Copy)]
struct Output {
    format: OutputFormat,
    carry: bool,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            format: OutputFormat::Frames(SurfaceFormat::Ply),
            carry: false,
        }
    }
}

impl Output {
    /// As it was written the last time: of `isomorph morph` animations.
    fn of(run: &RunFolder) -> Self {
        match animations_in(&run.meshes()) {
            [false, _] => Self::default(),
            [true, carry] => Self {
                format: OutputFormat::Animation(Precision::Full),
                carry,
            },
        }
    }
}

/// Where training begins.
enum Start {
    /// At its first step.
    New {
        /// Whether a run that is there already is deleted.
        replace: bool,
    },
    /// Where the run has come to.
    GoOn {
        /// The newest checkpoint; none if the run stopped before its first.
        checkpoint: Option<Box<Checkpoint>>,
        /// Whether the run's recipe is written anew.
        rewrite: bool,
        /// What this version leaves out of the recipe of an earlier one.
        notes: Vec<String>,
    },
}

impl Session {
    /// A new run. The shapes are read and the backend is opened, but nothing is written before
    /// [`Session::train`].
    ///
    /// # Errors
    /// A shape that cannot be read, a backend that cannot be opened.
    pub fn prepare(recipe: Recipe, folder: impl AsRef<Path>, backend: Backend) -> Result<Self> {
        Ok(Self {
            engine: backend.open()?,
            shapes: prepare::read(&recipe)?,
            recipe,
            folder: folder.as_ref().to_path_buf(),
            start: Start::New { replace: false },
            stop: StopFlag::default(),
            output: Output::default(),
            memory_limit: None,
        })
    }

    /// A run that goes on from its newest checkpoint, on any backend. `changes` are keys of its recipe with
    /// new values, as in `training.steps=2000`; those of its networks cannot change.
    ///
    /// Changes may append key frames to those of a run, as in `data.keys=[0, 10, 18]`; so may lines in its recipe.
    ///
    /// # Errors
    /// A folder that is no run, a damaged checkpoint, a change that the checkpoint does not fit.
    pub fn resume(folder: impl AsRef<Path>, changes: &[String], backend: Backend) -> Result<Self> {
        Self::append(folder, &Appended::default(), changes, backend)
    }

    /// A run that goes on with further shapes after its last key frame, where there are some. `changes` as of
    /// [`Self::resume`].
    ///
    /// What the run has learned is kept: its coordinates stay, networks go on from what they are, and splines are solved
    /// for anew. The steps of the appended key frames come after those of the run, unless `changes` has
    /// `training.steps`.
    ///
    /// # Errors
    /// Those of [`Self::resume`], times that do not ascend, another number of times than shapes.
    pub fn append(
        folder: impl AsRef<Path>,
        appended: &Appended,
        changes: &[String],
        backend: Backend,
    ) -> Result<Self> {
        let run = RunFolder::open(folder.as_ref())?;
        let (mut recipe, notes) = run.stored_recipe()?;
        appended.to(&mut recipe)?;
        recipe.with_all(changes)?;
        let checkpoint = match Checkpoint::newest(&run.checkpoints()) {
            Ok(checkpoint) => Some(Box::new(checkpoint)),
            // Stopped before its first checkpoint: it starts again, with the same seed.
            Err(CheckpointError::None(_)) => None,
            Err(damaged) => return Err(damaged.into()),
        };
        let is_appended = !appended.shapes.is_empty();
        let grows = match &checkpoint {
            Some(checkpoint) => grown::begin(checkpoint, &mut recipe, is_appended, changes)?,
            None => false,
        };
        Ok(Self {
            engine: backend.open()?,
            shapes: prepare::read(&recipe)?,
            recipe,
            folder: run.path().to_path_buf(),
            start: Start::GoOn {
                checkpoint,
                rewrite: is_appended || !changes.is_empty() || grows,
                notes,
            },
            stop: StopFlag::default(),
            output: Output::of(&run),
            memory_limit: None,
        })
    }

    /// Deletes a run that is in the folder already, when training starts; nothing but a run ever is.
    #[must_use]
    pub fn replacing(mut self) -> Self {
        if let Start::New { replace } = &mut self.start {
            *replace = true;
        }
        self
    }

    /// The flag that stops the training after its present step, with a checkpoint.
    pub fn stop_flag(&self) -> StopFlag {
        self.stop.clone()
    }

    /// The files of the surfaces at the end of training, PLY without this; with `carry` the source is carried
    /// along as well.
    #[must_use]
    pub fn writing(mut self, format: OutputFormat, carry: bool) -> Self {
        self.output = Output { format, carry };
        self
    }

    /// Takes no more than so many bytes of memory: [`Self::train`] refuses a run that would, before anything is
    /// written, and ends one that does at its next report, with a checkpoint. Memory of a graphics card is not
    /// part of it.
    #[must_use]
    pub fn within_memory(mut self, bytes: u64) -> Self {
        self.memory_limit = Some(bytes);
        self
    }

    /// Ends early when this flag is set, instead of one of its own.
    #[must_use]
    pub fn stopped_by(self, stop: StopFlag) -> Self {
        Self { stop, ..self }
    }

    /// Vertices of each of the shapes.
    pub(super) fn sizes(&self) -> Vec<usize> {
        let each = self.shapes.iter();
        each.map(|shape| shape.mesh.vertices.len()).collect()
    }

    /// The recipe, every key with its value.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// Trains to the last step and writes the surfaces that the recipe asks for. `on_event` hears of
    /// everything as it happens.
    ///
    /// # Errors
    /// Of kind [`Interruption`](crate::ErrorKind::Interruption) if the stop flag was set: a checkpoint then
    /// holds all steps so far. Else what keeps the run from being trained; the checkpoints written so far
    /// stay.
    pub fn train(&mut self, mut on_event: impl FnMut(&Event)) -> Result<Trained> {
        let ended = self.train_dyn(&mut on_event);
        if let Err(error) = &ended
            && error.kind() == ErrorKind::Failure
            && let Ok(run) = RunFolder::open(&self.folder)
        {
            // For whoever looks at the folder later; it is said now as well.
            let text = format!("{error}\n");
            let _ = write_atomically(&run.path().join(FAILED), |out| {
                out.write_all(text.as_bytes())
            });
        }
        ended
    }

    fn train_dyn(&mut self, on_event: &mut dyn FnMut(&Event)) -> Result<Trained> {
        if let Some(limit) = self.memory_limit {
            MemoryNeed::of(&self.recipe, &self.sizes()).within(limit)?;
        }
        let mut begun = match &self.start {
            Start::New { replace } => self.begin(*replace, on_event)?,
            Start::GoOn { .. } => self.go_on(on_event)?,
        };
        let mut step_backs = self.recipe.checkpoint.step_backs;
        let mut tried = None;
        let outcome = loop {
            match self.trained_to_the_end(&mut begun, on_event) {
                Err(LearnerError::NotFinite { step, what, .. }) if step_backs > 0 => {
                    step_backs -= 1;
                    let why = format!("step {step}: {what}");
                    (begun, tried) = self.step_back(begun, &why, tried, on_event)?;
                }
                ended => break ended?,
            }
        };
        let (run, log) = (&begun.run, &mut begun.log);
        // What is done is the run's: training again goes on from there.
        self.start = Start::GoOn {
            checkpoint: Checkpoint::newest(&run.checkpoints()).ok().map(Box::new),
            rewrite: false,
            notes: Vec::new(),
        };
        if outcome == Outcome::Interrupted {
            return Err(Error::interruption(format!(
                "{}: training was stopped; its newest checkpoint holds all steps so far",
                run.path().display()
            )));
        }
        let deformation = begun.learner.trainer().deformation();
        let learned = learned::learned(deformation, &self.recipe, begun.frame.clone())?;
        let trained = Trained::new(learned, self.recipe.clone(), begun.run);
        if self.recipe.result.frames > 0 {
            let Output { format, carry } = self.output;
            let options = ExtractOptions {
                format,
                carry,
                ..ExtractOptions::of(&self.recipe)
            };
            let frames = trained.extract_into(&options, &self.stop, log, on_event)?;
            let learned = trained.learned();
            let unsupported = begun.ends.windows(2).flat_map(|two| {
                let [first, last] = [&two[0], &two[1]];
                [
                    last.unsupported(first, learned),
                    first.unsupported(last, learned),
                ]
            });
            let said = begun.ends.iter().flat_map(|end| end.contradicted(&frames));
            let lost = against_input::lost(&begun.ends, &frames);
            for event in unsupported.flatten().chain(lost).chain(said) {
                on_event(&event);
                log.record(&event)?;
            }
            reported(trained.write_report(frames, None), log, on_event)?;
        } else if self.recipe.result.preview_every > 0 {
            // The last preview would go on loading itself.
            reported(trained.report(None), log, on_event)?;
        }
        Ok(trained)
    }

    /// Trains to the last step, or until it is stopped, with previews.
    fn trained_to_the_end(
        &self,
        begun: &mut Begun,
        on_event: &mut dyn FnMut(&Event),
    ) -> std::result::Result<Outcome, LearnerError> {
        let (run, log) = (&begun.run, &mut begun.log);
        let limit = self.memory_limit.unwrap_or(u64::MAX);
        let over = Cell::new(None);
        let mut emit = |event: Event| {
            on_event(&event);
            let peak = match &event {
                Event::Step(report) => report.peak_memory_bytes,
                _ => None,
            };
            if let Some(peak) = peak.filter(|peak| *peak > limit) {
                over.set(Some(peak));
                self.stop.set();
            }
            log.record(&event)
        };
        let (recipe, frame) = (&self.recipe, &begun.frame);
        let mut preview = |trainer: &dyn Trainer| -> std::result::Result<(), String> {
            let learned = learned::learned(trainer.deformation(), recipe, frame.clone());
            let shown = learned
                .and_then(|learned| Trained::new(learned, recipe.clone(), run.clone()).preview());
            shown.map_err(|error| error.to_string())
        };
        let (checkpoints, stop) = (run.checkpoints(), self.stop.flag());
        let outcome = begun
            .learner
            .run_with(&checkpoints, stop, &mut emit, &mut preview)?;
        match over.get() {
            Some(peak) if outcome == Outcome::Interrupted => {
                Err(LearnerError::Memory(exceeded(peak, limit)))
            }
            _ => Ok(outcome),
        }
    }
}

/// Says where the page is, or why there is none: all that was trained is there, and the page can be made again.
fn reported(
    page: Result<PathBuf>,
    log: &mut RunLog,
    on_event: &mut dyn FnMut(&Event),
) -> Result<()> {
    let event = match page {
        Ok(path) => Event::Reported { path },
        Err(reason) => Event::Note(format!("no report.html was written: {reason}")),
    };
    on_event(&event);
    Ok(log.record(&event)?)
}
