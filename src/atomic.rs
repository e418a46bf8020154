//! Whole files or none: every file that isomorph leaves under a final name is first written
//! beside it under a temporary one, flushed to the disk, and then renamed.

use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::Path;
use std::time::Duration;

/// What the names of temporary files begin with.
const TEMPORARY: &str = ".isomorph-";

/// No file takes as long to be written.
const OLD: Duration = Duration::from_secs(3600);

/// Whether a file of this name is what a killed [`write_atomically`] left behind.
pub(crate) fn is_left_over(name: &std::ffi::OsStr) -> bool {
    name.to_string_lossy().starts_with(TEMPORARY)
}

/// Deletes what killed processes left in a folder, and what is too old to be another's work in progress.
pub(crate) fn sweep(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let age = entry.metadata().and_then(|found| found.modified());
        let age = age.ok().and_then(|written| written.elapsed().ok());
        if is_left_over(&entry.file_name()) && age.is_some_and(|age| age > OLD) {
            // Only unused space is at stake: not worth stopping for.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Writes a file so that `path` holds either what it held before or all of what `write` writes.
///
/// Missing parent directories are created. On any error the temporary file is removed.
///
/// # Errors
/// What `write` returns, or what the file system says; the message names `path`.
pub(crate) fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let folder = folder_of(path);
    let whole = || -> io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let temporary = tempfile::Builder::new()
            .prefix(TEMPORARY)
            .tempfile_in(folder)?;
        let mut buffered = BufWriter::with_capacity(1 << 16, temporary.as_file());
        write(&mut buffered)?;
        buffered.flush()?;
        drop(buffered);
        temporary.as_file().sync_all()?;
        make_readable(temporary.as_file())?;
        temporary.persist(path).map_err(|refused| refused.error)?;
        flush_folder(folder)
    };
    whole().map_err(|error| naming(path, &error))
}

/// Whether [`write_atomically`] could write this file now, so that long work does not begin in vain. The parent
/// directory is created if it is missing.
///
/// # Errors
/// What the file system says, or that `path` is a folder; the message names `path`.
pub(crate) fn check_writable(path: &Path) -> io::Result<()> {
    let folder = folder_of(path);
    let tried = || -> io::Result<()> {
        if path.is_dir() {
            return Err(io::Error::other("is a folder, not a file"));
        }
        std::fs::create_dir_all(folder)?;
        let mut probe = tempfile::Builder::new();
        probe.prefix(TEMPORARY).tempfile_in(folder).map(drop)
    };
    tried().map_err(|error| naming(path, &error))
}

/// Makes the names in a folder as durable as the files, where the file system can.
///
/// # Errors
/// What the file system says, unless it says that it cannot.
pub(crate) fn flush_folder(path: &Path) -> io::Result<()> {
    if cfg!(unix) {
        let flushed = std::fs::File::open(path)?.sync_all();
        match flushed.as_ref().map_err(io::Error::kind) {
            Err(ErrorKind::InvalidInput | ErrorKind::Unsupported) => Ok(()),
            _ => flushed,
        }
    } else {
        Ok(())
    }
}

/// The folder that a file lies in.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// The same error with the file's name before it.
fn naming(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

/// Temporary files are private to their owner; a result is an ordinary file.
#[cfg(unix)]
fn make_readable(file: &std::fs::File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_file: &std::fs::File) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("deep/result.txt");
        write_atomically(&path, |out| out.write_all(b"first")).expect("a first write");
        let refused = write_atomically(&path, |out| {
            out.write_all(b"half of the sec")?;
            Err(io::Error::other("the disk is full"))
        });
        let message = refused.expect_err("the write failed").to_string();
        assert!(
            message.contains("result.txt") && message.contains("disk is full"),
            "{message}"
        );
        assert_eq!(std::fs::read(&path).expect("still there"), b"first");
        let left = std::fs::read_dir(path.parent().expect("a parent"))
            .expect("a folder")
            .count();
        assert_eq!(left, 1, "the temporary file is gone");
    }

    #[test]
    fn what_was_left_long_ago_is_deleted_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let old = std::time::SystemTime::now() - 2 * OLD;
        for (name, written) in [
            (".isomorph-a", Some(old)),
            (".isomorph-b", None),
            ("mine", Some(old)),
        ] {
            let file = std::fs::File::create(folder.path().join(name)).expect("a file");
            written
                .into_iter()
                .for_each(|at| file.set_modified(at).expect("a time"));
        }
        sweep(folder.path());
        let left = |name: &str| folder.path().join(name).exists();
        assert!(!left(".isomorph-a") && left(".isomorph-b") && left("mine"));
    }

    #[test]
    fn what_can_be_written_is_known_before_and_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("new/result.txt");
        check_writable(&path).expect("it can be written");
        let parent = path.parent().expect("a parent");
        assert_eq!(std::fs::read_dir(parent).expect("made").count(), 0);
        std::fs::write(folder.path().join("file"), "").expect("written");
        for (place, why) in [("new", "is a folder"), ("file/result.txt", "result.txt: ")] {
            let refused = check_writable(&folder.path().join(place));
            let message = refused.expect_err("refused").to_string();
            assert!(message.contains(why), "{message}");
        }
    }
}
