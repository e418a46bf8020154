//! Keys that do nothing in the chosen method.

use super::*;
use crate::method::{METHODS, spec_of};

fn refused(text: &str, overrides: &[&str]) -> String {
    parsed(text, overrides)
        .expect_err("a key that does nothing")
        .to_string()
}

#[test]
fn a_key_of_the_other_geometry_is_an_error_with_its_line_and_its_home() {
    let text = format!("{SHAPES}[loss]\nstrain = 1\nlevel-set = 3\n");
    assert_eq!(
        refused(&text, &[]),
        "recipe.toml:6: loss.level-set = 3: does nothing in the method velocity-field with \
         implicit.geometry = \"flow\"; delete this line (it acts in implicit.geometry = \"network\")"
    );
    let network = parsed(&text, &["implicit.geometry=network"]).expect("it acts there");
    assert!(network.has("loss.level-set") && !network.has("loss.distance"));
    assert!(parsed(&format!("preset = \"paper\"\n{text}"), &[]).is_ok());
    assert_eq!(
        refused(SHAPES, &["preset=paper", "loss.distance=1"]),
        "set loss.distance=1: does nothing in the method velocity-field with implicit.geometry = \
         \"network\"; leave it out (it acts in implicit.geometry = \"flow\", velocity.kind = \
         \"trained-spline\", method.name = \"mlp\", method.name = \"sdf-blend\" or method.name = \"efis\")"
    );
}

#[test]
fn a_key_of_another_method_is_an_error_with_its_home() {
    assert_eq!(
        refused(SHAPES, &["method.name=mlp", "loss.strain=1"]),
        "set loss.strain=1: does nothing in the method mlp; leave it out (it acts in method.name = \
         \"velocity-field\")"
    );
    assert_eq!(
        refused(&format!("{SHAPES}[nise]\nomega = 25\n"), &[]),
        "recipe.toml:5: nise.omega = 25: does nothing in the method velocity-field with \
         implicit.geometry = \"flow\"; delete this line (it acts in method.name = \"nise\" or \
         method.name = \"nise-velocity\")"
    );
    assert_eq!(
        refused(SHAPES, &["method.name=mlp", "implicit.geometry=flow"]),
        "set implicit.geometry=flow: does nothing in the method mlp; leave it out (it acts in \
         method.name = \"velocity-field\")"
    );
    assert_eq!(
        refused(SHAPES, &["method.name=mlp", "loss.level-set=1"]),
        "set loss.level-set=1: does nothing in the method mlp; leave it out (it acts in \
         method.name = \"velocity-field\" with implicit.geometry = \"network\")"
    );
}

#[test]
fn of_several_such_lines_the_first_is_explained_and_the_others_are_listed() {
    let text = format!("{SHAPES}[loss]\nlambda-l = 1\nstrain = 1\nlevel-set = 3\nstretch = 0\n");
    let told = refused(&text, &[]);
    assert!(
        told.starts_with("recipe.toml:5: loss.lambda-l = 1: does nothing"),
        "{told}"
    );
    assert!(
        told.ends_with("; lines 7 and 8 do nothing either"),
        "{told}"
    );
    assert_eq!(told.lines().count(), 1);
}

#[test]
fn a_key_that_is_gone_and_one_that_has_moved_say_so() {
    assert_eq!(
        refused(&format!("{SHAPES}[loss]\nsteadiness = 3\n"), &[]),
        "recipe.toml:5: loss.steadiness = 3: is no key any more; delete this line"
    );
    let text = format!("{SHAPES}[method]\nname = \"nise\"\nomega = 25\n");
    assert_eq!(
        refused(&text, &[]),
        "recipe.toml:6: method.omega = 25: is nise.omega now; move this line there"
    );
    assert_eq!(
        refused(&text, &["method.name=mlp"]),
        "recipe.toml:6: method.omega = 25: does nothing in the method mlp; delete this line (it acts \
         in method.name = \"nise\" or method.name = \"nise-velocity\")"
    );
}

#[test]
fn what_a_recipe_prints_is_what_acts() {
    for spec in METHODS {
        let mut overrides = vec![
            "data.correspondences=same-vertices".to_owned(),
            format!("method.name={}", spec.name),
        ];
        overrides.extend(
            spec.geometry
                .map(|kind| format!("implicit.geometry={kind}")),
        );
        overrides.extend(spec.velocity.map(|kind| format!("velocity.kind={kind}")));
        overrides.push("training.steps=18".to_owned());
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
        let recipe = parsed(SHAPES, &overrides).expect(spec.name);
        assert_eq!(spec_of(&recipe), *spec);
        let text = recipe.to_toml();
        let is_key = |line: &&str| !line.starts_with('#') && line.contains(" = ");
        let acting = catalogue::keys().filter(|key| spec.acts_on(key));
        // A sequence is not one of the two shapes.
        let printed = acting.filter(|key| !["sequence", "keys"].contains(&key.field));
        assert_eq!(
            text.lines().filter(is_key).count(),
            1 + printed.count(),
            "{text}"
        );
        assert_eq!(parsed(&text, &[]).expect("its own print"), recipe);
    }
}
