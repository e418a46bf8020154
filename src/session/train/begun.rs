//! Where training begins: at the first step of a new run, or where its newest checkpoint left one.

use super::{Session, Start};
use crate::atomic::write_atomically;
use crate::error::Result;
use crate::event::Event;
use crate::session::against_input::End;
use crate::session::checkpoint::{self, Checkpoint};
use crate::session::folder::RunFolder;
use crate::session::grown::Grown;
use crate::session::learned::{self, Frame};
use crate::session::learner::Learner;
use crate::session::lock::RunLock;
use crate::session::log::RunLog;
use crate::session::prepare::{self, Prepared};
use crate::session::state::FAILED;

/// A run whose folder is there and whose learner is ready.
pub(super) struct Begun {
    pub run: RunFolder,
    _lock: RunLock,
    pub log: RunLog,
    pub learner: Learner,
    pub frame: Frame,
    /// The shapes, to hold the result against.
    pub ends: Vec<End>,
}

impl Begun {
    /// What failed before does not stand any more.
    fn new(
        run: RunFolder,
        lock: RunLock,
        log: RunLog,
        learner: Learner,
        prepared: &Prepared,
    ) -> Self {
        let keyframes = &prepared.keyframes;
        let _ = std::fs::remove_file(run.path().join(FAILED));
        Self {
            run,
            _lock: lock,
            log,
            learner,
            ends: End::all(&keyframes.keys),
            frame: Frame {
                coordinates: keyframes.coordinates(),
                bounds: keyframes.bounds,
            },
        }
    }
}

impl Session {
    /// The run at its newest checkpoint, with half of all learning rates, and the step of that. Where training came
    /// no further from the checkpoint of step `tried`, that one is beyond repair and deleted.
    pub(super) fn step_back(
        &mut self,
        begun: Begun,
        why: &str,
        tried: Option<usize>,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<(Begun, Option<usize>)> {
        let checkpoints = begun.run.checkpoints();
        if let Some((step, path)) = checkpoint::list(&checkpoints).last()
            && Some(*step) == tried
        {
            checkpoint::remove(path, *step)?;
        }
        let back_to = checkpoint::list(&checkpoints).last().map(|(step, _)| *step);
        // It is opened again as any run that goes on is, and locked then.
        drop(begun);
        self.recipe = self.recipe.clone().with_rates_times(0.5);
        self.start = Start::GoOn {
            checkpoint: Checkpoint::newest(&checkpoints).ok().map(Box::new),
            rewrite: true,
            notes: vec![format!(
                "{why}: training goes back to step {}, with half of all learning rates (checkpoint.step-backs)",
                back_to.unwrap_or(0)
            )],
        };
        Ok((self.go_on(on_event)?, back_to))
    }

    /// A run before its first step: everything is checked before its folder is made.
    pub(super) fn begin(&self, replace: bool, on_event: &mut dyn FnMut(&Event)) -> Result<Begun> {
        let prepared = prepare::prepare(&self.recipe, &self.shapes, None, None, on_event)?;
        learned::check(&self.recipe, &prepared.keyframes.normalisation)?;
        let learner = Learner::new(self.recipe.clone(), &prepared.keyframes, &*self.engine)?;
        let (run, lock) = RunFolder::create(&self.folder, &self.recipe.to_toml(), replace)?;
        let mut log = RunLog::open(run.path(), None)?;
        let matched = prepared.keep(&run)?;
        let notes = prepared.keyframes.notes.iter().cloned().map(Event::Note);
        let unlocked = lock.note().map(Event::Note);
        for event in matched.into_iter().chain(notes).chain(unlocked) {
            on_event(&event);
            log.record(&event)?;
        }
        Ok(Begun::new(run, lock, log, learner, &prepared))
    }

    /// A run where its newest checkpoint left it: what is refused leaves it as it was.
    pub(super) fn go_on(&self, on_event: &mut dyn FnMut(&Event)) -> Result<Begun> {
        let Start::GoOn {
            checkpoint,
            rewrite,
            notes,
        } = &self.start
        else {
            unreachable!("a run that goes on");
        };
        let run = RunFolder::open(&self.folder)?;
        let lock = run.lock()?;
        let grown = match checkpoint {
            Some(checkpoint) => Grown::of(checkpoint, &self.recipe)?,
            None => None,
        };
        let frame = grown.map(|grown| grown.frame);
        let prepared = prepare::prepare(&self.recipe, &self.shapes, Some(&run), frame, on_event)?;
        let keyframes = &prepared.keyframes;
        let changes = match checkpoint {
            Some(checkpoint) => checkpoint.recipe()?.changes(&self.recipe),
            None => Vec::new(),
        };
        let (recipe, engine) = (self.recipe.clone(), &*self.engine);
        let learner = match checkpoint {
            Some(checkpoint) => Learner::resume(recipe, keyframes, engine, checkpoint)?,
            None => Learner::new(recipe, keyframes, engine)?,
        };
        // Nothing is written before here.
        let step = checkpoint.as_ref().map_or(0, |found| found.state.step);
        let mut log = RunLog::open(run.path(), Some(step))?;
        let mut events: Vec<Event> = prepared.keep(&run)?;
        events.extend(lock.note().map(Event::Note));
        events.extend(notes.iter().cloned().map(Event::Note));
        if checkpoint.is_none() {
            let note = "no checkpoint yet: the run starts again from its first step";
            events.push(Event::Note(note.to_owned()));
        }
        for change in changes {
            let note = format!("changed since the checkpoint: {change}");
            events.push(Event::Note(note));
        }
        for event in &events {
            on_event(event);
            log.record(event)?;
        }
        if *rewrite {
            let text = self.recipe.to_toml();
            write_atomically(&run.recipe(), |out| out.write_all(text.as_bytes()))?;
        }
        Ok(Begun::new(run, lock, log, learner, &prepared))
    }
}
