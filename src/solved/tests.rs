//! Solved fields as the rest of the program sees them: trained, stored, resumed, extracted.

mod found;
mod partial;

use isomorph_training::engine::Trainer;

use super::*;
use crate::geometry::testing::bumpy_sphere;
use crate::geometry::{Bounds, Mesh};
use crate::shape::{Normalisation, PointCloud};

/// A bumpy sphere at two places, 0.2 apart along x and turned by `angle` about z, with all vertices as pairs.
fn keyframes(angle: f32) -> Keyframes {
    let first: Mesh<f32> = bumpy_sphere(30).moved(|x| x.map(|part| part as f32));
    let (sin, cos) = angle.sin_cos();
    let last = first.moved(|[x, y, z]| [cos * x - sin * y + 0.2, sin * x + cos * y, z]);
    let key = |time: f64, mesh: &Mesh<f32>| Keyframe {
        time,
        cloud: PointCloud {
            points: mesh.vertices.clone(),
            normals: Some(mesh.vertex_normals()),
        },
        mesh: Some(mesh.clone()),
        border: Vec::new(),
        sheet: None,
    };
    let pairs = first
        .vertices
        .iter()
        .copied()
        .zip(last.vertices.iter().copied());
    let bounds = Bounds::of(&first.vertices).union(&Bounds::of(&last.vertices));
    Keyframes {
        between: vec![pairs.collect()],
        confidence: vec![Vec::new()],
        keys: vec![key(0.0, &first), key(1.0, &last)],
        placements: Default::default(),
        normalisation: Normalisation {
            centre: [0.0; 3],
            scale: 1.0,
        },
        bounds,
        notes: Vec::new(),
    }
}

fn recipe(changes: &[&str]) -> Recipe {
    let mut recipe = Recipe::between("a.ply", "b.ply").expect("two files");
    let set = ["preset=instant", "training.steps=6", "spline.band=3000"];
    let set = set.iter().chain(changes).map(|change| (*change).to_owned());
    recipe.with_all(&set.collect::<Vec<_>>()).expect("a recipe");
    recipe
}

fn trained(recipe: &Recipe, keyframes: &Keyframes) -> Solved {
    let (mut solved, data) = (
        Solved::new(recipe, keyframes).expect("shapes"),
        keyframes.training_data(),
    );
    for step in 0..recipe.training.steps {
        solved.advance(&data, step, false);
    }
    solved
}

#[test]
fn the_surface_is_the_shape_where_the_motion_takes_it() {
    let keyframes = keyframes(0.6);
    let deformation = trained(&recipe(&[]), &keyframes).deformation();
    let (field, motion) = (
        deformation.field().expect("one"),
        deformation.motion().expect("one"),
    );
    let source = &keyframes.keys[0].cloud.points;
    let target = &keyframes.keys[1].cloud.points;
    for (time, points) in [(0.0, source), (1.0, target)] {
        let off = field
            .values(points, time)
            .into_iter()
            .map(f32::abs)
            .fold(0.0, f32::max);
        // On the shapes themselves it is their distance, exact in f32.
        assert!(off < 1e-5, "at {time}: {off}");
    }
    let carried = motion.carry(source, 0.0, 0.5);
    let off = field.values(&carried, 0.5).into_iter().map(f32::abs);
    let mean = off.sum::<f32>() / carried.len() as f32;
    assert!(mean < 1e-3, "{mean}");
    let arrived = motion.path(source, &[0.3, 1.0]).remove(1);
    let miss = arrived
        .iter()
        .zip(target)
        .map(|(a, b)| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f32>().sqrt());
    let mean = miss.sum::<f32>() / arrived.len() as f32;
    assert!(mean < 2e-3, "{mean}");
}

#[test]
fn gradients_are_those_of_the_values() {
    let keyframes = keyframes(0.6);
    let deformation = trained(&recipe(&[]), &keyframes).deformation();
    let field = deformation.field().expect("one");
    let (time, step) = (0.4, 2e-3);
    let places = crate::geometry::testing::random_places(150, 0.5, 3);
    let gradients = field.gradients(&places, time);
    let mut far = 0;
    for (x, gradient) in places.iter().zip(&gradients) {
        let mut off = 0.0_f32;
        for axis in 0..3 {
            let at = |by: f32| {
                let mut x = *x;
                x[axis] += by;
                field.values(&[x], time)[0]
            };
            off = off.max(((at(step) - at(-step)) / (2.0 * step) - gradient[axis]).abs());
        }
        far += usize::from(off > 0.02);
    }
    // Where the closest point of a shape changes there is no gradient: a few places lie near such.
    assert!(far < 12, "{far} of 150");
}

#[test]
fn a_checkpoint_gives_the_same_field_and_goes_on_to_the_same_bits() {
    let keyframes = keyframes(0.6);
    let (recipe, data) = (recipe(&[]), keyframes.training_data());
    let whole = trained(&recipe, &keyframes);
    let mut first = Solved::new(&recipe, &keyframes).expect("shapes");
    for step in 0..4 {
        first.advance(&data, step, false);
    }
    let records = first.records().expect("it can be stored");
    let mut second = Solved::new(&recipe, &keyframes).expect("shapes");
    second.restore(&records).expect("its own record");
    for step in 4..6 {
        second.advance(&data, step, false);
    }
    assert_eq!(
        second.records().expect("stored").0,
        whole.records().expect("stored").0
    );
    // A run that is only looked at has no shapes but those of its checkpoint.
    let mut seen = Solved::unset();
    seen.restore(&whole.records().expect("stored"))
        .expect("whole");
    let points = &keyframes.keys[0].cloud.points[..50];
    let values = |solved: &Solved| {
        solved
            .deformation()
            .field()
            .expect("one")
            .values(points, 0.3)
    };
    assert_eq!(values(&seen), values(&whole));
}

#[test]
fn damaged_records_are_refused_by_name() {
    let keyframes = keyframes(0.2);
    let recipe = recipe(&[]);
    let solved = Solved::new(&recipe, &keyframes).expect("shapes");
    let records = solved.records().expect("stored");
    for k in 0..2 {
        let mut cut = records.clone();
        let half = cut.0[k].1.len() / 2;
        cut.0[k].1.truncate(half);
        let error = Solved::unset().restore(&cut).expect_err("cut");
        assert_eq!(error.file, records.0[k].0);
        let mut lost = records.clone();
        lost.0.remove(k);
        let error = Solved::unset().restore(&lost).expect_err("lost");
        assert_eq!(
            (error.file, error.problem.as_str()),
            (records.0[k].0.clone(), "it is missing")
        );
    }
}

#[test]
fn each_term_is_reported_with_its_weight() {
    let keyframes = keyframes(0.6);
    let recipe = recipe(&["loss.strain=5", "training.seed=3"]);
    let mut solved = Solved::new(&recipe, &keyframes).expect("shapes");
    let terms = solved
        .advance(&keyframes.training_data(), 0, true)
        .expect("read");
    let names: Vec<&str> = terms.iter().map(|term| term.name).collect();
    assert_eq!(
        names,
        ["matching", "on-surface", "strain", "divergence", "screw"]
    );
    // Before the first step nothing moves: pairs are as far apart as they were given.
    let apart = keyframes.between[0].iter().map(|(a, b)| {
        (0..3)
            .map(|i| f64::from(a[i] - b[i]).powi(2))
            .sum::<f64>()
            .sqrt()
    });
    let mean = apart.sum::<f64>() / keyframes.between[0].len() as f64;
    assert!(
        (terms[0].raw - mean).abs() < 0.05 * mean,
        "{} {mean}",
        terms[0].raw
    );
    assert_eq!(terms[0].weighted, 200.0 * terms[0].raw);
    let terms = solved
        .advance(&keyframes.training_data(), 1, true)
        .expect("read");
    assert!(terms[2].raw > 0.0 && terms[2].weighted == 5.0 * terms[2].raw);
}

#[test]
fn a_pair_of_low_confidence_pulls_less() {
    // Each point has two pairs: where it belongs, and a place 0.1 above that.
    let height = |low: [f32; 2]| {
        let mut keyframes = keyframes(0.3);
        let right = keyframes.between[0].clone();
        let above = right.iter().map(|&(a, [x, y, z])| (a, [x, y, z + 0.1]));
        keyframes.between[0].extend(above);
        let count = right.len();
        keyframes.confidence[0] = [vec![low[0]; count], vec![low[1]; count]].concat();
        // The surfaces decide nothing, so that the pairs do: all of them, or points would keep one of their two.
        let recipe = recipe(&["loss.on-surface=0", "training.correspondence-batch=4000"]);
        let deformation = trained(&recipe, &keyframes).deformation();
        let motion = deformation.motion().expect("one");
        let starts: Vec<[f32; 3]> = right.iter().map(|pair| pair.0).collect();
        let ends = motion.carry(&starts, 0.0, 1.0);
        let risen = ends
            .iter()
            .zip(&right)
            .map(|(end, (_, goal))| end[2] - goal[2]);
        risen.sum::<f32>() / count as f32
    };
    let (sure, unsure) = (height([1.0, 0.2]), height([0.2, 1.0]));
    // Distances are not squared: the surer of two pairs wins, and the regularisers take a little.
    assert!(
        sure.abs() < 0.02 && (unsure - 0.1).abs() < 0.02,
        "{sure} {unsure}"
    );
}

#[test]
fn shapes_without_a_distance_are_refused_with_a_cure() {
    let mut keyframes = keyframes(0.2);
    keyframes.keys[1].mesh = None;
    keyframes.keys[1].cloud.normals = None;
    let Err(text) = Solved::new(&recipe(&[]), &keyframes) else {
        panic!("it has no distance");
    };
    assert!(
        text.contains("the target") && text.contains("data.normals"),
        "{text}"
    );
}

#[test]
fn every_key_that_it_names_acts() {
    let keyframes = keyframes(0.6);
    let outcome = |changes: &[&str]| {
        let recipe = recipe(changes);
        let mut solved = Solved::new(&recipe, &keyframes).expect("shapes");
        for step in 0..4 {
            solved.advance(&keyframes.training_data(), step, false);
        }
        solved.records().expect("stored").0
    };
    let plain = outcome(&[]);
    for change in [
        "loss.matching=100",
        "loss.on-surface=50",
        "loss.strain=6",
        "loss.divergence=4",
        "loss.screw=10",
        "training.steps=8",
        "training.correspondence-batch=300",
        "training.time-steps=4",
        "training.band-widths=[0.03]",
        "training.seed=1",
        "spline.spacing=0.1",
        "spline.coarse-shares=[0]",
        "spline.band=4000",
        "spline.surface-samples=100",
        "spline.robust=0.03",
        "spline.iterations=5",
        "spline.tolerance=0.3",
    ] {
        assert!(outcome(&[change]) != plain, "{change}: nothing changed");
    }
}

#[test]
fn the_guide_of_networks_is_the_field_of_the_preset() {
    let keyframes = keyframes(0.6);
    let mut network = Recipe::between("a.ply", "b.ply").expect("two files");
    let changes = ["preset=quick", "loss.strain=4", "training.seed=7"].map(str::to_owned);
    network.with_all(&changes).expect("a recipe");
    let guidance = guide(&network, &keyframes).expect("a field");
    let solved = trained(
        &recipe(&[
            "training.steps=18",
            "spline.band=24000",
            "loss.strain=4",
            "training.seed=7",
        ]),
        &keyframes,
    );
    let places = crate::geometry::testing::random_places(50, 0.5, 3);
    let times = vec![0.3; places.len()];
    let Field::Pair(field) = solved.field() else {
        panic!("two shapes");
    };
    let expected = field.values(&places, 0.3);
    assert_eq!(guidance.guide.velocities(&places, &times), expected);
    assert_eq!(guidance.completed, [None, None]);
}

#[test]
fn motions_that_splines_do_not_have_are_named() {
    let keyframes = keyframes(0.6);
    for (change, named) in [
        ("velocity.time-dependent=false", "time-dependent"),
        ("loss.smoothness=1", "loss.smoothness"),
        ("loss.strain-scale=0.1", "loss.strain-scale"),
    ] {
        let mut network = Recipe::between("a.ply", "b.ply").expect("two files");
        network.with(change).expect("a recipe");
        let told = super::guide(&network, &keyframes).err();
        assert!(
            told.as_ref().is_some_and(|told| told.contains(named)),
            "{change}: {told:?}"
        );
    }
}

#[test]
fn a_field_without_time_is_stored_and_read() {
    let keyframes = keyframes(0.3);
    let recipe = recipe(&["velocity.time-dependent=false"]);
    let whole = trained(&recipe, &keyframes);
    let Field::Pair(field) = whole.field() else {
        panic!("two shapes");
    };
    assert_eq!(field.time_basis(), isomorph_spline::TimeBasis::Constant);
    let records = whole.records().expect("stored");
    let mut seen = Solved::unset();
    seen.restore(&records).expect("its own record");
    assert_eq!(seen.field().coefficients(), whole.field().coefficients());
    let mut again = Solved::new(&recipe, &keyframes).expect("shapes");
    again.restore(&records).expect("its own record");
}

/// A bumpy sphere that falls faster and faster, at three uneven times.
fn falling() -> Keyframes {
    let first: Mesh<f32> = bumpy_sphere(30).moved(|x| x.map(|part| part as f32));
    let times = [0.0, 0.4, 1.0];
    let meshes = times.map(|time: f64| {
        let way = 0.3 * (time * time) as f32;
        first.moved(|[x, y, z]| [x, y, z - way])
    });
    let mut out = keyframes(0.0);
    out.keys = (times.iter().zip(&meshes))
        .map(|(time, mesh)| Keyframe {
            time: *time,
            cloud: PointCloud {
                points: mesh.vertices.clone(),
                normals: Some(mesh.vertex_normals()),
            },
            mesh: Some(mesh.clone()),
            border: Vec::new(),
            sheet: None,
        })
        .collect();
    out.between = (meshes.windows(2))
        .map(|two| {
            let ends = two[0].vertices.iter().zip(&two[1].vertices);
            ends.map(|(a, b)| (*a, *b)).collect()
        })
        .collect();
    out.confidence = vec![Vec::new(); 2];
    out
}

fn of_many(changes: &[&str]) -> Recipe {
    let shapes = [("a.ply", 0.0), ("b.ply", 0.4), ("c.ply", 1.0)];
    let mut recipe = Recipe::through(&shapes).expect("three files");
    let set = ["training.steps=6", "spline.band=2000"];
    let set = set.iter().chain(changes).map(|change| (*change).to_owned());
    recipe.with_all(&set.collect::<Vec<_>>()).expect("a recipe");
    recipe
}

fn mean_z(points: &[[f32; 3]]) -> f32 {
    points.iter().map(|x| x[2]).sum::<f32>() / points.len() as f32
}

#[test]
fn many_key_frames_have_each_its_own_surface_and_one_smooth_motion() {
    let keyframes = falling();
    // At a key frame, just before and just after it: what the speed is, and how much it jumps.
    let jump = |changes: &[&str]| {
        let deformation = trained(&of_many(changes), &keyframes).deformation();
        let field = deformation.field().expect("one");
        let motion = deformation.motion().expect("one");
        for key in &keyframes.keys {
            let off = field.values(&key.cloud.points, key.time).into_iter();
            let off = off.map(f32::abs).fold(0.0, f32::max);
            assert!(off < 1e-5, "at the key frame {}: {off}", key.time);
        }
        let there = &keyframes.keys[1].cloud.points;
        let speed = |time: f64| mean_z(&motion.velocities(there, time));
        let ends = motion.carry(&keyframes.keys[0].cloud.points, 0.0, 1.0);
        let back = motion.carry(&ends, 1.0, 0.0);
        let lost = mean_z(&back) - mean_z(&keyframes.keys[0].cloud.points);
        assert!(lost.abs() < 1e-4, "there and back: {lost}");
        let path = motion.path(&keyframes.keys[0].cloud.points, &[0.4, 0.4, 1.0]);
        assert_eq!(path[0], path[1]);
        assert_eq!(path[2], ends);
        (speed(0.4 - 1e-6), speed(0.4 + 1e-6))
    };
    let (before, after) = jump(&[]);
    // The true speed is .24; that of straight lines is .12 before the key frame and .42 after it.
    assert!((before - after).abs() < 1e-4, "{before} {after}");
    assert!((before + 0.24).abs() < 0.05, "{before}");
    let (before, after) = jump(&["spline.motion=pairs"]);
    assert!((before - after).abs() > 0.2, "by pairs: {before} {after}");
}

#[test]
fn fields_through_many_key_frames_are_stored_read_and_gone_on_with() {
    let keyframes = falling();
    for changes in [&[][..], &["spline.motion=pairs"]] {
        let recipe = of_many(changes);
        let whole = trained(&recipe, &keyframes);
        let mut half = Solved::new(&recipe, &keyframes).expect("shapes");
        let data = keyframes.training_data();
        for step in 0..4 {
            half.advance(&data, step, false);
        }
        let records = half.records().expect("stored");
        let mut resumed = Solved::new(&recipe, &keyframes).expect("shapes");
        resumed.restore(&records).expect("its own record");
        for step in 4..6 {
            resumed.advance(&data, step, false);
        }
        assert!(resumed.field() == whole.field(), "the same bits");
        let mut seen = Solved::unset();
        seen.restore(&whole.records().expect("stored"))
            .expect("its own record");
        assert!(seen.field() == whole.field(), "the same bits");
        let points = &keyframes.keys[0].cloud.points;
        let of = |solved: &Solved| {
            let deformation = solved.deformation();
            deformation.field().expect("one").values(points, 0.7)
        };
        assert_eq!(of(&seen), of(&whole));
    }
    // A record of one field is none of two.
    let one = trained(&of_many(&[]), &keyframes)
        .records()
        .expect("stored");
    let mut two = Solved::new(&of_many(&["spline.motion=pairs"]), &keyframes).expect("shapes");
    let refused = two.restore(&one).expect_err("another kind").problem;
    assert!(
        refused.contains("another number of key frames"),
        "{refused}"
    );
}
