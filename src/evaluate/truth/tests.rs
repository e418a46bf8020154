//! Ground truths as they are read, and as they are refused.

use isomorph_training::recipe::natural_order;

use super::*;
use crate::evaluate::testing::sphere;

/// A tetrahedron whose last vertex is at this height, as an ASCII PLY file.
fn write_ply(path: &Path, height: f64, faces: &str) {
    let count = faces.lines().count();
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nelement face {count}\nproperty list uchar int vertex_indices\nend_header\n\
         0 0 0\n1 0 0\n0 1 0\n0 0 {height}\n{faces}\n"
    );
    std::fs::write(path, text).expect("a temporary folder");
}

const FACES: &str = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3";

fn refused(path: &Path) -> String {
    GroundTruth::read(path).expect_err("refused").to_string()
}

/// A sphere that moves by 0.1 a frame, about 1e5 from the origin.
fn moving_sphere() -> (GroundTruth, Normalisation) {
    let ball = sphere(3);
    let frame = |k: usize| {
        let mesh = ball.moved(|[x, y, z]| [x + 1e5 + 0.1 * k as f64, y, z]);
        mesh.vertices
    };
    let frames = (0..6).map(frame).collect();
    let truth = GroundTruth::new("ball.anime".into(), frames, ball.triangles).expect("six frames");
    let ends = [truth.shape(0), truth.shape(5)];
    let normalisation = Normalisation::joint(&[&ends[0], &ends[1]]).expect("areas");
    (truth, normalisation)
}

#[test]
fn a_folder_is_read_in_the_order_in_which_people_count() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for frame in [1, 2, 10] {
        let path = folder.path().join(format!("frame-{frame}.ply"));
        write_ply(&path, f64::from(frame), FACES);
    }
    // Neither is a frame.
    std::fs::write(folder.path().join("frames.json"), "[]").expect("a temporary folder");
    std::fs::write(folder.path().join("._frame-1.ply"), "x").expect("a temporary folder");
    let truth = GroundTruth::read(folder.path()).expect("three frames");
    assert_eq!(truth.frame_count(), 3);
    let heights = [0, 1, 2].map(|frame| truth.vertices(frame)[3][2]);
    assert_eq!(heights, [1.0, 2.0, 10.0]);
    assert_eq!(truth.triangles().len(), 4);
}

#[test]
fn names_are_compared_number_by_number() {
    let mut names = [
        "b2", "a10b1", "a2", "a10", "a010", "a9z", "A3", "a10b02", "é1",
    ];
    names.sort_by(|a, b| natural_order(a, b));
    assert_eq!(
        names,
        [
            "A3", "a2", "a9z", "a010", "a10", "a10b1", "a10b02", "b2", "é1"
        ]
    );
}

#[test]
fn a_sequence_is_read_frame_by_frame() {
    // Three frames of one triangle; each later one is higher by one.
    let whole = [[3, 3, 1], [0, 1, 2]].map(|row: [i32; 3]| row.map(i32::to_le_bytes));
    let first: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let later = [[[0.0, 0.0, 1.0]; 3], [[0.0, 0.0, 2.0]; 3]];
    let real = |rows: [[f32; 3]; 3]| rows.map(|row| row.map(f32::to_le_bytes));
    let bytes = [
        whole[0].concat(),
        real(first).concat().concat(),
        whole[1].concat(),
        later.map(|rows| real(rows).concat().concat()).concat(),
    ];
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("rise.ANIME");
    std::fs::write(&path, bytes.concat()).expect("a temporary folder");
    let truth = GroundTruth::read(&path).expect("three frames");
    assert_eq!(
        truth.vertices(2),
        [[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]]
    );
    assert_eq!(truth.triangles(), [[0, 1, 2]]);
}

#[test]
fn frames_of_different_meshes_are_refused_by_both_their_names() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |frame: usize| folder.path().join(format!("{frame}.ply"));
    (0..3).for_each(|frame| write_ply(&path(frame), 1.0, FACES));
    write_ply(&path(1), 1.0, "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 3 2");
    let text = refused(folder.path());
    assert!(
        text.contains("1.ply: triangle 3 is [1, 3, 2] instead of the [1, 2, 3]"),
        "{text}"
    );
    assert!(text.contains("0.ply"), "{text}");
    write_ply(&path(1), 1.0, "3 0 2 1\n3 0 1 3\n3 0 3 2");
    let text = refused(folder.path());
    assert!(
        text.contains("1.ply: 3 triangles instead of the 4 of "),
        "{text}"
    );
}

#[test]
fn what_is_no_sequence_says_what_one_is() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("0.ply");
    write_ply(&path, 1.0, FACES);
    assert!(refused(&path).contains("0.ply: is not a sequence (allowed: a .anime file"));
    assert!(refused(folder.path()).contains(": 1 frames, at least 3 needed"));
    assert!(refused(&folder.path().join("gone.obj")).contains("gone.obj: cannot be read"));
    assert!(refused(&folder.path().join("gone.anime")).contains("gone.anime: cannot be read"));
}

#[test]
fn a_span_has_frames_in_between_and_times_from_0_to_1() {
    let (truth, _) = moving_sphere();
    let span = truth.span(1, 5).expect("three frames in between");
    assert_eq!(span.between(), 2..5);
    // Quarters are exact.
    assert_eq!([1, 2, 5].map(|frame| span.time(frame)), [0.0, 0.25, 1.0]);
    for (from, to) in [(2, 2), (2, 3), (3, 2), (0, 6)] {
        let text = truth.span(from, to).expect_err("refused").to_string();
        let expected = format!("ball.anime: frames {from} to {to}: ");
        assert!(
            text.starts_with(&expected) && text.contains("frames 0 to 5"),
            "{text}"
        );
    }
}

#[test]
fn a_run_about_other_shapes_or_other_coordinates_is_told_so() {
    let (truth, normalisation) = moving_sphere();
    let span = truth.span(0, 5).expect("four frames in between");
    let points = |frame| truth.normalised(frame, &normalisation);
    let check = |source: &[[f32; 3]], target: &[[f32; 3]]| {
        truth.check_ends(span, &normalisation, source, target)
    };
    check(&points(0), &points(5)).expect("the ends themselves");
    let text = check(&points(1), &points(5))
        .expect_err("another frame")
        .to_string();
    assert!(
        text.starts_with("ball.anime: frame 0 is not the run's source"),
        "{text}"
    );
    let text = check(&points(0), &points(4))
        .expect_err("another frame")
        .to_string();
    assert!(
        text.starts_with("ball.anime: frame 5 is not the run's target"),
        "{text}"
    );
    check(&[[f32::NAN; 3]], &points(5)).expect_err("no distance");
    // A sphere of area 1 moved by 0.1 of its radius of 1/sqrt(4 pi) is away by half of that on
    // average: the mean of |cos| over a sphere. Ten per cent for what is lost to the nearest sample
    // not being the nearest point.
    let distance = truth.distance(0, &normalisation, &points(1));
    let expected = 0.5 * 0.1 / (4.0 * std::f64::consts::PI).sqrt();
    assert!(
        (distance / expected - 1.0).abs() < 0.1,
        "{distance} {expected}"
    );
}
