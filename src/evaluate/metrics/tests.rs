//! Metrics of shapes whose distances are known.

use std::f64::consts::PI;

use super::*;
use crate::evaluate::sampled::{Use, generator};
use crate::evaluate::testing::{sphere, square};
use crate::geometry::Mesh;
use crate::geometry::testing::cuboid;

const SAMPLES: usize = 10_000;

fn sampled(mesh: &Mesh<f64>, purpose: Use) -> SampledSurface {
    SampledSurface::new(mesh, SAMPLES, generator(5, 0, purpose)).expect("area")
}

fn compared(surface: &Mesh<f64>, truth: &Mesh<f64>) -> Metrics {
    compare(
        &sampled(surface, Use::Compared),
        &sampled(truth, Use::Truth),
        0.0,
    )
}

#[test]
fn concentric_spheres_are_as_far_apart_as_their_radii() {
    let inner = sphere(5);
    let (gap, growth) = (0.1, 1.1);
    let outer = inner.moved(|vertex| vertex.map(|x| growth * x));
    let metrics = compared(&outer, &inner);
    // The nearest sample is beside the nearest point by s with E[s^2] = 1 / (pi rho): 4e-4 on the
    // unit sphere at 10,000, so a distance grows by s^2 / (2 gap) = 2e-3. The facets sag by 6e-4 of
    // the radius at most, which moves the gap by as much of itself.
    let density = SAMPLES as f64 / (4.0 * PI);
    let beside = 1.0 / (PI * density);
    let off = metrics.chamfer - gap;
    assert!(off > -1e-4 && off < 2.0 * beside / (2.0 * gap), "{off}");
    // Both directions: 2 gap^2 and E[s^2] of each sphere; a tenth of these for the sampling.
    let squared = 2.0 * gap * gap + beside * (1.0 + growth * growth);
    assert!((metrics.chamfer_squared - squared).abs() < 0.1 * beside + 2e-3 * gap * gap);
    // The farthest of n samples has s^2 = E[s^2] ln n, give or take E[s^2].
    let farthest = (SAMPLES as f64).ln() * beside * growth * growth / (2.0 * gap);
    let off = metrics.hausdorff - gap;
    assert!(off > 0.0 && off < 1.5 * farthest, "{off} {farthest}");
    assert_eq!(
        metrics.hausdorff_squared,
        metrics.hausdorff * metrics.hausdorff
    );
    assert!(metrics.chamfer < metrics.hausdorff95 && metrics.hausdorff95 < metrics.hausdorff);
    // Facets of the two face each other: their normals differ by at most the angle of an edge,
    // 0.05.
    assert!(
        metrics.normal_consistency > 0.05_f64.cos(),
        "{}",
        metrics.normal_consistency
    );
    // The same facets, scaled: rounding only.
    assert!((metrics.volume_ratio - growth.powi(3)).abs() < 1e-12);
    assert!((metrics.area_ratio - growth.powi(2)).abs() < 1e-12);
}

#[test]
fn a_shifted_plane_is_as_far_off_as_the_shift() {
    let shift = 0.3;
    let metrics = compared(&square(shift), &square(0.0));
    // s^2 / (2 shift) with E[s^2] = 1 / (pi 10,000) = 3.2e-5 adds 5.3e-5, and more along the
    // border.
    let off = metrics.chamfer - shift;
    assert!(off > 0.0 && off < 1.5e-4, "{off}");
    // At a corner s^2 is four times as large, and 9 times for the farthest of 10,000.
    assert!(metrics.hausdorff - shift < 36.0 * 3.2e-5 / (2.0 * shift));
    assert!((metrics.chamfer_squared - 2.0 * shift * shift).abs() < 1.5e-4);
    // All normals are (0, 0, 1).
    assert_eq!(metrics.normal_consistency, 1.0);
    // Flat sheets enclose nothing.
    assert_eq!(metrics.volume_ratio, 0.0);
    assert_eq!((metrics.components, metrics.outside_largest), (1.0, 0.0));
}

#[test]
fn hausdorff_is_that_of_the_worse_direction_and_chamfer_the_mean_of_both() {
    // A square with a second one a unit above it, against the first one alone.
    let mut both = square(0.0);
    let above = square(1.0);
    both.triangles.extend(
        above
            .triangles
            .iter()
            .map(|triangle| triangle.map(|i| i + 4)),
    );
    both.vertices.extend(above.vertices);
    let metrics = compared(&both, &square(0.0));
    // One direction is 1/2, as half of the samples are a unit away; the other one is the floor,
    // 0.0035 with 20,000 samples on the square. The share of samples above scatters by 0.0025:
    // allow four.
    assert!(
        (metrics.chamfer - 0.25).abs() < 0.005 + 0.0035,
        "{}",
        metrics.chamfer
    );
    assert!((metrics.hausdorff - 1.0).abs() < 1e-3 && (metrics.hausdorff95 - 1.0).abs() < 1e-3);
    assert_eq!((metrics.components, metrics.outside_largest), (2.0, 0.5));
    assert_eq!(metrics.area_ratio, 2.0);
}

#[test]
fn normals_of_a_tilted_plane_agree_by_the_cosine_of_the_tilt_whichever_way_they_point() {
    for tilt in [0.0_f64, 0.4, 1.2, PI - 0.4] {
        let (sin, cos) = tilt.sin_cos();
        let tilted = square(0.0).moved(|[x, y, _]| [cos * x, y, sin * x]);
        let metrics = compared(&tilted, &square(0.0));
        // Normals are float32.
        assert!(
            (metrics.normal_consistency - cos.abs()).abs() < 1e-6,
            "{tilt}"
        );
    }
}

#[test]
fn a_scaled_box_has_the_cube_of_the_volume_and_the_square_of_the_area() {
    let small = cuboid([1.0, 2.0, 3.0]);
    let large = small.moved(|vertex| vertex.map(|x| 1.5 * x));
    let metrics = compared(&large, &small);
    // Few terms: rounding only.
    assert!((metrics.volume_ratio - 3.375).abs() < 1e-13);
    assert!((metrics.area_ratio - 2.25).abs() < 1e-13);
    let inside_out = small.moved(|[x, y, z]| [-x, y, z]);
    assert!((compared(&inside_out, &small).volume_ratio + 1.0).abs() < 1e-13);
}

#[test]
fn the_floor_is_that_of_random_points_of_the_same_density() {
    let ball = sphere(4);
    let (once, again) = (sampled(&ball, Use::Truth), sampled(&ball, Use::Floor));
    let metrics = compare(&again, &once, 0.5);
    let density = SAMPLES as f64 / once.area;
    // P(d > r) = exp(-pi rho r^2): mean 1 / (2 sqrt rho), mean square 1 / (pi rho). Over 2 * 10,000
    // samples the means scatter by 0.4 % and 0.7 % (by more, as neighbours share their
    // surroundings): five of these.
    let mean = 0.5 / density.sqrt();
    assert!(
        (metrics.chamfer / mean - 1.0).abs() < 0.02,
        "{}",
        metrics.chamfer / mean
    );
    let squared = 2.0 / (PI * density);
    assert!((metrics.chamfer_squared / squared - 1.0).abs() < 0.04);
    // exp(-pi rho r^2) = 0.05; the 95th percentile of 10,000 scatters by 0.7 %, and the larger of
    // two is taken.
    let percentile95 = (20.0_f64.ln() / (PI * density)).sqrt();
    assert!((metrics.hausdorff95 / percentile95 - 1.0).abs() < 0.04);
    assert_eq!(
        (metrics.time, metrics.volume_ratio, metrics.area_ratio),
        (0.5, 1.0, 1.0)
    );
}

#[test]
fn vertices_that_are_all_off_by_the_same_have_its_square_as_their_error() {
    let found = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    let truth = [[1.0, 2.0, 0.0], [4.0, 9.0, 6.0]];
    assert_eq!(mean_squared_error(&found, &truth), (9.0 + 16.0) / 2.0);
}
