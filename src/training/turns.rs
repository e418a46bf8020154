//! Which interval between two of many key frames a step is made in: all in turns, in another order each round.

use rand::seq::SliceRandom;

use crate::samples::{Purpose, stream};

/// The interval of a step, one of `count`. A function of seed and step alone, so that a resumed run has the same ones.
pub(crate) fn turn(seed: u64, step: usize, count: usize) -> usize {
    let (round, place) = (step / count, step % count);
    let mut order: Vec<usize> = (0..count).collect();
    order.shuffle(&mut stream(seed, round, Purpose::Turns));
    order[place]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_round_has_every_interval_once_in_an_order_of_its_own() {
        let round = |round: usize| -> Vec<usize> {
            (0..6).map(|place| turn(3, 6 * round + place, 6)).collect()
        };
        for k in 0..4 {
            let mut sorted = round(k);
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3, 4, 5]);
        }
        assert!((1..4).any(|k| round(k) != round(0)));
        assert_eq!(round(2), round(2));
    }
}
