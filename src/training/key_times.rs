//! The times of key frames: which interval a time lies in, and where in it.

/// The times of at least two key frames, ascending from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyTimes(Vec<f64>);

impl KeyTimes {
    /// At these times.
    ///
    /// # Panics
    /// If there are fewer than two.
    pub fn new(times: Vec<f64>) -> Self {
        assert!(times.len() >= 2, "{} key frames, 2 needed", times.len());
        Self(times)
    }

    /// How many intervals there are.
    pub fn intervals(&self) -> usize {
        self.0.len() - 1
    }

    /// The interval of a time: a key frame belongs to the one that begins there, the last to the one that ends there.
    /// Times beyond the ends belong to the first and the last.
    pub fn interval(&self, time: f64) -> usize {
        let after = self.0.partition_point(|key| *key <= time);
        after.saturating_sub(1).min(self.0.len() - 2)
    }

    /// A time within the interval `s`, 0 to 1; times beyond it are those of its ends.
    pub fn within(&self, s: usize, time: f64) -> f64 {
        ((time - self.0[s]) / self.length(s)).clamp(0.0, 1.0)
    }

    /// The length of the interval `s`.
    pub fn length(&self, s: usize) -> f64 {
        self.0[s + 1] - self.0[s]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_has_an_interval_and_a_place_in_it() {
        let times = KeyTimes::new(vec![0.0, 0.25, 1.0]);
        assert_eq!(times.intervals(), 2);
        let found = [-1.0, 0.0, 0.2, 0.25, 0.9, 1.0, 2.0].map(|time| times.interval(time));
        assert_eq!(found, [0, 0, 0, 1, 1, 1, 1]);
        assert_eq!(times.within(1, 0.625), 0.5);
        assert_eq!([times.within(1, 0.0), times.within(0, 0.7)], [0.0, 1.0]);
        assert_eq!(times.length(1), 0.75);
    }
}
