//! Groups of points with empty space between them.

use rustc_hash::FxHashMap;

/// The number of each point's part, counted from 0 in the order of their first points. Points of different parts are
/// at least so far apart; points of one part may be too, by up to twice the diagonal of a cube of that edge.
pub(crate) fn parts_apart(points: &[[f64; 3]], apart: f64) -> Vec<usize> {
    if apart.is_nan() || apart <= 0.0 {
        return vec![0; points.len()];
    }
    let cell =
        |point: &[f64; 3]| [0, 1, 2].map(|k| ((point[k] - points[0][k]) / apart).floor() as i64);
    let mut members: FxHashMap<[i64; 3], Vec<usize>> = FxHashMap::default();
    for (k, point) in points.iter().enumerate() {
        members.entry(cell(point)).or_default().push(k);
    }
    let mut part_of = vec![usize::MAX; points.len()];
    let mut next = 0;
    for k in 0..points.len() {
        if part_of[k] != usize::MAX {
            continue;
        }
        let mut waiting = vec![cell(&points[k])];
        while let Some(at) = waiting.pop() {
            // Taken out, so that each cell is seen once.
            let Some(inside) = members.remove(&at) else {
                continue;
            };
            inside.into_iter().for_each(|k| part_of[k] = next);
            let around = (0..27).map(|n| [n / 9, n / 3 % 3, n % 3]);
            waiting.extend(
                around.map(|by: [i64; 3]| [0, 1, 2].map(|k| at[k].saturating_add(by[k] - 1))),
            );
        }
        next += 1;
    }
    part_of
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_apart_are_parts_and_points_of_a_chain_are_one() {
        let at = |x: f64| [x, -7.0, 1e9];
        let points: Vec<[f64; 3]> = [0.0, 0.4, 50.0, 0.9, 50.5, -3.0, 1e18].map(at).to_vec();
        assert_eq!(parts_apart(&points, 0.5), [0, 0, 1, 0, 1, 2, 3]);
        assert_eq!(parts_apart(&points, 0.0), [0; 7]);
        assert_eq!(parts_apart(&[], 1.0), [0_usize; 0]);
    }
}
