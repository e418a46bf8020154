//! The one line of each kind of mistake.

use super::*;

fn message(text: &str, overrides: &[&str]) -> String {
    parsed(text, overrides).expect_err(text).to_string()
}

/// A line of a recipe, and what is told about it after "recipe.toml:2: ".
const MISTAKES: &str = r#"
loss.divergence = -1
    loss.divergence = -1: must be 0 or more (0 turns volume preservation off)
loss.data = "x"
    loss.data = "x": must be a number, 0 or more (0 frees f from the shapes)
loss.eikonal = nan
    loss.eikonal = nan: must be a finite number in single precision, 0 or more (0 lets f collapse)
training.steps = 1e3
    training.steps = 1e3: must be a whole number from 1 to 10_000_000
training.steps = 0
    training.steps = 0: must be from 1 to 10_000_000
velocity.time-dependent = 1
    velocity.time-dependent = 1: must be true or false
training.integrator = 'heun'
    training.integrator = 'heun': must be "euler", "midpoint" or "rk4"
training.band-widths = 0.1
    training.band-widths = 0.1: must be a list of numbers, each above 0 and at most 10
data.source = ""
    data.source = "": must be the path of a file
data.correspondences = 'same'
    data.correspondences = 'same': must be "none", "same-vertices", "match" or the path of a file (folder/name.extension)
preset = 'fast'
    preset = 'fast': must be "instant", "quick", "default", "quality" or "paper"
loss = 5
    loss = 5: must be a section: [loss] on a line of its own, once
checkpoint.evry = 5
    checkpoint.evry: no such key; did you mean every? ([checkpoint] has every, keep, step-backs)
checkpoint."ev\u001bry" = 5
    checkpoint.ev�ry: no such key; did you mean every? ([checkpoint] has every, keep, step-backs)
result.steps = 5
    result.steps: no such key; it belongs in [training] ([result] has frames, resolution, preview-every, smallest-component)
result.zzz = 5
    result.zzz: no such key ([result] has frames, resolution, preview-every, smallest-component)
steps = 5
    steps: no such key; it belongs in [training] (above all sections stands preset)
preste = 'quick'
    preste: no such key; did you mean preset? (above all sections stands preset)
lss.data = 5
    [lss]: no such section; did you mean loss? (a recipe has data, method, spline, lipmlp, nise, eigenbasis, nfgp, efis, implicit, velocity, loss, training, checkpoint, result)
"#;

#[test]
fn each_mistake_in_the_file_is_one_line_that_says_where_what_and_what_instead() {
    let lines: Vec<&str> = MISTAKES.trim().lines().map(str::trim).collect();
    for pair in lines.chunks(2) {
        let text = format!("# a comment\n{}\n", pair[0]);
        assert_eq!(message(&text, &[]), format!("recipe.toml:2: {}", pair[1]));
    }
}

#[test]
fn of_several_mistakes_the_first_in_the_file_is_told() {
    let text = "[training]\nsteps = 0\nbatch = 0\n[data]\npoints = 0\n";
    let told = message(text, &[]);
    assert!(
        told.starts_with("recipe.toml:2: training.steps = 0: "),
        "{told}"
    );
}

#[test]
fn text_that_is_not_toml_is_told_with_its_line() {
    let told = message(&format!("{SHAPES}points = 5\npoints = 6\n"), &[]);
    assert_eq!(
        told,
        "recipe.toml:5: not TOML (duplicate key): `points = 6`"
    );
    for broken in [
        "points = ",
        "points = = 5",
        "[loss",
        "points",
        "points = 'x",
        "points = 1_",
    ] {
        let told = message(&format!("{SHAPES}{broken}\n\n"), &[]);
        assert!(told.starts_with("recipe.toml:4: not TOML ("), "{told}");
        assert!(told.ends_with(&format!("): `{}`", broken.trim())), "{told}");
        assert_eq!(told.lines().count(), 1, "{told}");
    }
}

#[test]
fn a_recipe_without_shapes_says_which_is_missing() {
    let told = message("[data]\nsource = \"a.ply\"", &[]);
    assert_eq!(
        told,
        "recipe.toml: data.target is missing (the path of a file); add it under [data]"
    );
}

#[test]
fn a_recipe_that_is_not_there_says_how_to_get_one() {
    let told = Recipe::read(Path::new("/no/such.toml"), &[])
        .expect_err("missing")
        .to_string();
    let (start, end) = (
        "/no/such.toml: cannot be read (",
        "`isomorph init SOURCE TARGET` prints",
    );
    assert!(told.starts_with(start) && told.contains(end), "{told}");
}

#[test]
fn overrides_win_in_their_order_and_name_themselves_when_refused() {
    let text = format!("{SHAPES}[training]\nsteps = 5\n");
    let recipe = parsed(
        &text,
        &["training.steps=6", "training.steps = 7", "preset=quick"],
    );
    let recipe = recipe.expect("three good overrides");
    assert_eq!((recipe.training.steps, recipe.preset), (7, Preset::Quick));
    for (given, told) in [
        (
            "loss.divergence=-1",
            "must be 0 or more (0 turns volume preservation off)",
        ),
        (
            "loss.divergence=much",
            "must be 0 or more (0 turns volume preservation off)",
        ),
        (
            "training.steps",
            "must be section.key=value (such as training.steps=2000)",
        ),
        (
            "steps=5",
            "must be section.key=value (such as training.steps=2000)",
        ),
        (
            "result.frame=5",
            "no such key; did you mean frames? ([result] has frames, resolution, preview-every, smallest-component)",
        ),
        (
            "results.frames=5",
            "no such section; did you mean result? (a recipe has data, method, spline, lipmlp, nise, \
             eigenbasis, nfgp, efis, implicit, velocity, loss, training, checkpoint, result)",
        ),
    ] {
        assert_eq!(message(&text, &[given]), format!("set {given}: {told}"));
    }
}

#[test]
fn values_that_exclude_each_other_name_both_keys_and_lines() {
    let text = format!("{SHAPES}[training]\nwarm-up = 0.6\nvelocity-until = 0.5\nramp-until = 1\n");
    assert_eq!(
        message(&text, &[]),
        "recipe.toml:5: training.warm-up = 0.6: must be at most training.velocity-until = 0.5 \
         (recipe.toml:6); change one of the two"
    );
    assert_eq!(
        message(SHAPES, &["training.ramp-until=0.1"]),
        "set training.ramp-until=0.1: must be at least training.warm-up = 0.3 (preset \
         \"default\"); change one of the two"
    );
    assert_eq!(
        message(&format!("{SHAPES}[velocity]\nskip = 4"), &[]),
        "recipe.toml:5: velocity.skip = 4: must be less than velocity.depth = 4 (preset \
         \"default\"); change one of the two"
    );
}

#[test]
fn what_a_method_lacks_is_told_with_the_cure() {
    let refused = |overrides: &[&str]| {
        let error = parsed(SHAPES, overrides).expect_err("refused");
        error.to_string()
    };
    assert_eq!(
        refused(&["method.name=lipmlp", "data.normals=none"]),
        "set data.normals=none: the method \"lipmlp\" is trained on the normals of the shapes; set it \
         to \"auto\", or choose another method.name"
    );
    let text = refused(&["method.name=eigenbasis"]);
    assert!(text.contains("data.correspondences = \"none\""), "{text}");
    assert!(text.contains("name a file of pairs there"), "{text}");
    assert!(parsed(SHAPES, &["method.name=lipmlp"]).is_ok());
}

#[test]
fn steps_of_training_are_refused_where_a_solver_takes_them() {
    let refused = |overrides: &[&str]| {
        let error = parsed(SHAPES, overrides).expect_err("refused");
        error.to_string()
    };
    let (kind, steps) = ("velocity.kind=spline", "training.steps=501");
    let text = refused(&[kind]);
    assert!(
        text.contains("training.steps = 1000") && text.contains("at most 500"),
        "{text}"
    );
    assert!(refused(&[kind, steps]).contains("preset = \"instant\""));
    assert!(parsed(SHAPES, &[kind, "training.steps=500"]).is_ok());
}
