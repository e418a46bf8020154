//! Texts that isomorph writes and reads back.

use proptest::prelude::*;

use super::*;
use crate::method::METHODS;
use crate::recipe::VelocityKind;
use crate::recipe::rule::{Kind, Range};

fn any_number(range: Range) -> BoxedStrategy<f64> {
    // Above every key's preset, below single precision's infinity.
    let high = range.high.min(1e30);
    let low = if range.above { 1e-12 } else { range.low };
    prop_oneof![low..=high, low..=high.min(1.0).max(low), Just(high)].boxed()
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

/// Any values that are allowed in any method, as TOML text, and how many there are.
fn any_recipe() -> impl Strategy<Value = (String, usize)> {
    let keys: Vec<&Key> = catalogue::keys()
        .filter(|key| !["sequence", "keys"].contains(&key.field))
        .collect();
    let values: Vec<_> = keys.iter().map(|key| any_value(key.rule.kind)).collect();
    let methods = prop::sample::select(METHODS);
    let presets = prop::sample::select(Preset::ALL);
    (presets, methods, values).prop_map(move |(preset, spec, values)| {
        let mut text = format!("preset = \"{preset}\"\n");
        let mut count = 0;
        for (key, value) in keys.iter().zip(values).filter(|(key, _)| spec.acts_on(key)) {
            let word = |word: &str| Value::Text(word.to_owned());
            let value = match key.id().as_str() {
                "method.name" => word(spec.name),
                "implicit.geometry" => word(spec.geometry.expect("it acts").word()),
                "velocity.kind" => word(spec.velocity.expect("it acts").word()),
                "training.steps" if spec.velocity == Some(VelocityKind::Spline) => Value::Whole(20),
                // What some methods cannot do without.
                "data.normals" if spec.needs.normals => word("auto"),
                "data.correspondences" if spec.needs.correspondences => word("same-vertices"),
                // Values that others bound.
                "implicit.skip" | "velocity.skip" => Value::Whole(0),
                "training.warm-up" => Value::Number(0.0),
                _ => value,
            };
            text.push_str(&format!("{} = {value}\n", key.id()));
            count += 1;
        }
        (text, count)
    })
}

proptest! {
    #[test]
    fn any_recipe_reads_back_from_its_print((given, count) in any_recipe()) {
        let read = |text: &str| parsed(text, &[]).map_err(|error| {
            TestCaseError::fail(format!("{error}\n{text}"))
        });
        let recipe = read(&given)?;
        let text = recipe.to_toml();
        prop_assert_eq!(&read(&text)?, &recipe);
        // Every value given is there.
        prop_assert_eq!(recipe.acting().len(), count);
        let stored = Recipe::parse_stored(&text, Path::new("recipe.toml"));
        let stored = stored.map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert_eq!(&stored.0, &recipe);
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "(\\[?[a-z]{0,8}\\]?[ =.'\"\\[\\]{}0-9#-]{0,9}\n?){0,8}") {
        // Any of the errors is as good as a recipe here; each must be one line.
        if let Err(error) = parsed(&text, &[]) {
            prop_assert_eq!(error.to_string().lines().count(), 1);
        }
    }
}

#[test]
fn another_preset_brings_its_own_values_and_leaves_what_was_chosen() {
    let mut recipe = Recipe::between("a.ply", "b.ply").expect("two files");
    recipe.with("loss.strain=7").expect("a key");
    for (preset, steps, batch) in [(Preset::Quick, 550, 2200), (Preset::Paper, 10_000, 4000)] {
        recipe.with(&format!("preset={preset}")).expect("a preset");
        let training = &recipe.training;
        assert_eq!((training.steps, training.batch), (steps, batch), "{preset}");
        assert_eq!(recipe.loss.strain, 7.0);
    }
    recipe.with("preset=instant").expect("a preset");
    assert_eq!(recipe.velocity.kind, VelocityKind::Spline);
    assert_eq!((recipe.training.steps, recipe.loss.strain), (18, 7.0));
}
