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

/// The same where the intervals between the first `known` key frames are learned already: every other step is made in one
/// of the others.
pub(crate) fn turn_among(seed: u64, step: usize, count: usize, known: usize) -> usize {
    let learned = known.saturating_sub(1);
    if learned == 0 || learned >= count {
        return turn(seed, step, count);
    }
    match step % 2 {
        0 => learned + turn(seed, step / 2, count - learned),
        _ => turn(seed, step / 2, learned),
    }
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

    #[test]
    fn every_other_step_is_of_intervals_that_are_not_learned() {
        let turns: Vec<usize> = (0..12).map(|step| turn_among(3, step, 8, 7)).collect();
        let of = |parity: usize| {
            let mut all: Vec<usize> = turns.iter().copied().skip(parity).step_by(2).collect();
            all.sort_unstable();
            all
        };
        assert_eq!(of(0), [6, 6, 6, 7, 7, 7]);
        assert_eq!(of(1), [0, 1, 2, 3, 4, 5]);
        for known in [0, 9] {
            let all = (0..16).map(|step| turn_among(3, step, 8, known));
            assert!(all.eq((0..16).map(|step| turn(3, step, 8))));
        }
    }
}
