//! Points of a mesh of several closed parts that lie on the outside of all of them.
//!
//! Characters are often made of parts that pass through each other. Faces inside another part are no surface of the
//! whole: trained on, they make pockets inside it. A point is hidden where the winding number just outside of its face
//! exceeds one half (Jacobson, Kavan and Sorkine-Hornung, "Robust inside-outside segmentation using generalized
//! winding numbers", 2013).

use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::sample::{SurfaceSamples, sample_surface};
use crate::geometry::linear::difference;
use crate::geometry::{EdgeSharing, Mesh, TriangleSearch};

/// How far outside of its face a point is looked from, as a share of the square root of the area.
const OUTSIDE: f64 = 5e-4;

/// So many samples of the surface, none of them hidden in another part; and the share of the surface that is.
pub(super) fn sample_exposed(
    mesh: &Mesh<f64>,
    count: usize,
    rng: &mut ChaCha8Rng,
) -> (SurfaceSamples, f64) {
    let first = sample_surface(mesh, count, rng);
    let Some(outside) = Outside::of(mesh) else {
        return (first, 0.0);
    };
    let mut seen = outside.of_samples(&first);
    let kept = seen.iter().filter(|seen| **seen).count();
    if kept == count || kept == 0 {
        return (first, 0.0);
    }
    let hidden = 1.0 - kept as f64 / count as f64;
    let mut all = first;
    // As many more as make up for those that are hidden, and some.
    while seen.iter().filter(|seen| **seen).count() < count {
        let more = sample_surface(mesh, count, rng);
        seen.extend(outside.of_samples(&more));
        all.points.extend(more.points);
        all.normals.extend(more.normals);
        all.faces.extend(more.faces);
        all.barycentric.extend(more.barycentric);
    }
    let chosen: Vec<usize> = (0..seen.len()).filter(|k| seen[*k]).take(count).collect();
    let samples = SurfaceSamples {
        points: chosen.iter().map(|&k| all.points[k]).collect(),
        normals: chosen.iter().map(|&k| all.normals[k]).collect(),
        faces: chosen.iter().map(|&k| all.faces[k]).collect(),
        barycentric: chosen.iter().map(|&k| all.barycentric[k]).collect(),
    };
    (samples, hidden)
}

/// What lies outside of all parts of a mesh.
struct Outside {
    search: TriangleSearch,
    /// The mesh is searched near the origin, with an area of 1, in single precision.
    origin: [f64; 3],
    scale: f64,
}

impl Outside {
    /// Of a closed mesh of more than one part; of others nothing is known to be hidden.
    fn of(mesh: &Mesh<f64>) -> Option<Self> {
        if !EdgeSharing::of(mesh).is_closed() || mesh.components_by_place().len() < 2 {
            return None;
        }
        let (origin, scale) = (mesh.vertices[0], mesh.area().sqrt().recip());
        let near = mesh.moved(|x| placed(x, origin, scale));
        Some(Self {
            search: TriangleSearch::new(&near)?,
            origin,
            scale,
        })
    }

    /// Whether each sample is seen from outside.
    fn of_samples(&self, samples: &SurfaceSamples) -> Vec<bool> {
        let each = samples.points.par_iter().zip(&samples.normals);
        each.map(|(x, normal)| {
            let x = placed(*x, self.origin, self.scale);
            let before = [0, 1, 2].map(|k| x[k] + OUTSIDE as f32 * normal[k]);
            self.search.winding(before) <= 0.5
        })
        .collect()
    }
}

fn placed(x: [f64; 3], origin: [f64; 3], scale: f64) -> [f32; 3] {
    difference(x, origin).map(|part| (part * scale) as f32)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::geometry::testing::{cuboid, together};

    fn sampled(mesh: &Mesh<f64>) -> (SurfaceSamples, f64) {
        sample_exposed(mesh, 2000, &mut ChaCha8Rng::seed_from_u64(1))
    }

    #[test]
    fn faces_within_another_part_have_no_samples() {
        // Two bars that cross: each has a middle inside the other. Far from the origin, as maps are.
        let away = |x: [f64; 3]| [x[0] + 4e5, x[1] - 5e6, x[2]];
        let one = cuboid([3.0, 1.0, 1.0]).moved(away);
        let other = cuboid([1.0, 3.0, 1.2]).moved(|[x, y, z]| away([x + 1.0, y - 1.0, z - 0.1]));
        let (samples, hidden) = sampled(&together(&[one, other]));
        assert_eq!(samples.points.len(), 2000);
        // Four faces of 1 by 1 of the first lie in the second, two of 1 by 1 of the second in the first.
        let share = 6.0 / (14.0 + 2.0 * (3.0 + 1.2 + 3.6));
        assert!((hidden - share).abs() < 0.03, "{hidden}, not {share}");
        for point in &samples.points {
            let [x, y, z] = [point[0] - 4e5, point[1] + 5e6, point[2]];
            let in_first = x > 0.01 && x < 2.99 && y > 0.01 && y < 0.99 && z > 0.01 && z < 0.99;
            let in_other = x > 1.01 && x < 1.99 && y > -0.99 && y < 1.99 && z > -0.09 && z < 1.09;
            assert!(!in_first && !in_other, "{x} {y} {z}");
        }
    }

    #[test]
    fn the_wall_of_a_hollow_and_parts_apart_are_seen() {
        let ball = cuboid([2.0; 3]);
        let mut inner = cuboid([1.0; 3]).moved(|x| x.map(|part| part + 0.5));
        inner.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let apart = ball.moved(|[x, y, z]| [x + 5.0, y, z]);
        let hollow = together(&[ball.clone(), inner]);
        let two = together(&[ball.clone(), apart]);
        for mesh in [hollow, two, ball] {
            assert_eq!(sampled(&mesh).1, 0.0);
        }
    }
}
