//! Texts that isomorph writes and reads back.

use proptest::prelude::*;

use super::*;
use crate::recipe::rule::{Kind, Range};

#[test]
fn a_commented_recipe_is_the_preset_with_and_without_its_comments() {
    for word in Preset::WORDS {
        let commented = Recipe::commented(
            Path::new("/s.ply"),
            Path::new("/t.ply"),
            &Correspondences::None,
            Preset::from_word(word).expect("its own word"),
        );
        let commented = commented.expect("Unicode paths");
        assert_eq!(parsed(&commented, &[]).expect("a recipe"), preset(word));
        // Remove the values' `#`, so that every key stands there live.
        let is_key = |line: &str| line.starts_with('#') && !line.starts_with("# ");
        let live: Vec<&str> = commented
            .lines()
            .map(|line| if is_key(line) { &line[1..] } else { line })
            .collect();
        assert_eq!(live.iter().filter(|line| line.contains(" = ")).count(), {
            let in_comments = commented.lines().filter(|line| line.starts_with("# "));
            1 + KEYS.len() + in_comments.filter(|line| line.contains(" = ")).count()
        });
        assert_eq!(
            parsed(&live.join("\n"), &[]).expect("a recipe"),
            preset(word)
        );
        assert!(
            commented
                .lines()
                .filter(|line| line.starts_with("# "))
                .all(|line| { line.chars().count() <= 100 })
        );
    }
}

#[test]
fn a_commented_recipe_says_what_the_other_presets_have() {
    let text = Recipe::commented(
        Path::new("a b.ply"),
        Path::new("t.ply"),
        &Correspondences::File("pairs".into()),
        Preset::Quick,
    );
    let text = text.expect("Unicode paths");
    assert!(
        text.contains("\n#steps = 1000  # default: 6000, quality: 10000, paper: 10000\n"),
        "{text}"
    );
    assert!(text.contains("\nsource = \"a b.ply\"\n"), "{text}");
    // Without a folder or an extension it would be a misspelt word.
    assert!(text.contains("\ncorrespondences = \"./pairs\"\n"), "{text}");
    assert!(parsed(&text, &[]).is_ok());
}

fn any_number(range: Range) -> BoxedStrategy<f64> {
    // Above every key's preset, below single precision's infinity.
    let high = range.high.min(1e30);
    let low = if range.above { 1e-12 } else { range.low };
    prop_oneof![low..=high, low..=high.min(1.0), Just(high)].boxed()
}

fn any_value(kind: Kind) -> BoxedStrategy<Value> {
    let path = "/[ -~äß☃\t\n]{1,12}\\.ply".prop_map(Value::Text);
    match kind {
        Kind::Whole { low, high } => (low..=high).prop_map(Value::Whole).boxed(),
        Kind::Number(range) => any_number(range).prop_map(Value::Number).boxed(),
        Kind::Numbers(range) => prop::collection::vec(any_number(range), 1..6)
            .prop_map(Value::Numbers)
            .boxed(),
        Kind::Flag => any::<bool>().prop_map(Value::Flag).boxed(),
        Kind::Word(words) => prop::sample::select(words)
            .prop_map(|word| Value::Text(word.to_owned()))
            .boxed(),
        Kind::Path => path.boxed(),
        Kind::WordOrPath(words) => prop_oneof![any_value(Kind::Word(words)), path].boxed(),
    }
}

fn any_recipe() -> impl Strategy<Value = Recipe> {
    let values: Vec<_> = KEYS.iter().map(|key| any_value(key.rule.kind)).collect();
    (prop::sample::select(Preset::ALL).boxed(), values).prop_map(|(preset, values)| {
        let mut recipe = Recipe::from_values(preset, values);
        recipe.implicit.skip %= recipe.implicit.depth;
        recipe.velocity.skip %= recipe.velocity.depth;
        let training = &mut recipe.training;
        training.warm_up = training
            .warm_up
            .min(training.ramp_until)
            .min(training.velocity_until);
        for path in [&mut recipe.data.source, &mut recipe.data.target] {
            *path = std::path::absolute(&*path).expect("it is not empty");
        }
        if recipe.data.normals == NormalSource::None
            || recipe.data.correspondences == Correspondences::None
        {
            // The method that needs neither.
            recipe.method.name = MethodName::Mlp;
        }
        if let Correspondences::File(path) = &mut recipe.data.correspondences {
            *path = std::path::absolute(&*path).expect("it is not empty");
        }
        recipe
    })
}

proptest! {
    #[test]
    fn any_recipe_reads_back_from_its_print(recipe in any_recipe()) {
        let text = recipe.to_toml();
        prop_assert_eq!(&parsed(&text, &[]).map_err(|error| {
            TestCaseError::fail(format!("{error}\n{text}"))
        })?, &recipe);
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "(\\[?[a-z]{0,8}\\]?[ =.'\"\\[\\]{}0-9#-]{0,9}\n?){0,8}") {
        // Any of the errors is as good as a recipe here; each must be one line.
        if let Err(error) = parsed(&text, &[]) {
            prop_assert_eq!(error.to_string().lines().count(), 1);
        }
    }
}
