//! Phases, checkpoints, and what stops a run.

use super::*;

#[test]
fn an_interrupted_run_resumes_to_the_same_weights_and_keeps_the_newest_checkpoints() {
    let whole = tempfile::tempdir().expect("a temporary folder");
    let torn = tempfile::tempdir().expect("a temporary folder");
    train(&mut learner(&[]), whole.path(), None);
    let mut first = learner(&[]);
    let events = train(&mut first, torn.path(), Some(7));
    assert!(
        events
            .iter()
            .any(|event| matches!(event, Event::Interrupted { step: 7 }))
    );
    let newest = Checkpoint::newest(torn.path()).expect("written on the interrupt");
    assert_eq!(newest.state.step, 7);
    let mut second =
        Learner::<B>::resume(recipe(&[]), pair(), Default::default(), &newest).expect("resumes");
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
        assert_eq!(a.expect("written"), b.expect("written"), "{file}");
    }
}

#[test]
fn other_networks_and_other_shapes_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    train(&mut learner(&[]), folder.path(), None);
    let newest = Checkpoint::newest(folder.path()).expect("at the end");
    let wider = recipe(&["implicit.width=12"]);
    let refused = Learner::<B>::resume(wider, pair(), Default::default(), &newest).err();
    let text = refused.expect("another width").to_string();
    assert!(
        text.contains("implicit.width is 8 in the checkpoint and 12"),
        "{text}"
    );
    let mut moved = pair();
    moved.normalisation.scale = 2.0;
    let refused = Learner::<B>::resume(recipe(&[]), moved, Default::default(), &newest).err();
    assert!(
        matches!(refused, Some(LearnerError::OtherShapes(_))),
        "{refused:?}"
    );
    let longer = recipe(&["training.steps=12"]);
    let resumed = Learner::<B>::resume(longer, pair(), Default::default(), &newest);
    assert_eq!(resumed.expect("more steps are fine").step_count(), 10);
}

#[test]
fn a_damaged_checkpoint_is_named_and_not_loaded() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    train(&mut learner(&[]), folder.path(), None);
    let newest = Checkpoint::newest(folder.path()).expect("at the end");
    let file = newest.path.join("velocity.mpk");
    let whole = std::fs::read(&file).expect("written");
    let attempt = || Learner::<B>::resume(recipe(&[]), pair(), Default::default(), &newest);
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
    let mut pair = pair();
    pair.correspondences
        .iter_mut()
        .for_each(|(_, target)| target[0] = f32::NAN);
    let mut learner = Learner::<B>::new(recipe(&[]), pair, Default::default()).expect("a method");
    let refused = learner.run(folder.path(), &AtomicBool::new(false), &mut |_| Ok(()));
    let text = refused.expect_err("matching is NaN").to_string();
    assert!(text.contains("step 1: the matching term is NaN"), "{text}");
    assert!(text.contains("no checkpoint"), "{text}");
    assert!(checkpoint::list(folder.path()).is_empty());
}

#[test]
fn the_phases_train_the_networks_that_they_name() {
    // The files of f with its optimiser, and of V with its own.
    let digest = |learner: &Learner<B>| {
        let files = learner.method().records().expect("encodes").0;
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
