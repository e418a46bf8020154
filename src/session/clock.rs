//! Times as the user gives and reads them, and as the rest of the program counts them: from 0 to 1.

use crate::error::{Error, Result};
use crate::recipe::Recipe;

/// The time of the first and of the last key frame, in the recipe's own unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clock {
    first: f64,
    last: f64,
}

impl Clock {
    pub(super) fn of(recipe: &Recipe) -> Self {
        let keys = &recipe.data.keyframes;
        Self {
            first: keys[0].time,
            last: keys[keys.len() - 1].time,
        }
    }

    /// The first and the last time.
    pub(super) fn span(self) -> [f64; 2] {
        [self.first, self.last]
    }

    /// How long it is from the first to the last key frame.
    pub(super) fn length(self) -> f64 {
        self.last - self.first
    }

    /// A time of the user's as one from 0 to 1.
    ///
    /// # Errors
    /// A time that is not between the first and the last key frame.
    pub(super) fn unit(self, time: f64) -> Result<f64> {
        if (self.first..=self.last).contains(&time) {
            // Exactly 1 at the last, whatever is rounded.
            return Ok(((time - self.first) / self.length()).min(1.0));
        }
        let [first, last] = self.span();
        let ends = match self.span() {
            [0.0, 1.0] => ["the source", "the target"],
            _ => ["the first shape", "the last"],
        };
        Err(Error::usage(format!(
            "time {time}: must be {first} to {last} ({first} is {}, {last} {})",
            ends[0], ends[1]
        )))
    }

    /// A time from 0 to 1 as one of the user's.
    pub(super) fn own(self, unit: f64) -> f64 {
        if unit == 1.0 {
            return self.last;
        }
        self.first + unit * self.length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_the_user_are_brought_to_0_to_1_and_back() {
        let clock = Clock {
            first: 10.0,
            last: 64.0,
        };
        assert_eq!(clock.unit(10.0).expect("within"), 0.0);
        assert_eq!(clock.unit(37.0).expect("within"), 0.5);
        assert_eq!(clock.unit(64.0).expect("within"), 1.0);
        assert_eq!(
            (clock.own(0.0), clock.own(0.5), clock.own(1.0)),
            (10.0, 37.0, 64.0)
        );
        let refused = clock.unit(0.5).expect_err("before the first").to_string();
        assert_eq!(
            refused,
            "time 0.5: must be 10 to 64 (10 is the first shape, 64 the last)"
        );
        assert!(clock.unit(f64::NAN).is_err());
        let usual = Clock {
            first: 0.0,
            last: 1.0,
        };
        let refused = usual.unit(2.0).expect_err("after the last").to_string();
        assert_eq!(
            refused,
            "time 2: must be 0 to 1 (0 is the source, 1 the target)"
        );
    }
}
