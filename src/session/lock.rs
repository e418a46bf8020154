//! One process for a run: the folder is locked while it is trained in.
//!
//! The lock is the system's own on the file `.lock`, which ends with the process however that ends. Its text names
//! the process for others. Network file systems may have no locks, or locks that other machines do not see: so the
//! process also touches the file every few seconds, and one on another machine that was seen a short while ago counts as
//! alive. A process that has ended, or was not seen for a minute, is taken over from.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Seek, Write};
use std::path::Path;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

use super::folder::FolderError;

/// The file in the folder of a run.
pub(super) const FILE: &str = ".lock";

/// How often the file is touched.
const BEAT: Duration = Duration::from_secs(10);

/// A process on another machine that has not touched the file for so long is gone.
const STALE: Duration = Duration::from_secs(60);

/// The right to train in a folder, until it is dropped.
#[derive(Debug)]
pub(super) struct RunLock {
    /// Locked, where the file system has locks.
    file: File,
    beat: Option<(Sender<()>, JoinHandle<()>)>,
    /// What to say of it.
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
        let busy = |holder| FolderError::Busy {
            path: folder.to_path_buf(),
            holder,
        };
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(folder.join(FILE))
            .map_err(refused)?;
        let mut note = None;
        match file.try_lock() {
            Ok(()) => {}
            // Its text only says who; a lock without it is one all the same.
            Err(TryLockError::WouldBlock) => {
                return Err(busy(
                    named(folder).unwrap_or_else(|| "another process".to_owned()),
                ));
            }
            Err(TryLockError::Error(reason)) => {
                note = Some(format!(
                    "{}: the file system has no locks ({reason}); processes on other machines are noticed by the file \
                     {FILE} alone",
                    folder.display()
                ));
            }
        }
        if let Some(before) = named(folder) {
            if is_elsewhere_and_alive(&before, &file) {
                return Err(busy(before));
            }
            note.get_or_insert_with(|| format!("{before} was killed: its run is taken over"));
        }
        sign(&mut file).map_err(refused)?;
        let beat = file.try_clone().ok().map(beating);
        Ok(Self { file, beat, note })
    }

    /// What to say of it: that it was taken over, or that the file system has no locks.
    pub(super) fn note(&self) -> Option<String> {
        self.note.clone()
    }
}

impl Drop for RunLock {
    fn drop(&mut self) {
        if let Some((end, thread)) = self.beat.take() {
            drop(end);
            let _ = thread.join();
        }
        // Nothing to take over for whoever comes next.
        let _ = self.file.set_len(0);
    }
}

/// Who trains in a folder just now.
pub(super) fn holder(folder: &Path) -> Option<String> {
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .open(folder.join(FILE))
        .or_else(|_| File::open(folder.join(FILE)))
        .ok()?;
    let name = named(folder);
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => name.or_else(|| Some("another process".to_owned())),
        // Given back as the file is closed.
        _ => name.filter(|name| is_elsewhere_and_alive(name, &file)),
    }
}

/// Who the file names.
fn named(folder: &Path) -> Option<String> {
    let text = std::fs::read_to_string(folder.join(FILE)).ok()?;
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

/// Whether a process of another machine has touched the file a short while ago.
fn is_elsewhere_and_alive(name: &str, file: &File) -> bool {
    let own = on_host();
    let is_here = own.is_empty() || name.contains(&format!("{own} since"));
    let touched = file.metadata().and_then(|found| found.modified());
    let Ok(touched) = touched else {
        return false;
    };
    let now = SystemTime::now();
    // Clocks of two machines differ, either way.
    let apart = now
        .duration_since(touched)
        .unwrap_or_else(|ahead| ahead.duration());
    !is_here && apart < STALE
}

/// Touches the file from time to time until the sender goes.
fn beating(file: File) -> (Sender<()>, JoinHandle<()>) {
    let (end, ended) = mpsc::channel();
    let thread = std::thread::spawn(move || {
        while ended.recv_timeout(BEAT) == Err(RecvTimeoutError::Timeout) {
            // A file system that refuses leaves the system's lock.
            let _ = file.set_modified(SystemTime::now());
        }
    });
    (end, thread)
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
    )?;
    file.set_modified(SystemTime::now())
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

    #[test]
    fn a_process_of_another_machine_counts_until_it_was_not_seen_for_a_minute() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join(FILE);
        let elsewhere = "process 7 on another-machine since 2026-01-01T00:00:00Z";
        std::fs::write(&path, elsewhere).expect("a file");
        let refused = RunLock::take(folder.path()).expect_err("seen just now");
        assert!(refused.to_string().contains("another-machine"), "{refused}");
        assert_eq!(holder(folder.path()).as_deref(), Some(elsewhere));
        let long_ago = SystemTime::now() - 2 * STALE;
        let file = OpenOptions::new().write(true).open(&path).expect("a file");
        file.set_modified(long_ago).expect("a time");
        assert_eq!(holder(folder.path()), None);
        let lock = RunLock::take(folder.path()).expect("gone");
        let note = lock.note().expect("said");
        assert!(
            note.contains("another-machine") && note.ends_with("taken over"),
            "{note}"
        );
        drop(lock);
        // What ended well leaves nothing to take over.
        assert_eq!(RunLock::take(folder.path()).expect("free").note(), None);
    }

    #[test]
    fn one_that_was_killed_on_this_machine_is_taken_over_at_once() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let own = format!("process 1{} since then", on_host());
        std::fs::write(folder.path().join(FILE), own).expect("a file");
        assert_eq!(holder(folder.path()), None);
        let lock = RunLock::take(folder.path()).expect("gone");
        assert!(lock.note().is_some_and(|note| note.contains("process 1 ")));
        assert!(holder(folder.path()).is_some_and(|name| name.contains("process")));
    }
}
