//! Batches and the loop, on small spheres.

use std::sync::atomic::AtomicBool;

use burn::module::ParamId;
use burn::optim::GradientsParams;
use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;

use super::batch::{BatchSizes, draw};
use super::*;

type B = Autodiff<NdArray>;

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
fn pair() -> Pair {
    Pair::spheres(200, 200)
}

/// A learner of the small recipe with these changes, on two spheres.
fn learner(extra: &[&str]) -> Learner<B> {
    Learner::new(recipe(extra), pair(), Default::default()).expect("the spheres have all it needs")
}

#[test]
fn a_batch_is_a_function_of_seed_and_step_alone() {
    let (pair, recipe) = (pair(), recipe(&[]));
    let sizes = BatchSizes::new(&recipe.training, pair.correspondences.len(), 1);
    assert_eq!(sizes.total(), recipe.training.batch);
    let at = |step| draw(&pair, &recipe.training, sizes, step);
    assert_eq!(at(17), at(17));
    assert_ne!(at(17), at(18));
    let mut other = recipe.training.clone();
    other.seed = 1;
    assert_ne!(at(17), draw(&pair, &other, sizes, 17));
}

#[test]
fn a_batch_has_the_sizes_and_ranges_that_it_says() {
    for times in ["random", "grid"] {
        let (pair, recipe) = (pair(), recipe(&[&format!("training.times={times}")]));
        let sizes = BatchSizes::new(&recipe.training, pair.correspondences.len(), 1);
        let batch = draw(&pair, &recipe.training, sizes, 3);
        assert_eq!(batch.ends.points.len(), 2 * sizes.ends);
        assert_eq!(batch.ends.normals.len(), 2 * sizes.ends);
        assert_eq!(batch.stops.len(), 2 * sizes.carried);
        assert_eq!(
            (batch.offsets.len(), batch.uniform.points.len()),
            (sizes.band, sizes.uniform)
        );
        assert_eq!(batch.matched.0.len(), 8);
        assert!(
            batch.stops.iter().all(|t| (0.0..=1.0).contains(t)),
            "{:?}",
            batch.stops
        );
        let on_grid = batch
            .stops
            .iter()
            .all(|t| (t * 3.0 - (t * 3.0).round()).abs() < 1e-6);
        assert_eq!(on_grid, times == "grid");
        let bounds = pair.bounds.padded(recipe.training.box_margin as f32);
        let inside = |x: &[f32; 3]| {
            (0..3).all(|axis| (bounds.min[axis]..=bounds.max[axis]).contains(&x[axis]))
        };
        assert!(batch.uniform.points.iter().all(inside));
    }
}

#[test]
fn the_parts_of_a_step_add_up_to_the_whole() {
    // As drawn for 88 points and 8 correspondences, all numbers are even.
    let of = 2;
    for name in [
        "method.name=velocity-field",
        FLOW,
        "method.name=mlp",
        "method.name=sdf-blend",
        "method.name=lipmlp",
        "method.name=nise",
    ] {
        let learner = learner(&[name, "training.warm-up=0", "training.ramp-until=0"]);
        let solve = |part: Part| {
            learner
                .method
                .objective(&learner.data, 5, part)
                .solve(part.of, true)
        };
        let (whole, gradients) = solve(Part::WHOLE);
        let (terms, parts): (Vec<_>, Vec<_>) =
            (0..of).map(|index| solve(Part { index, of })).unzip();
        for (whole, sum) in whole.iter().zip(posed::mean_of(&terms)) {
            assert_eq!(whole.name, sum.name);
            // Means of some dozen f32 of the size of the term, in another order.
            let off = (whole.raw - sum.raw).abs();
            assert!(
                off <= 1e-5 * whole.raw.abs().max(1e-3),
                "{name}, {}: {whole:?} and {sum:?}",
                whole.name
            );
        }
        for network in 0..gradients.len() {
            let read = |params: &GradientsParams| {
                let first = params
                    .get::<NdArray, 2>(ParamId::from(1))
                    .expect("of the first layer");
                first.into_data().to_vec::<f32>().expect("f32")
            };
            let whole = read(&gradients[network]);
            let mut sum = vec![0.0; whole.len()];
            for part in &parts {
                sum.iter_mut()
                    .zip(read(&part[network]))
                    .for_each(|(sum, value)| *sum += value);
            }
            let size = whole
                .iter()
                .fold(0.0f32, |most, value| most.max(value.abs()));
            assert!(size > 0.0, "{name}: the first layer has a gradient");
            for (whole, sum) in whole.iter().zip(sum) {
                // Cancelling sums of f32 as large as the weighted terms.
                assert!(
                    (whole - sum).abs() <= 1e-3 * size,
                    "{name}: {whole} and {sum} of {size}"
                );
            }
        }
    }
}

#[test]
fn large_batches_are_divided_on_a_processor_alone() {
    let parts = |batch: usize| method::parts::<B>(batch);
    assert_eq!([88, 511, 512, 1000, 2200].map(parts), [1, 1, 4, 4, 4]);
    assert_eq!([4000, 4086, 16_000].map(parts), [8, 8, 32]);
    #[cfg(feature = "wgpu")]
    assert_eq!(
        <burn_wgpu::Wgpu as isomorph_model::ModelBackend>::POINTS_AT_A_TIME,
        None
    );
}

/// Trains in a folder until done or until `stop_after` steps; the events.
fn train(learner: &mut Learner<B>, folder: &Path, stop_after: Option<usize>) -> Vec<Event> {
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

/// Our method with the other geometry.
const FLOW: &str = "implicit.geometry=flow";

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
