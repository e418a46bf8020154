//! What each method trains, keeps and lacks.

use burn::tensor::Tensor;

use super::samples::first_layer;
use super::*;
use crate::method::{self, fixed_change, names, spec_of};
use crate::recipe::Optimiser;

#[test]
fn the_end_fields_of_a_flow_train_in_every_step_and_its_velocity_as_the_schedule_says() {
    let digest = |method: &dyn Method<B>| {
        let files = networks(method);
        let named = |name: &str| files.iter().find(|(file, _)| file == name).cloned();
        let [ends, velocity] = ["ends.mpk", "velocity.mpk"].map(named);
        (ends.expect("g and h"), velocity.expect("V"))
    };
    let data = data();
    let mut method = build(&recipe(&[FLOW]), &data);
    for step in 0..10 {
        let (ends, v) = digest(&*method);
        advance(&mut *method, &data, step);
        let (next_ends, next_v) = digest(&*method);
        assert_ne!(ends, next_ends, "the end fields in step {step}");
        assert_eq!(v != next_v, step < 7, "V in step {step}");
    }
}

#[test]
fn the_surface_term_of_a_flow_moves_its_velocity_and_leaves_the_end_fields_alone() {
    let data = data();
    let gradients = |on_surface: &str| {
        let early = ["training.ramp-until=0", "training.warm-up=0"];
        let recipe = recipe(&[&[FLOW, on_surface], &early[..]].concat());
        let method = build(&recipe, &data);
        let drawn = method.draw(&data, 5);
        let (terms, gradients) = solve(&*method, &data, &drawn, 5, Part::WHOLE);
        let has = terms.iter().any(|term| term.name == "on-surface");
        let first = |network: usize| first_layer(&gradients[network]).expect("of the first layer");
        (has, first(0), first(1))
    };
    let (with, ends, v) = gradients("loss.on-surface=100");
    let (without, bare_ends, bare_v) = gradients("loss.on-surface=0");
    assert!(with && !without);
    assert_eq!(ends, bare_ends, "the end fields are constants of it");
    assert_ne!(v, bare_v);
}

/// The small recipe of a method with each optimiser that it can have.
fn optimised(spec: &'static MethodSpec) -> Vec<(&'static MethodSpec, Recipe)> {
    let with = |word: &&str| {
        let mut recipe = recipe_of(spec, &[]);
        let change = format!("training.optimiser={word}");
        let chosen = recipe.has("training.optimiser") && recipe.with(&change).is_ok();
        (chosen || *word == "adam").then_some((spec, recipe))
    };
    Optimiser::WORDS.iter().filter_map(with).collect()
}

#[test]
fn every_method_trains_and_resumes_to_the_same_weights() {
    for (spec, recipe) in trained().flat_map(optimised) {
        let (data, optimiser) = (data(), recipe.training.optimiser);
        let name = format!("{}, {optimiser}", spec.described());
        let mut whole = build(&recipe, &data);
        let mut eighth = None;
        for step in 0..10 {
            if step == 8 {
                eighth = Some(whole.records().expect("encodes"));
            }
            let terms = advance(&mut *whole, &data, step);
            assert!(
                !terms.is_empty() && terms.iter().all(|term| term.raw.is_finite()),
                "{name}, step {step}: {terms:?}"
            );
        }
        let mut again = build(&recipe, &data);
        again
            .restore(&eighth.expect("after step 8"))
            .expect("records of the same method");
        advance(&mut *again, &data, 8);
        advance(&mut *again, &data, 9);
        // Bit for bit: the products are too small for more than one thread.
        assert!(networks(&*whole) == networks(&*again), "{name}");
    }
}

#[test]
fn every_method_has_a_surface_or_moves_points() {
    for spec in trained() {
        let (data, name) = (data(), spec.described());
        let method = build(&recipe_of(spec, &[]), &data);
        let x = || {
            crate::tensors::rows::<NdArray, 3>(&[[0.3, 0.0, 0.1], [0.0; 3]], &Default::default())
        };
        let t = Tensor::full([2, 1], 0.5, &Default::default());
        let (geometry, motion) = (method.geometry(), method.motion());
        assert!(geometry.is_some() || motion.is_some(), "{name}");
        // Without a surface of its own it moves the source's.
        assert_eq!(geometry.is_none(), spec.needs.mesh, "{name}");
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
fn a_method_says_what_it_lacks() {
    for spec in METHODS {
        let recipe = recipe_of(spec, &[]);
        let (mut bare, mut unmatched) = (data(), data());
        bare.keys[0].normals = None;
        unmatched.between[0].clear();
        for (data, needed, key) in [
            (data(), false, ""),
            (bare, spec.needs.normals, "data.normals"),
            (
                unmatched,
                spec.needs.correspondences,
                "data.correspondences",
            ),
        ] {
            match method::check(&recipe, &data) {
                Ok(()) => assert!(!needed, "{}", spec.name),
                Err(text) => {
                    assert!(needed, "{text}");
                    assert!(text.contains(spec.name) && text.contains(key), "{text}");
                }
            }
        }
    }
}

#[test]
fn the_list_of_methods_has_every_name_and_finds_each_method_again() {
    let wanted = [
        "velocity-field",
        "mlp",
        "sdf-blend",
        "lipmlp",
        "nise",
        "nise-velocity",
        "eigenbasis",
        "nfgp",
        "efis",
    ];
    assert_eq!(names(), wanted);
    for spec in METHODS {
        assert_eq!(spec_of(&recipe_of(spec, &[])), *spec);
        assert!(!spec.about.is_empty() && !spec.citation.is_empty());
        // What a comparison changes is a recipe of that method.
        let set = spec.compare_overrides();
        let text = "preset = \"quick\"\n[data]\nsource = \"a.ply\"\ntarget = \"b.ply\"\n\
                    correspondences = \"same-vertices\"\n";
        let recipe = Recipe::parse(text, Path::new("recipe.toml"), &set).expect(spec.name);
        assert_eq!(spec_of(&recipe), *spec);
    }
}

#[test]
fn a_run_that_has_begun_keeps_its_method_its_networks_and_what_is_shared_out() {
    let key = |before: &[&str], after: &[&str]| {
        let change = fixed_change(&recipe(before), &recipe(after));
        change.map(|(change, why)| {
            assert!(!why.is_empty());
            change.key
        })
    };
    let nise = "method.name=nise";
    assert_eq!(key(&[], &["training.steps=20", "loss.strain=1"]), None);
    assert_eq!(key(&[], &[nise]).as_deref(), Some("method.name"));
    assert_eq!(
        key(&[FLOW], &[NETWORK]).as_deref(),
        Some("implicit.geometry")
    );
    assert_eq!(
        key(&[], &["velocity.width=9"]).as_deref(),
        Some("velocity.width")
    );
    assert_eq!(
        key(&["training.optimiser=adam"], &["training.optimiser=muon"]).as_deref(),
        Some("training.optimiser")
    );
    assert_eq!(key(&[nise], &[nise, "nise.residual=1"]), None);
    let steps = key(&[nise], &[nise, "training.steps=20"]);
    assert_eq!(steps.as_deref(), Some("training.steps"));
    let omega = key(&[nise], &[nise, "nise.omega=9"]);
    assert_eq!(omega.as_deref(), Some("nise.omega"));
    // What a field is solved with, all of it.
    let trained = "velocity.kind=trained-spline";
    assert_eq!(key(&[trained], &[trained, "training.steps=20"]), None);
    let band = key(&[trained], &[trained, "spline.band=2000"]);
    assert_eq!(band.as_deref(), Some("spline.band"));
}
