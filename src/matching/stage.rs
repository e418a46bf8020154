//! What matching is about, while it works.

use std::fmt;

/// A stage of the search for pairs, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MatchStage {
    /// Points and nodes are spread over both surfaces.
    Surfaces,
    /// The rigid motion to begin with is looked for.
    Alignment,
    /// Each surface is laid onto the other.
    Registration,
    /// Pairs are taken from the registrations and measured.
    Pairs,
}

impl fmt::Display for MatchStage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Surfaces => "surfaces",
            Self::Alignment => "rigid alignment",
            Self::Registration => "registration in both directions",
            Self::Pairs => "pairs",
        })
    }
}

/// Calls with the stage, how many of its steps are done, and how many there are: 0 as a stage
/// begins, all as it ends.
pub(crate) type Report<'a> = dyn FnMut(MatchStage, usize, usize) + 'a;
