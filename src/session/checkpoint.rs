//! Checkpoints: networks and optimiser states in full precision, whole or not at all.
//!
//! ```text
//! checkpoints/step-000500/
//!   implicit.mpk  implicit-optimiser.mpk  velocity.mpk  velocity-optimiser.mpk
//!   state.json    the step, what made it, and the size and checksum of every other file
//!
//! (other methods have other networks, each with its optimiser)
//! ```
//!
//! The folder is written under a temporary name, flushed, and renamed. `state.json` is read first; a file
//! whose size or checksum is not the one it names is reported, never loaded.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use isomorph_training::records::{RecordError, Records};
use serde::{Deserialize, Serialize};

use super::grown::Grown;
use crate::atomic::flush_folder;
use crate::recipe::{Recipe, RecipeError};
use crate::shape::{Bounds, Coordinates, Normalisation, Placements};

/// The layout of a checkpoint; raised when an older isomorph could not read it.
pub(crate) const FORMAT_VERSION: u32 = 1;

const STATE: &str = "state.json";

/// What the names of folders begin with that are being written or deleted.
const TEMPORARY: &str = ".step-";

/// What `state.json` holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    /// [`FORMAT_VERSION`] of the writer.
    pub format_version: u32,
    /// The release of isomorph that wrote it.
    pub isomorph_version: String,
    /// The release of burn that wrote it.
    pub burn_version: String,
    /// Steps done.
    pub step: usize,
    /// Seconds of training that they took, over all resumes.
    pub seconds: f64,
    /// The seed of the run.
    pub seed: u64,
    /// The backend that made the last step.
    pub backend: String,
    /// From the user's coordinates to the network's.
    pub normalisation: Normalisation,
    /// Where shapes lie that were laid onto each other.
    #[serde(default, skip_serializing_if = "Placements::is_empty")]
    pub placements: Placements,
    /// The bounds of both shapes, normalised.
    pub bounds: Bounds,
    /// What it has from before key frames were appended, if some were.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grown: Option<Grown>,
    /// The whole recipe, resolved, as TOML.
    pub recipe: String,
    /// Size and checksum of the other files, by name.
    pub files: BTreeMap<String, FileDigest>,
}

impl State {
    /// The way between the user's coordinates and those of the networks.
    pub(crate) fn coordinates(&self) -> Coordinates {
        Coordinates {
            normalisation: self.normalisation,
            placements: self.placements.clone(),
        }
    }
}

/// What a file must look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct FileDigest {
    /// Its length in bytes.
    pub bytes: u64,
    /// CRC-32 of its content.
    pub crc32: u32,
}

impl FileDigest {
    fn of(content: &[u8]) -> Self {
        Self {
            bytes: content.len() as u64,
            crc32: crc32fast::hash(content),
        }
    }
}

/// Why a checkpoint cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file system refused.
    #[error("{path}: {reason}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What it said.
        reason: io::Error,
    },
    /// The folder of the run is not where it was.
    #[error(
        "{0}: the folder is gone: it was moved or deleted while the run trained; put it back, and `isomorph resume` goes \
         on from its newest checkpoint"
    )]
    Gone(PathBuf),
    /// There is none to start from.
    #[error(
        "{0}: no checkpoint here: the run stopped before its first one, or was moved without them; train again"
    )]
    None(PathBuf),
    /// A file is not what was written.
    #[error(
        "{path}: {problem}: the checkpoint is damaged; delete its folder to use the one before it"
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// Written by a later isomorph.
    #[error(
        "{path}: format version {found}, and this isomorph reads {FORMAT_VERSION} at most; update isomorph"
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// The recipe inside does not parse.
    #[error(transparent)]
    Recipe(#[from] RecipeError),
}

/// A checkpoint on the disk whose `state.json` has been read.
#[derive(Clone, Debug)]
pub(crate) struct Checkpoint {
    /// Its folder.
    pub path: PathBuf,
    /// What it says of itself.
    pub state: State,
}

impl Checkpoint {
    /// Opens a checkpoint's folder.
    ///
    /// # Errors
    /// [`CheckpointError`] if `state.json` is missing, damaged or too new.
    pub(crate) fn open(path: &Path) -> Result<Self, CheckpointError> {
        let file = path.join(STATE);
        let text = fs::read_to_string(&file).map_err(|reason| CheckpointError::Io {
            path: file.clone(),
            reason,
        })?;
        let damaged = |error: serde_json::Error| CheckpointError::Damaged {
            path: file.clone(),
            problem: format!("not the JSON that was written ({error})"),
        };
        let value: serde_json::Value = serde_json::from_str(&text).map_err(damaged)?;
        let found = value["format_version"].as_u64().unwrap_or(0) as u32;
        if found > FORMAT_VERSION {
            return Err(CheckpointError::Version { path: file, found });
        }
        let state: State = serde_json::from_value(value).map_err(damaged)?;
        // Files of the checkpoint alone: a run may come from anywhere.
        if let Some(name) = state.files.keys().find(|name| !is_plain(name)) {
            return Err(CheckpointError::Damaged {
                path: file,
                problem: format!("{name:?} is no name of a file beside it"),
            });
        }
        Ok(Self {
            path: path.to_path_buf(),
            state,
        })
    }

    /// The newest checkpoint in a folder of checkpoints.
    ///
    /// # Errors
    /// [`CheckpointError::None`] if there is none; that of [`Self::open`] if it is damaged.
    pub(crate) fn newest(folder: &Path) -> Result<Self, CheckpointError> {
        match list(folder).last() {
            Some((_, path)) => Self::open(path),
            None => Err(CheckpointError::None(folder.to_path_buf())),
        }
    }

    /// The recipe that it was made with.
    ///
    /// # Errors
    /// [`CheckpointError::Recipe`] if it no longer parses.
    pub(crate) fn recipe(&self) -> Result<Recipe, CheckpointError> {
        let origin = self.path.join("recipe.toml");
        let (recipe, _) = Recipe::parse_stored(&self.state.recipe, &origin)?;
        Ok(recipe)
    }

    /// Networks and optimiser states, each file checked against its digest.
    ///
    /// # Errors
    /// [`CheckpointError::Damaged`] if one is not what was written, [`CheckpointError::Io`] if it cannot be
    /// read.
    pub(crate) fn records(&self) -> Result<Records, CheckpointError> {
        let read = |(file, wanted): (&String, &FileDigest)| {
            let path = self.path.join(file);
            let content = fs::read(&path).map_err(|reason| CheckpointError::Io {
                path: path.clone(),
                reason,
            })?;
            let found = FileDigest::of(&content);
            if found.bytes != wanted.bytes {
                let problem = format!("{} bytes, {} written", found.bytes, wanted.bytes);
                return Err(CheckpointError::Damaged { path, problem });
            }
            if found != *wanted {
                let problem = "its checksum is not the one written".to_owned();
                return Err(CheckpointError::Damaged { path, problem });
            }
            Ok((file.clone(), content))
        };
        let files = self.state.files.iter().map(read);
        Ok(Records(files.collect::<Result<_, _>>()?))
    }

    /// What `state.json` says and cannot be.
    pub(crate) fn damaged_state(&self, problem: String) -> CheckpointError {
        CheckpointError::Damaged {
            path: self.path.join(STATE),
            problem,
        }
    }

    /// A record of this checkpoint that is not what the method takes.
    pub(crate) fn damaged(&self, error: RecordError) -> CheckpointError {
        CheckpointError::Damaged {
            path: self.path.join(error.file),
            problem: error.problem,
        }
    }
}

/// Writes a checkpoint into `folder` and deletes all but the `keep` newest there; returns its path.
///
/// # Errors
/// [`CheckpointError::Io`]; nothing is left under the final name then. [`CheckpointError::Gone`] if the folder that holds
/// `folder` is not there any more: a new one in its place would have no recipe.
pub(crate) fn save(
    folder: &Path,
    mut state: State,
    files: Records,
    keep: usize,
) -> Result<PathBuf, CheckpointError> {
    let Records(files) = files;
    state.files = files
        .iter()
        .map(|(name, bytes)| (name.clone(), FileDigest::of(bytes)))
        .collect();
    let path = folder.join(format!("step-{:06}", state.step));
    let written = || -> io::Result<()> {
        match fs::create_dir(folder) {
            Err(reason) if reason.kind() != io::ErrorKind::AlreadyExists => return Err(reason),
            _ => {}
        }
        let temporary = tempfile::Builder::new()
            .prefix(TEMPORARY)
            .tempdir_in(folder)?;
        for (name, bytes) in &files {
            write_through(&temporary.path().join(name), bytes)?;
        }
        write_through(
            &temporary.path().join(STATE),
            &serde_json::to_vec_pretty(&state)?,
        )?;
        flush_folder(temporary.path())?;
        if path.exists() {
            remove(&path, state.step)?;
        }
        fs::rename(temporary.path(), &path)?;
        // Renamed away: there is nothing left to delete.
        let _ = temporary.keep();
        flush_folder(folder)
    };
    written().map_err(|reason| match folder.parent() {
        Some(run) if !run.exists() => CheckpointError::Gone(run.to_path_buf()),
        _ => CheckpointError::Io {
            path: path.clone(),
            reason,
        },
    })?;
    prune(folder, keep)?;
    Ok(path)
}

/// Deletes all but the `keep` newest.
fn prune(folder: &Path, keep: usize) -> Result<(), CheckpointError> {
    let all = list(folder);
    for (step, old) in &all[..all.len().saturating_sub(keep)] {
        remove(old, *step).map_err(|reason| CheckpointError::Io {
            path: old.clone(),
            reason,
        })?;
    }
    Ok(())
}

/// Deletes a checkpoint, which has lost its name before it has lost its first file.
pub(crate) fn remove(path: &Path, step: usize) -> io::Result<()> {
    let hidden = path.with_file_name(format!("{TEMPORARY}{step:06}-old"));
    fs::rename(path, &hidden)?;
    fs::remove_dir_all(&hidden)
}

/// The checkpoints in a folder, oldest first.
pub(crate) fn list(folder: &Path) -> Vec<(usize, PathBuf)> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<_> = entries
        .filter_map(|entry| {
            let name = entry.file_name();
            let step = name.to_str()?.strip_prefix("step-")?.parse().ok()?;
            Some((step, entry.path()))
        })
        .collect();
    found.sort();
    found
}

/// Deletes what an interrupted [`save`] left behind: what it was writing, and what it had yet to delete.
pub(crate) fn sweep(folder: &Path, keep: usize) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
            // Only unused space is at stake: not worth stopping for.
            let _ = fs::remove_dir_all(entry.path());
        }
    }
    let _ = prune(folder, keep);
}

/// Whether a name is one of a file, and no path to elsewhere.
fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    matches!(parts.next(), Some(Component::Normal(_))) && parts.next().is_none()
}

/// Writes a file down to the disk; an error names it.
fn write_through(path: &Path, content: &[u8]) -> io::Result<()> {
    let write = || {
        let mut file = fs::File::create(path)?;
        file.write_all(content)?;
        file.sync_all()
    };
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    write().map_err(|error: io::Error| io::Error::new(error.kind(), format!("{file}: {error}")))
}

#[cfg(test)]
mod tests;
