//! The folder of one run: where everything lies in it, and how it is created without harm to another.
//!
//! ```text
//! recipe.toml  pairs.csv (where they were to be found)  metrics.jsonl  run.log  checkpoints/  meshes/  report.html
//! ```

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::lock::{self, RunLock};
use crate::atomic;
use crate::error::Result;
use crate::recipe::{Recipe, RecipeError};

/// Why a run's folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// Something is there already.
    #[error("{0}: exists already; resume the run in it, choose another folder, or replace it")]
    Exists(PathBuf),
    /// Something is there that is not a run, which is never deleted.
    #[error(
        "{0}: exists and is not a run (it has no recipe.toml), so it is not replaced; choose another folder"
    )]
    NotARun(PathBuf),
    /// Not a run.
    #[error("{0}: not a run: it has no recipe.toml; name the folder that training made")]
    Missing(PathBuf),
    /// Another process trains in it.
    #[error("{path}: in use: {holder} trains this run; wait until it ends, or stop it")]
    Busy {
        /// The folder.
        path: PathBuf,
        /// Who.
        holder: String,
    },
    /// Something of the run lies elsewhere.
    #[error(
        "{0}: is a symbolic link, and nothing is written through one inside a run; put a file or folder in its place"
    )]
    Link(PathBuf),
    /// The file system refused.
    #[error("{path}: {reason}")]
    Io {
        /// The folder.
        path: PathBuf,
        /// What it said.
        reason: io::Error,
    },
}

/// Whether a folder holds a run.
pub fn is_run(path: &Path) -> bool {
    RunFolder::open(path).is_ok()
}

/// The folder of one run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RunFolder(PathBuf);

impl RunFolder {
    /// Makes the folder of a new run and writes the resolved recipe into it.
    ///
    /// # Errors
    /// [`FolderError`]; with `replace` an older run there is deleted first, and nothing but a run ever is.
    pub(super) fn create(
        path: &Path,
        recipe: &str,
        replace: bool,
    ) -> std::result::Result<(Self, RunLock), FolderError> {
        let io = |reason| FolderError::Io {
            path: path.to_path_buf(),
            reason,
        };
        let run = Self(path.to_path_buf());
        let refused_as_it_is = || match fs::read_dir(path).map(holds_anything) {
            Ok(true) if !replace => Err(FolderError::Exists(path.to_path_buf())),
            Ok(true) if !run.recipe().is_file() => Err(FolderError::NotARun(path.to_path_buf())),
            Ok(_) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            Err(reason) => Err(io(reason)),
        };
        // Before the lock, so that what is refused is as it was; and with it, for what came in between.
        refused_as_it_is()?;
        fs::create_dir_all(path).map_err(io)?;
        let lock = run.lock()?;
        refused_as_it_is()?;
        run.clear().map_err(io)?;
        atomic::write_atomically(&run.recipe(), |out| out.write_all(recipe.as_bytes()))
            .map_err(io)?;
        Ok((run, lock))
    }

    /// The right to train in it.
    ///
    /// # Errors
    /// [`FolderError::Busy`], [`FolderError::Link`], [`FolderError::Io`].
    pub(super) fn lock(&self) -> std::result::Result<RunLock, FolderError> {
        let files = [lock::FILE, "metrics.jsonl", "run.log"].map(|name| self.0.join(name));
        let folders = [self.checkpoints(), self.meshes()];
        files.into_iter().chain(folders).try_for_each(no_link)?;
        RunLock::take(&self.0)
    }

    /// Whether its surfaces and its log can be written without leaving it.
    ///
    /// # Errors
    /// [`FolderError::Link`].
    pub(super) fn check_output(&self) -> std::result::Result<(), FolderError> {
        no_link(self.0.join("run.log"))?;
        no_link(self.meshes())
    }

    /// Opens the folder of an existing run.
    ///
    /// # Errors
    /// [`FolderError::Missing`] if it holds no recipe.
    pub(crate) fn open(path: &Path) -> std::result::Result<Self, FolderError> {
        let run = Self(path.to_path_buf());
        if run.recipe().is_file() {
            Ok(run)
        } else {
            Err(FolderError::Missing(path.to_path_buf()))
        }
    }

    /// The recipe of the run, of this version or an earlier one, with notes on what this version leaves out
    /// of it.
    ///
    /// # Errors
    /// What [`Recipe::parse_stored`] refuses, or the file system.
    pub(crate) fn stored_recipe(&self) -> Result<(Recipe, Vec<String>)> {
        let path = self.recipe();
        let text = fs::read_to_string(&path).map_err(|reason| RecipeError::Unreadable {
            path: path.clone(),
            reason,
        })?;
        Ok(Recipe::parse_stored(&text, &path)?)
    }

    /// The folder itself.
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// The resolved recipe.
    pub(crate) fn recipe(&self) -> PathBuf {
        self.0.join("recipe.toml")
    }

    /// The pairs that were found by matching, from key frame `k` to the next, of so many intervals.
    pub(crate) fn pairs(&self, k: usize, intervals: usize) -> PathBuf {
        self.0.join(match intervals {
            1 => PAIRS.to_owned(),
            _ => format!("{PAIRS_OF_INTERVAL}{k:04}.csv"),
        })
    }

    /// The same where they may have been found before further key frames were appended to two.
    pub(crate) fn found_pairs(&self, k: usize, intervals: usize) -> PathBuf {
        let (own, of_two) = (self.pairs(k, intervals), self.pairs(k, 1));
        if k == 0 && !own.exists() { of_two } else { own }
    }

    /// The folder of checkpoints.
    pub(crate) fn checkpoints(&self) -> PathBuf {
        self.0.join("checkpoints")
    }

    /// The folder of extracted surfaces.
    pub(crate) fn meshes(&self) -> PathBuf {
        self.0.join("meshes")
    }

    /// The page that shows the run.
    pub(crate) fn report(&self) -> PathBuf {
        self.0.join("report.html")
    }

    /// Deletes what a run is made of, and nothing else.
    fn clear(&self) -> io::Result<()> {
        for folder in [self.checkpoints(), self.meshes()] {
            if folder.exists() {
                fs::remove_dir_all(folder)?;
            }
        }
        let mut files = [
            "metrics.jsonl",
            "run.log",
            PAIRS,
            "report.html",
            super::state::FAILED,
        ]
        .map(str::to_owned)
        .to_vec();
        let names = fs::read_dir(&self.0)?.flatten();
        let names = names.filter_map(|entry| entry.file_name().into_string().ok());
        files.extend(names.filter(|name| is_pairs_of_interval(name)));
        // The recipe last: without it this is no run that another try may replace.
        files.push("recipe.toml".to_owned());
        for file in files {
            match fs::remove_file(self.0.join(file)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }
}

/// The file of pairs between two shapes.
const PAIRS: &str = "pairs.csv";

/// What the names of the files of pairs begin with where there are more than two shapes.
const PAIRS_OF_INTERVAL: &str = "pairs-";

fn is_pairs_of_interval(name: &str) -> bool {
    let number = name.strip_prefix(PAIRS_OF_INTERVAL);
    let number = number.and_then(|rest| rest.strip_suffix(".csv"));
    number.is_some_and(|number| number.len() >= 4 && number.bytes().all(|c| c.is_ascii_digit()))
}

/// Whether a folder holds anything but what a run leaves that was killed before it had written its recipe,
/// and so is none yet; that is deleted.
fn holds_anything(entries: fs::ReadDir) -> bool {
    let (left_over, others): (Vec<_>, Vec<_>) = entries
        .flatten()
        .partition(|entry| atomic::is_left_over(&entry.file_name()));
    for entry in left_over {
        // Only unused space is at stake: not worth stopping for.
        let _ = fs::remove_file(entry.path());
    }
    others.iter().any(|entry| entry.file_name() != lock::FILE)
}

/// Nothing is written through a symbolic link in a run's folder: a run may come from anywhere, and its links lead
/// where its maker chose. Files that are written anew replace a link.
fn no_link(path: PathBuf) -> std::result::Result<(), FolderError> {
    match fs::symlink_metadata(&path) {
        Ok(found) if found.is_symlink() => Err(FolderError::Link(path)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_replaced_only_by_force_and_only_if_it_is_a_run() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("run");
        RunFolder::create(&path, "first", false).expect("a new run");
        fs::write(path.join("mine.txt"), "kept").expect("a file of the user's");
        let refused = RunFolder::create(&path, "second", false).expect_err("it exists");
        assert!(refused.to_string().contains("replace it"), "{refused}");
        let (run, _lock) = RunFolder::create(&path, "second", true).expect("replaced");
        assert_eq!(
            fs::read_to_string(run.recipe()).expect("a recipe"),
            "second"
        );
        assert!(
            path.join("mine.txt").exists(),
            "what is not the run's stays"
        );
        fs::remove_file(run.recipe()).expect("no longer a run");
        let refused = RunFolder::create(&path, "third", true).expect_err("not a run");
        assert!(matches!(refused, FolderError::NotARun(_)), "{refused}");
        assert!(matches!(
            RunFolder::open(&path),
            Err(FolderError::Missing(_))
        ));
    }

    #[test]
    fn what_a_killed_run_left_of_its_recipe_is_no_run_and_goes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let torn = folder.path().join(".isomorph-x1Y2z3");
        fs::write(&torn, "half a rec").expect("written");
        RunFolder::create(folder.path(), "whole", false).expect("a new run");
        assert!(!torn.exists(), "nothing torn is left");
    }

    #[cfg(unix)]
    #[test]
    fn nothing_is_written_through_links_in_a_run() {
        use std::os::unix::fs::symlink;

        let place = tempfile::tempdir().expect("a temporary folder");
        let (path, elsewhere) = (place.path().join("run"), place.path().join("elsewhere"));
        let (run, lock) = RunFolder::create(&path, "recipe", false).expect("a new run");
        drop(lock);
        fs::create_dir(&elsewhere).expect("a folder");
        for name in ["checkpoints", "meshes", "run.log", "metrics.jsonl", ".lock"] {
            let link = path.join(name);
            let _ = fs::remove_file(&link);
            symlink(&elsewhere, &link).expect("a link");
            let refused = run.lock().expect_err("a link").to_string();
            assert!(
                refused.contains(name) && refused.contains("symbolic link"),
                "{refused}"
            );
            fs::remove_file(&link).expect("removed");
        }
        run.lock().expect("no link any more");
        // What is written whole takes the place of a link.
        let mine = elsewhere.join("mine.txt");
        fs::write(&mine, "kept").expect("written");
        symlink(&mine, run.report()).expect("a link");
        atomic::write_atomically(&run.report(), |out| out.write_all(b"page")).expect("written");
        assert_eq!(fs::read(&mine).expect("still there"), b"kept");
        assert!(!run.report().is_symlink());
    }
}
