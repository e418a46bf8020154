//! The pairs of frames on which the project reports: between the two the motion goes one way, so that
//! the ends determine what lies in between.

use super::plan::FramePair;

const fn pair(from: usize, to: usize) -> FramePair {
    FramePair { from, to }
}

/// The pairs by the name of the sequence.
const PAIRS: &[(&str, &[FramePair])] = &[
    ("fox_survey", &[pair(0, 18), pair(20, 47)]),
    ("bear_walk", &[pair(0, 16), pair(16, 30), pair(30, 47)]),
    ("human_raise_arms", &[pair(0, 26), pair(26, 53)]),
    ("human_male_to_heavy", &[pair(0, 10)]),
];

/// The protocol's pairs of a sequence, by its name (the file's name without ending); `None` for a
/// sequence of the user's own.
#[must_use]
pub fn protocol_pairs(sequence: &str) -> Option<&'static [FramePair]> {
    PAIRS
        .iter()
        .find(|(name, _)| *name == sequence)
        .map(|(_, pairs)| *pairs)
}

/// The sequences that have pairs of their own, for messages.
pub(super) fn known_sequences() -> String {
    let names: Vec<&str> = PAIRS.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}
