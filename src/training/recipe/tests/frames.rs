//! Key frames: their three forms, and what can be wrong with them.

use super::*;

const THREE: &str = r#"
[data]
points = 100
correspondences = "same-vertices"
[[data.keyframe]]
file = "a.ply"
time = 0
[[data.keyframe]]
file = "/b.ply"
time = 12.5
correspondences = "b-to-c.csv"
[[data.keyframe]]
file = "c.ply"
time = 20
"#;

const SEQUENCE: &str = "[data]\nsequence = \"walk.anime\"\nkeys = [0, 10, 18]\n\
                        correspondences = \"same-vertices\"\n";

/// All that a text says, of whatever key frames.
fn read(text: &str) -> Result<Recipe, RecipeError> {
    Recipe::parse_stored(text, Path::new("/shapes/recipe.toml")).map(|(recipe, _)| recipe)
}

fn message(text: &str) -> String {
    parsed(text, &[]).expect_err("refused").to_string()
}

#[test]
fn two_shapes_are_the_short_form_of_two_key_frames() {
    let recipe = parsed(SHAPES, &[]).expect("a recipe");
    let keys = &recipe.data.keyframes;
    let told: Vec<_> = keys
        .iter()
        .map(|key| (key.file.as_path(), key.time))
        .collect();
    assert_eq!(
        told,
        [(Path::new("/s.ply"), 0.0), (Path::new("/t.ply"), 1.0)]
    );
    assert_eq!(recipe.data.between, [Correspondences::None]);
    let long = "[[data.keyframe]]\nfile = \"/s.ply\"\ntime = 0\n\
                [[data.keyframe]]\nfile = \"/t.ply\"\ntime = 1\n";
    assert_eq!(parsed(long, &[]).expect("two key frames"), recipe);
    assert!(recipe.to_toml().contains("\nsource = \"/s.ply\"\n"));
}

#[test]
fn a_list_of_key_frames_has_files_times_and_what_is_known_between() {
    let recipe = read(THREE).expect("three key frames");
    let keys = &recipe.data.keyframes;
    let told: Vec<_> = keys
        .iter()
        .map(|key| (key.file.as_path(), key.time))
        .collect();
    let file = |name: &'static str| Path::new(name);
    let wanted = [
        (file("/shapes/a.ply"), 0.0),
        (file("/b.ply"), 12.5),
        (file("/shapes/c.ply"), 20.0),
    ];
    assert_eq!(told, wanted);
    let pairs = Correspondences::File("/shapes/b-to-c.csv".into());
    assert_eq!(recipe.data.between, [Correspondences::SameVertices, pairs]);
    assert_eq!(recipe.data.points, 100);
    assert_eq!(read(&recipe.to_toml()).expect("its own print"), recipe);
    // Two with times of their own keep them.
    let two = "[[data.keyframe]]\nfile = \"/s.ply\"\ntime = -3\n\
               [[data.keyframe]]\nfile = \"/t.ply\"\ntime = 4\n";
    let two = parsed(two, &[]).expect("two key frames");
    assert_eq!(two.data.keyframes[0].time, -3.0);
    assert_eq!(parsed(&two.to_toml(), &[]).expect("its own print"), two);
}

#[test]
fn a_sequence_has_the_frames_that_are_its_key_frames() {
    let recipe = read(SEQUENCE).expect("three frames");
    let frames: Vec<_> = recipe.data.keyframes.iter().map(|key| key.frame).collect();
    assert_eq!(frames, [Some(0), Some(10), Some(18)]);
    assert_eq!(recipe.data.source(), Path::new("/shapes/walk.anime"));
    assert_eq!(
        recipe.data.between,
        [Correspondences::SameVertices, Correspondences::SameVertices]
    );
    assert_eq!(read(&recipe.to_toml()).expect("its own print"), recipe);
}

#[test]
fn methods_that_take_two_refuse_more_in_one_place() {
    let presets = "for more, set preset = \"instant\", \"quick\" or \"default\"";
    let refused = format!(
        "velocity-field with implicit.geometry = \"network\" takes two key frames, not 3; {presets}"
    );
    let paper = |text: &str| message(&format!("preset = \"paper\"\n{text}"));
    assert_eq!(paper(THREE), format!("recipe.toml:7: {refused}"));
    assert_eq!(paper(SEQUENCE), format!("recipe.toml:3: {refused}"));
    let baseline = parsed(SEQUENCE, &["method.name=mlp"]);
    let told = baseline.expect_err("refused").to_string();
    assert!(told.contains("mlp takes two key frames, not 3"), "{told}");
    let still = parsed(SEQUENCE, &["velocity.time-dependent=false"]);
    let told = still.expect_err("refused").to_string();
    assert!(told.contains("through 3 key frames"), "{told}");
    assert!(
        told.contains("leave velocity.time-dependent at true"),
        "{told}"
    );
}

#[test]
fn the_steps_of_networks_grow_with_the_number_of_intervals() {
    let steps = |preset: &str, keys: &str| {
        let text = format!(
            "preset = \"{preset}\"\n{}",
            SEQUENCE.replace("[0, 10, 18]", keys)
        );
        parsed(&text, &[]).expect("a recipe").training.steps
    };
    let two = steps("quick", "[0, 10]");
    // An end field between two intervals learns in both: two thirds of the steps of a pair for each.
    assert_eq!(
        steps("quick", "[0, 1, 2]"),
        (two as f64 * 4.0 / 3.0).round() as usize
    );
    assert_eq!(steps("quick", "[0, 10, 18, 28, 39, 47, 54]"), 4 * two);
    let [one, seven] = ["[0, 1]", "[0, 1, 2, 3, 4, 5, 6]"].map(|keys| steps("default", keys));
    assert_eq!(seven, 4 * one);
    assert_eq!(
        steps("instant", "[0, 1, 2]"),
        steps("instant", "[0, 1, 2, 3]")
    );
    // A number of one's own stays.
    let own = parsed(SEQUENCE, &["training.steps=77"]).expect("a recipe");
    assert_eq!(own.training.steps, 77);
    assert_eq!(read(&own.to_toml()).expect("its own print"), own);
}

#[test]
fn each_mistake_says_where_it_is_and_what_to_do() {
    let key = |file: &str, rest: &str| format!("[[data.keyframe]]\nfile = \"{file}\"\n{rest}\n");
    let two = |rest: &str| key("/a.ply", "time = 1") + &key("/b.ply", rest);
    for (text, told) in [
        (
            two("time = 1"),
            "recipe.toml:5: data.keyframe.file = \"/b.ply\": its time 1 is not after 1, that of the key \
             frame before; give them in ascending order",
        ),
        (
            two(""),
            "recipe.toml: data.keyframe.time is missing (from -1000000000 to 1000000000); add it under \
             [[data.keyframe]]",
        ),
        (
            two("time = 2\ncorrespondences = \"none\""),
            "recipe.toml:7: data.keyframe.correspondences = \"none\": no key frame follows the last one; \
             delete this line",
        ),
        (
            key("/a.ply", "time = 1"),
            "recipe.toml:2: data.keyframe.file = \"/a.ply\": it is the only key frame; give at least two",
        ),
        (
            two("time = \"late\""),
            "recipe.toml:6: data.keyframe.time = \"late\": must be a number, from -1000000000 to \
             1000000000",
        ),
        (
            two("tme = 2"),
            "recipe.toml:6: data.keyframe.tme: no such key; did you mean time? ([data.keyframe] has \
             file, time, correspondences)",
        ),
        (
            SHAPES.to_owned() + &two("time = 2"),
            "recipe.toml:2: data.source = \"/s.ply\": data.keyframe.file is given too (recipe.toml:5); \
             give the key frames in one way",
        ),
        (
            SEQUENCE.replace("10, 18", "18, 10"),
            "recipe.toml:3: data.keys = [0, 18, 10]: must be at least two whole numbers in ascending \
             order",
        ),
        (
            SEQUENCE.replace("keys = [0, 10, 18]", ""),
            "recipe.toml: data.keys is missing (a list of numbers, each from 0 to 10000000); add it \
             under [data]",
        ),
        (
            "data.keyframe = 3\n".to_owned(),
            "recipe.toml:1: data.keyframe = 3: must be a list: [[data.keyframe]] on a line of its own \
             for each key frame",
        ),
    ] {
        assert_eq!(message(&text), told);
    }
}

#[test]
fn a_folder_or_a_pattern_is_a_sequence_in_the_order_of_its_numbers() {
    let place = tempfile::tempdir().expect("a temporary folder");
    for name in [
        "scan10.ply",
        "scan2.ply",
        "scan1.ply",
        ".scan3.ply",
        "notes.txt",
    ] {
        std::fs::write(place.path().join(name), "").expect("written");
    }
    let of = |sequence: &str, rest: &str| {
        let path = place.path().join(sequence);
        let text = format!("[data]\nsequence = {path:?}\n{rest}");
        read(&text)
    };
    let names = |recipe: &Recipe| -> Vec<(String, f64)> {
        let keys = recipe.data.keyframes.iter();
        let name = |key: &KeyframeRecipe| {
            key.file
                .file_name()
                .map(|name| name.to_string_lossy().into_owned())
        };
        keys.map(|key| (name(key).expect("a name"), key.time))
            .collect()
    };
    let all = [("scan1.ply", 0.0), ("scan2.ply", 1.0), ("scan10.ply", 2.0)];
    let all = all.map(|(name, time)| (name.to_owned(), time));
    for sequence in ["", "*.ply"] {
        let recipe = of(sequence, "").expect("three files");
        assert_eq!(names(&recipe)[..], all, "{sequence:?}");
        assert_eq!(read(&recipe.to_toml()).expect("its own print"), recipe);
    }
    let some = of("*.ply", "keys = [0, 2]\ncorrespondences = \"match\"\n").expect("two files");
    assert_eq!(names(&some), [all[0].clone(), all[2].clone()]);
    assert_eq!(some.data.between, [Correspondences::Match]);
    for (sequence, rest, told) in [
        (
            "*.ply",
            "keys = [0, 3]\n",
            "there is no frame 3: 3 files, counted from 0",
        ),
        (
            "*.obj",
            "",
            "there are 0 shapes in this place; give two or more",
        ),
        ("[.ply", "", "Pattern syntax error"),
        ("**/*.ply", "", "there are 0 shapes in this place"),
    ] {
        let refused = of(sequence, rest).expect_err(told).to_string();
        assert!(refused.contains(told), "{refused}");
    }
}

#[test]
fn what_is_known_throughout_can_be_changed_for_all_key_frames() {
    let shapes = [("/a.ply", 0.0), ("/b.ply", 1.0), ("/c.ply", 4.0)];
    let mut recipe = Recipe::through(&shapes).expect("three files");
    assert_eq!(recipe.data.between, vec![Correspondences::None; 2]);
    recipe
        .with("data.correspondences=same-vertices")
        .expect("a word");
    assert_eq!(recipe.data.between, vec![Correspondences::SameVertices; 2]);
    assert!(
        recipe
            .to_toml()
            .contains("\ncorrespondences = \"same-vertices\"\n")
    );
    assert_eq!(read(&recipe.to_toml()).expect("its own print"), recipe);
}

#[test]
fn shapes_that_are_appended_come_last_and_bring_the_values_of_many() {
    let mut recipe = parsed(SHAPES, &["preset=instant", "loss.matching=150"]).expect("a recipe");
    let two = recipe.clone();
    recipe
        .append(&[("/c.ply", 2.0), ("/d.ply", 5.0)], Some("match"))
        .expect("two more");
    let of = |key: &KeyframeRecipe| (key.file.display().to_string(), key.time);
    let told: Vec<_> = recipe.data.keyframes.iter().map(of).collect();
    let wanted = [
        ("/s.ply", 0.0),
        ("/t.ply", 1.0),
        ("/c.ply", 2.0),
        ("/d.ply", 5.0),
    ];
    assert_eq!(told, wanted.map(|(file, time)| (file.to_owned(), time)));
    let known = [
        Correspondences::None,
        Correspondences::Match,
        Correspondences::Match,
    ];
    assert_eq!(recipe.data.between, known);
    // Those of the preset change, and the user's own stays.
    assert_eq!((two.training.steps, recipe.training.steps), (18, 10));
    assert_eq!(recipe.loss.matching, 150.0);
    assert_eq!(read(&recipe.to_toml()).expect("its own print"), recipe);
    // They go on after those before; not the other way round, nor with others.
    assert!(recipe.data.continues(&two.data));
    assert!(!two.data.continues(&recipe.data) && !two.data.continues(&two.data));
    let mut other = two.clone();
    other.data.keyframes[1].time = 0.5;
    assert!(!recipe.data.continues(&other.data));
    // Without a word it is as it was between the last two.
    recipe.append(&[("/e.ply", 6.0)], None).expect("one more");
    assert_eq!(recipe.data.between[3], Correspondences::Match);
}

#[test]
fn what_cannot_be_appended_leaves_the_recipe_as_it_was() {
    let recipe = parsed(SHAPES, &["preset=instant"]).expect("a recipe");
    let refused = |recipe: &Recipe, time: f64, known: Option<&str>| {
        let mut longer = recipe.clone();
        let refused = longer
            .append(&[("/c.ply", time)], known)
            .expect_err("refused");
        assert_eq!(longer, *recipe);
        refused.to_string()
    };
    assert!(refused(&recipe, 1.0, None).contains("its time 1 is not after 1"));
    let found = refused(&recipe, 2.0, Some("mtach"));
    assert!(
        found.contains("mtach") && found.contains("\"match\""),
        "{found}"
    );
    let frames = read(SEQUENCE).expect("frames of a sequence");
    assert!(refused(&frames, 20.0, None).contains("append to data.keys"));
    let paper = parsed(SHAPES, &["preset=paper"]).expect("a recipe");
    assert!(refused(&paper, 2.0, None).contains("takes two key frames"));
}
