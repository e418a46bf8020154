//! The natural cubic spline through key frames: the smoothest curve through points that are known at each of them.

use super::Carried;
use super::vertex_path::VertexPath;
use crate::geometry::natural::shares;

/// The curves through the vertices of key frames, at times of one interval: `own` brings those to the time of the
/// keys.
pub(super) fn through(
    keys: &[f64],
    vertices: &Carried,
    times: &[f64],
    own: impl Fn(f64) -> f64,
) -> VertexPath {
    let at = |time: &f64| -> Vec<[f32; 3]> {
        let shares = shares(keys, own(*time));
        let count = vertices[0].len();
        let mut sums = vec![[0.0f64; 3]; count];
        for (share, known) in shares.iter().zip(vertices) {
            for (sum, x) in sums.iter_mut().zip(known) {
                for axis in 0..3 {
                    sum[axis] += share * f64::from(x[axis]);
                }
            }
        }
        sums.into_iter()
            .map(|x| x.map(|part| part as f32))
            .collect()
    };
    VertexPath {
        times: times.to_vec(),
        positions: times.iter().map(at).collect(),
    }
}
