//! Which keys act, found by trying: a key that a method names must change its training, and no other may.

use super::*;
use crate::recipe::rule::Value;
use crate::recipe::schema::{Key, Keyed};
use crate::recipe::{ImplicitRecipe, LossRecipe, TrainingRecipe, VelocityRecipe};

/// Steps of the trial: one of each phase.
const STEPS: usize = 4;

/// Changes under which no key is switched off by another.
const ALL_ON: [&str; 15] = [
    "training.steps=4",
    "training.warm-up=0.25",
    "training.ramp-until=0.5",
    "training.velocity-until=0.75",
    "training.clip=0.01",
    "training.optimiser=adam",
    "training.schedule=step",
    "training.decay-every=0.25",
    "training.times=grid",
    "loss.smoothness=1",
    "loss.strain-scale=0.1",
    "loss.matching-scale=0.1",
    "loss.off-surface=1",
    "loss.distance=10",
    "velocity.time-dependent=true",
];

/// Another value of each key of the sections that methods share, and what that needs.
const OTHER: [(&str, &[&str]); 59] = [
    ("implicit.depth=3", &[]),
    ("implicit.width=9", &[]),
    ("implicit.activation=sine", &[]),
    ("implicit.beta=50", &[]),
    ("implicit.frequencies=1", &[]),
    ("implicit.sphere-radius=0.3", &[]),
    ("implicit.skip=1", &[]),
    ("velocity.depth=3", &[]),
    ("velocity.width=9", &[]),
    ("velocity.activation=sine", &[]),
    ("velocity.beta=50", &[]),
    ("velocity.frequencies=1", &[]),
    ("velocity.skip=1", &[]),
    ("velocity.time-dependent=false", &[]),
    ("loss.level-set=11", &[]),
    ("loss.level-set-form=olse", &[]),
    ("loss.lambda-l=2", &[]),
    ("loss.smoothness=2", &[]),
    ("loss.smoothness-alpha=0.5", &[]),
    ("loss.smoothness-gamma=2", &[]),
    ("loss.divergence=3", &[]),
    ("loss.strain=4", &[]),
    ("loss.strain-scale=0.01", &[]),
    ("loss.matching=150", &[]),
    ("loss.matching-warm-up=150", &[]),
    ("loss.matching-scale=0.2", &[]),
    ("loss.data=50", &[]),
    ("loss.normals=10", &[]),
    ("loss.eikonal=5", &[]),
    ("loss.on-surface=50", &[]),
    ("loss.transported-normals=10", &[]),
    ("loss.off-surface=2", &[]),
    ("loss.distance=20", &[]),
    ("loss.screw=20", &[]),
    ("training.steps=8", &[]),
    ("training.batch=176", &[]),
    ("training.correspondence-batch=16", &[]),
    ("training.optimiser=muon", &[]),
    ("training.learning-rate=1e-3", &[]),
    ("training.velocity-learning-rate=1e-3", &[]),
    ("training.muon-rate=2e-3", &["training.optimiser=muon"]),
    (
        "training.velocity-muon-rate=1e-3",
        &["training.optimiser=muon"],
    ),
    ("training.schedule=cosine", &[]),
    ("training.decay=0.25", &[]),
    ("training.decay-every=0.5", &[]),
    (
        "training.final-learning-rate=0.5",
        &["training.schedule=cosine"],
    ),
    ("training.guided-until=0.25", &[]),
    ("training.warm-up=0", &[]),
    ("training.ramp-until=0.75", &[]),
    ("training.velocity-until=1", &[]),
    ("training.integrator=euler", &[]),
    ("training.time-steps=2", &[]),
    ("training.times=random", &[]),
    ("training.derivatives=forward", &[]),
    ("training.band-share=0.5", &[]),
    ("training.band-widths=[0.02]", &[]),
    ("training.box-margin=0.3", &[]),
    ("training.clip=0.005", &[]),
    ("training.seed=3", &[]),
];

/// What training a recipe for some steps gives.
fn outcome(recipe: &Recipe, data: &TrainingData) -> Vec<(String, Vec<u8>)> {
    let mut method = build(recipe, data);
    for step in 0..STEPS {
        advance(&mut *method, data, step);
    }
    networks(&*method)
}

/// Gives a key of a shared section this value, although it may do nothing there.
fn put(recipe: &mut Recipe, change: &str) {
    let section = change.split('.').next().unwrap_or_default();
    match section {
        "implicit" => recipe.implicit = replaced(&recipe.implicit, change).0,
        "velocity" => recipe.velocity = replaced(&recipe.velocity, change).0,
        "loss" => recipe.loss = replaced(&recipe.loss, change).0,
        _ => recipe.training = replaced(&recipe.training, change).0,
    }
}

/// A section with one value replaced, and the key.
fn replaced<K: Keyed>(section: &K, change: &str) -> (K, &'static Key) {
    let (id, text) = change.split_once('=').expect("key=value");
    let place = K::SECTION.keys.iter().position(|key| key.id() == id);
    let place = place.expect(id);
    let key = &K::SECTION.keys[place];
    let value = if key.rule.takes_text() {
        Value::Text(text.to_owned())
    } else {
        let parsed = toml::de::DeValue::parse(text).expect("a TOML value");
        key.rule
            .admit(parsed.get_ref())
            .expect("a value of the key")
    };
    let mut values = section.to_values();
    values[place] = Some(value);
    (K::from_values(values), key)
}

/// The key that a change names.
fn key_of(recipe: &Recipe, change: &str) -> &'static Key {
    match change.split('.').next().unwrap_or_default() {
        "implicit" => replaced(&recipe.implicit, change).1,
        "velocity" => replaced(&recipe.velocity, change).1,
        "loss" => replaced(&recipe.loss, change).1,
        _ => replaced(&recipe.training, change).1,
    }
}

#[test]
#[ignore = "minutes"]
fn a_key_acts_in_a_method_exactly_if_the_method_names_it() {
    let (data, mut wrong) = (data(), Vec::new());
    for spec in trained() {
        let mut base = recipe_of(spec, &[]);
        ALL_ON.iter().for_each(|change| put(&mut base, change));
        let plain = outcome(&base, &data);
        for (change, needed) in OTHER {
            let mut changed = base.clone();
            needed.iter().for_each(|change| put(&mut changed, change));
            let before = match needed {
                [] => plain.clone(),
                _ => outcome(&changed, &data),
            };
            put(&mut changed, change);
            let differs = outcome(&changed, &data) != before;
            let acts = spec.acts_on(key_of(&base, change));
            // Both ways of a derivative may give the same bits.
            let may_agree = acts && change.starts_with("training.derivatives");
            if differs != acts && !may_agree {
                wrong.push(format!("{}: {change}: {differs}", spec.described()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_trial_has_every_key_of_the_shared_sections() {
    let sections = [
        ImplicitRecipe::SECTION,
        VelocityRecipe::SECTION,
        LossRecipe::SECTION,
        TrainingRecipe::SECTION,
    ];
    let keys = sections.into_iter().flat_map(|section| section.keys);
    let mut ids: Vec<String> = keys.map(Key::id).collect();
    // The first two are part of what a method is; the last is for the loop, whatever the method.
    ids.retain(|id| {
        !["implicit.geometry", "velocity.kind", "training.log-every"].contains(&id.as_str())
    });
    let tried: Vec<&str> = OTHER
        .iter()
        .filter_map(|(change, _)| change.split('=').next())
        .collect();
    assert_eq!(tried, ids);
}

#[test]
fn every_key_that_a_method_names_is_one() {
    for spec in METHODS {
        let acts = &spec.acts;
        for (section, keys) in [
            (ImplicitRecipe::SECTION, &acts.implicit),
            (VelocityRecipe::SECTION, &acts.velocity),
            (LossRecipe::SECTION, &acts.loss),
            (TrainingRecipe::SECTION, &acts.training),
        ] {
            for name in keys.named() {
                let known = section.keys.iter().any(|key| key.name() == *name);
                assert!(known, "{}: [{}] {name}", spec.described(), section.name);
            }
        }
    }
}
