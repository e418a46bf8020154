//! Area-uniform points on a triangle mesh.
//!
//! A triangle is drawn with probability `area / total area`, then a point in it: with `r, s`
//! uniform in [0, 1), the barycentric coordinates `(1 - sqrt r, sqrt r (1 - s), sqrt r s)` are
//! uniform over the triangle.

use rand::{Rng, RngExt};

use crate::geometry::Mesh;
use crate::geometry::linear::{length, unit};

/// Points on a surface and where on it they are; all lists have the same length.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SurfaceSamples {
    /// Positions, in the coordinates of the mesh.
    pub points: Vec<[f64; 3]>,
    /// Unit normals of the triangles that they lie on.
    pub normals: Vec<[f32; 3]>,
    /// The triangles that they lie on.
    pub faces: Vec<u32>,
    /// Their weights on the corners of these triangles; each triple sums to 1.
    pub barycentric: Vec<[f32; 3]>,
}

/// Draws `count` independent points uniformly by area.
///
/// A triangle without area is never chosen. The same generator gives the same points on every
/// platform: only IEEE arithmetic and square roots are used.
///
/// # Panics
/// If the mesh has no area, or indices out of range: a [`Shape`](crate::formats::Shape) that was read has neither.
pub(crate) fn sample_surface(mesh: &Mesh<f64>, count: usize, rng: &mut impl Rng) -> SurfaceSamples {
    let triangles = &mesh.triangles;
    let mut total = 0.0;
    let mut running = Vec::with_capacity(triangles.len());
    for &triangle in triangles {
        total += length(mesh.area_vector(triangle));
        running.push(total);
    }
    assert!(
        total > 0.0,
        "cannot sample a mesh of {} triangles without area",
        triangles.len()
    );
    let mut samples = SurfaceSamples {
        points: Vec::with_capacity(count),
        normals: Vec::with_capacity(count),
        faces: Vec::with_capacity(count),
        barycentric: Vec::with_capacity(count),
    };
    for _ in 0..count {
        let height = rng.random::<f64>() * total;
        // The first triangle whose running area exceeds the height: one without area never does,
        // as its running area is that of the triangle before. A product below 1 times the total
        // stays below the total, so there always is one.
        let face = running.partition_point(|&area| area <= height);
        let weights = uniform_barycentric(rng);
        samples
            .points
            .push(point_at(mesh, triangles[face], weights));
        samples
            .normals
            .push(unit(mesh.area_vector(triangles[face])));
        samples.faces.push(face as u32);
        samples
            .barycentric
            .push(weights.map(|weight| weight as f32));
    }
    samples
}

/// Barycentric coordinates uniform over a triangle.
fn uniform_barycentric(rng: &mut impl Rng) -> [f64; 3] {
    let (root, split) = (rng.random::<f64>().sqrt(), rng.random::<f64>());
    [1.0 - root, root * (1.0 - split), root * split]
}

/// The point of a triangle at these barycentric coordinates.
///
/// Reckoned from the first corner, whose own weight is what the others leave: far from the origin
/// the rounding of weights that sum to nearly 1 would move the point by their error times the
/// distance.
pub(super) fn point_at(mesh: &Mesh<f64>, triangle: [u32; 3], weights: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = mesh.corners(triangle);
    let [_, second, third] = weights;
    [0, 1, 2].map(|axis| a[axis] + second * (b[axis] - a[axis]) + third * (c[axis] - a[axis]))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::geometry::linear::difference;

    /// A 3 x 1 strip in the plane z = 2 of three triangles with areas 0, 1/2 and 1, and a point.
    fn strip() -> Mesh<f64> {
        let vertices = vec![
            [0.0, 0.0, 2.0],
            [1.0, 0.0, 2.0],
            [0.0, 1.0, 2.0],
            [1.0, 0.0, 2.0],
            [3.0, 0.0, 2.0],
            [3.0, 1.0, 2.0],
        ];
        Mesh::new(vertices, vec![[0, 1, 1], [0, 1, 2], [3, 4, 5], [2, 2, 2]])
    }

    #[test]
    fn triangles_are_chosen_by_area_and_degenerate_ones_never() {
        let strip = strip();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let count = 30_000;
        let samples = sample_surface(&strip, count, &mut rng);
        let share = |face| {
            samples.faces.iter().filter(|&&found| found == face).count() as f64 / count as f64
        };
        assert_eq!([share(0), share(3)], [0.0, 0.0]);
        // Standard deviation of a share of 1/3 over 30,000 draws is 0.0027: allow five.
        assert!((share(1) - 1.0 / 3.0).abs() < 0.014, "{}", share(1));
        assert!(
            samples
                .normals
                .iter()
                .all(|&normal| normal == [0.0, 0.0, 1.0])
        );
    }

    #[test]
    fn points_fill_each_triangle_evenly_and_match_their_barycentric_coordinates() {
        let mut strip = strip();
        strip.triangles = vec![strip.triangles[1]];
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let samples = sample_surface(&strip, 30_000, &mut rng);
        let mean = |axis| samples.points.iter().map(|p| p[axis]).sum::<f64>() / 30_000.0;
        // The centroid is (1/3, 1/3); a coordinate deviates by 0.236, its mean by 0.0014: five.
        assert!((mean(0) - 1.0 / 3.0).abs() < 0.007 && (mean(1) - 1.0 / 3.0).abs() < 0.007);
        for (point, weights) in samples.points.iter().zip(&samples.barycentric) {
            let again = point_at(&strip, strip.triangles[0], weights.map(f64::from));
            // The weights are rounded to float32 and the corners are at most 3 away.
            assert!(length(difference(*point, again)) < 1e-6);
        }
    }

    #[test]
    fn a_seed_names_the_same_points_everywhere() {
        let strip = strip();
        let draw = |seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            sample_surface(&strip, 3, &mut rng)
        };
        assert_eq!(draw(7), draw(7));
        assert_ne!(draw(7), draw(8));
        // Written down once (rand_chacha 0.10, x86-64): a change would change every run.
        let golden: Vec<[u64; 3]> = draw(7)
            .points
            .iter()
            .map(|point| point.map(f64::to_bits))
            .collect();
        assert_eq!(golden, GOLDEN);
    }

    const GOLDEN: [[u64; 3]; 3] = [
        [
            0x3fbf_076a_0550_61f3,
            0x3fd2_7960_21b7_5e4b,
            0x4000_0000_0000_0000,
        ],
        [
            0x4004_6813_32d8_bb11,
            0x3fd1_d579_05c3_2a0f,
            0x4000_0000_0000_0000,
        ],
        [
            0x3fe2_bdf9_9d31_5b95,
            0x3fd5_7f0a_4e86_5171,
            0x4000_0000_0000_0000,
        ],
    ];
}
