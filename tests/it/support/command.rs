//! Commands of many words.

/// The words of a command, and more arguments as they are.
pub(crate) fn with<'a>(command: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    command
        .split_whitespace()
        .chain(more.iter().copied())
        .collect()
}
