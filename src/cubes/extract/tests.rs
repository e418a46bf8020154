//! Tests of extraction on shapes with exact answers and on random fields.

use std::collections::HashMap;
use std::convert::Infallible;

use proptest::prelude::*;

use super::*;
use crate::cubes::GridError;

type Point = [f32; 3];
type Shape = fn(Point) -> f32;

fn distance(a: Point, b: Point) -> f32 {
    (0..3)
        .map(|axis| (a[axis] - b[axis]).powi(2))
        .sum::<f32>()
        .sqrt()
}

fn sphere(centre: Point, radius: f32) -> impl Fn(Point) -> f32 {
    move |x| distance(x, centre) - radius
}

/// Radii 0.5 and 0.2 about the z axis.
fn torus([x, y, z]: Point) -> f32 {
    (x.hypot(y) - 0.5).hypot(z) - 0.2
}

fn capsule(x: Point, from: Point, to: Point, radius: f32) -> f32 {
    let along: Point = std::array::from_fn(|axis| to[axis] - from[axis]);
    let share = (0..3)
        .map(|axis| (x[axis] - from[axis]) * along[axis])
        .sum::<f32>()
        / along.iter().map(|part| part * part).sum::<f32>();
    let share = share.clamp(0.0, 1.0);
    distance(
        x,
        std::array::from_fn(|axis| from[axis] + share * along[axis]),
    ) - radius
}

/// A body with four legs, a tail and a neck; the thinnest is 0.03 across in a box of 2.
fn animal(x: Point) -> f32 {
    let limbs = [
        ([-0.5, 0.1, 0.0], [0.4, 0.1, 0.0], 0.16),
        ([-0.45, 0.0, 0.1], [-0.5, -0.7, 0.12], 0.03),
        ([-0.45, 0.0, -0.1], [-0.4, -0.7, -0.12], 0.03),
        ([0.4, 0.0, 0.1], [0.45, -0.7, 0.12], 0.03),
        ([0.4, 0.0, -0.1], [0.3, -0.7, -0.12], 0.03),
        ([0.4, 0.15, 0.0], [0.75, 0.5, 0.0], 0.08),
        ([-0.55, 0.1, 0.0], [-0.9, 0.45, 0.3], 0.015),
    ];
    limbs
        .iter()
        .map(|&(from, to, radius)| capsule(x, from, to, radius))
        .fold(f32::MAX, f32::min)
}

fn extraction(
    field: impl Fn(Point) -> f32,
    side: f32,
    resolution: usize,
) -> Result<Extraction, ExtractError<Infallible>> {
    let grid = Grid::new([-side; 3], [side; 3], resolution).expect("a good grid");
    extract(
        |points: &[Point]| Ok(points.iter().map(|&x| field(x)).collect()),
        &grid,
    )
}

fn extracted(field: impl Fn(Point) -> f32, side: f32, resolution: usize) -> Extraction {
    extraction(field, side, resolution).expect("a surface")
}

/// Closed, oriented, and one ring of triangles round every vertex.
fn assert_closed_manifold(mesh: &Mesh<f32>) {
    assert!(mesh.is_closed());
    let mut rings: Vec<HashMap<u32, u32>> = vec![HashMap::new(); mesh.vertices.len()];
    for &[a, b, c] in &mesh.triangles {
        for (centre, from, to) in [(a, b, c), (b, c, a), (c, a, b)] {
            assert_eq!(
                rings[centre as usize].insert(from, to),
                None,
                "edge used twice"
            );
        }
    }
    for (vertex, ring) in rings.iter().enumerate() {
        let start = *ring.keys().next().expect("every vertex has triangles");
        let (mut at, mut walked) = (ring[&start], 1);
        while at != start {
            at = ring[&at];
            walked += 1;
        }
        assert_eq!(walked, ring.len(), "vertex {vertex} has more than one ring");
    }
}

#[test]
fn a_sphere_is_closed_and_its_errors_fall_with_the_square_of_the_cell() {
    let mut errors = Vec::new();
    for resolution in [16, 32, 64, 128] {
        // Off centre, so that no symmetry flatters the result.
        let (centre, radius) = ([0.013, -0.021, 0.007], 0.6);
        let found = extracted(sphere(centre, radius), 1.0, resolution);
        assert_closed_manifold(&found.mesh);
        assert_eq!(
            (
                found.mesh.components().len(),
                found.mesh.euler_characteristic()
            ),
            (1, 2)
        );
        assert!(!found.touches_box);
        let r = f64::from(radius);
        let volume = found.mesh.volume() / (4.0 / 3.0 * std::f64::consts::PI * r.powi(3)) - 1.0;
        let area = found.mesh.area() / (4.0 * std::f64::consts::PI * r.powi(2)) - 1.0;
        let off = |&vertex: &Point| f64::from((distance(vertex, centre) - radius).abs());
        let vertex = found.mesh.vertices.iter().map(off).fold(0.0, f64::max);
        println!("{resolution}: volume {volume:.2e}, area {area:.2e}, vertices {vertex:.2e}");
        // Vertices keep 1e-3 of a cell from nodes; that, not interpolation, limits them.
        assert!(
            vertex < 1.1e-3 * 2.0 / resolution as f64,
            "{resolution}: {vertex:e}"
        );
        errors.push([volume.abs(), area.abs()]);
    }
    let slope = |i: usize| (errors[0][i] / errors[3][i]).log2() / 3.0;
    // Chords of a smooth surface: second order; 0.15 for the scatter of cells against the sphere.
    assert!((slope(0) - 2.0).abs() < 0.15, "volume: order {}", slope(0));
    assert!((slope(1) - 2.0).abs() < 0.15, "area: order {}", slope(1));
}

#[test]
fn a_torus_has_one_handle_and_its_volume() {
    let found = extracted(torus, 1.0, 96);
    assert_closed_manifold(&found.mesh);
    assert_eq!(found.mesh.euler_characteristic(), 0);
    let exact = 2.0 * std::f64::consts::PI.powi(2) * 0.5 * 0.04;
    // Chord error h²/(8 r) is 3e-4 on a tube of radius 0.2: some 1e-3 of its volume.
    assert!(
        (found.mesh.volume() / exact - 1.0).abs() < 3e-3,
        "{}",
        found.mesh.volume() / exact
    );
}

#[test]
fn two_spheres_of_very_different_size_are_both_found() {
    // The small one is 2.5 cells of 256 across and lies between nodes of the scan.
    let (large, small) = (
        sphere([0.3, 0.0, 0.0], 0.5),
        sphere([-0.78, 0.41, -0.53], 0.01),
    );
    let found = extracted(|x| large(x).min(small(x)), 1.0, 256);
    assert_closed_manifold(&found.mesh);
    assert_eq!(
        (
            found.mesh.components().len(),
            found.mesh.euler_characteristic()
        ),
        (2, 4)
    );
}

#[test]
fn at_256_cells_less_than_five_per_cent_of_the_grid_is_evaluated() {
    let shapes: [(&str, Shape); 3] = [
        ("sphere", |x| sphere([0.0; 3], 0.6)(x)),
        ("torus", torus),
        ("animal", animal),
    ];
    for (name, shape) in shapes {
        let found = extracted(shape, 1.0, 256);
        assert_closed_manifold(&found.mesh);
        assert_eq!(found.mesh.components().len(), 1, "{name}");
        let share = found.evaluated as f64 / found.grid_points as f64;
        println!(
            "{name}: {} of {}: {:.2} %",
            found.evaluated,
            found.grid_points,
            100.0 * share
        );
        assert!(share < 0.05, "{name}: {share}");
    }
}

#[test]
fn steeper_or_flatter_fields_than_a_distance_give_the_same_surface() {
    let plain = extracted(animal, 1.0, 128).mesh;
    // Flat far away, steep at the surface, and the other way round: the same zero set, and the same
    // signs at the nodes, so the same triangles.
    let warps: [fn(f32) -> f32; 4] = [
        |d| (20.0 * d).tanh(),
        |d| 30.0 * d,
        |d| d * (1.0 + 3.0 * d.abs()),
        |d| d.signum() * d.abs().sqrt(),
    ];
    for (i, warp) in warps.into_iter().enumerate() {
        let found = extracted(|x| warp(animal(x)), 1.0, 128).mesh;
        assert_closed_manifold(&found);
        assert_eq!(found.vertices.len(), plain.vertices.len(), "warp {i}");
    }
}

#[test]
fn a_limb_that_the_scan_drops_is_found_from_the_body_that_it_grows_on() {
    // The rod runs between the nodes of the scan (1/16 apart), and f leaps by 0.2 at its surface,
    // so the slopes of the scan leave no room for it; near the body finer nodes show otherwise.
    let body = sphere([-0.5, 0.031, 0.031], 0.3);
    let rod = |x: Point| capsule(x, [-0.5, 0.031, 0.031], [0.8, 0.031, 0.031], 0.02);
    let steep = |d: f32| d + 50.0 * d.clamp(-0.004, 0.004);
    let found = extracted(|x| body(x).min(steep(rod(x))), 1.0, 128);
    assert_closed_manifold(&found.mesh);
    assert_eq!(
        (
            found.mesh.components().len(),
            found.mesh.euler_characteristic()
        ),
        (1, 2)
    );
    let tip = found
        .mesh
        .vertices
        .iter()
        .map(|vertex| vertex[0])
        .fold(f32::MIN, f32::max);
    // The rod ends in a half sphere, which a cell of 1/64 may cut short by half of its side.
    assert!((tip - 0.82).abs() < 0.008, "{tip}");
}

#[test]
fn a_plane_through_the_box_is_left_open_there_and_reported() {
    let found = extracted(|[x, y, z]| 0.6 * x + 0.8 * z - 0.05 + 0.0 * y, 1.0, 64);
    assert!(found.touches_box && !found.mesh.is_closed());
    // A plane is met exactly: area 2 x 2 / 0.8, f32 coordinates.
    assert!(
        (found.mesh.area() - 5.0).abs() < 1e-4,
        "{}",
        found.mesh.area()
    );
    assert_eq!(found.mesh.euler_characteristic(), 1, "a disc");
}

#[test]
fn a_shape_that_fills_the_box_around_a_bubble_is_reported() {
    let found = extracted(|x| 0.5 - distance(x, [0.0; 3]), 1.0, 32);
    assert!(found.touches_box && found.mesh.is_closed());
    assert!(found.mesh.volume() < 0.0, "the bubble is a hole");
}

#[test]
fn boxes_that_are_no_cubes_have_cubic_cells_that_cover_them() {
    let grid = Grid::new([0.0, -1.0, 2.0], [4.0, 0.0, 2.1], 100).expect("a good grid");
    assert_eq!(grid.cells(), [100, 25, 3]);
    assert_eq!(grid.points(), 101 * 26 * 4);
    let field = |x: Point| capsule(x, [0.2, -0.5, 2.05], [3.8, -0.5, 2.05], 0.04);
    let values = |points: &[Point]| Ok::<_, Infallible>(points.iter().map(|&x| field(x)).collect());
    let found = extract(values, &grid).expect("a surface");
    assert_closed_manifold(&found.mesh);
    assert_eq!(found.mesh.euler_characteristic(), 2);
}

#[test]
fn values_of_exactly_zero_at_nodes_make_no_degenerate_triangle() {
    // Faces of the cube pass through nodes; its inside is -1, so f = 0 on whole faces of cells.
    let cube = |x: Point| {
        x.iter()
            .fold(-1.0_f32, |most, part| most.max(part.abs() - 0.5))
    };
    let flat = |x: Point| {
        if cube(x) < 0.0 {
            -1.0
        } else {
            cube(x).max(0.0)
        }
    };
    for field in [&cube as &dyn Fn(Point) -> f32, &flat] {
        let found = extracted(field, 1.0, 32);
        assert_closed_manifold(&found.mesh);
        assert_eq!(found.mesh.euler_characteristic(), 2);
        let least = found
            .mesh
            .triangles
            .iter()
            .map(|&t| found.mesh.triangle_area(t))
            .fold(1.0, f64::min);
        // Corners stay 1/1000 of a cell of 1/16 from nodes: the least area is half that squared.
        assert!(least > 0.9 * 0.5 * (1e-3_f64 / 16.0).powi(2), "{least:e}");
    }
}

#[test]
fn bad_grids_and_fields_are_refused_with_what_is_wrong() {
    let (low, high) = ([-1.0; 3], [1.0; 3]);
    assert_eq!(
        Grid::new(low, high, 7).expect_err("too coarse"),
        GridError::Resolution(7)
    );
    assert!(matches!(
        Grid::new(low, high, 2049),
        Err(GridError::Resolution(2049))
    ));
    assert!(matches!(
        Grid::new(high, low, 64),
        Err(GridError::Box { .. })
    ));
    assert!(matches!(
        Grid::new(low, [f32::NAN, 1.0, 1.0], 64),
        Err(GridError::Box { .. })
    ));
    let far = Grid::new([999.0; 3], [1000.0; 3], 2048);
    assert!(matches!(far, Err(GridError::FarFromOrigin { .. })));

    let grid = Grid::new(low, high, 32).expect("a good grid");
    let with = |field: Shape| extraction(field, 1.0, 32).expect_err("a bad field");
    let nan = with(|[x, y, z]| {
        if x > 0.9 && y > 0.9 && z > 0.9 {
            f32::NAN
        } else {
            x
        }
    });
    assert!(
        nan.to_string().contains("NaN at [0.9375, 0.9375, 0.9375]"),
        "{nan}"
    );
    let none = with(|x| 2.0 + x[0]);
    assert!(none.to_string().contains("between 1e0 and 3e0"), "{none}");
    assert!(
        matches!(with(|_| 0.0), ExtractError::NoSurface { .. }),
        "zero is outside"
    );
    let short = extract(|_: &[Point]| Ok::<_, Infallible>(vec![1.0]), &grid).expect_err("too few");
    assert!(matches!(short, ExtractError::Count { found: 1, .. }));
    let failed = extract(
        |_: &[Point]| Err(std::io::Error::other("the device is gone")),
        &grid,
    );
    assert_eq!(
        failed.expect_err("the field failed").to_string(),
        "the device is gone"
    );
}

/// A value for every node that depends on the seed, and 1 on the box.
fn noise(seed: u64, grid: &Grid, x: Point) -> f32 {
    let place = x.map(|part| ((f64::from(part) + 1.0) / grid.spacing()).round() as u32);
    if (0..3).any(|axis| place[axis] == 0 || place[axis] == grid.cells()[axis]) {
        return 1.0;
    }
    let mut mixed = seed;
    for part in place {
        mixed = (mixed ^ u64::from(part)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        mixed ^= mixed >> 29;
    }
    let size = 0.1 + (mixed >> 8 & 0xFF) as f32 / 256.0;
    if mixed & 1 == 1 { -size } else { size }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn noise_at_every_node_gives_a_closed_manifold(seed: u64, resolution in 8_usize..16) {
        // Every sign pattern and every ambiguous face, next to every other.
        let grid = Grid::new([-1.0; 3], [1.0; 3], resolution).expect("a good grid");
        let found = extracted(|x| noise(seed, &grid, x), 1.0, resolution);
        prop_assert!(!found.touches_box);
        assert_closed_manifold(&found.mesh);
    }

    #[test]
    fn smooth_random_fields_give_closed_manifolds(
        waves in prop::collection::vec((prop::array::uniform3(-9.0_f32..9.0), 0.0_f32..6.3), 5),
        resolution in 20_usize..80,
    ) {
        // Waves of random direction, cut off by a sphere inside the box.
        let field = |x: Point| {
            let wave = |(k, phase): &(Point, f32)| {
                (k[0] * x[0] + k[1] * x[1] + k[2] * x[2] + phase).sin()
            };
            let height = waves.iter().map(wave).sum::<f32>() / 10.0;
            height.max(distance(x, [0.0; 3]) - 0.85)
        };
        match extraction(field, 1.0, resolution) {
            Ok(found) => {
                prop_assert!(!found.touches_box);
                assert_closed_manifold(&found.mesh);
                prop_assert!(found.mesh.volume() > 0.0);
            }
            Err(refused) => {
                let none = matches!(refused, ExtractError::NoSurface { .. });
                prop_assert!(none, "{}", refused);
            }
        }
    }
}
