//! Times on the command line.

use isomorph::Trained;

use super::{Failure, Result};

/// The word for the times of all key frames.
const KEYS: &str = "keys";

/// The times that are given, or so many even ones.
pub(super) fn times_of(trained: &Trained, given: &[String], frames: usize) -> Result<Vec<f64>> {
    match given {
        [] => Ok(trained.even_times(frames)),
        [word] if word == KEYS => Ok(trained.key_times()),
        given => given.iter().map(|text| number(text)).collect(),
    }
}

fn number(text: &str) -> Result<f64> {
    text.trim().parse().map_err(|_not_a_number| {
        Failure::Usage(format!(
            "--times {text}: must be numbers with commas between them, or {KEYS}"
        ))
    })
}
