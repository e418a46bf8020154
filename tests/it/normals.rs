//! `normals`: those of a raw cloud, written with its points.

use serde_json::Value;

use crate::support::mesh::{Mesh, Point, dot};
use crate::support::ply::{self, Ply};
use crate::support::workplace::Workplace;

/// Two spheres side by side and a hollow in one of them, with the way out of the shape.
fn cloud() -> Vec<(Point, Point)> {
    let sphere = |radius: f64, x: f64, sign: f64, cuts: usize| {
        let vertices = Mesh::sphere(radius, cuts).vertices.into_iter();
        vertices.map(move |p| ([p[0] + x, p[1], p[2]], p.map(|c| sign * c / radius)))
    };
    let outer = sphere(1.0, 0.0, 1.0, 4).chain(sphere(0.5, 1.8, 1.0, 3));
    outer.chain(sphere(0.6, 0.0, -1.0, 3)).collect()
}

fn points_of(file: &Ply, names: [&str; 3]) -> Vec<Point> {
    let [x, y, z] = names.map(|name| file.column(name));
    (0..x.len()).map(|k| [x[k], y[k], z[k]]).collect()
}

#[test]
fn they_point_out_of_the_shape_and_into_its_hollow() {
    let place = Workplace::new();
    let (points, out): (Vec<Point>, Vec<Point>) = cloud().into_iter().unzip();
    place.write("raw.ply", ply::cloud(&points));
    let ended = place
        .isomorph(&["normals", "raw.ply", "-o", "with.ply"])
        .succeeded();
    assert!(
        ended.stdout.contains("estimated: with.ply"),
        "{}",
        ended.stdout
    );
    assert!(!ended.stdout.contains("own normals"), "{}", ended.stdout);
    let written = Ply::read(&place.path("with.ply"));
    for (found, point) in points_of(&written, ["x", "y", "z"]).iter().zip(&points) {
        assert!((0..3).all(|axis| (found[axis] - point[axis]).abs() < 1e-6));
    }
    let normals = points_of(&written, ["nx", "ny", "nz"]);
    assert_eq!(normals.len(), points.len());
    for (normal, out) in normals.iter().zip(&out) {
        assert!((dot(*normal, *normal) - 1.0).abs() < 1e-5);
        assert!(dot(*normal, *out) > 0.9, "{normal:?}, not {out:?}");
    }
    // What was written reads as a cloud with normals, which are those of the estimate.
    let again = place
        .isomorph(&["normals", "with.ply", "-o", "again.obj", "--json"])
        .succeeded();
    let report: Value = serde_json::from_str(&again.stdout).expect("JSON");
    assert_eq!(report["points"], points.len());
    assert_eq!(report["own"]["same_side"], 1.0);
    assert!(report["own"]["median_angle"].as_f64().expect("a number") < 0.1);
    // Where the spheres face each other the cloud as a whole is mistaken, and the neighbours know.
    assert!(report["clear"].as_f64().expect("a number") > 0.95);
    let contradicted = report["contradicted"].as_f64().expect("a number");
    assert!(contradicted > 0.0 && contradicted < 0.02, "{contradicted}");
    let text = std::fs::read_to_string(place.path("again.obj")).expect("an OBJ");
    let lines = |prefix: &str| text.lines().filter(|line| line.starts_with(prefix)).count();
    assert_eq!([lines("v "), lines("vn ")], [points.len(); 2]);
}

#[test]
fn what_cannot_be_written_or_read_is_refused_and_leaves_nothing() {
    let place = Workplace::new();
    place.write("few.ply", ply::cloud(&[[0.0; 3], [1.0, 0.0, 0.0]]));
    place
        .isomorph(&["normals", "few.ply", "-o", "few.stl"])
        .refused(2, &["--output few.stl", "must end in .ply or .obj"]);
    place
        .isomorph(&["normals", "few.ply", "-o", "out.ply"])
        .refused(1, &["few.ply", "2"]);
    place
        .isomorph(&["normals", "none.ply", "-o", "out.ply"])
        .refused(1, &["none.ply"]);
    assert_eq!(place.names(), ["few.ply"]);
}
