//! The fingerprint of all that decides a result: equal fingerprints, equal results, so that what is
//! done need not be done again.
//!
//! It is SHA-256 over the recipe, the contents of every data file, the sequence, the pair and the
//! settings of the evaluation. Of a path only the contents behind it count, so that a folder may
//! move; comments, blank lines and the order of keys do not count, nor does `[checkpoint]`, which
//! decides what is kept on the way and not what comes out. The version of the program is not part of
//! it: [`super::Store`] holds that against the file itself, to be able to say so.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use toml::{Table, Value};

use super::plan::FramePair;

/// Sections of a recipe that decide nothing about a result.
const IRRELEVANT: [&str; 1] = ["checkpoint"];
/// The section whose texts may be paths.
const DATA: &str = "data";

/// Why there is no fingerprint.
#[derive(Debug, thiserror::Error)]
pub enum DigestError {
    /// A file of the data cannot be read.
    #[error("{}: cannot be read: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the file system said.
        reason: io::Error,
    },
    /// The recipe is not TOML.
    #[error("the recipe of this run: not TOML ({0}); pass the resolved recipe")]
    Recipe(#[from] toml::de::Error),
}

/// All that decides a result.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inputs<'a> {
    /// The resolved recipe, TOML. A path in its `[data]` counts by the contents of the file; where
    /// there is no such file, by its name without the folder.
    pub recipe: &'a str,
    /// The contents of the sequence.
    pub sequence: &'a [u8],
    /// The frames that the method sees.
    pub pair: FramePair,
    /// What else decides the numbers, as name and value: samples, resolution, backend, and so on.
    pub settings: &'a [(&'a str, String)],
}

impl Inputs<'_> {
    /// The fingerprint, 64 hexadecimal digits.
    ///
    /// # Errors
    /// [`DigestError`].
    pub(crate) fn digest(&self) -> Result<String, DigestError> {
        let mut pieces = BTreeMap::new();
        for (section, value) in self.recipe.parse::<Table>()? {
            if !IRRELEVANT.contains(&section.as_str()) {
                collect(&section, &value, section == DATA, &mut pieces)?;
            }
        }
        let mut hash = Sha256::new();
        for (key, value) in &pieces {
            feed(&mut hash, "recipe", key.as_bytes(), value);
        }
        for (name, value) in self.settings {
            feed(&mut hash, "setting", name.as_bytes(), value.as_bytes());
        }
        let pair = self.pair.to_string();
        feed(&mut hash, "sequence", pair.as_bytes(), self.sequence);
        Ok(hexadecimal(&hash.finalize()))
    }
}

/// The values under `key`, each under its full name, in an order of their own.
fn collect(
    key: &str,
    value: &Value,
    is_data: bool,
    into: &mut BTreeMap<String, Vec<u8>>,
) -> Result<(), DigestError> {
    match value {
        Value::Table(table) => {
            for (name, value) in table {
                collect(&format!("{key}.{name}"), value, is_data, into)?;
            }
        }
        Value::String(text) if is_data => {
            into.insert(key.to_owned(), contents(text)?);
        }
        other => {
            into.insert(key.to_owned(), other.to_string().into_bytes());
        }
    }
    Ok(())
}

/// What a text of `[data]` stands for: the contents of a file, or itself.
fn contents(text: &str) -> Result<Vec<u8>, DigestError> {
    let path = Path::new(text);
    // A word such as "none" has no folder; the paths of a resolved recipe do.
    let is_path = path.components().count() > 1;
    if is_path && path.is_file() {
        return fs::read(path).map_err(|reason| DigestError::Unreadable {
            path: path.to_path_buf(),
            reason,
        });
    }
    let name = if is_path { path.file_name() } else { None };
    Ok(name.map_or_else(
        || text.as_bytes().to_vec(),
        |name| name.to_string_lossy().into_owned().into_bytes(),
    ))
}

/// Feeds kind, name and value, each after its length: no two lists of pieces give the same bytes.
fn feed(hash: &mut Sha256, kind: &str, name: &[u8], value: &[u8]) {
    for piece in [kind.as_bytes(), name, value] {
        hash.update((piece.len() as u64).to_le_bytes());
        hash.update(piece);
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: FramePair = FramePair { from: 0, to: 18 };

    fn digest(recipe: &str, sequence: &[u8], pair: FramePair, samples: &str) -> String {
        let inputs = Inputs {
            recipe,
            sequence,
            pair,
            settings: &[("samples", samples.to_owned())],
        };
        inputs.digest().expect("a recipe")
    }

    #[test]
    fn the_digest_changes_with_everything_that_decides_the_result() {
        let recipe = "preset = \"quick\"\n[training]\nsteps = 100\n";
        let first = digest(recipe, b"frames", PAIR, "1000");
        assert_eq!(first.len(), 64);
        let others = [
            digest(&recipe.replace("100", "101"), b"frames", PAIR, "1000"),
            digest(&recipe.replace("quick", "paper"), b"frames", PAIR, "1000"),
            digest(recipe, b"Frames", PAIR, "1000"),
            digest(recipe, b"frames", FramePair { from: 0, to: 19 }, "1000"),
            digest(recipe, b"frames", PAIR, "1001"),
        ];
        assert!(!others.contains(&first));
    }

    #[test]
    fn comments_order_and_checkpoints_do_not_count() {
        let one = "preset = \"quick\"\n[training]\nsteps = 1\nseed = 2\n[checkpoint]\nkeep = 1\n";
        let other = "# why\npreset = \"quick\"\n[checkpoint]\nkeep = 9\n\
                     [training]\nseed = 2 # or\nsteps = 1\n";
        assert_eq!(digest(one, b"", PAIR, ""), digest(other, b"", PAIR, ""));
    }

    #[test]
    fn a_data_file_counts_by_its_contents_and_not_by_its_folder() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let recipe = |name: &str, text: &str| {
            let path = folder.path().join(name).join("pairs.csv");
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(&path, text).expect("written");
            format!("[data]\ncorrespondences = '{}'\n", path.display())
        };
        let here = digest(&recipe("here", "0,1"), b"", PAIR, "");
        assert_eq!(here, digest(&recipe("there", "0,1"), b"", PAIR, ""));
        assert_ne!(here, digest(&recipe("here", "0,2"), b"", PAIR, ""));
    }

    #[test]
    fn a_path_without_a_file_counts_by_its_name() {
        let source = |path: &str| digest(&format!("[data]\nsource = '{path}'\n"), b"", PAIR, "");
        assert_eq!(source("/none/here/a.ply"), source("/none/there/a.ply"));
        assert_ne!(source("/none/here/a.ply"), source("/none/here/b.ply"));
    }

    #[test]
    fn the_hash_is_sha_256() {
        // The test vector of FIPS 180-2 for "abc".
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(hexadecimal(&Sha256::digest(b"abc")), expected);
    }
}
