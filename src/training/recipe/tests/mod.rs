//! The recipe from outside: presets, paths, overrides and changes here. The range of every key stands
//! in `ranges`, the text of every mistake in `messages`, keys that do nothing in `acting`, what reads back
//! from print in `round_trip`, the recipe of `init` in `init`, those of earlier versions in `stored`, and
//! key frames in `frames`.

mod acting;
mod frames;
mod init;
mod messages;
mod ranges;
mod round_trip;
mod rule;
mod stored;

use std::path::Path;

use super::schema::Key;
use super::*;

const SHAPES: &str = "[data]\nsource = \"/s.ply\"\ntarget = \"/t.ply\"\n";

fn parsed(text: &str, overrides: &[&str]) -> Result<Recipe, RecipeError> {
    let overrides: Vec<String> = overrides.iter().map(|given| (*given).to_owned()).collect();
    Recipe::parse(text, Path::new("recipe.toml"), &overrides)
}

fn preset(name: &str) -> Recipe {
    parsed(&format!("preset = \"{name}\"\n{SHAPES}"), &[]).expect("a preset is a recipe")
}

#[test]
fn an_override_of_a_text_needs_no_quotes() {
    for given in [
        "data.source=2024",
        "data.source=\"2024\"",
        "data.source='2024'",
    ] {
        let recipe = parsed(SHAPES, &[given]).expect(given);
        assert!(
            recipe.data.source().ends_with("2024"),
            "{given}: {:?}",
            recipe.data.source()
        );
    }
}

#[test]
fn paths_are_relative_to_the_recipe() {
    let text = "[data]\nsource = \"a.ply\"\ntarget = \"/b.ply\"\ncorrespondences = \"c/d.csv\"";
    let recipe = Recipe::parse(text, Path::new("/runs/fox/recipe.toml"), &[]).expect("a recipe");
    assert_eq!(recipe.data.source(), Path::new("/runs/fox/a.ply"));
    assert_eq!(recipe.data.target(), Path::new("/b.ply"));
    let pairs = Correspondences::File("/runs/fox/c/d.csv".into());
    assert_eq!(recipe.data.between, [pairs]);
    // A recipe in the working directory has a parent of no name.
    let here = std::env::current_dir().expect("a working directory");
    let recipe = parsed("[data]\nsource = \"a.ply\"\ntarget = \"b.ply\"", &[]).expect("a recipe");
    assert_eq!(recipe.data.source(), here.join("a.ply"));
}

/// The numbers are those that the paper prints.
#[test]
fn the_paper_preset_has_the_schedule_that_the_paper_prints() {
    let paper = preset("paper");
    let steps = |share: f64| share * paper.training.steps as f64;
    assert_eq!(
        (paper.training.steps, paper.training.batch),
        (10_000, 4_000)
    );
    assert_eq!(steps(paper.training.warm_up), 2000.0);
    assert_eq!(steps(paper.training.ramp_until), 5000.0);
    assert_eq!(steps(paper.training.velocity_until), 8000.0);
    assert_eq!(paper.training.schedule, Schedule::Step);
    assert_eq!(steps(paper.training.decay_every), 2000.0);
    assert_eq!(
        (paper.training.learning_rate, paper.training.decay),
        (5e-3, 0.5)
    );
    assert_eq!(paper.training.velocity_learning_rate, 5e-3);
    assert_eq!((paper.loss.level_set, paper.loss.smoothness), (100.0, 20.0));
    assert_eq!((paper.loss.matching, paper.loss.data), (200.0, 200.0));
    assert_eq!(paper.loss.matching_warm_up, 100.0);
    assert_eq!((paper.implicit.depth, paper.implicit.width), (8, 512));
    assert_eq!((paper.velocity.depth, paper.velocity.width), (8, 256));
    assert_eq!(paper.training.integrator, Integrator::Euler);
    assert_eq!(
        (paper.data.points, paper.data.correspondence_fraction),
        (20_000, 0.05)
    );
}

#[test]
fn no_preset_named_is_the_default_and_a_key_given_wins_over_it() {
    assert_eq!(parsed(SHAPES, &[]).expect("a recipe"), preset("default"));
    let text = format!("preset = 'quick'\nloss = {{ data = 7 }}\n{SHAPES}");
    let quick = parsed(&text, &[]).expect("a recipe");
    assert_eq!((quick.loss.data, quick.training.steps), (7.0, 550));
}

#[test]
fn changes_name_the_key_and_both_values() {
    let before = preset("quick");
    let mut after = before.clone();
    assert_eq!(before.changes(&after), []);
    after.preset = Preset::Paper;
    after.velocity.width = 64;
    after.training.steps = 2000;
    let changes = before.changes(&after);
    let told: Vec<String> = changes.iter().map(Change::to_string).collect();
    assert_eq!(
        told,
        [
            "preset: \"quick\" -> \"paper\"",
            "velocity.width: 96 -> 64",
            "training.steps: 550 -> 2000",
        ]
    );
    // Between methods what only one of them has stands with "nothing" for the other.
    let other = parsed(SHAPES, &["preset=quick", "method.name=nise"]).expect("a recipe");
    let told: Vec<String> = before
        .changes(&other)
        .iter()
        .map(Change::to_string)
        .collect();
    assert!(
        told.contains(&"nise.omega: nothing -> 20".to_owned()),
        "{told:?}"
    );
    assert!(
        told.contains(&"velocity.width: 96 -> nothing".to_owned()),
        "{told:?}"
    );
}

#[test]
fn two_shapes_alone_make_the_default_recipe_with_absolute_paths() {
    let recipe = Recipe::between(Path::new("a.ply"), Path::new("/b.ply")).expect("a recipe");
    let here = std::env::current_dir().expect("a working directory");
    let set = format!("data.source={}", here.join("a.ply").display());
    assert_eq!(
        recipe,
        parsed(SHAPES, &[&set, "data.target=/b.ply"]).expect("a recipe")
    );
}

#[test]
fn a_changed_key_leaves_the_others_and_drops_what_the_new_method_does_not_use() {
    let mut recipe = parsed(SHAPES, &["loss.strain=5", "training.steps=7"]).expect("a recipe");
    recipe.with("training.batch=70").expect("a change");
    assert_eq!((recipe.training.batch, recipe.training.steps), (70, 7));
    let before = recipe.clone();
    let told = recipe
        .with("loss.level-set=3")
        .expect_err("idle")
        .to_string();
    assert!(
        told.starts_with("set loss.level-set=3: does nothing"),
        "{told}"
    );
    assert_eq!(recipe, before);
    let both = ["training.warm-up=0.9", "training.ramp-until=0.95"].map(str::to_owned);
    assert!(recipe.with(&both[0]).is_err(), "beyond the ramp");
    recipe.with_all(&both).expect("together they are a recipe");
    recipe.with("method.name=mlp").expect("another method");
    assert_eq!(recipe.training.steps, 7);
    // The preset's again, as nothing reads it.
    assert_eq!(recipe.loss.strain, preset("default").loss.strain);
}
