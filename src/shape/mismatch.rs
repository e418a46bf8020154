//! Two shapes that may not be what they seem to each other: in another unit, or mirrored.

use crate::formats::{Shape, ShapeError};
use crate::geometry::Mesh;
use crate::geometry::linear::{add_outer, difference, dot, mean, symmetric_eigen};

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

/// What is said of two shapes that differ much in size.
///
/// # Errors
/// [`ShapeError::Area`].
pub(super) fn sizes([source, target]: [&Shape; 2]) -> Result<Option<String>, ShapeError> {
    let ratio = (target.area()? / source.area()?).sqrt();
    let factor = ratio.max(ratio.recip());
    if factor < SIZES {
        return Ok(None);
    }
    let name = target.path.display();
    let which = if ratio > 1.0 { "larger" } else { "smaller" };
    let unit = UNITS
        .iter()
        .find(|unit| factor < **unit * NEAR && factor > **unit / NEAR);
    let why = match unit {
        Some(unit) => format!(
            "this is near {unit}, as between two units of length; if it is one, scale a file"
        ),
        None => "if this is not meant, scale a file".to_owned(),
    };
    Ok(Some(format!(
        "{name} is {factor:.1} times {which} in length than {}: {why}",
        source.path.display()
    )))
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
    let determinant = dot(a, crate::geometry::linear::cross(b, c));
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

/// The bounding boxes of shapes that are far apart, in words.
pub(super) fn distance([source, target]: [&Shape; 2]) -> Option<String> {
    let ([low, high], [other_low, other_high]) = (extent(&source.mesh), extent(&target.mesh));
    let diagonal = |low: [f64; 3], high: [f64; 3]| {
        let sides = difference(high, low);
        dot(sides, sides).sqrt()
    };
    let largest = diagonal(low, high).max(diagonal(other_low, other_high));
    let gap = [0, 1, 2].map(|k| {
        (other_low[k] - high[k])
            .max(low[k] - other_high[k])
            .max(0.0)
    });
    let gap = dot(gap, gap).sqrt();
    (gap > largest).then(|| {
        format!(
            "{} and {} are {:.1} times their size apart: the motion goes all the way; if it is not meant, move a file",
            source.path.display(),
            target.path.display(),
            gap / largest
        )
    })
}

/// The lowest and the highest coordinates of what belongs to the surface.
fn extent(mesh: &Mesh<f64>) -> [[f64; 3]; 2] {
    let mut found = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let mut include = |place: &[f64; 3]| {
        for axis in 0..3 {
            found[0][axis] = found[0][axis].min(place[axis]);
            found[1][axis] = found[1][axis].max(place[axis]);
        }
    };
    if mesh.triangles.is_empty() {
        mesh.vertices.iter().for_each(&mut include);
    } else {
        let used = mesh.triangles.iter().flatten();
        used.for_each(|vertex| include(&mesh.vertices[*vertex as usize]));
    }
    found
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::geometry::testing::{random_places, tetrahedron};

    fn shape(name: &str, scale: f64, along: f64) -> Shape {
        let mesh = tetrahedron(0.0).moved(|[x, y, z]| [scale * x + along, scale * y, scale * z]);
        Shape::at(Path::new(name), mesh)
    }

    #[test]
    fn sizes_near_a_ratio_of_units_are_said_with_the_factor() {
        let source = shape("a.ply", 1.0, 0.0);
        let said = |scale| sizes([&source, &shape("b.ply", scale, 0.0)]).expect("areas");
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
                .ends_with("if this is not meant, scale a file")
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
    fn shapes_far_apart_are_said_to_be() {
        let source = shape("a.ply", 1.0, 0.0);
        assert_eq!(distance([&source, &shape("b.ply", 1.0, 2.0)]), None);
        let said = distance([&source, &shape("b.ply", 1.0, 11.0)]).expect("said");
        assert!(said.contains("5.8 times their size apart"), "{said}");
    }
}
