//! Two shapes that may not be what they seem to each other: in another unit, or mirrored.

use std::num::NonZeroUsize;

use isomorph_training::data::PointPair;

use super::keyframes::PointCloud;
use crate::formats::Shape;
use crate::geometry::linear::{
    add, add_outer, cross, difference, dot, mean, symmetric_eigen, tangents,
};
use crate::geometry::{EdgeSharing, Extent, NeighbourSearch};

/// Shapes whose lengths differ by more than this are said to.
const SIZES: f64 = 3.5;

/// Ratios of units in use: millimetres and centimetres, inches and feet, centimetres and metres.
const UNITS: [f64; 5] = [10.0, 12.0, 25.4, 100.0, 1000.0];

/// How near a ratio must be to one of these, as a factor.
const NEAR: f64 = 1.25;

/// Pairs are called mirrored if a reflection leaves less than this share of what the best rotation leaves.
const MIRRORED: f64 = 0.5;

/// Fewer pairs say too little.
const FEWEST_PAIRS: usize = 8;

/// What is said of two shapes of these areas that differ much in size.
pub(super) fn sizes([source, target]: [&Shape; 2], areas: [f64; 2]) -> Option<String> {
    let ratio = (areas[1] / areas[0]).sqrt();
    let factor = ratio.max(ratio.recip());
    if factor < SIZES {
        return None;
    }
    let name = target.path.display();
    let which = if ratio > 1.0 { "larger" } else { "smaller" };
    let unit = UNITS
        .iter()
        .find(|unit| factor < **unit * NEAR && factor > **unit / NEAR);
    let why = match unit {
        Some(unit) => format!(
            "this is near {unit}, as between two units of length; if it is one, set data.align = \"auto\""
        ),
        None => "if this is not meant, set data.align = \"auto\"".to_owned(),
    };
    Some(format!(
        "{name} is {factor:.1} times {which} in length than {}: {why}",
        source.path.display()
    ))
}

/// Whether a reflection lays the sources of pairs onto their targets and no rotation does.
///
/// The best orthogonal map is found from the singular values of `sum (y - mean) (x - mean)^T` (Kabsch, 1976): their
/// sum is what a map with the sign of its determinant gains, and the least counts twice for one of the other sign.
pub(super) fn are_mirrored(pairs: &[([f64; 3], [f64; 3])]) -> bool {
    if pairs.len() < FEWEST_PAIRS {
        return false;
    }
    let from = mean(pairs.iter().map(|pair| pair.0));
    let to = mean(pairs.iter().map(|pair| pair.1));
    let (mut covariance, mut square) = ([[0.0; 3]; 3], 0.0);
    for pair in pairs {
        let (x, y) = (difference(pair.0, from), difference(pair.1, to));
        add_outer(&mut covariance, 1.0, y, x);
        square += dot(x, x) + dot(y, y);
    }
    let (a, b, c) = (covariance[0], covariance[1], covariance[2]);
    let determinant = dot(a, cross(b, c));
    // The squares of the singular values.
    let product = |i: usize, j: usize| (0..3).map(|k| covariance[k][i] * covariance[k][j]).sum();
    let gram: [[f64; 3]; 3] = [0, 1, 2].map(|i| [0, 1, 2].map(|j| product(i, j)));
    let (squares, _) = symmetric_eigen(gram);
    let mut singular = squares.map(|value: f64| value.max(0.0).sqrt());
    singular.sort_by(f64::total_cmp);
    let [least, middle, most] = singular;
    let left = |gain: f64| square - 2.0 * gain;
    let best = left(most + middle + least);
    let other = left(most + middle - least);
    determinant < 0.0 && best < MIRRORED * other
}

/// Pairs of which the surface about is looked at.
const LOOKED_AT: usize = 300;

/// Neighbouring pairs that say how the surface maps there.
const NEIGHBOURS: usize = 16;

/// Pairs are mirrored if at this share of them the surface is turned over, and are not if at this share it is not.
const TURNED_OVER: f64 = 0.8;

/// A map that flattens the surface to less than this share says nothing of its side.
const FLAT: f64 = 0.05;

/// The share of pairs about which the surface of one shape goes to that of the other seen from behind, as in a mirror: a
/// turn to the left becomes one to the right, outside up. `None` if there are no normals or too few pairs.
///
/// This also shows where a shape is nearly its own mirror image, or nearly flat: what bends a plate the other way is close
/// to a reflection.
fn turned_over(pairs: &[PointPair], clouds: [&PointCloud; 2]) -> Option<f64> {
    let [Some(source), Some(target)] = clouds.map(|cloud| cloud.normals.as_ref()) else {
        return None;
    };
    if pairs.len() <= 2 * NEIGHBOURS {
        return None;
    }
    let wide = |x: [f32; 3]| x.map(f64::from);
    let search = clouds.map(|cloud| {
        let points: Vec<[f64; 3]> = cloud.points.iter().map(|x| wide(*x)).collect();
        NeighbourSearch::new(&points)
    });
    let from: Vec<[f64; 3]> = pairs.iter().map(|pair| wide(pair.0)).collect();
    let around = NeighbourSearch::new(&from);
    let count = NonZeroUsize::MIN.saturating_add(NEIGHBOURS);
    let side = |k: usize| -> Option<bool> {
        let to = wide(pairs[k].1);
        let normal = |side: usize, normals: &[[f32; 3]], x| {
            normals[search[side].nearest_one(x).index as usize]
        };
        let [e, f] = [normal(0, source, from[k]), normal(1, target, to)]
            .map(|normal| tangents(normal).map(wide));
        let flat = |[u, v]: [[f64; 3]; 2], x: [f64; 3]| [dot(u, x), dot(v, x)];
        // Least squares of the map of the plane: M sum(x x^T) = sum(y x^T).
        let (mut square, mut mapped) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
        for near in &around.nearest(from[k], count)[1..] {
            let other = near.index as usize;
            let x = flat(e, difference(from[other], from[k]));
            let y = flat(f, difference(wide(pairs[other].1), to));
            for i in 0..2 {
                for j in 0..2 {
                    square[i][j] += x[i] * x[j];
                    mapped[i][j] += y[i] * x[j];
                }
            }
        }
        let area = |m: [[f64; 2]; 2]| m[0][0] * m[1][1] - m[0][1] * m[1][0];
        let factor = area(mapped) / area(square);
        (factor.abs() > FLAT && factor.is_finite()).then_some(factor < 0.0)
    };
    let step = pairs.len().div_ceil(LOOKED_AT);
    let sides: Vec<bool> = (0..pairs.len()).step_by(step).filter_map(side).collect();
    let over = sides.iter().filter(|over| **over).count();
    (sides.len() > NEIGHBOURS).then(|| over as f64 / sides.len() as f64)
}

/// Whether pairs mirror one shape into another: about most of them, where normals say so, else all of them together.
/// `fits` is whether a reflection alone fits them.
pub(super) fn is_mirror(fits: bool, pairs: &[PointPair], clouds: Option<[&PointCloud; 2]>) -> bool {
    match clouds.and_then(|clouds| turned_over(pairs, clouds)) {
        Some(share) if share > TURNED_OVER => true,
        Some(share) if share < 1.0 - TURNED_OVER => false,
        _ => fits,
    }
}

/// The sum of the area vectors of a mesh is nothing if it is closed, half of the area for half a sphere, and more for a
/// sheet.
const SHEET: f64 = 0.6;

/// Whether a shape is a mesh that encloses nothing.
pub(super) fn is_sheet(shape: &Shape) -> bool {
    if !shape.is_mesh() || EdgeSharing::of(&shape.mesh).is_closed() {
        return false;
    }
    let vectors = shape
        .mesh
        .triangles
        .iter()
        .map(|t| shape.mesh.area_vector(*t));
    let sum = vectors.fold([0.0; 3], add);
    let share = dot(sum, sum).sqrt() / 2.0 / shape.mesh.area();
    share > SHEET
}

/// What is said of such a shape, of this thickness in its own unit or of none.
pub(super) fn of_sheet(shape: &Shape, thickness: Option<f64>) -> String {
    let name = shape.path.display();
    match thickness {
        Some(thickness) => format!(
            "{name}: an open sheet has no inside: its surfaces are {thickness:.3} thick (spline.sheet-thickness of the \
             preset instant); the carried mesh (--carry) is the sheet itself"
        ),
        None => format!(
            "{name}: an open sheet has no inside: its surfaces are closed behind it by a cushion, which may reach the box; \
             use the carried mesh (--carry), which is the sheet itself, or the preset instant, which gives it a thickness"
        ),
    }
}

/// The bounding boxes of shapes that are far apart, in words.
pub(super) fn distance([source, target]: [&Shape; 2]) -> Option<String> {
    let [one, other] = [source, target].map(|shape| Extent::of_surface(&shape.mesh));
    let largest = one.diagonal().max(other.diagonal());
    let gap = one.gap(&other);
    (gap > largest).then(|| {
        format!(
            "{} and {} are {:.1} times their size apart: the motion goes all the way; if it is not meant, set data.align = \"auto\"",
            source.path.display(),
            target.path.display(),
            gap / largest
        )
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::geometry::Mesh;
    use crate::geometry::testing::{bumpy_sphere, random_places, tetrahedron};

    fn shape(name: &str, scale: f64, along: f64) -> Shape {
        let mesh = tetrahedron(0.0).moved(|[x, y, z]| [scale * x + along, scale * y, scale * z]);
        Shape::at(Path::new(name), mesh)
    }

    #[test]
    fn sizes_near_a_ratio_of_units_are_said_with_the_factor() {
        let source = shape("a.ply", 1.0, 0.0);
        let said = |scale| {
            let target = shape("b.ply", scale, 0.0);
            let areas = [&source, &target].map(|shape| shape.area().expect("an area"));
            sizes([&source, &target], areas)
        };
        assert_eq!(said(3.0), None);
        assert_eq!(said(0.3), None);
        let metres = said(0.001).expect("said");
        assert!(
            metres.starts_with(
                "b.ply is 1000.0 times smaller in length than a.ply: this is near 1000"
            )
        );
        assert!(said(24.0).expect("said").contains("near 25.4"));
        assert!(
            said(5.0)
                .expect("said")
                .ends_with("if this is not meant, set data.align = \"auto\"")
        );
    }

    #[test]
    fn pairs_that_a_reflection_alone_fits_are_mirrored() {
        let places: Vec<[f64; 3]> = random_places(60, 1.0, 3)
            .iter()
            .map(|p| p.map(f64::from))
            .collect();
        let pairs = |to: &dyn Fn([f64; 3]) -> [f64; 3]| -> Vec<([f64; 3], [f64; 3])> {
            places.iter().map(|x| (*x, to(*x))).collect()
        };
        assert!(are_mirrored(&pairs(&|[x, y, z]| [9.0 - x, y, z])));
        // Mirrored and turned and bent a little.
        assert!(are_mirrored(&pairs(&|[x, y, z]| [y, x, z + 0.2 * x * x])));
        assert!(!are_mirrored(&pairs(&|[x, y, z]| [-x, -y, z])));
        assert!(!are_mirrored(&pairs(&|[x, y, z]| [x, y + x * z, z - x])));
        // Flat: a reflection is as good as a rotation, and no better.
        let flat: Vec<_> = places
            .iter()
            .map(|[x, y, _]| ([*x, *y, 0.0], [-*x, *y, 0.0]))
            .collect();
        assert!(!are_mirrored(&flat));
        assert!(!are_mirrored(&pairs(&|[x, y, z]| [-x, y, z])[..7]));
    }

    #[test]
    fn a_mirror_shows_in_the_surface_also_where_the_shape_is_its_own_mirror_image() {
        let ball = bumpy_sphere(30).moved(|[x, y, z]| [0.4 * x, y, z]);
        let cloud = |to: &dyn Fn([f64; 3]) -> [f64; 3], flip: bool| {
            let mut mesh = ball.moved(to);
            if flip {
                mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            }
            PointCloud {
                points: mesh
                    .vertices
                    .iter()
                    .map(|x| x.map(|part| part as f32))
                    .collect(),
                normals: Some(mesh.vertex_normals()),
            }
        };
        let source = cloud(&|x| x, false);
        let pairs = |target: &PointCloud, at: &dyn Fn(usize) -> usize| -> Vec<PointPair> {
            let some = (0..source.points.len()).step_by(3);
            some.map(|k| (source.points[k], target.points[at(k)]))
                .collect()
        };
        let found = |target: &PointCloud, at: &dyn Fn(usize) -> usize| {
            is_mirror(false, &pairs(target, at), Some([&source, target]))
        };
        let bent = |[x, y, z]: [f64; 3]| [x + 0.5 * y * y, y, z];
        assert!(!found(&cloud(&bent, false), &|k| k));
        let mirrored = |x: [f64; 3]| {
            let [x, y, z] = bent(x);
            [-x, y, z]
        };
        let target = cloud(&mirrored, true);
        assert!(found(&target, &|k| k));
        // A reflection that fits all of them together is none where the surface is not turned over.
        let same = cloud(&bent, false);
        assert!(!is_mirror(
            true,
            &pairs(&same, &|k| k),
            Some([&source, &same])
        ));
        assert!(is_mirror(true, &pairs(&same, &|k| k), None));
        // Pairs that are wrong everywhere say nothing.
        let count = source.points.len();
        assert!(!found(&target, &|k| (k * 7919) % count));
        let without = PointCloud {
            normals: None,
            ..target
        };
        assert!(!found(&without, &|k| k));
    }

    #[test]
    fn a_sheet_is_told_from_a_mesh_with_holes() {
        let mut ball = bumpy_sphere(20);
        let of = |mesh: &Mesh<f64>| {
            let shape = Shape::at(Path::new("a.ply"), mesh.clone());
            is_sheet(&shape).then(|| of_sheet(&shape, None))
        };
        assert_eq!(of(&ball), None);
        let half = ball.triangles.len() / 2;
        ball.triangles.drain(..half / 5);
        assert_eq!(of(&ball), None, "a hole");
        ball.triangles.truncate(half / 3);
        assert!(
            of(&ball).expect("said").contains("an open sheet"),
            "a band at its edge"
        );
    }

    #[test]
    fn shapes_far_apart_are_said_to_be() {
        let source = shape("a.ply", 1.0, 0.0);
        assert_eq!(distance([&source, &shape("b.ply", 1.0, 2.0)]), None);
        let said = distance([&source, &shape("b.ply", 1.0, 11.0)]).expect("said");
        assert!(said.contains("5.8 times their size apart"), "{said}");
    }
}
