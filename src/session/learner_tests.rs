//! The loop on small spheres: phases, checkpoints, and what stops a run.

use std::sync::atomic::AtomicBool;

use super::*;
use crate::backend::Backend;
use crate::geometry::Bounds;
use crate::shape::{Keyframe, PointCloud};

fn recipe(extra: &[&str]) -> Recipe {
    let text = "preset = \"quick\"\n[data]\nsource = \"a.ply\"\ntarget = \"b.ply\"\n";
    let small = [
        "data.correspondences=same-vertices",
        "implicit.geometry=network",
        "implicit.activation=softplus",
        "implicit.beta=100",
        "training.velocity-until=0.7",
        "training.integrator=midpoint",
        "training.time-steps=3",
        "implicit.depth=2",
        "implicit.width=8",
        "velocity.depth=2",
        "velocity.width=8",
        "training.batch=88",
        "training.correspondence-batch=8",
        "training.steps=10",
        "training.optimiser=adam",
        "training.log-every=1",
        "checkpoint.every=4",
        "checkpoint.keep=2",
    ];
    let set: Vec<String> = small
        .iter()
        .chain(extra)
        .map(|text| (*text).to_owned())
        .collect();
    Recipe::parse(text, Path::new("recipe.toml"), &set).expect("a valid recipe")
}

/// Points of two spheres, the second moved along x.
fn spheres() -> Keyframes {
    let data = TrainingData::spheres(200, 200);
    let keys = data.keys.iter().map(|key| Keyframe {
        time: f64::from(key.time),
        cloud: PointCloud {
            points: key.points.to_vec(),
            normals: key.normals.as_deref().map(<[_]>::to_vec),
        },
        mesh: None,
        border: Vec::new(),
        sheet: None,
    });
    Keyframes {
        keys: keys.collect(),
        between: data.between,
        confidence: vec![Vec::new()],
        placements: Default::default(),
        normalisation: crate::shape::Normalisation {
            centre: [0.0; 3],
            scale: 1.0,
        },
        bounds: Bounds {
            min: data.bounds.min,
            max: data.bounds.max,
        },
        notes: Vec::new(),
    }
}

fn engine() -> Box<dyn Engine> {
    Backend::Flex.open().expect("a processor")
}

/// A learner of the small recipe with these changes, on two spheres.
fn learner(extra: &[&str]) -> Learner {
    Learner::new(recipe(extra), &spheres(), &*engine()).expect("the spheres have all it needs")
}

fn resumed(
    recipe: Recipe,
    keyframes: &Keyframes,
    checkpoint: &Checkpoint,
) -> Result<Learner, LearnerError> {
    Learner::resume(recipe, keyframes, &*engine(), checkpoint)
}

/// Trains in a folder until done or until `stop_after` steps; the events.
fn train(learner: &mut Learner, folder: &Path, stop_after: Option<usize>) -> Vec<Event> {
    let (stop, mut events) = (AtomicBool::new(false), Vec::new());
    let mut emit = |event: Event| {
        if let Event::Tick { step } = event {
            stop.store(Some(step) == stop_after, Ordering::Relaxed);
        }
        events.push(event);
        Ok(())
    };
    learner
        .run(folder, &stop, &mut emit)
        .expect("a small run trains");
    events
}

#[test]
fn an_interrupted_run_resumes_to_the_same_weights_and_keeps_the_newest_checkpoints() {
    for optimiser in ["training.optimiser=adam", "training.optimiser=muon"] {
        resumes_to_the_same_weights(&[optimiser]);
    }
}

#[track_caller]
fn resumes_to_the_same_weights(keys: &[&str]) {
    let whole = tempfile::tempdir().expect("a temporary folder");
    let torn = tempfile::tempdir().expect("a temporary folder");
    train(&mut learner(keys), whole.path(), None);
    let mut first = learner(keys);
    let events = train(&mut first, torn.path(), Some(7));
    assert!(
        events
            .iter()
            .any(|event| matches!(event, Event::Interrupted { step: 7 }))
    );
    let newest = Checkpoint::newest(torn.path()).expect("written on the interrupt");
    assert_eq!(newest.state.step, 7);
    let mut second = resumed(recipe(keys), &spheres(), &newest).expect("resumes");
    train(&mut second, torn.path(), None);
    let steps = |folder: &Path| -> Vec<usize> {
        checkpoint::list(folder)
            .into_iter()
            .map(|(step, _)| step)
            .collect()
    };
    assert_eq!(
        (steps(whole.path()), steps(torn.path())),
        (vec![8, 10], vec![8, 10])
    );
    for file in ["implicit.mpk", "velocity.mpk"] {
        let read = |folder: &Path| std::fs::read(folder.join("step-000010").join(file));
        let (a, b) = (read(whole.path()), read(torn.path()));
        // Bit for bit: the products are too small for more than one thread.
        assert_eq!(a.expect("written"), b.expect("written"), "{file}, {keys:?}");
    }
}

#[test]
fn what_a_kill_left_to_delete_goes_when_the_run_goes_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    train(&mut learner(&[]), folder.path(), None);
    // Killed between the newest checkpoint and the deletion of the oldest, and within a deletion.
    for left in ["step-000004", ".step-000002-old"] {
        std::fs::create_dir(folder.path().join(left)).expect("a folder");
    }
    let newest = Checkpoint::newest(folder.path()).expect("at the end");
    let mut again = resumed(recipe(&[]), &spheres(), &newest).expect("resumes");
    train(&mut again, folder.path(), None);
    let mut left: Vec<_> = std::fs::read_dir(folder.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    left.sort();
    assert_eq!(left, ["step-000008", "step-000010"]);
}

#[test]
fn other_networks_and_other_shapes_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    train(&mut learner(&[]), folder.path(), None);
    let newest = Checkpoint::newest(folder.path()).expect("at the end");
    let wider = recipe(&["implicit.width=12"]);
    let refused = resumed(wider, &spheres(), &newest).err();
    let text = refused.expect("another width").to_string();
    assert!(
        text.contains("implicit.width is 8 in the checkpoint and 12"),
        "{text}"
    );
    let mut moved = spheres();
    moved.normalisation.scale = 2.0;
    let refused = resumed(recipe(&[]), &moved, &newest).err();
    assert!(
        matches!(refused, Some(LearnerError::OtherShapes(_))),
        "{refused:?}"
    );
    let longer = recipe(&["training.steps=12"]);
    let longer = resumed(longer, &spheres(), &newest);
    assert_eq!(longer.expect("more steps are fine").step, 10);
}

#[test]
fn a_damaged_checkpoint_is_named_and_not_loaded() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    train(&mut learner(&[]), folder.path(), None);
    let newest = Checkpoint::newest(folder.path()).expect("at the end");
    let file = newest.path.join("velocity.mpk");
    let whole = std::fs::read(&file).expect("written");
    let attempt = || resumed(recipe(&[]), &spheres(), &newest);
    for (damage, words) in [
        (whole[..whole.len() / 2].to_vec(), "bytes"),
        (
            [&whole[..whole.len() - 1], &[!whole[whole.len() - 1]]].concat(),
            "checksum",
        ),
    ] {
        std::fs::write(&file, damage).expect("damaged");
        let text = attempt().err().expect("refused").to_string();
        assert!(
            text.contains("velocity.mpk") && text.contains(words),
            "{text}"
        );
    }
    std::fs::write(&file, whole).expect("mended");
    assert!(attempt().is_ok());
}

#[test]
fn a_term_that_is_not_finite_stops_the_run_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut keyframes = spheres();
    for (_, target) in &mut keyframes.between[0] {
        target[0] = f32::NAN;
    }
    let mut learner = Learner::new(recipe(&[]), &keyframes, &*engine()).expect("a method");
    let refused = learner.run(folder.path(), &AtomicBool::new(false), &mut |_| Ok(()));
    let text = refused.expect_err("matching is NaN").to_string();
    assert!(text.contains("step 1: the matching term is NaN"), "{text}");
    assert!(text.contains("no checkpoint"), "{text}");
    assert!(checkpoint::list(folder.path()).is_empty());
}

#[test]
fn the_phases_train_the_networks_that_they_name() {
    // The files of f with its optimiser, and of V with its own.
    let digest = |learner: &Learner| {
        let files = learner.trainer().records().expect("encodes").0;
        let named = |name: &str| files.iter().find(|(file, _)| file == name).cloned();
        (
            named("implicit.mpk").expect("f"),
            named("velocity.mpk").expect("V"),
        )
    };
    let mut learner = learner(&[]);
    for step in 0..10 {
        let (f, v) = digest(&learner);
        learner.advance(false);
        let (next_f, next_v) = digest(&learner);
        assert_eq!(f != next_f, step >= 3, "f in step {step}");
        assert_eq!(v != next_v, step < 7, "V in step {step}");
    }
}
