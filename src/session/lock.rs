//! One process for a run: the folder is locked while it is trained in.
//!
//! The lock is the system's own on the file `.lock`, which ends with the process however that ends. Its text names
//! the process for others.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Seek, Write};
use std::path::Path;
use std::time::SystemTime;

use super::folder::FolderError;

/// The file in the folder of a run.
pub(super) const FILE: &str = ".lock";

/// The right to train in a folder, until it is dropped.
#[derive(Debug)]
pub(super) struct RunLock {
    /// None where the file system has no locks.
    _file: Option<File>,
    /// Why there is none.
    note: Option<String>,
}

impl RunLock {
    /// Takes it; the folder is there.
    ///
    /// # Errors
    /// [`FolderError::Busy`] if another process has it, [`FolderError::Io`].
    pub(super) fn take(folder: &Path) -> Result<Self, FolderError> {
        let refused = |reason| FolderError::Io {
            path: folder.join(FILE),
            reason,
        };
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(folder.join(FILE))
            .map_err(refused)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                // It only says who; a lock without it is one all the same.
                let holder = std::fs::read_to_string(folder.join(FILE)).unwrap_or_default();
                return Err(FolderError::Busy {
                    path: folder.to_path_buf(),
                    holder: match holder.trim() {
                        "" => "another process".to_owned(),
                        holder => holder.to_owned(),
                    },
                });
            }
            Err(TryLockError::Error(reason)) => {
                let note = format!(
                    "{}: cannot be locked ({reason}); make sure that no other process trains this run",
                    folder.display()
                );
                return Ok(Self {
                    _file: None,
                    note: Some(note),
                });
            }
        }
        sign(&mut file).map_err(refused)?;
        Ok(Self {
            _file: Some(file),
            note: None,
        })
    }

    /// What to say where the file system has no locks.
    pub(super) fn note(&self) -> Option<String> {
        self.note.clone()
    }
}

/// Writes who has the lock.
fn sign(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.rewind()?;
    let since = humantime::format_rfc3339_seconds(SystemTime::now().max(SystemTime::UNIX_EPOCH));
    writeln!(
        file,
        "process {}{} since {since}",
        std::process::id(),
        on_host()
    )
}

#[cfg(unix)]
fn on_host() -> String {
    let name = nix::unistd::gethostname().unwrap_or_default();
    match name.to_string_lossy() {
        name if name.is_empty() => String::new(),
        name => format!(" on {name}"),
    }
}

#[cfg(not(unix))]
fn on_host() -> String {
    String::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_one_is_refused_with_the_name_of_the_first_until_that_ends() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let first = RunLock::take(folder.path()).expect("free");
        assert_eq!(first.note(), None);
        let refused = RunLock::take(folder.path()).expect_err("taken").to_string();
        let own = format!("process {}", std::process::id());
        assert!(refused.contains(&own), "{refused}");
        drop(first);
        RunLock::take(folder.path()).expect("free again");
    }
}
