//! The folder of one run: where everything lies in it, and how it is created without harm to another.
//!
//! ```text
//! recipe.toml  pairs.csv (where they were to be found)  metrics.jsonl  run.log  checkpoints/  meshes/
//! ```

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::atomic;

/// Why a run's folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Something is there already.
    #[error(
        "{0}: exists already; resume it with `isomorph resume {0}`, choose another with --run, or replace it with --force"
    )]
    Exists(PathBuf),
    /// Something is there that is not a run, which --force does not delete.
    #[error(
        "{0}: exists and is not a run (it has no recipe.toml), so --force leaves it alone; choose another folder with --run"
    )]
    NotARun(PathBuf),
    /// Not a run.
    #[error("{0}: not a run: it has no recipe.toml; give the folder that `isomorph train` made")]
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

/// The folder of one run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunDirectory(PathBuf);

impl RunDirectory {
    /// Makes the folder of a new run and writes the resolved recipe into it.
    ///
    /// # Errors
    /// [`RunError`]; with `force` an older run there is deleted first, and nothing but a run ever is.
    pub fn create(path: &Path, recipe: &str, force: bool) -> Result<Self, RunError> {
        let io = |reason| RunError::Io {
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
            if !force {
                return Err(RunError::Exists(path.to_path_buf()));
            }
            if !run.recipe().is_file() {
                return Err(RunError::NotARun(path.to_path_buf()));
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
    /// [`RunError::Missing`] if it holds no recipe.
    pub fn open(path: &Path) -> Result<Self, RunError> {
        let run = Self(path.to_path_buf());
        if run.recipe().is_file() {
            Ok(run)
        } else {
            Err(RunError::Missing(path.to_path_buf()))
        }
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// The resolved recipe.
    pub fn recipe(&self) -> PathBuf {
        self.0.join("recipe.toml")
    }

    /// The pairs that were found by matching.
    pub fn pairs(&self) -> PathBuf {
        self.0.join("pairs.csv")
    }

    /// The folder of checkpoints.
    pub fn checkpoints(&self) -> PathBuf {
        self.0.join("checkpoints")
    }

    /// The folder of extracted surfaces.
    pub fn meshes(&self) -> PathBuf {
        self.0.join("meshes")
    }

    /// Deletes what a run is made of, and nothing else.
    fn clear(&self) -> io::Result<()> {
        for folder in [self.checkpoints(), self.meshes()] {
            if folder.exists() {
                fs::remove_dir_all(folder)?;
            }
        }
        let files = ["metrics.jsonl", "run.log", "report.html", "pairs.csv"];
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
        RunDirectory::create(&path, "first", false).expect("a new run");
        fs::write(path.join("mine.txt"), "kept").expect("a file of the user's");
        let refused = RunDirectory::create(&path, "second", false).expect_err("it exists");
        assert!(refused.to_string().contains("--force"), "{refused}");
        let run = RunDirectory::create(&path, "second", true).expect("replaced");
        assert_eq!(
            fs::read_to_string(run.recipe()).expect("a recipe"),
            "second"
        );
        assert!(
            path.join("mine.txt").exists(),
            "what is not the run's stays"
        );
        fs::remove_file(run.recipe()).expect("no longer a run");
        let refused = RunDirectory::create(&path, "third", true).expect_err("not a run");
        assert!(matches!(refused, RunError::NotARun(_)), "{refused}");
        assert!(matches!(
            RunDirectory::open(&path),
            Err(RunError::Missing(_))
        ));
    }

    #[test]
    fn what_a_killed_run_left_of_its_recipe_is_no_run_and_goes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let torn = folder.path().join(".isomorph-x1Y2z3");
        fs::write(&torn, "half a rec").expect("written");
        RunDirectory::create(folder.path(), "whole", false).expect("a new run");
        assert!(!torn.exists(), "nothing torn is left");
    }
}
