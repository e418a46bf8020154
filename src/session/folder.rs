//! The folder of one run: where everything lies in it, and how it is created without harm to another.
//!
//! ```text
//! recipe.toml  pairs.csv (where they were to be found)  metrics.jsonl  run.log  checkpoints/  meshes/  report.html
//! ```

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

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
    pub(crate) fn create(
        path: &Path,
        recipe: &str,
        replace: bool,
    ) -> std::result::Result<Self, FolderError> {
        let io = |reason| FolderError::Io {
            path: path.to_path_buf(),
            reason,
        };
        let occupied = match fs::read_dir(path) {
            Ok(entries) => holds_anything(entries),
            Err(error) if error.kind() == io::ErrorKind::NotFound => false,
            Err(reason) => return Err(io(reason)),
        };
        let run = Self(path.to_path_buf());
        if occupied {
            if !replace {
                return Err(FolderError::Exists(path.to_path_buf()));
            }
            if !run.recipe().is_file() {
                return Err(FolderError::NotARun(path.to_path_buf()));
            }
            run.clear().map_err(io)?;
        }
        fs::create_dir_all(path).map_err(io)?;
        atomic::write_atomically(&run.recipe(), |out| out.write_all(recipe.as_bytes()))
            .map_err(io)?;
        Ok(run)
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

    /// The pairs that were found by matching.
    pub(crate) fn pairs(&self) -> PathBuf {
        self.0.join("pairs.csv")
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
        let files = ["metrics.jsonl", "run.log", "pairs.csv", "report.html"];
        // The recipe last: without it this is no run that another try may replace.
        for file in files.into_iter().chain(["recipe.toml"]) {
            match fs::remove_file(self.0.join(file)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }
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
    !others.is_empty()
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
        let run = RunFolder::create(&path, "second", true).expect("replaced");
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
}
