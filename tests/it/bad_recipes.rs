//! Recipes and command lines that are wrong: one line with the place, the value and what is allowed, exit
//! status 2, and no run is begun. (clap words its own usage errors, in more than one line.)

use std::fs;

use crate::support::workplace::{Ended, NETWORK, Workplace};

/// Lines that are wrong, and what the message must say of each.
const WRONG: &[(&str, &[&str])] = &[
    ("training.stesp = 5", &["stesp", "steps"]),
    ("trainig.steps = 5", &["trainig", "training"]),
    (
        "loss.divergence = \"two\"",
        &["loss.divergence = \"two\"", "number"],
    ),
    ("training.steps = 1.5", &["training.steps = 1.5", "whole"]),
    (
        "loss.divergence = -1",
        &["loss.divergence = -1", "0 or more"],
    ),
    ("loss.strain = nan", &["loss.strain = nan", "finite"]),
    ("result.resolution = 0", &["resolution = 0", "from 8 to"]),
    ("training.integrator = \"verlet\"", &["verlet", "midpoint"]),
    (
        "implicit.skip = 7",
        &["implicit.skip = 7", "implicit.depth"],
    ),
    // Keys that do nothing: of the other geometry, of another method, of an earlier version.
    (
        "loss.lambda-l = 1",
        &["loss.lambda-l = 1", "does nothing", "flow", "network"],
    ),
    (
        "loss.transported-normals = 0",
        &[
            "loss.transported-normals = 0",
            "does nothing",
            "delete this line",
        ],
    ),
    ("nfgp.deformations = 4", &["nfgp.deformations = 4", "nfgp"]),
    (
        "method.deformations = 4",
        &["method.deformations = 4", "nfgp"],
    ),
    (
        "loss.steadiness = 1",
        &["loss.steadiness = 1", "delete this line"],
    ),
    (
        "loss.stretch = 0",
        &["loss.stretch = 0", "delete this line"],
    ),
    ("training.steps = = 5", &["not TOML"]),
];

/// Of the paper's geometry other keys do nothing, and of another method most.
#[test]
fn a_key_that_does_nothing_is_refused_with_its_line_and_where_it_acts() {
    let cases: [(&[&str], &str, &[&str]); 4] = [
        (NETWORK, "loss.distance = 10", &["flow"]),
        (
            &["method.name = \"mlp\""],
            "velocity.width = 24",
            &["mlp", "velocity-field"],
        ),
        (
            &["method.name = \"lipmlp\""],
            "nise.omega = 20",
            &["lipmlp", "nise"],
        ),
        (
            &["method.name = \"nise\""],
            "method.omega = 20",
            &["nise.omega"],
        ),
    ];
    for (keys, line, parts) in cases {
        let place = Workplace::tiny_with(&[], &[keys, &[line]].concat());
        let text = fs::read_to_string(place.path("recipe.toml")).expect("a recipe");
        let at = format!("recipe.toml:{}: {line}", text.lines().count());
        let before = place.names();
        let train = ["train", "recipe.toml", "--run", "run"];
        place
            .isomorph(&train)
            .refused(2, &[&[at.as_str()], parts].concat());
        assert_eq!(place.names(), before, "{line:?} leaves something behind");
    }
    // The same words on the command line.
    let place = Workplace::tiny(&[]);
    let ended = place.isomorph(&["train", "recipe.toml", "--set", "loss.lambda-l=1"]);
    ended.refused(2, &["set loss.lambda-l=1", "does nothing"]);
}

#[test]
fn a_bad_recipe_is_refused_with_file_line_key_value_and_what_is_allowed() {
    // Each stands on the last line of a recipe, after good ones.
    for (line, parts) in WRONG {
        let place = Workplace::tiny(&[line]);
        let text = fs::read_to_string(place.path("recipe.toml")).expect("a recipe");
        assert_eq!(
            text.lines().last(),
            Some(*line),
            "the line that the messages name"
        );
        let at = format!("recipe.toml:{}", text.lines().count());
        let parts = [&[at.as_str()], *parts].concat();
        let before = place.names();
        place
            .isomorph(&["train", "recipe.toml", "--run", "run"])
            .refused(2, &parts);
        place.isomorph(&["info", "recipe.toml"]).refused(2, &parts);
        assert_eq!(place.names(), before, "{line:?} leaves something behind");
    }
}

#[test]
fn a_bad_override_is_refused_with_its_words() {
    let place = Workplace::tiny(&[]);
    let before = place.names();
    for (set, allowed) in [
        ("result.resolution=0", "from 8 to"),
        ("loss.matching=-3", "0 or more"),
        ("training.steps=many", "from 1 to"),
        ("steps=5", "section"),
        ("training.steps", "section.key=value"),
    ] {
        let ended = place.isomorph(&["train", "recipe.toml", "--run", "run", "--set", set]);
        ended.refused(2, &[&format!("set {set}"), allowed]);
    }
    assert_eq!(place.names(), before);
}

#[test]
fn a_missing_recipe_is_a_bad_recipe() {
    let place = Workplace::new();
    place
        .isomorph(&["train", "no.toml"])
        .refused(2, &["no.toml: cannot be read", "isomorph init"]);
    place.write("no.toml", "");
    place
        .isomorph(&["train", "no.toml"])
        .refused(2, &["no.toml: data.source is missing"]);
    assert_eq!(place.names(), ["no.toml"]);
}

#[test]
fn a_backend_or_device_that_is_not_there_leaves_no_run() {
    let place = Workplace::tiny(&[]);
    let before = place.names();
    let train = ["train", "recipe.toml", "--run", "run"];
    let ended = place.isomorph(&[&train[..], &["--backend", "cuda"]].concat());
    assert_eq!(ended.code, Some(2), "{ended:?}");
    assert!(
        ended.stderr.contains("cuda") && ended.stderr.contains("flex"),
        "{ended:?}"
    );
    let gpu = ["--backend", "flex", "--device", "discrete:1"];
    place
        .isomorph(&[&train[..], &gpu].concat())
        .refused(2, &["device discrete:1", "wgpu"]);
    let unknown = ["--backend", "wgpu", "--device", "gpu"];
    place
        .isomorph(&[&train[..], &unknown].concat())
        .refused(2, &["device gpu", "discrete"]);
    assert_eq!(place.names(), before);
}

#[test]
fn a_machine_without_a_vulkan_driver_is_told_what_to_do() {
    let place = Workplace::tiny(&[]);
    let before = place.names();
    let mut command = place.command(&[
        "train",
        "recipe.toml",
        "--run",
        "run",
        "--quiet",
        "--backend",
        "wgpu",
    ]);
    // The loader looks for drivers nowhere else then.
    command
        .env("VK_DRIVER_FILES", "/nowhere")
        .env("VK_ICD_FILENAMES", "/nowhere");
    let ended = Ended::from(command.output().expect("the program starts"));
    ended.refused(
        1,
        &[
            "backend wgpu: no device",
            "mesa-vulkan-drivers",
            "backend flex",
        ],
    );
    assert_eq!(place.names(), before);
}
