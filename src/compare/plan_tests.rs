//! Tests of plans: what is understood, and what is refused in which words.

use super::*;

const KNOWN: &[&str] = &["quick", "default", "paper", "lipmlp", "nise", "eigenbasis"];

const PAIR: Option<&str> = Some("0-18");

fn request<'a>(
    pairs: Option<&'a str>,
    methods: Option<&'a str>,
    variants: &'a [String],
) -> Request<'a> {
    Request {
        sequence: "fox_survey",
        frames: 55,
        pairs,
        methods,
        variants,
        known: KNOWN,
    }
}

fn refusal(pairs: Option<&str>, methods: Option<&str>, variants: &[&str]) -> String {
    let variants: Vec<String> = variants.iter().map(|text| (*text).to_owned()).collect();
    let plan = Plan::new(&request(pairs, methods, &variants));
    plan.expect_err("must be refused").to_string()
}

#[test]
fn pairs_are_read_in_the_order_given() {
    let plan = Plan::new(&request(Some("20-47, 0-18"), Some("quick"), &[])).expect("a plan");
    let expected = [
        FramePair { from: 20, to: 47 },
        FramePair { from: 0, to: 18 },
    ];
    assert_eq!(plan.pairs, expected);
}

#[test]
fn pairs_must_be_given() {
    let refused = refusal(None, Some("quick"), &[]);
    assert_eq!(
        refused,
        "pairs are missing: fox_survey has 55 frames, 0 to 54; give the first and the last frame of \
         each pair, such as pairs 0-10,10-20"
    );
}

#[test]
fn what_is_no_pair_is_refused() {
    for given in ["", "18", "a-b", "0-18-20", "0--18", "-1-5", "0-18,,20-47"] {
        let refused = refusal(Some(given), Some("quick"), &[]);
        assert!(refused.contains("must be FROM-TO"), "{given}: {refused}");
    }
    let refused = refusal(Some("3-4"), Some("quick"), &[]);
    assert!(refused.contains("at least FROM + 2 (here 5)"), "{refused}");
    let refused = refusal(Some("18-0"), Some("quick"), &[]);
    assert!(refused.contains("(here 20)"), "{refused}");
    let refused = refusal(Some("0-55"), Some("quick"), &[]);
    assert!(
        refused.contains("fox_survey has 55 frames, 0 to 54"),
        "{refused}"
    );
    let refused = refusal(Some("0-18,0-18"), Some("quick"), &[]);
    assert_eq!(
        refused,
        "pairs 0-18 is given twice; each must be there once"
    );
}

#[test]
fn methods_come_before_variants_and_keep_their_order() {
    let variants = ["no divergence=quick,loss.divergence=0".to_owned()];
    let plan = Plan::new(&request(PAIR, Some("lipmlp,quick"), &variants)).expect("a plan");
    let labels: Vec<&str> = plan
        .methods
        .iter()
        .map(|method| method.label.as_str())
        .collect();
    assert_eq!(labels, ["lipmlp", "quick", "no divergence"]);
    let changed = &plan.methods[2];
    assert_eq!(changed.method, "quick");
    assert_eq!(changed.overrides, ["loss.divergence=0"]);
}

#[test]
fn a_typing_error_is_answered_with_the_nearest_method() {
    let refused = refusal(PAIR, Some("quick,lipmpl"), &[]);
    assert_eq!(
        refused,
        "methods lipmpl: no such method \"lipmpl\"; did you mean lipmlp? \
         (quick, default, paper, lipmlp, nise, eigenbasis)"
    );
    let refused = refusal(PAIR, Some("zzz"), &[]);
    assert!(!refused.contains("did you mean"), "{refused}");
    let refused = refusal(PAIR, None, &["a=quikc"]);
    assert!(refused.contains("did you mean quick?"), "{refused}");
}

#[test]
fn commas_within_a_value_stay_in_it() {
    let given = [
        "x=quick,data.correspondences=a,b.csv,loss.spread=[0.1, 0.2],training.seed=3".to_owned(),
    ];
    let plan = Plan::new(&request(PAIR, None, &given)).expect("a plan");
    let expected = [
        "data.correspondences=a,b.csv",
        "loss.spread=[0.1, 0.2]",
        "training.seed=3",
    ];
    assert_eq!(plan.methods[0].overrides, expected);
}

#[test]
fn what_is_no_variant_is_refused() {
    let refused = |given: &str| refusal(PAIR, None, &[given]);
    assert!(refused("quick").contains("has no \"=\""));
    assert!(refused("=quick").contains("0 characters, allowed are 1 to 48"));
    assert!(refused(&format!("{}=quick", "x".repeat(49))).contains("49 characters"));
    assert!(refused("a\nb=quick").contains("control character"));
    assert!(refused("a=quick,training.steps").contains("\"training.steps\" is not section.key"));
    assert!(refused("floor=quick").contains("is in every table"));
}

#[test]
fn a_label_is_there_once_whatever_its_case() {
    assert!(refusal(PAIR, Some("quick,quick"), &[]).contains("given twice"));
    assert!(refusal(PAIR, Some("quick"), &["Quick=default"]).contains("given twice"));
    assert!(refusal(PAIR, Some("linear"), &[]).contains("is in every table"));
}

#[test]
fn nothing_to_compare_is_refused() {
    for methods in [None, Some(""), Some(" , ")] {
        let refused = refusal(PAIR, methods, &[]);
        assert!(refused.starts_with("methods are missing"), "{refused}");
    }
}

#[test]
fn a_sequence_is_called_by_its_file_or_folder() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let frames = folder.path().join("walk.1");
    std::fs::create_dir(&frames).expect("made");
    assert_eq!(sequence_name(&frames), "walk.1");
    assert_eq!(sequence_name(&frames.join("..").join("walk.1")), "walk.1");
    assert_eq!(
        sequence_name(Path::new("none/bear_walk.anime")),
        "bear_walk"
    );
}
