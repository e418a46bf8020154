//! The folder of results: one JSON file per pair and method, so that a comparison that was interrupted
//! goes on where it stopped, and one that is extended does only what is new.
//!
//! ```text
//! RESULTS/fox_survey/0-18.quick.json  0-18.lipmlp.json  20-47.quick.json  …
//! RESULTS/fox_survey/table.md  comparison.json  error.svg
//! ```

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::entry::Entry;
use super::plan::FramePair;
use crate::atomic::write_atomically;

/// The version of the files; another one is not read.
const FORMAT: u32 = 1;
/// The version of the program; what another one measured is measured again.
const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Longest part of a file name that is made of a label, in bytes; file systems allow 255 in all.
const LONGEST_STEM: usize = 80;

/// Why a result cannot be kept.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system refused; the message names the file.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// A number that JSON has no word for.
    #[error(
        "{}: {method} on {pair} has a result that is not finite, which JSON cannot hold ({reason}); leave \
         out of the evaluation what cannot be measured", path.display()
    )]
    NotFinite {
        /// The file that was to be written.
        path: PathBuf,
        /// The label of the method.
        method: String,
        /// The pair.
        pair: FramePair,
        /// Where the JSON reader stopped.
        reason: serde_json::Error,
    },
}

/// What the store knows of a pair and a method.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Lookup {
    /// It is done.
    Done(Box<Entry>),
    /// There is nothing of it.
    Missing,
    /// Something is there that cannot be used, and is replaced by the next [`Store::record`].
    Unusable {
        /// One line for the user: which file, why, and what follows.
        note: String,
    },
}

/// The results of one sequence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Store {
    folder: PathBuf,
    sequence: String,
}

/// An entry as its file holds it.
#[derive(Serialize, Deserialize)]
struct Stored<E> {
    format: u32,
    isomorph: String,
    #[serde(flatten)]
    entry: E,
}

/// The part of a file that is read first.
#[derive(Deserialize)]
struct Versions {
    format: u32,
    isomorph: String,
}

impl Store {
    /// The results of a sequence under the folder `results`, which need not be there yet.
    #[must_use]
    pub(crate) fn at(results: &Path, sequence: &str) -> Self {
        Self {
            folder: results.join(file_stem(sequence)),
            sequence: sequence.to_owned(),
        }
    }

    /// Makes the folder, if need be.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub(crate) fn create(&self) -> Result<(), StoreError> {
        fs::create_dir_all(&self.folder).map_err(|error| {
            io::Error::new(error.kind(), format!("{}: {error}", self.folder.display()))
        })?;
        Ok(())
    }

    /// The results of a sequence under the folder `results`, which is made if need be.
    ///
    /// # Errors
    /// [`StoreError::Io`] if the folder cannot be made.
    #[cfg(test)]
    pub(crate) fn open(results: &Path, sequence: &str) -> Result<Self, StoreError> {
        let store = Self::at(results, sequence);
        store.create()?;
        Ok(store)
    }

    /// The folder of the sequence.
    #[must_use]
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Looks for the result of a method on a pair, made from the same inputs: see
    /// [`super::Inputs::digest`].
    #[must_use]
    pub(crate) fn find(&self, pair: FramePair, label: &str, digest: &str) -> Lookup {
        let path = self.folder.join(file_name(pair, label));
        let text = match fs::read(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Lookup::Missing,
            Err(error) => return unusable(&path, pair, label, &format!("cannot be read: {error}")),
        };
        match self.read(&text, pair, label, digest) {
            Ok(entry) => Lookup::Done(Box::new(entry)),
            Err(problem) => unusable(&path, pair, label, &problem),
        }
    }

    /// Keeps a result, in place of any earlier one of its pair and method.
    ///
    /// # Errors
    /// [`StoreError`]; an earlier result then stays as it was.
    pub(crate) fn record(&self, entry: &Entry) -> Result<(), StoreError> {
        let path = self.folder.join(file_name(entry.pair, &entry.run.method));
        let stored = Stored {
            format: FORMAT,
            isomorph: VERSION.to_owned(),
            entry,
        };
        let text = serde_json::to_string(&stored).map_err(io::Error::from)? + "\n";
        // JSON turns NaN into null: better to find out now than to measure again at every call.
        if let Err(reason) = serde_json::from_str::<Stored<Entry>>(&text) {
            return Err(StoreError::NotFinite {
                path,
                method: entry.run.method.clone(),
                pair: entry.pair,
                reason,
            });
        }
        write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
        Ok(())
    }

    /// The entry in the text of a file, or why it is not the one that is looked for.
    fn read(
        &self,
        text: &[u8],
        pair: FramePair,
        label: &str,
        digest: &str,
    ) -> Result<Entry, String> {
        let damaged = |error: serde_json::Error| format!("damaged ({error})");
        let versions: Versions = serde_json::from_slice(text).map_err(damaged)?;
        if versions.format != FORMAT {
            let found = versions.format;
            return Err(format!("format {found}, this program reads {FORMAT}"));
        }
        if versions.isomorph != VERSION {
            let found = versions.isomorph;
            return Err(format!(
                "made by isomorph {found}, this program is {VERSION}"
            ));
        }
        let stored: Stored<Entry> = serde_json::from_slice(text).map_err(damaged)?;
        let entry = stored.entry;
        if (
            entry.sequence.as_str(),
            entry.pair,
            entry.run.method.as_str(),
        ) != (self.sequence.as_str(), pair, label)
        {
            return Err(format!(
                "holds {} on {} of {}",
                entry.run.method, entry.pair, entry.sequence
            ));
        }
        if entry.run.digest != digest {
            return Err("made with another recipe, data or evaluation".to_owned());
        }
        Ok(entry)
    }
}

fn unusable(path: &Path, pair: FramePair, label: &str, problem: &str) -> Lookup {
    Lookup::Unusable {
        note: format!(
            "{}: {problem}; {label} on {pair} is done again",
            path.display()
        ),
    }
}

/// The file of a pair and a method in the folder of their sequence.
pub(super) fn file_name(pair: FramePair, label: &str) -> String {
    format!("{pair}.{}.json", file_stem(label))
}

/// A name that every file system takes: ASCII letters, digits, `-`, `_` and dots inside. What had to
/// be changed for it gets a checksum of the text, so that "a/b" and "a b" stay two.
pub(crate) fn file_stem(text: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_.".contains(letter);
    let stem: String = text
        .chars()
        .map(|letter| if is_plain(letter) { letter } else { '_' })
        .take(LONGEST_STEM)
        .collect();
    let is_hidden = stem.starts_with('.') || stem.ends_with('.');
    if stem == text && !stem.is_empty() && !is_hidden {
        stem
    } else {
        let stem = stem.trim_matches('.');
        format!("{stem}-{:08x}", crc32fast::hash(text.as_bytes()))
    }
}

#[cfg(test)]
#[path = "store_tests.rs"]
mod tests;
