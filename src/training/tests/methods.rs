//! What each method trains, keeps and misses.

use burn::module::ParamId;

use super::*;

#[test]
fn the_end_fields_of_a_flow_train_in_every_step_and_its_velocity_as_the_schedule_says() {
    let digest = |learner: &Learner<B>| {
        let files = learner.method().records().expect("encodes").0;
        let named = |name: &str| files.iter().find(|(file, _)| file == name).cloned();
        let [ends, velocity] = ["ends.mpk", "velocity.mpk"].map(named);
        (ends.expect("g and h"), velocity.expect("V"))
    };
    let mut learner = learner(&[FLOW]);
    for step in 0..10 {
        let (ends, v) = digest(&learner);
        learner.advance(false);
        let (next_ends, next_v) = digest(&learner);
        assert_ne!(ends, next_ends, "the end fields in step {step}");
        assert_eq!(v != next_v, step < 7, "V in step {step}");
    }
}

#[test]
fn the_surface_term_of_a_flow_moves_its_velocity_and_leaves_the_end_fields_alone() {
    let gradients = |on_surface: &str| {
        let learner = learner(&[
            FLOW,
            "training.ramp-until=0",
            "training.warm-up=0",
            on_surface,
        ]);
        let posed = learner.method.objective(&learner.data, 5, Part::WHOLE);
        let (terms, gradients) = posed.solve(1, true);
        let has = terms.iter().any(|term| term.name == "on-surface");
        let first = |network: usize| {
            let of = gradients[network].get::<NdArray, 2>(ParamId::from(1));
            let data = of.expect("of the first layer").into_data();
            data.to_vec::<f32>().expect("f32")
        };
        (has, first(0), first(1))
    };
    let (with, ends, v) = gradients("loss.on-surface=100");
    let (without, bare_ends, bare_v) = gradients("loss.on-surface=0");
    assert!(with && !without);
    assert_eq!(ends, bare_ends, "the end fields are constants of it");
    assert_ne!(v, bare_v);
}

/// Every method by name, ours with both geometries.
fn methods() -> impl Iterator<Item = String> {
    let names = crate::recipe::MethodName::WORDS.iter();
    let named = names.map(|name| format!("method.name={name}"));
    named.chain([FLOW.to_owned()])
}

/// Small settings of what only some methods have.
const SMALL: [&str; 3] = ["method.modes=2", "method.deformations=2", "method.blocks=1"];

#[test]
fn every_method_trains_and_resumes_to_the_same_weights() {
    for name in methods() {
        let extra = [&SMALL[..], &[name.as_str()]].concat();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut whole = learner(&extra);
        let events = train(&mut whole, folder.path(), None);
        let totals: Vec<f64> = events
            .iter()
            .filter_map(|event| match event {
                Event::Step(report) => Some(report.total),
                _ => None,
            })
            .collect();
        assert_eq!(totals.len(), 10, "{name}");
        assert!(
            totals.iter().all(|total| total.is_finite()),
            "{name}: {totals:?}"
        );
        let (_, eighth) = checkpoint::list(folder.path()).remove(0);
        let checkpoint = Checkpoint::open(&eighth).expect("after step 8");
        let again = Learner::<B>::resume(recipe(&extra), pair(), Default::default(), &checkpoint);
        let mut again = again.expect("resumes");
        again.advance(false);
        again.advance(false);
        // Without the optimisers, whose records list the same states in an order of their own.
        let networks = |learner: &Learner<B>| {
            let mut files = learner.method().records().expect("encodes").0;
            files.retain(|(file, _)| !file.ends_with("-optimiser.mpk"));
            files
        };
        // Bit for bit: the products are too small for more than one thread.
        assert!(networks(&whole) == networks(&again), "{name}");
    }
}

#[test]
fn every_method_has_a_surface_or_moves_points() {
    for name in methods() {
        let learner = learner(&[&SMALL[..], &[name.as_str()]].concat());
        let x = || {
            crate::tensors::rows::<NdArray, 3>(&[[0.3, 0.0, 0.1], [0.0; 3]], &Default::default())
        };
        let t = burn::tensor::Tensor::full([2, 1], 0.5, &Default::default());
        let geometry = learner.method().geometry();
        let motion = learner.method().motion();
        assert!(geometry.is_some() || motion.is_some(), "{name}");
        if let Some(f) = geometry {
            assert_eq!(f.value(x(), t.clone()).dims(), [2, 1], "{name}");
            assert_eq!(f.gradient(x(), t).dims(), [2, 3], "{name}");
        }
        if let Some(motion) = motion {
            assert_eq!(motion.carry(x(), 0.0, 0.5).dims(), [2, 3], "{name}");
        }
    }
}

#[test]
fn a_method_says_what_it_misses() {
    let refused = |extra: &[&str], pair: Pair| {
        let learner = Learner::<B>::new(recipe(extra), pair, Default::default());
        learner.err().expect("refused").to_string()
    };
    let mut bare = pair();
    bare.source.normals = None;
    let text = refused(&["method.name=lipmlp"], bare);
    assert!(
        text.contains("lipmlp") && text.contains("data.normals"),
        "{text}"
    );
    for name in ["eigenbasis", "nfgp"] {
        let mut unmatched = pair();
        unmatched.correspondences.clear();
        let text = refused(&[&format!("method.name={name}")], unmatched);
        assert!(
            text.contains(name) && text.contains("data.correspondences"),
            "{text}"
        );
    }
}
