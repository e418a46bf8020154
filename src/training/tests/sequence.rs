//! Networks through more than two key frames.

use super::*;
use crate::data::{Guide, KeyPoints};
use crate::method::Through;
use crate::turns::turn;

/// Uneven: the first interval is a quarter of the whole.
const TIMES: [f32; 4] = [0.0, 0.25, 0.5, 1.0];

/// Spheres there and back, with their pairs and a guide.
fn through_four() -> TrainingData {
    let two = data();
    let key = |k: usize| -> KeyPoints { two.keys[k % 2].at(TIMES[k]) };
    let pairs = |k: usize| {
        let pairs = two.between[0].iter();
        let turned = pairs.map(|(source, target)| match k % 2 {
            0 => (*source, *target),
            _ => (*target, *source),
        });
        turned.collect()
    };
    let mut data = TrainingData::new((0..4).map(key).collect(), (0..3).map(pairs).collect());
    data.guide.clone_from(&two.guide);
    data
}

/// The small recipe through four key frames with these changes.
fn recipe_through(extra: &[&str]) -> Recipe {
    let key = |time: f32| format!("[[data.keyframe]]\nfile = \"{time}.ply\"\ntime = {time}\n");
    let text = format!("preset = \"quick\"\n{}", TIMES.map(key).concat());
    let set: Vec<String> = [&SMALL[..], extra]
        .concat()
        .iter()
        .map(|text| (*text).to_owned())
        .collect();
    Recipe::parse(&text, Path::new("recipe.toml"), &set).expect("a recipe")
}

#[test]
fn a_step_moves_the_fields_of_its_two_key_frames_and_the_velocity() {
    let (data, recipe) = (through_four(), recipe_through(&[]));
    let mut method = build(&recipe, &data);
    let names = ["end-0000", "end-0001", "end-0002", "end-0003", "velocity"];
    assert_eq!(
        networks(&*method)
            .iter()
            .map(|(file, _)| file.as_str())
            .collect::<Vec<_>>(),
        names.map(|name| format!("{name}.mpk"))
    );
    for step in 0..9 {
        let before = networks(&*method);
        let terms = advance(&mut *method, &data, step);
        assert!(terms.iter().any(|term| term.name == "data"));
        let s = turn(recipe.training.seed, step, 3);
        let moved = networks(&*method).into_iter().zip(before);
        let moved: Vec<bool> = moved.map(|(now, then)| now != then).collect();
        let wanted: Vec<bool> = (0..5)
            .map(|k| k == s || k == s + 1 || k == 4 && step < 7)
            .collect();
        assert_eq!(moved, wanted, "step {step}, interval {s}");
    }
}

#[test]
fn it_resumes_to_the_same_weights() {
    for optimiser in ["adam", "muon"] {
        let (data, extra) = (through_four(), format!("training.optimiser={optimiser}"));
        let recipe = recipe_through(&[&extra]);
        let (mut whole, mut eighth) = (build(&recipe, &data), None);
        for step in 0..10 {
            if step == 8 {
                eighth = Some(whole.records().expect("encodes"));
            }
            let terms = advance(&mut *whole, &data, step);
            assert!(terms.iter().all(|term| term.raw.is_finite()), "{terms:?}");
        }
        let mut again = build(&recipe, &data);
        let eighth = eighth.expect("after step 8");
        again.restore(&eighth).expect("records of the same method");
        advance(&mut *again, &data, 8);
        advance(&mut *again, &data, 9);
        assert!(networks(&*whole) == networks(&*again), "{optimiser}");
        // Those of another number of key frames are not taken.
        let mut fewer = eighth;
        fewer.0.retain(|(file, _)| !file.starts_with("end-0003"));
        build(&recipe, &data)
            .restore(&fewer)
            .expect_err("one is missing");
    }
}

/// What the motion makes of places, from the start of an interval to its end.
fn carried(through: &Through<NdArray>, s: usize, places: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let (_, motion) = (through.part)(s);
    let x = crate::tensors::rows::<NdArray, 3>(places, &Default::default());
    let values = crate::tensors::host(motion.carry(x, 0.0, 1.0));
    values.as_chunks::<3>().0.to_vec()
}

#[test]
fn a_guided_velocity_follows_its_guide_through_all_key_frames() {
    let data = through_four();
    let steps = [
        "training.guided-until=1",
        "training.steps=600",
        "training.velocity-learning-rate=1e-2",
    ];
    let mut method = build(&recipe_through(&steps), &data);
    let start = [[0.4, 0.0, 0.1], [0.0, -0.3, 0.2], [-0.3, 0.3, 0.0]];
    let off = |method: &dyn Method<B>| {
        let through = method.through().expect("more than two key frames");
        assert_eq!(through.times, TIMES.map(f64::from));
        let end = (0..3).fold(start.to_vec(), |at, s| carried(&through, s, &at));
        let there = guided::Turning.carried(&start, &[0.0; 3], &[1.0; 3]);
        let off = end.iter().zip(&there).map(|(a, b)| {
            let squares = (0..3).map(|axis| (a[axis] - b[axis]).powi(2));
            squares.sum::<f32>().sqrt()
        });
        off.sum::<f32>() / 3.0
    };
    let before = off(&*method);
    for step in 0..600 {
        advance(&mut *method, &data, step);
    }
    let after = off(&*method);
    assert!(after < 0.25 * before, "{after}, of {before}");
}

#[test]
fn the_motion_has_no_jump_of_speed_at_a_key_frame() {
    let data = through_four();
    let mut method = build(
        &recipe_through(&["training.velocity-learning-rate=1e-2"]),
        &data,
    );
    for step in 0..10 {
        advance(&mut *method, &data, step);
    }
    let through = method.through().expect("more than two key frames");
    let places = [[0.4, 0.0, 0.1], [0.0, -0.3, 0.2]];
    let x = crate::tensors::rows::<NdArray, 3>(&places, &Default::default());
    let length = |s: usize| (TIMES[s + 1] - TIMES[s]) as f64;
    // In the time of the whole span.
    let velocity = |s: usize, time: f64| -> Vec<f32> {
        let (_, motion) = (through.part)(s);
        let v = motion.velocity(x.clone(), time).expect("it has one");
        crate::tensors::host(v / length(s))
    };
    for s in 0..2 {
        let (before, after) = (velocity(s, 1.0), velocity(s + 1, 0.0));
        // How fast it changes just before and after.
        let step = 2e-3;
        let inner = velocity(s, 1.0 - step / length(s));
        let outer = velocity(s + 1, step / length(s + 1));
        for k in 0..before.len() {
            assert!(before[k].abs() > 1e-4, "it moves: {before:?}");
            assert!((before[k] - after[k]).abs() < 1e-5 * before[k].abs().max(1.0));
            let rates = [before[k] - inner[k], outer[k] - after[k]].map(|by| by / step as f32);
            // The rate is continuous. Its own rate is not: the two differ by that over the step.
            let bound = 0.05 * (rates[0].abs() + rates[1].abs()) + 2e-3;
            assert!(
                (rates[0] - rates[1]).abs() < bound,
                "{rates:?} at key frame {}",
                s + 1
            );
        }
    }
}

#[test]
fn an_interval_is_data_of_its_own_with_the_guide_in_its_time() {
    let data = through_four();
    let part = data.interval(2);
    assert_eq!([part.keys[0].time, part.keys[1].time], [0.0, 1.0]);
    assert_eq!(part.keys[0].points, data.keys[2].points);
    assert_eq!((part.bounds, part.pair_count()), (data.bounds, 200));
    let guide = part.guide.as_ref().expect("that of the whole");
    // Half of the span: half of a radian.
    assert_eq!(
        guide.velocities(&[[1.0, 0.0, 0.0]], &[0.3]),
        [[0.0, 0.5, 0.0]]
    );
    let carried = guide.carried(&[[1.0, 0.0, 0.0]], &[0.0], &[1.0])[0];
    let (sin, cos) = 0.5_f32.sin_cos();
    assert!((carried[0] - cos).abs() < 1e-6 && (carried[1] - sin).abs() < 1e-6);
}
