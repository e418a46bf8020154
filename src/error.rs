//! What can go wrong, as one type: a sentence for people, and a kind that decides what a program does next.
//!
//! Every error inside the library becomes an [`Error`] in `kinds.rs`, where alone its kind is decided.

use std::fmt;

/// What kind of thing went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// What was requested cannot be: a recipe, an option, a folder, a time. Change the request.
    Usage,
    /// A file is not what it should be. Change the file.
    Input,
    /// The work could not be done: a disk is full, a device fails, a term is not a number.
    Failure,
    /// The caller stopped the work. What was done is in the newest checkpoint.
    Interruption,
}

impl ErrorKind {
    /// The exit status of a program that ends with it: 2 usage, 130 interrupted, else 1.
    pub const fn exit_status(self) -> u8 {
        match self {
            Self::Usage => 2,
            Self::Input | Self::Failure => 1,
            Self::Interruption => 130,
        }
    }
}

/// What went wrong, in one sentence: where, what (found, allowed), and what to do.
#[derive(Debug)]
pub struct Error {
    kind: ErrorKind,
    message: String,
    source: Option<Box<dyn std::error::Error + Send + Sync>>,
}

/// What most functions of this library return.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// What kind it is of.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Of what the caller requested.
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::Usage,
            message: message.into(),
            source: None,
        }
    }

    /// The work could not be done.
    pub(crate) fn failure(error: impl fmt::Display) -> Self {
        Self {
            kind: ErrorKind::Failure,
            message: error.to_string(),
            source: None,
        }
    }

    /// The caller stopped the work.
    pub(crate) fn interruption(message: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::Interruption,
            message: message.into(),
            source: None,
        }
    }

    /// The error inside the library that this one comes from.
    pub(crate) fn cause(&self) -> Option<&(dyn std::error::Error + Send + Sync + 'static)> {
        self.source.as_deref()
    }

    /// The same error about a part of the work: `part: message`.
    #[must_use]
    pub(crate) fn within(self, part: &str) -> Self {
        Self {
            message: format!("{part}: {}", self.message),
            ..self
        }
    }

    /// An error of this kind with its cause.
    pub(crate) fn of(
        kind: ErrorKind,
        error: impl std::error::Error + Send + Sync + 'static,
    ) -> Self {
        Self {
            kind,
            message: error.to_string(),
            source: Some(Box::new(error)),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        // The message is that of the first cause: the chain goes on behind it.
        self.source.as_deref().and_then(std::error::Error::source)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kind_decides_the_exit_status_and_a_part_of_the_work_is_named_once() {
        let error = Error::usage("t = 2: must be 0 to 1").within("method quick");
        assert_eq!(error.to_string(), "method quick: t = 2: must be 0 to 1");
        assert_eq!(
            (error.kind(), error.kind().exit_status()),
            (ErrorKind::Usage, 2)
        );
        let stopped = Error::interruption("stopped").kind().exit_status();
        assert_eq!(stopped, 130);
        let refused: Error = std::io::Error::other("disk full").into();
        assert_eq!(
            (refused.kind(), refused.kind().exit_status()),
            (ErrorKind::Failure, 1)
        );
    }
}
