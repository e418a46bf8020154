//! Scans as they come: what is no part of a surface is left out, and what cannot be meant is said.

use std::fmt::Write;

use serde_json::Value;

use crate::support::mesh::{Mesh, Point};
use crate::support::ply::{self, Ply};
use crate::support::workplace::Workplace;

/// A ball of many points.
fn ball() -> Vec<Point> {
    Mesh::sphere(1.0, 4).vertices
}

/// The ball with points that a scanner adds: nothing measured, in one place, and far away.
fn scan(moved: f64) -> (String, Vec<usize>) {
    let mut rows: Vec<String> = Vec::new();
    let mut numbers = Vec::new();
    for (k, [x, y, z]) in ball().into_iter().enumerate() {
        if k % 10 == 0 {
            rows.push("nan nan nan".to_owned());
            rows.push("9 9 9".to_owned());
        }
        numbers.push(rows.len());
        rows.push(format!("{} {y} {z}", x + moved));
    }
    rows.push("-150 20 3".to_owned());
    let mut text = String::from("ply\nformat ascii 1.0\n");
    let _ = writeln!(text, "element vertex {}", rows.len());
    text += "property float x\nproperty float y\nproperty float z\nend_header\n";
    (text + &rows.join("\n") + "\n", numbers)
}

#[test]
fn a_scan_is_cleaned_its_pairs_keep_their_numbers_and_its_surface_is_the_objects() {
    let place = Workplace::new();
    let (source, numbers) = scan(0.0);
    let (target, _) = scan(0.2);
    place.write("a.ply", &source);
    place.write("b.ply", &target);
    let pairs: Vec<String> = numbers
        .iter()
        .step_by(4)
        .map(|k| format!("{k},{k}"))
        .collect();
    place.write("pairs.csv", pairs.join("\n"));
    let args = [
        "morph",
        "a.ply",
        "b.ply",
        "-o",
        "run",
        "--pairs",
        "pairs.csv",
        "--preset",
        "instant",
    ];
    let more = [
        "--frames",
        "3",
        "--set",
        "result.resolution=48",
        "--strict",
        "--json",
    ];
    let ended = place.isomorph(&[&args[..], &more[..]].concat()).succeeded();
    let events: Vec<Value> = ended
        .stdout
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect();
    let notes: Vec<&str> = events
        .iter()
        .filter_map(|event| event["text"].as_str())
        .collect();
    let said = |part: &str| notes.iter().any(|note| note.contains(part));
    assert!(
        said("points have no place (NaN or infinite): left out"),
        "{notes:?}"
    );
    assert!(said("at the one place (9, 9, 9)"), "{notes:?}");
    assert!(said("1 astray"), "{notes:?}");
    // Wrong numbers would pull the ball in all directions.
    let surfaces: Vec<&Value> = events
        .iter()
        .filter(|event| event["event"] == "extracted")
        .collect();
    assert_eq!(surfaces.len(), 3, "{notes:?}");
    assert!(
        surfaces.iter().all(|event| event["components"] == 1),
        "{surfaces:?}"
    );
    let last = events
        .iter()
        .rev()
        .find(|event| event["event"] == "step")
        .expect("a step");
    let matching = &last["terms"]["matching"]["raw"];
    assert!(matching.as_f64().expect("a number") < 0.003, "{last}");
}

#[test]
fn clean_leaves_out_what_info_says_and_writes_the_rest() {
    let place = Workplace::new();
    place.write("a.ply", scan(0.0).0);
    let info = place.isomorph(&["info", "a.ply"]).succeeded().stdout;
    assert!(info.contains("at the one place (9, 9, 9)"), "{info}");
    let ended = place
        .isomorph(&["clean", "a.ply", "-o", "b.ply", "--json"])
        .succeeded();
    let report: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert_eq!(report["vertices"][1], ball().len(), "{report}");
    let info = place.isomorph(&["info", "b.ply"]).succeeded().stdout;
    assert!(!info.contains("note"), "{info}");
    let refused = place.isomorph(&["clean", "a.ply", "-o", "b.ply", "--strays", "1"]);
    refused.refused(2, &["--strays 1: must be more than 1"]);
    let refused = place.isomorph(&["clean", "a.ply", "-o", "b.stl"]);
    refused.refused(1, &["b.stl"]);
}

#[test]
fn a_mirrored_pair_is_refused_before_a_run_is_made() {
    let place = Workplace::new();
    let bent = |sign: f64| -> Vec<Point> {
        ball()
            .into_iter()
            .map(|[x, y, z]| [sign * x, y, z + 0.3 * x * y])
            .collect()
    };
    place.write("a.ply", ply::cloud(&bent(1.0)));
    let mirrored: Vec<Point> = bent(1.0).into_iter().map(|[x, y, z]| [-x, y, z]).collect();
    place.write("b.ply", ply::cloud(&mirrored));
    let args = [
        "morph",
        "a.ply",
        "b.ply",
        "-o",
        "run",
        "--pairs",
        "same-vertices",
        "--quiet",
    ];
    place.isomorph(&args).refused(1, &["the pairs mirror"]);
    assert!(!place.path("run").exists());
}

#[test]
fn a_result_that_is_not_its_input_is_called_so_and_strict_fails() {
    let place = Workplace::new();
    place.write("a.ply", ply::cloud(&ball()));
    place.write("b.ply", ply::cloud(&ball()));
    // Two steps of networks are no ball.
    let args = [
        "morph", "a.ply", "b.ply", "-o", "run", "--preset", "quick", "--pairs", "none", "--frames",
        "2",
    ];
    let few = [
        "training.steps=2",
        "training.guided-until=0",
        "result.resolution=32",
        "implicit.sphere-radius=0.15",
    ];
    let few: Vec<&str> = few.iter().flat_map(|set| ["--set", *set]).collect();
    let ended = place.isomorph(&[&args[..], &few[..]].concat()).succeeded();
    assert!(
        ended.stderr.contains("doubtful: the surface at 0"),
        "{}",
        ended.stderr
    );
    assert!(
        !ended.stderr.contains("nothing speaks against"),
        "{}",
        ended.stderr
    );
    let strict = [&args[..], &few[..], &["--strict", "--force", "--quiet"]].concat();
    place
        .isomorph(&strict)
        .refused(1, &["contradicts the shapes"]);
}

/// A reflection fits the pairs better than any rotation, and yet nothing is mirrored.
#[test]
fn a_sheet_that_bends_the_other_way_is_no_mirror_image() {
    let place = Workplace::new();
    place.write("a.ply", ply::text(&cloth(0.3)));
    place.write("b.ply", ply::text(&cloth(-0.2)));
    let morph = [
        "morph", "a.ply", "b.ply", "-o", "run", "--frames", "2", "--strict",
    ];
    let more = ["--pairs", "same-vertices", "--set", "result.resolution=64"];
    place
        .isomorph(&[&morph[..], &more[..]].concat())
        .succeeded();
    // Seen in a mirror, with its outside where it was: that is refused.
    let mut mirrored = cloth(0.3).map(|[x, y, z]| [-x, y, z]);
    mirrored.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    place.write("b.ply", ply::text(&mirrored));
    place
        .isomorph(&[&morph[..], &more[..], &["--force", "--quiet"]].concat())
        .refused(1, &["the pairs mirror"]);
}

/// A square sheet of side 2, bent upwards by `bend` along x.
fn cloth(bend: f64) -> Mesh {
    const SIDE: u32 = 24;
    let at = |i: u32| f64::from(i) / f64::from(SIDE) * 2.0 - 1.0;
    let corners = (0..=SIDE).flat_map(|i| (0..=SIDE).map(move |k| (i, k)));
    let vertices = corners.map(|(i, k)| [at(i), at(k), bend * at(i) * at(i)]);
    let cells = (0..SIDE).flat_map(|i| (0..SIDE).map(move |k| i * (SIDE + 1) + k));
    let two = |a: u32| {
        let b = a + SIDE + 1;
        [[a, b, b + 1], [a, b + 1, a + 1]]
    };
    Mesh {
        vertices: vertices.collect(),
        triangles: cells.flat_map(two).collect(),
    }
}

#[test]
fn a_sheet_has_a_thickness_and_is_cut_off_nowhere() {
    let place = Workplace::new();
    place.write("a.ply", ply::text(&cloth(0.0)));
    place.write("b.ply", ply::text(&cloth(0.4)));
    let morph = [
        "morph",
        "a.ply",
        "b.ply",
        "-o",
        "run",
        "--pairs",
        "same-vertices",
    ];
    let more = [
        "--frames",
        "3",
        "--set",
        "result.resolution=128",
        "--strict",
    ];
    let said = place
        .isomorph(&[&morph[..], &more[..]].concat())
        .succeeded()
        .stderr;
    // The side of a sheet of area 1 is a unit of the recipe: 0.02 of about 2.05.
    assert!(
        said.contains("an open sheet has no inside: its surfaces are 0.04"),
        "{said}"
    );
    assert!(
        !said.contains("doubtful") && !said.contains("the box cuts"),
        "{said}"
    );
    let thickness = 0.02 * 2.05;
    place
        .isomorph(&[
            "extract",
            "run",
            "--times",
            "0,0.5,1",
            "--resolution",
            "160",
            "--carry",
            "-o",
            "out",
        ])
        .succeeded();
    for (k, bend) in [0.0, 0.2, 0.4].into_iter().enumerate() {
        let surface = Ply::read(&place.path(&format!("out/surface-00{k}.ply"))).mesh();
        assert!(
            surface.is_closed() && surface.components() == 1,
            "at frame {k}"
        );
        // The area of the bent sheet times its thickness, and half a tube around its rim.
        let area = 4.0 * (1.0 + 2.0 / 3.0 * bend * bend);
        let wanted = area * thickness + 8.0 * std::f64::consts::PI / 8.0 * thickness * thickness;
        let volume = surface.volume() / wanted;
        assert!((0.85..1.15).contains(&volume), "at frame {k}: {volume}");
    }
}
