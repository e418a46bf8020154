//! Tests of the preparation of key frames.

use std::fmt::Write as _;
use std::path::Path;

use super::*;
use crate::geometry::testing::{sphere_cloud, tetrahedron};

/// The corner of a cube as OBJ, scaled and moved; `inwards` turns every triangle around.
fn write_tetrahedron(path: &Path, scale: f64, inwards: bool, faces: usize) {
    let mesh = tetrahedron(0.0);
    let mut text = String::new();
    for [x, y, z] in mesh.vertices {
        writeln!(text, "v {} {} {}", scale * x + 5e5, scale * y, scale * z).expect("grows");
    }
    for [a, b, c] in &mesh.triangles[..faces] {
        let (b, c) = if inwards { (c, b) } else { (b, c) };
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("grows");
    }
    std::fs::write(path, text).expect("written");
}

fn write_cloud(path: &Path, points: &[[f64; 3]], normals: Option<&[[f64; 3]]>) {
    let mut text = String::new();
    for [x, y, z] in points {
        writeln!(text, "v {x} {y} {z}").expect("grows");
    }
    for [x, y, z] in normals.unwrap_or_default() {
        writeln!(text, "vn {x} {y} {z}").expect("grows");
    }
    std::fs::write(path, text).expect("written");
}

/// Two shapes as files, and what to make of them.
struct Files {
    folder: tempfile::TempDir,
    source: PathBuf,
    target: PathBuf,
    options: DataOptions,
}

impl Files {
    fn prepare(&self) -> Result<Keyframes, ShapeError> {
        let shapes = [&self.source, &self.target].map(|path| crate::formats::read(path));
        let [source, target] = shapes.map(|shape| shape.expect("a shape"));
        prepare(&[source, target], &self.options)
    }

    fn prepared(&self) -> Keyframes {
        self.prepare().expect("prepared")
    }
}

/// Two tetrahedra in a folder of their own, the second twice as large, and options for them.
fn tetrahedra() -> Files {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = DataOptions {
        times: vec![0.0, 1.0],
        between: vec![CorrespondenceSource::SameVertices],
        points: 1000,
        correspondence_fraction: 0.05,
        normals: NormalSource::Auto,
        mirrored: false,
        sheets: None,
        normalisation: None,
        seed: 9,
    };
    let (source, target) = (folder.path().join("a.obj"), folder.path().join("b.obj"));
    write_tetrahedron(&source, 1.0, false, 4);
    write_tetrahedron(&target, 2.0, false, 4);
    Files {
        folder,
        source,
        target,
        options,
    }
}

/// The point in the user's coordinates relative to the corner of the tetrahedron.
fn relative(pair: &Keyframes, point: [f32; 3]) -> [f64; 3] {
    let [x, y, z] = pair.normalisation.invert(point);
    [x - 5e5, y, z]
}

#[test]
fn shared_triangles_give_surface_pairs_at_equal_barycentric_coordinates() {
    let files = tetrahedra();
    let pair = files.prepared();
    assert_eq!(pair.keys[0].cloud.points.len(), 1000);
    assert_eq!(pair.between[0].len(), 50);
    assert_eq!(pair.notes, Vec::<String>::new());
    for &(from, to) in &pair.between[0] {
        let (from, to) = (relative(&pair, from), relative(&pair, to));
        for axis in 0..3 {
            // Float32 in a frame two units wide.
            assert!(
                (2.0 * from[axis] - to[axis]).abs() < 1e-6,
                "{from:?} {to:?}"
            );
        }
    }
    // Not merely the vertices: there are only four.
    assert!(
        pair.between[0]
            .iter()
            .any(|&(from, _)| relative(&pair, from)[0] % 1.0 > 0.01)
    );
}

#[test]
fn the_same_options_give_the_same_pair_and_another_seed_another() {
    let mut files = tetrahedra();
    let first = files.prepared();
    assert_eq!(files.prepared(), first);
    files.options.seed = 10;
    let second = files.prepared();
    assert_ne!(second.keys[0].cloud.points, first.keys[0].cloud.points);
    assert_ne!(first.keys[0].cloud.points, first.keys[1].cloud.points);
    assert_eq!(second.normalisation, first.normalisation);
}

#[test]
fn pairs_from_a_file_are_used_up_to_the_fraction() {
    let mut files = tetrahedra();
    let path = files.folder.path().join("pairs.csv");
    std::fs::write(&path, "0,0\n1,3\n2,2\n").expect("written");
    files.options.between = vec![CorrespondenceSource::File(path)];
    let pair = files.prepared();
    let places = |(from, to)| (relative(&pair, from), relative(&pair, to));
    let round = |x: [f64; 3]| x.map(|coordinate| (coordinate * 1e5).round() / 1e5);
    let (from, to) = places(pair.between[0][1]);
    assert_eq!((round(from), round(to)), ([1.0, 0.0, 0.0], [0.0, 0.0, 2.0]));
    assert_eq!(pair.between[0].len(), 3);
    let one_based = files.folder.path().join("map.txt");
    std::fs::write(&one_based, "1\n4\n3\n2\n").expect("written");
    files.options.between = vec![CorrespondenceSource::File(one_based)];
    let mapped = files.prepared();
    assert_eq!(mapped.between[0].len(), 4);
    assert_eq!(mapped.between[0][1], pair.between[0][1]);
    assert!(
        mapped.notes[0].contains("map.txt: no vertex is 0 and one"),
        "{:?}",
        mapped.notes
    );
    files.options.correspondence_fraction = 0.002;
    assert_eq!(files.prepared().between[0].len(), 2);
    for fraction in [0.0, -1.0, f64::NAN] {
        files.options.correspondence_fraction = fraction;
        let text = files.prepare().expect_err("none left").to_string();
        assert!(
            text.starts_with("data.correspondence-fraction = "),
            "{text}"
        );
    }
    files.options.between = vec![CorrespondenceSource::None];
    assert!(files.prepared().between[0].is_empty());
}

#[test]
fn a_mesh_wound_inwards_has_its_normals_flipped_unless_told_not_to() {
    let mut files = tetrahedra();
    let outward = files.prepared().keys[0].cloud.normals.clone();
    write_tetrahedron(&files.source, 1.0, true, 4);
    let pair = files.prepared();
    assert_eq!(pair.notes.len(), 1);
    assert!(
        pair.notes[0].contains("a.obj: triangles are wound inwards"),
        "{:?}",
        pair.notes
    );
    let inside = |normals: &Option<Vec<[f32; 3]>>| {
        let normals = normals.as_ref().expect("normals").iter();
        // The slanted face is the only one whose outward normal has positive coordinates.
        normals
            .filter(|normal| normal.iter().any(|&x| x > 0.01) != (normal[0] > 0.5))
            .count()
    };
    assert_eq!(
        [inside(&outward), inside(&pair.keys[0].cloud.normals)],
        [0, 0]
    );
    files.options.normals = NormalSource::Given;
    let given = files.prepared();
    assert!(inside(&given.keys[0].cloud.normals) > 0, "as wound");
    files.options.normals = NormalSource::None;
    assert_eq!(files.prepared().keys[0].cloud.normals, None);
}

#[test]
fn an_open_mesh_and_one_wound_both_ways_are_noted() {
    let files = tetrahedra();
    write_tetrahedron(&files.source, 1.0, false, 3);
    let text = std::fs::read_to_string(&files.target).expect("read");
    let turned = text.replacen("f 1 3 2", "f 1 2 3", 1);
    assert_ne!(text, turned);
    std::fs::write(&files.target, turned).expect("written");
    let notes = files.prepared().notes;
    assert!(
        notes[0].contains("b.obj: 1 of 4 triangles are wound against the rest: turned"),
        "{notes:?}"
    );
    assert!(
        notes[1].contains("a.obj: the mesh is not closed (3 open edges"),
        "{notes:?}"
    );
    assert_eq!(notes.len(), 2, "b.obj is closed");
}

#[test]
fn a_cloud_is_used_as_it_is_with_its_own_normals_or_estimated_ones() {
    let mut files = tetrahedra();
    let points = sphere_cloud(500, 2.0, 31);
    let inward: Vec<_> = points.iter().map(|point| point.map(|x| -x)).collect();
    write_cloud(&files.source, &points, Some(&inward));
    write_cloud(&files.target, &points, None);
    let pair = files.prepared();
    assert_eq!(pair.keys[0].cloud.points.len(), 500);
    // 5 % of the 500 points there are, not of the 1,000 asked of meshes.
    assert_eq!(pair.between[0].len(), 25);
    assert!(
        pair.notes[0]
            .contains("a.obj: the file's normals point inwards at 500 of 500 points: turned over"),
        "{:?}",
        pair.notes
    );
    assert!(
        pair.notes[1].contains("b.obj: the file has no normals: estimated"),
        "{:?}",
        pair.notes
    );
    assert_eq!(pair.notes.len(), 2);
    write_cloud(&files.source, &points, Some(&points));
    assert_eq!(files.prepared().notes.len(), 1);
    write_cloud(&files.source, &points, Some(&inward));
    let outward = |cloud: &PointCloud| {
        let normals = cloud.normals.as_ref().expect("normals");
        let pairs = cloud.points.iter().zip(normals);
        pairs
            .filter(|(p, n)| p.iter().zip(*n).map(|(p, n)| p * n).sum::<f32>() > 0.0)
            .count()
    };
    assert_eq!(
        [outward(&pair.keys[0].cloud), outward(&pair.keys[1].cloud)],
        [500, 500]
    );
    files.options.normals = NormalSource::Given;
    let text = files.prepare().expect_err("no normals").to_string();
    assert!(
        text.contains("b.obj: the file has no normals; set data.normals"),
        "{text}"
    );
    files.options.normals = NormalSource::Estimate;
    let pair = files.prepared();
    assert_eq!(
        [outward(&pair.keys[0].cloud), outward(&pair.keys[1].cloud)],
        [500, 500]
    );
}

#[test]
fn pairs_that_mirror_the_shape_are_refused_unless_that_is_meant() {
    let mut files = tetrahedra();
    let points = sphere_cloud(500, 2.0, 31);
    let bent: Vec<_> = points
        .iter()
        .map(|[x, y, z]| [*x, *y, z + 0.3 * x * y])
        .collect();
    let mirrored: Vec<_> = bent.iter().map(|[x, y, z]| [-x, *y, *z]).collect();
    write_cloud(&files.source, &bent, None);
    write_cloud(&files.target, &mirrored, None);
    let text = files.prepare().expect_err("mirrored").to_string();
    assert!(
        text.contains("the pairs mirror") && text.contains("b.obj"),
        "{text}"
    );
    files.options.mirrored = true;
    assert_eq!(files.prepared().between[0].len(), 25);
    files.options.mirrored = false;
    write_cloud(&files.target, &bent, None);
    assert_eq!(files.prepared().between[0].len(), 25);
}

#[test]
fn pairs_that_were_found_and_mirror_one_of_many_are_left_out() {
    let mut files = tetrahedra();
    let points = sphere_cloud(500, 2.0, 31);
    let bent: Vec<_> = points
        .iter()
        .map(|[x, y, z]| [*x, *y, z + 0.3 * x * y])
        .collect();
    let mirrored: Vec<_> = bent.iter().map(|[x, y, z]| [-x, *y, *z]).collect();
    write_cloud(&files.source, &bent, None);
    write_cloud(&files.target, &mirrored, None);
    let [bent, mirrored] =
        [&files.source, &files.target].map(|path| crate::formats::read(path).expect("a shape"));
    let known = Correspondences::same_vertices(&bent, &mirrored).expect("pairs");
    let found = CorrespondenceSource::Pairs(known);
    files.options.times = vec![0.0, 0.5, 1.0];
    files.options.between = vec![found.clone(), found.clone()];
    let three = [bent.clone(), bent, mirrored];
    let keyframes = prepare(&three, &files.options).expect("the other interval stands");
    assert_eq!(
        [keyframes.between[0].len(), keyframes.between[1].len()],
        [25, 0]
    );
    let said = "from key frame 1 to key frame 2 the surfaces alone lead, without the pairs that were found: the pairs mirror";
    let notes = &keyframes.notes;
    assert!(notes.iter().any(|note| note.starts_with(said)), "{notes:?}");
    // Pairs that are given are refused as ever.
    files.options.between[1] = CorrespondenceSource::SameVertices;
    let error = prepare(&three, &files.options).expect_err("mirrored");
    assert!(error.to_string().contains("the pairs mirror"), "{error}");
}

#[test]
fn a_target_in_another_unit_is_said_to_be() {
    let files = tetrahedra();
    let points = sphere_cloud(500, 2.0, 31);
    let metres: Vec<_> = points.iter().map(|p| p.map(|x| x / 1000.0)).collect();
    write_cloud(&files.source, &points, None);
    write_cloud(&files.target, &metres, None);
    let notes = files.prepared().notes;
    assert!(
        notes[0].contains("1000.0 times smaller in length than"),
        "{notes:?}"
    );
}

#[test]
fn the_bounds_hold_every_point_of_both() {
    let mut files = tetrahedra();
    let pair = files.prepared();
    for point in pair.keys[0]
        .cloud
        .points
        .iter()
        .chain(&pair.keys[1].cloud.points)
    {
        assert_eq!(pair.bounds.union(&Bounds::of(&[*point])), pair.bounds);
    }
    // And no more: half of a box this size would not.
    assert_ne!(pair.bounds, Bounds::of(&pair.keys[0].cloud.points));
    files.options.points = 63;
    let text = files.prepare().expect_err("too few").to_string();
    assert_eq!(text, "data.points = 63: must be 64 or more");
}

#[test]
fn three_key_frames_have_pairs_between_each_two_and_samples_of_their_own() {
    let files = tetrahedra();
    let shapes =
        [&files.source, &files.target, &files.source].map(|path| crate::formats::read(path));
    let shapes = shapes.map(|shape| shape.expect("a shape"));
    let options = DataOptions {
        times: vec![0.0, 0.25, 1.0],
        between: vec![
            CorrespondenceSource::SameVertices,
            CorrespondenceSource::None,
        ],
        ..files.options.clone()
    };
    let three = prepare(&shapes, &options).expect("prepared");
    assert_eq!([three.between[0].len(), three.between[1].len()], [50, 0]);
    assert_eq!((three.keys.len(), three.pair_count()), (3, 50));
    assert_eq!(three.keys[1].time, 0.25);
    let [first, .., last] = &three.keys[..] else {
        panic!("three key frames")
    };
    assert_ne!(
        first.cloud.points, last.cloud.points,
        "one shape, drawn anew"
    );
    assert_eq!(three.training_data().keys.len(), 3);
}

#[test]
fn a_table_is_about_the_key_frames_from_the_first_on_that_share_it() {
    let of = |between: &str| -> Vec<usize> {
        let between: Vec<char> = between.chars().collect();
        (0..between.len())
            .map(|k| columns(&between, k)[1])
            .collect()
    };
    assert_eq!(of("aaa"), [4, 4, 4]);
    assert_eq!(of("aab"), [3, 3, 4]);
    // One file of pairs, and others.
    assert_eq!(of("abb"), [4, 4, 4]);
    assert_eq!(of("a"), [2]);
}
