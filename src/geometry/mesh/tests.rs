//! Meshes whose measures are known.

use super::*;
use crate::geometry::testing::tetrahedron;

#[test]
fn a_tetrahedron_has_the_area_volume_and_topology_of_the_textbook_wherever_it_is() {
    // Three right triangles of 1/2 and one equilateral of side sqrt 2.
    let area = 1.5 + 3.0_f64.sqrt() / 2.0;
    for offset in [0.0, 1000.0, 5.0e5] {
        let wide = tetrahedron(offset);
        // Whole numbers: exact in float32 too, and reckoned in float64 relative to a vertex.
        let narrow = wide.moved(|vertex| vertex.map(|x| x as f32));
        for (found, volume) in [
            (wide.area(), wide.volume()),
            (narrow.area(), narrow.volume()),
        ] {
            assert!((found - area).abs() < 1e-12, "{found}");
            assert!((volume - 1.0 / 6.0).abs() < 1e-12, "{volume}");
        }
        assert!(wide.is_closed() && narrow.is_closed());
        assert_eq!(wide.euler_characteristic(), 2);
    }
}

#[test]
fn an_open_or_twisted_or_empty_mesh_is_not_closed() {
    let mut open = tetrahedron(0.0);
    open.triangles.pop();
    assert!(!open.is_closed(), "a face is missing");
    let mut twisted = tetrahedron(0.0);
    twisted.triangles[0] = [0, 1, 2];
    assert!(!twisted.is_closed(), "a face is wound the other way");
    let mut doubled = tetrahedron(0.0);
    doubled.triangles.extend_from_within(..);
    assert!(!doubled.is_closed(), "every edge lies in four triangles");
    assert!(!Mesh::<f32>::default().is_closed(), "nothing is not closed");
}

#[test]
fn turning_a_mesh_inside_out_changes_the_sign_of_its_volume() {
    let mut mesh = tetrahedron(0.0);
    mesh.triangles
        .iter_mut()
        .for_each(|triangle| triangle.swap(0, 1));
    // Rounding of a few products of 0 and 1.
    assert!(
        (mesh.volume() + 1.0 / 6.0).abs() < 1e-12,
        "{}",
        mesh.volume()
    );
    assert!(mesh.is_closed());
}

#[test]
fn normals_at_a_corner_are_the_mean_of_its_faces_by_area() {
    let normals = tetrahedron(0.0).vertex_normals();
    let third = 1.0 / 3.0_f32.sqrt();
    for part in normals[0] {
        // Three equal faces meet at the origin: the mean points along -(1, 1, 1). f32 rounding.
        assert!((part + third).abs() < 1e-6, "{part}");
    }
    // At (1, 0, 0): -z, -y and (1, 1, 1) by twice their areas sum to (1, 0, 0).
    assert_eq!(normals[1], [1.0, 0.0, 0.0]);
}

#[test]
fn vertex_normals_are_weighted_by_area() {
    // At the first vertex two triangles meet: area 1 facing z, area 1/2 facing x.
    let vertices = [
        [0.0; 3],
        [2.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [7.0; 3],
    ];
    let normals = vertex_normals(&vertices, &[[0, 1, 2], [0, 3, 4]]);
    let expected = unit([1.0, 0.0, 2.0]);
    // Both are rounded to float32 once: equal to its epsilon.
    for axis in 0..3 {
        assert!(
            (normals[0][axis] - expected[axis]).abs() < 1e-6,
            "{:?}",
            normals[0]
        );
    }
    assert_eq!(normals[1], [0.0, 0.0, 1.0]);
    assert_eq!(normals[5], [0.0; 3], "in no triangle");
}

#[test]
fn a_moved_mesh_keeps_its_triangles_and_loses_its_normals() {
    let mut mesh = tetrahedron(0.0);
    mesh.normals = Some(mesh.vertex_normals());
    let moved = mesh.moved(|[x, y, z]| [x + 1.0, y, z]);
    assert_eq!(moved.triangles, mesh.triangles);
    assert_eq!(moved.vertices[1], [2.0, 0.0, 0.0]);
    assert_eq!(moved.normals, None);
}
