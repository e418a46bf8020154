//! The recipe from outside: presets, paths and overrides here; the range of every key in `ranges`,
//! the text of every mistake in `messages`, and what reads back from print in `round_trip`.

mod messages;
mod ranges;
mod round_trip;

use std::path::Path;

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
            recipe.data.source.ends_with("2024"),
            "{given}: {:?}",
            recipe.data.source
        );
    }
}

#[test]
fn paths_are_relative_to_the_recipe() {
    let text = "[data]\nsource = \"a.ply\"\ntarget = \"/b.ply\"\ncorrespondences = \"c/d.csv\"";
    let recipe = Recipe::parse(text, Path::new("/runs/fox/recipe.toml"), &[]).expect("a recipe");
    assert_eq!(recipe.data.source, Path::new("/runs/fox/a.ply"));
    assert_eq!(recipe.data.target, Path::new("/b.ply"));
    let pairs = Correspondences::File("/runs/fox/c/d.csv".into());
    assert_eq!(recipe.data.correspondences, pairs);
    // A recipe in the working directory has a parent of no name.
    let here = std::env::current_dir().expect("a working directory");
    let recipe = parsed("[data]\nsource = \"a.ply\"\ntarget = \"b.ply\"", &[]).expect("a recipe");
    assert_eq!(recipe.data.source, here.join("a.ply"));
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
    assert_eq!((quick.loss.data, quick.training.steps), (7.0, 1000));
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
            "training.steps: 1000 -> 2000"
        ]
    );
    let networks: Vec<bool> = changes.iter().map(Change::is_of_a_network).collect();
    assert_eq!(networks, [false, true, false]);
}
