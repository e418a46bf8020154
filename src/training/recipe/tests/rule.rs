//! What each kind of rule admits.

use toml::de::DeValue;

use crate::recipe::rule::{Rule, Value};

fn admitted(rule: Rule, text: &str) -> Result<Value, String> {
    rule.admit(DeValue::parse(text).expect("a TOML value").get_ref())
}

#[test]
fn an_integer_is_a_number_but_a_float_is_not_a_whole_number() {
    assert_eq!(
        admitted(Rule::number(0.0, 9.0), "3"),
        Ok(Value::Number(3.0))
    );
    assert_eq!(
        admitted(Rule::whole(0, 20_000), "3.0").expect_err("refused"),
        { "a whole number from 0 to 20_000" }
    );
}

#[test]
fn infinities_and_what_overflows_single_precision_are_refused() {
    for text in ["inf", "-inf", "nan", "1e999", "3.5e38"] {
        let refused = admitted(Rule::positive_or_zero(), text).expect_err("refused");
        assert_eq!(
            refused, "a finite number in single precision, 0 or more",
            "{text}"
        );
    }
    assert_eq!(
        admitted(Rule::positive_or_zero(), "3e38"),
        Ok(Value::Number(3e38))
    );
}

#[test]
fn whole_numbers_come_in_every_notation_of_toml() {
    for text in ["1_000", "0x3e8", "0b1111101000", "0o1750", "+1000"] {
        assert_eq!(
            admitted(Rule::whole(1, 9999), text),
            Ok(Value::Whole(1000)),
            "{text}"
        );
    }
}

#[test]
fn a_list_is_refused_for_one_bad_number_and_for_having_none() {
    let rule = Rule::list_above_zero(10.0);
    assert_eq!(
        admitted(rule, "[1, 0.5]"),
        Ok(Value::Numbers(vec![1.0, 0.5]))
    );
    for text in ["[]", "[1, 0]", "[1, \"2\"]", "[[1]]", "1"] {
        let refused = admitted(rule, text).expect_err("refused");
        assert_eq!(
            refused, "a list of numbers, each above 0 and at most 10",
            "{text}"
        );
    }
}

#[test]
fn a_misspelt_word_is_not_taken_for_a_path() {
    let rule = Rule::word_or_path(&["none", "same-vertices"]);
    assert_eq!(
        admitted(rule, "'pairs.csv'"),
        Ok(Value::Text("pairs.csv".into()))
    );
    assert_eq!(
        admitted(rule, "'same-vertex'").expect_err("refused"),
        "\"none\", \"same-vertices\" or the path of a file (folder/name.extension)"
    );
}
