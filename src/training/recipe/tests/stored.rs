//! Recipes that are stored with runs, of this version and of 0.1.

use super::*;
use crate::method::spec_of;

/// As version 0.1 printed that of data/fox/quick.toml, and one of the method nise.
const FLOW: &str = include_str!("version-0.1-flow.toml");
const NISE: &str = include_str!("version-0.1-nise.toml");

/// What runs did before there were keys for it.
const THEN: [&str; 4] = [
    "training.optimiser=adam",
    "training.guided-until=0",
    "data.clean=none",
    "data.mirrored=true",
];

fn stored(text: &str) -> (Recipe, Vec<String>) {
    Recipe::parse_stored(text, Path::new("/run/recipe.toml")).expect("a recipe of a run")
}

#[test]
fn a_recipe_of_version_0_1_is_the_preset_that_it_was() {
    let (recipe, notes) = stored(FLOW);
    assert_eq!(notes, [""; 0]);
    let set = [
        "preset=quick",
        "data.source=/shapes/source.ply",
        "data.target=/shapes/target.ply",
        "data.correspondences=/shapes/pairs.csv",
        "training.steps=1000",
        "training.optimiser=adam",
        "training.guided-until=0",
        "data.clean=none",
        "data.mirrored=true",
        "checkpoint.every=200",
    ];
    // The preset's other values that act have not changed since.
    assert_eq!(recipe, parsed(SHAPES, &set).expect("a recipe"));
    assert_eq!(stored(&recipe.to_toml()).0, recipe);
}

#[test]
fn keys_that_moved_are_taken_and_a_term_that_is_gone_is_noted() {
    let (recipe, notes) = stored(NISE);
    assert_eq!(spec_of(&recipe).name, "nise");
    assert_eq!(recipe.training.steps, 700);
    assert!(
        recipe.to_toml().contains("\nomega = 25\n"),
        "{}",
        recipe.to_toml()
    );
    assert_eq!(
        notes,
        [
            "/run/recipe.toml:174: loss.steadiness = 3: this version has no such term; it is left out"
        ]
    );
}

#[test]
fn train_says_which_lines_of_such_a_recipe_to_delete() {
    let told = parsed(FLOW, &[]).expect_err("dead keys").to_string();
    assert!(
        told.starts_with("recipe.toml:31: method.ends-until = 0.4: does nothing"),
        "{told}"
    );
    assert!(told.contains("delete this line"), "{told}");
    // Without those lines it is the same recipe.
    let listed = told.rsplit_once("; lines ").expect("others").1;
    let numbers = listed.split(|letter: char| !letter.is_ascii_digit());
    let mut lines: Vec<usize> = numbers.filter_map(|number| number.parse().ok()).collect();
    lines.push(31);
    let left = FLOW.lines().enumerate();
    let left = left.filter(|(index, _)| !lines.contains(&(index + 1)));
    let left: Vec<&str> = left.map(|(_, line)| line).collect();
    // Later keys have the values of the preset there, and those of earlier runs here.
    assert_eq!(
        parsed(&left.join("\n"), &THEN).expect("a recipe"),
        stored(FLOW).0
    );
}

#[test]
fn what_a_later_version_added_is_left_out_with_a_note() {
    let text = format!("{SHAPES}colour = true\n[clean]\nholes = 3\n");
    let (recipe, notes) = stored(&text);
    assert_eq!(recipe, parsed(SHAPES, &THEN).expect("a recipe"));
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(
        notes[0].starts_with("/run/recipe.toml:4: data.colour: no such key"),
        "{notes:?}"
    );
    assert!(notes[1].ends_with("it is left out"), "{notes:?}");
    // A value that is wrong is one that no version wrote.
    let wrong = format!("{SHAPES}points = 1\n");
    assert!(Recipe::parse_stored(&wrong, Path::new("r.toml")).is_err());
}
