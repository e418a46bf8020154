//! Scans with each kind of fault, beside the same without.

use std::path::Path;

use super::*;
use crate::geometry::Mesh;
use crate::geometry::testing::{bumpy_sphere, random_places, sphere_cloud};
use crate::shape::Normalisation;

fn cloud(points: Vec<[f64; 3]>) -> Shape {
    Shape::at(Path::new("scan.ply"), Mesh::new(points, Vec::new()))
}

fn cleaned(points: &[[f64; 3]]) -> Shape {
    cloud(points.to_vec()).cleaned(&CleanOptions::default())
}

/// A scan of 4000 points.
fn ball() -> Vec<[f64; 3]> {
    sphere_cloud(4000, 1.0, 71)
}

/// How far the frame of a cleaned scan is from that of the ball: in scale, as a share, and in place.
fn off(shape: &Shape) -> [f64; 2] {
    let frame = |shape: &Shape| Normalisation::joint(&[shape]).expect("an area");
    let (found, right) = (frame(shape), frame(&cloud(ball())));
    let away = [0, 1, 2].map(|k| (found.centre[k] - right.centre[k]).abs());
    [(found.scale / right.scale - 1.0).abs(), away.iter().sum()]
}

#[test]
fn clean_clouds_stay_as_they_are() {
    let dense = bumpy_sphere(40).vertices;
    // Its density varies by a factor of 40, from the pole to the middle.
    let uneven = ball().into_iter().map(|[x, y, z]| {
        let z = z.signum() * z.abs().powf(0.2);
        [x, y, z]
    });
    let grid = (0..5000).map(|k| [f64::from(k % 100), f64::from(k / 100), 0.0]);
    for points in [ball(), dense, uneven.collect(), grid.collect()] {
        let before = cloud(points);
        assert_eq!(before.clone().cleaned(&CleanOptions::default()), before);
    }
}

#[test]
fn zeros_of_a_depth_camera_go_and_the_frame_is_that_of_the_object() {
    let mut points = ball();
    points.splice(1000..1000, vec![[0.0, 0.0, 50.0]; 200]);
    let found = cleaned(&points);
    assert_eq!(found.mesh.vertices, ball());
    assert_eq!(off(&found), [0.0; 2]);
    assert_eq!(
        found.number_in_file(1000),
        1200,
        "numbers are those of the file"
    );
    let note = &found.notes[0];
    assert!(note.contains("200 at the one place (0, 0, 50)"), "{note}");
    assert!(note.contains("data.clean = \"none\""), "{note}");
}

#[test]
fn one_point_two_hundred_sizes_away_changes_nothing() {
    let mut points = ball();
    points.insert(17, [200.0, -30.0, 5.0]);
    let found = cleaned(&points);
    assert_eq!(found.mesh.vertices, ball());
    assert!(found.notes[0].contains("1 astray"), "{}", found.notes[0]);
}

#[test]
fn stray_points_round_a_scan_go_but_for_those_that_touch_it() {
    let mut points = ball();
    let strays = random_places(80, 2.0, 72);
    points.extend(strays.iter().map(|p| p.map(f64::from)));
    let found = cleaned(&points);
    let (left, lost) = (
        found.mesh.vertices.len(),
        points.len() - found.mesh.vertices.len(),
    );
    assert!(lost >= 74 && left >= 4000, "{lost} of 80 strays left out");
    assert_eq!(found.mesh.vertices[..4000], ball()[..]);
    let [scale, place] = off(&found);
    assert!(scale < 0.01 && place < 0.1, "{scale} {place}");
}

#[test]
fn corners_of_a_soup_and_almost_equal_points_stand_once() {
    let ball = ball();
    let six: Vec<[f64; 3]> = ball.iter().flat_map(|point| [*point; 6]).collect();
    let found = cleaned(&six);
    assert_eq!(found.mesh.vertices, ball);
    assert!(
        found.notes[0].contains("20000 that repeat"),
        "{}",
        found.notes[0]
    );
    // Merged scans: every point again, a hundredth of the spacing away.
    let again = ball.iter().map(|[x, y, z]| [x + 3e-4, *y, *z]);
    let twice: Vec<[f64; 3]> = ball.iter().copied().chain(again).collect();
    let found = cleaned(&twice);
    let count = found.mesh.vertices.len();
    assert!((3950..=4000).contains(&count), "{count}");
}

#[test]
fn a_cluster_far_away_goes_and_a_second_object_stays() {
    let mut points = ball();
    let small = sphere_cloud(150, 0.2, 73);
    points.extend(small.iter().map(|[x, y, z]| [x + 30.0, *y, *z]));
    let found = cleaned(&points);
    assert_eq!(found.mesh.vertices, ball());
    let note = &found.notes[0];
    assert!(note.contains("150 in small parts"), "{note}");
    let other = sphere_cloud(1500, 0.7, 74);
    let mut two = ball();
    two.extend(other.iter().map(|[x, y, z]| [x + 4.0, *y, *z]));
    assert!(cleaned(&two).notes.is_empty());
}

#[test]
fn options_keep_what_they_say() {
    let mut points = ball();
    points.extend(
        sphere_cloud(60, 0.2, 73)
            .iter()
            .map(|[x, y, z]| [x + 30.0, *y, *z]),
    );
    let kept = |part| {
        let options = CleanOptions {
            part,
            ..CleanOptions::default()
        };
        cloud(points.clone()).cleaned(&options).mesh.vertices.len()
    };
    assert_eq!(
        (kept(0.02), kept(0.0)),
        (4000, 4000),
        "far away goes in any case"
    );
    points[4000..]
        .iter_mut()
        .for_each(|point| point[0] -= 27.15);
    let kept = |part| {
        let options = CleanOptions {
            part,
            ..CleanOptions::default()
        };
        cloud(points.clone()).cleaned(&options).mesh.vertices.len()
    };
    assert_eq!((kept(0.02), kept(0.0)), (4000, 4060));
}

#[test]
fn nothing_goes_that_would_leave_too_few_points() {
    let points: Vec<[f64; 3]> = (0..100).map(|k| [f64::from(k / 50), 0.0, 0.0]).collect();
    let before = cloud(points);
    assert_eq!(before.clone().cleaned(&CleanOptions::default()), before);
}

#[test]
fn of_a_mesh_small_pieces_far_away_go_and_numbers_stay() {
    let ball = bumpy_sphere(20);
    let mut mesh = ball.clone();
    let first = mesh.vertices.len() as u32;
    mesh.vertices
        .extend([[90.0, 0.0, 0.0], [90.01, 0.0, 0.0], [90.0, 0.01, 0.0]]);
    mesh.triangles.insert(5, [first, first + 1, first + 2]);
    let shape = Shape::at(Path::new("scan.ply"), mesh.clone());
    let found = shape.cleaned(&CleanOptions::default());
    assert_eq!(found.mesh.triangles, ball.triangles);
    assert_eq!(found.mesh.vertices, mesh.vertices);
    assert!(
        found.notes[0].contains("1 small pieces"),
        "{}",
        found.notes[0]
    );
    // Near by it may be an eye.
    mesh.vertices[first as usize..]
        .iter_mut()
        .for_each(|vertex| vertex[0] -= 89.5);
    let near = Shape::at(Path::new("scan.ply"), mesh);
    assert_eq!(near.clone().cleaned(&CleanOptions::default()), near);
}
