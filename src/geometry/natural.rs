//! The natural cubic spline through values at given times: the smoothest curve through them.

/// The share of each key's value in the curve at a time: the curve is linear in the values.
///
/// `keys` ascend. Beyond the first and the last of them the outermost cubics go on.
pub(crate) fn shares(keys: &[f64], t: f64) -> Vec<f64> {
    let count = keys.len();
    (0..count)
        .map(|key| {
            let unit: Vec<f64> = (0..count).map(|k| f64::from(u8::from(k == key))).collect();
            value(keys, &unit, &curvatures(keys, &unit), t)
        })
        .collect()
}

/// The second derivatives at the keys, 0 at both ends.
fn curvatures(keys: &[f64], values: &[f64]) -> Vec<f64> {
    let count = keys.len();
    let mut found = vec![0.0; count];
    let step = |k: usize| keys[k + 1] - keys[k];
    let slope = |k: usize| (values[k + 1] - values[k]) / step(k);
    // Thomas' algorithm on `h[k-1] m[k-1] + 2 (h[k-1] + h[k]) m[k] + h[k] m[k+1] = 6 (slope[k] - slope[k-1])`.
    let (mut upper, mut right) = (vec![0.0; count], vec![0.0; count]);
    for k in 1..count - 1 {
        let pivot = 2.0 * (step(k - 1) + step(k)) - step(k - 1) * upper[k - 1];
        upper[k] = step(k) / pivot;
        right[k] = (6.0 * (slope(k) - slope(k - 1)) - step(k - 1) * right[k - 1]) / pivot;
    }
    for k in (1..count - 1).rev() {
        found[k] = right[k] - upper[k] * found[k + 1];
    }
    found
}

fn value(keys: &[f64], values: &[f64], curvatures: &[f64], t: f64) -> f64 {
    let after = keys.partition_point(|key| *key <= t);
    let k = after.clamp(1, keys.len() - 1) - 1;
    let h = keys[k + 1] - keys[k];
    let (a, b) = ((keys[k + 1] - t) / h, (t - keys[k]) / h);
    a * values[k]
        + b * values[k + 1]
        + h * h / 6.0 * ((a.powi(3) - a) * curvatures[k] + (b.powi(3) - b) * curvatures[k + 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_meets_its_points_and_has_no_curvature_at_the_ends() {
        let keys = [0.0, 1.0, 3.0, 4.0];
        for (k, key) in keys.iter().enumerate() {
            for (j, share) in shares(&keys, *key).into_iter().enumerate() {
                assert!((share - f64::from(u8::from(j == k))).abs() < 1e-15);
            }
        }
        // Straight lines are reproduced: shares sum to 1, and so do their moments.
        for t in [0.2, 1.7, 3.9] {
            let shares = shares(&keys, t);
            let moment: f64 = shares
                .iter()
                .zip(keys)
                .map(|(share, key)| share * key)
                .sum();
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            assert!((moment - t).abs() < 1e-14);
        }
        // Keys at 0, 1, 2 with values 0, 1, 0: the curvature at 1 is -3, so that the value at 1/2 is 11/16.
        let share = shares(&[0.0, 1.0, 2.0], 0.5)[1];
        assert!((share - 11.0 / 16.0).abs() < 1e-15, "{share}");
    }
}
