//! What all commands share that train a new run.

use std::path::{Path, PathBuf};

use clap::Args;
use isomorph::{Event, Recipe, Session};

use super::view::show;
use super::{BackendArgs, Failure, MemoryArgs, ProgressArgs, Result, SetArgs, stop_on_interrupt};

/// How a new run is made and shown.
#[derive(Debug, Args)]
pub(super) struct NewRunArgs {
    /// Open the page of the run in the browser at the end
    #[arg(long)]
    open: bool,

    /// Replace an existing run
    #[arg(long)]
    pub force: bool,

    /// Fail (exit status 1) if the surfaces at the ends contradict the shapes that were given
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    pub set: SetArgs,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    memory: MemoryArgs,

    #[command(flatten)]
    pub progress: ProgressArgs,
}

impl NewRunArgs {
    /// Trains a recipe into a folder, a session that `change` has changed, and shows its events; the page of the
    /// run, if one was written.
    pub(super) fn train(
        &self,
        recipe: Recipe,
        folder: &Path,
        change: impl FnOnce(Session) -> Session,
        on_event: impl FnMut(&Event),
    ) -> Result<Option<PathBuf>> {
        let session = Session::prepare(recipe, folder, self.place.backend()?)?;
        let mut session = change(session.stopped_by(stop_on_interrupt()));
        if self.force {
            session = session.replacing();
        }
        self.watched(session, folder, on_event)
    }

    /// Goes on with the run of this recipe in a folder; nothing is done if it is finished.
    pub(super) fn go_on(&self, recipe: Recipe, folder: &Path) -> Result<Option<PathBuf>> {
        let Some(session) = Session::begin_or_go_on(recipe, folder, self.place.backend()?)? else {
            if self.progress.is_for_people() {
                eprintln!("{}: is finished already", folder.display());
            }
            return Ok(None);
        };
        self.watched(session.stopped_by(stop_on_interrupt()), folder, |_| {})
    }

    /// Trains a session and shows its events; the page of the run, if one was written.
    fn watched(
        &self,
        session: Session,
        folder: &Path,
        mut on_event: impl FnMut(&Event),
    ) -> Result<Option<PathBuf>> {
        let mut session = self.memory.limited(session);
        let mut terminal = self.progress.terminal(folder);
        let (mut page, mut contradicted) = (None, false);
        session.train(|event| {
            on_event(event);
            match event {
                Event::Reported { path } => page = Some(path.clone()),
                Event::Doubtful { .. } => contradicted = true,
                _ => {}
            }
            terminal.show(event);
        })?;
        if self.strict && contradicted {
            return Err(Failure::Contradicted);
        }
        Ok(page)
    }

    /// Opens the page of the run, if that is wanted.
    pub(super) fn open(&self, page: Option<&Path>) {
        match page {
            Some(page) if self.open => show(page),
            None if self.open => eprintln!("no page was written: result.frames is 0"),
            _ => {}
        }
    }
}
