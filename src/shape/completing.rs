//! Shapes that enclose nothing, with points of a surface that does: a shape that is known in part, with points where it
//! is not, and an open sheet with its thickness.

use rand_distr::{Distribution, UnitSphere};

use super::border::BorderSearch;
use super::keyframes::{Draw, Keyframe, PointCloud};
use super::sample::sample_surface;
use super::solid::Solid;
use crate::geometry::Mesh;
use crate::geometry::linear::unit;

/// Of a surface at least this share is taken to be known: what is sampled grows with its inverse.
const LEAST_KNOWN: f64 = 0.05;

/// How far beyond the border points are added, in spacings of those that are given: as far as these are apart.
const APART: f64 = 1.0;

/// Steps back onto the surface of a sheet: one is exact but for rounding, and where a far part of it is nearer.
const BACK: usize = 2;

/// The points of key frame `k` and, of a surface that is whole, those beyond their border, as dense; with
/// normals, which `normals` gives at points. `None` if the surface has no area.
pub(crate) fn complete(
    key: &Keyframe,
    k: usize,
    surface: &Mesh<f32>,
    normals: impl FnOnce(&[[f32; 3]]) -> Vec<[f32; 3]>,
    seed: u64,
) -> Option<PointCloud> {
    let surface = surface.moved(|x| x.map(f64::from));
    let has_area = |triangle| surface.triangle_area(triangle) > 0.0;
    if key.border.is_empty() || !surface.triangles.iter().copied().any(has_area) {
        return None;
    }
    let given = &key.cloud;
    let border = BorderSearch::new(&given.points, &key.border);
    let mut rng = Draw::Completing(k).generator(seed);
    let mut more = |count: usize| -> Vec<[f32; 3]> {
        let drawn = sample_surface(&surface, count, &mut rng).points;
        let drawn: Vec<[f32; 3]> = drawn.iter().map(|x| x.map(|part| part as f32)).collect();
        let are_beyond = border.beyond(&drawn, APART);
        let drawn = drawn.into_iter().zip(are_beyond);
        drawn.filter_map(|(x, is)| is.then_some(x)).collect()
    };
    // As many in all as make those that are not beyond as many as are given.
    let count = given.points.len();
    let mut added = more(count);
    let known = 1.0 - added.len() as f64 / count as f64;
    added.extend(more(
        (count as f64 / known.max(LEAST_KNOWN)).round() as usize - count,
    ));
    let added_normals = normals(&added);
    let mut points = given.points.clone();
    points.extend(added);
    let normals = given.normals.as_ref().map(|normals| {
        let mut normals = normals.clone();
        normals.extend(added_normals);
        normals
    });
    Some(PointCloud { points, normals })
}

/// The surface of a sheet that has a thickness, by as many points as its key frame `k` has: on both sides and around the
/// rim. `solid` is the sheet with its thickness; `None` if the key frame is no such sheet.
pub(crate) fn thicken(key: &Keyframe, k: usize, solid: &Solid, seed: u64) -> Option<PointCloud> {
    let sheet = key.sheet.as_ref()?;
    let mut rng = Draw::Completing(k).generator(seed);
    let mut away = |x: &[f32; 3]| {
        let by: [f64; 3] = UnitSphere.sample(&mut rng);
        [0, 1, 2].map(|axis| x[axis] + sheet.thickness * by[axis] as f32)
    };
    // Twice as far from the sheet as its surface is, and back along the gradient of the distance.
    let mut points: Vec<[f32; 3]> = key.cloud.points.iter().map(&mut away).collect();
    for _ in 0..BACK {
        let (values, gradients) = (solid.distances(&points), solid.gradients(&points));
        for (x, (value, gradient)) in points.iter_mut().zip(values.iter().zip(&gradients)) {
            *x = [0, 1, 2].map(|axis| x[axis] - value * gradient[axis]);
        }
    }
    let normals = solid.gradients(&points).into_iter().map(unit).collect();
    Some(PointCloud {
        points,
        normals: Some(normals),
    })
}
