//! Shapes laid onto each other: what is taken out, and what is left.

use std::path::Path;

use super::*;
use crate::geometry::linear::Matrix;
use crate::geometry::testing::bumpy_sphere;

fn turned(degrees: f64) -> Matrix {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    [[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]]
}

/// A shape without symmetry, by this way.
fn shape(name: &str, way: &Similarity) -> Shape {
    let mut mesh = bumpy_sphere(24);
    for [x, y, _] in &mut mesh.vertices {
        *x *= 1.0 + (*y + 0.4);
        *y *= 1.6;
    }
    Shape::at(Path::new(name), mesh).laid_by(way)
}

fn laid(recipe: &Recipe, way: &Similarity) -> (f64, Aligned<'static>) {
    let shapes = vec![shape("a.ply", &Similarity::IDENTITY), shape("b.ply", way)];
    let shapes: &'static [Shape] = Vec::leak(shapes);
    let aligned = aligned(recipe, shapes).expect("shapes with surfaces");
    let [a, b] = [0, 1].map(|k| &aligned.shapes[k].mesh.vertices);
    let apart = a.iter().zip(b).map(|(a, b)| length(difference(*a, *b)));
    (apart.sum::<f64>() / a.len() as f64, aligned)
}

fn recipe(changes: &[&str]) -> Recipe {
    let mut recipe = Recipe::between("a.ply", "b.ply").expect("two paths");
    let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
    recipe.with_all(&changes).expect("keys that exist");
    recipe
}

const FAR: Similarity = Similarity {
    scale: 1.0,
    rotation: crate::geometry::linear::IDENTITY,
    translation: [7.0, -3.0, 20.0],
};

#[test]
fn units_places_and_turns_are_taken_out_from_the_surfaces_alone_or_by_pairs() {
    let mut way = Similarity {
        scale: 1000.0,
        rotation: turned(75.0),
        ..FAR
    };
    for known in ["none", "same-vertices"] {
        let known = format!("data.correspondences={known}");
        for align in ["auto", "similarity"] {
            way.scale = 1000.0;
            let (off, aligned) = laid(&recipe(&[&known, &format!("data.align={align}")]), &way);
            assert!(off < 0.02, "{known}, {align}: {off}, {:?}", aligned.notes);
            assert!(
                aligned.notes[0].contains("turned by 7"),
                "{:?}",
                aligned.notes
            );
            assert!(
                aligned.notes[0].contains("scaled by 0.001"),
                "{:?}",
                aligned.notes
            );
            // The way back meets the file.
            let back = aligned.to_files[1].apply(aligned.shapes[1].mesh.vertices[5]);
            let file = shape("b.ply", &way).mesh.vertices[5];
            assert!(length(difference(back, file)) < 1e-6, "{back:?}, {file:?}");
        }
        way.scale = 1.0;
        let (off, aligned) = laid(&recipe(&[&known, "data.align=rigid"]), &way);
        assert!(off < 0.02, "{known}: {off}, {:?}", aligned.notes);
    }
}

#[test]
fn auto_leaves_what_may_be_meant() {
    let small = |degrees: f64, scale: f64, along: f64| Similarity {
        scale,
        rotation: turned(degrees),
        translation: [along, 0.0, 0.0],
    };
    for way in [
        small(0.0, 1.0, 0.0),
        small(12.0, 1.0, 0.1),
        small(5.0, 1.5, 0.0),
    ] {
        for known in ["none", "same-vertices"] {
            let known = format!("data.correspondences={known}");
            let (_, aligned) = laid(&recipe(&[&known, "data.align=auto"]), &way);
            assert!(aligned.to_files.is_empty(), "{way:?}: {:?}", aligned.notes);
        }
    }
}

#[test]
fn units_are_taken_for_what_they_are() {
    assert_eq!(unit_ratio(0.001_03), 1e-3);
    assert_eq!(unit_ratio(24.9), 25.4);
    assert_eq!(unit_ratio(2.0), 1.0);
    assert_eq!(unit_ratio(5.0), 5.0);
}

#[test]
fn chains_go_back_to_the_first() {
    let ways = [Similarity::IDENTITY, FAR, small_and_far()];
    let shapes = ways.map(|way| shape("a.ply", &way));
    let mut recipe =
        Recipe::through(&[("a.ply", 0.0), ("b.ply", 1.0), ("c.ply", 3.0)]).expect("three paths");
    recipe
        .with_all(&[
            "data.align=auto".to_owned(),
            "data.correspondences=same-vertices".to_owned(),
        ])
        .expect("keys that exist");
    let aligned = aligned(&recipe, &shapes).expect("shapes with surfaces");
    let first = &aligned.shapes[0].mesh.vertices;
    for shape in &aligned.shapes[1..] {
        let off = length(difference(shape.mesh.vertices[9], first[9]));
        assert!(off < 1e-9, "{off}");
    }
}

fn small_and_far() -> Similarity {
    Similarity {
        scale: 0.01,
        rotation: turned(140.0),
        ..FAR
    }
}
