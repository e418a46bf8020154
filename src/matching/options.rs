//! How to match: what the flags of `isomorph match` set.

use super::MatchError;
use crate::shape::FEWEST_POINTS;

/// How to match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatchOptions {
    /// Points spread over each mesh, and the most that are taken of a cloud.
    pub points: usize,
    /// Points among them that move on their own; time grows with the square.
    pub nodes: usize,
    /// The shapes are in one frame: no rigid motion is looked for.
    pub aligned: bool,
    /// The least confidence that a pair must have, 0 to 1.
    pub least_confidence: f64,
    /// The most pairs to keep, spread evenly over the source; all without it.
    pub count: Option<usize>,
    /// Names the points that are drawn.
    pub seed: u64,
}

impl Default for MatchOptions {
    fn default() -> Self {
        Self {
            points: 20_000,
            nodes: 1500,
            aligned: false,
            least_confidence: 0.5,
            count: None,
            seed: 0,
        }
    }
}

impl MatchOptions {
    pub(super) fn checked(&self) -> Result<(), MatchError> {
        let refused = |option, found: String, allowed| {
            Err(MatchError::Option {
                option,
                found,
                allowed,
            })
        };
        if self.points < FEWEST_POINTS {
            return refused("points", self.points.to_string(), "64 or more");
        }
        if !(FEWEST_POINTS..=10_000).contains(&self.nodes) {
            return refused("nodes", self.nodes.to_string(), "64 to 10000");
        }
        if !(0.0..=1.0).contains(&self.least_confidence) {
            return refused("confidence", self.least_confidence.to_string(), "0 to 1");
        }
        if self.count == Some(0) {
            return refused("count", "0".to_owned(), "1 or more");
        }
        Ok(())
    }
}
