//! The recipe that `init` prints.

use super::*;

fn commented(preset: Preset, all: bool) -> String {
    let shapes = ["/s.ply".into(), "/t.ply".into()];
    let text = Recipe::commented(&shapes, &Correspondences::None, preset, all);
    text.expect("Unicode paths")
}

/// The keys of a printed recipe in their order, live or in comments.
fn ids(text: &str) -> Vec<&str> {
    let lines = text.lines().filter(|line| !line.starts_with("# "));
    lines
        .filter_map(|line| Some(line.trim_start_matches('#').split_once(" = ")?.0))
        .collect()
}

/// The text without the `#` before its keys, so that each stands there live.
fn live(text: &str) -> String {
    let is_key = |line: &str| line.starts_with('#') && !line.starts_with("# ");
    let lines = text.lines();
    let live = lines.map(|line| if is_key(line) { &line[1..] } else { line });
    live.collect::<Vec<_>>().join("\n")
}

#[test]
fn it_is_the_preset_with_and_without_its_comments() {
    for preset_of in Preset::ALL {
        let text = commented(*preset_of, false);
        let wanted = preset(preset_of.word());
        assert_eq!(parsed(&text, &[]).expect("a recipe"), wanted);
        assert_eq!(parsed(&live(&text), &[]).expect("a recipe"), wanted);
        let comments = text.lines().filter(|line| line.starts_with("# "));
        for line in comments {
            assert!(line.chars().count() <= 100, "{line}");
        }
    }
}

#[test]
fn the_shapes_and_the_ten_keys_that_people_change_come_first() {
    let text = commented(Preset::Default, false);
    let first = [
        "data.source",
        "data.target",
        "preset",
        "data.correspondences",
        "data.normals",
        "loss.divergence",
        "loss.strain",
        "loss.matching-scale",
        "training.steps",
        "training.seed",
        "result.frames",
        "result.resolution",
    ];
    assert_eq!(ids(&text)[..12], first);
}

#[test]
fn every_key_stands_once_and_only_all_has_those_of_other_methods() {
    for preset_of in Preset::ALL {
        let recipe = preset(preset_of.word());
        let acting = recipe.acting();
        let mut acting: Vec<String> = acting.iter().map(|(key, _)| key.id()).collect();
        acting.push("preset".to_owned());
        let text = commented(*preset_of, false);
        let mut found: Vec<String> = ids(&text).into_iter().map(str::to_owned).collect();
        acting.sort();
        found.sort();
        assert_eq!(found, acting);

        let all = commented(*preset_of, true);
        assert!(all.starts_with(&text));
        let mut found = ids(&all);
        found.sort_unstable();
        let keys = catalogue::keys().map(Key::id);
        let mut keys: Vec<String> = keys.chain(["preset".to_owned()]).collect();
        keys.retain(|id| id != "data.sequence" && id != "data.keys");
        keys.sort();
        assert_eq!(found, keys);
        // Read as it is, it is still the preset.
        assert_eq!(parsed(&all, &[]).expect("a recipe"), recipe);
    }
    let all = commented(Preset::Quick, true);
    assert!(
        all.contains("# Acts in nise, nise-velocity. Until here only the two end fields train.")
    );
    assert!(
        all.contains("# Acts in velocity-field with implicit.geometry = \"network\"."),
        "{all}"
    );
}

#[test]
fn it_says_what_the_other_presets_have() {
    let text = Recipe::commented(
        &["a b.ply".into(), "t.ply".into()],
        &Correspondences::File("pairs".into()),
        Preset::Quick,
        false,
    );
    let text = text.expect("Unicode paths");
    let steps =
        "\n#training.steps = 550  # instant: 18, default: 1000, quality: 3000, paper: 10000\n";
    assert!(text.contains(steps), "{text}");
    assert!(text.contains("\ndata.source = \"a b.ply\"\n"), "{text}");
    // Without a folder or an extension it would be a misspelt word.
    assert!(
        text.contains("\ndata.correspondences = \"./pairs\"\n"),
        "{text}"
    );
    assert!(parsed(&text, &[]).is_ok());
}

#[test]
fn many_shapes_are_key_frames_with_the_values_of_many() {
    let shapes = ["/a.ply", "/b.ply", "/c.ply"].map(Into::into);
    let text = Recipe::commented(
        &shapes,
        &Correspondences::SameVertices,
        Preset::Instant,
        false,
    );
    let text = text.expect("Unicode paths");
    let recipe = parsed(&text, &[]).expect("a recipe");
    let times: Vec<f64> = recipe.data.keyframes.iter().map(|key| key.time).collect();
    assert_eq!(times, [0.0, 1.0, 2.0]);
    assert_eq!(recipe.data.between, vec![Correspondences::SameVertices; 2]);
    assert!(text.contains("\n#loss.screw = 10\n"), "{text}");
    assert_eq!(parsed(&live(&text), &[]).expect("each key live"), recipe);
}
