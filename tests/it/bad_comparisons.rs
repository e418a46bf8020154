//! Comparisons that cannot be made as asked: one line of error and exit status 2 before anything is
//! trained, and nothing left behind.

use crate::comparison::{SMALL, compare, place};
use crate::support::command::with;
use crate::support::workplace::turn;

#[test]
fn a_method_that_nobody_knows_or_that_is_there_already_is_refused() {
    let place = place();
    let cases: [(&[&str], &[&str]); 7] = [
        (
            &["--methods", "mlp,sdf-blned"],
            &["sdf-blned", "did you mean sdf-blend?"],
        ),
        (
            &["--variant", "a=lipmpl"],
            &["a=lipmpl", "did you mean lipmlp?"],
        ),
        (
            &["--variant", "half"],
            &["half", "it has no \"=\"", "LABEL=METHOD"],
        ),
        (&["--methods", "mlp,mlp"], &["\"mlp\"", "twice"]),
        (
            &["--methods", "mlp", "--variant", "MLP=nise"],
            &["\"MLP\"", "twice"],
        ),
        (
            &["--methods", "mlp,linear"],
            &["linear", "is in every table"],
        ),
        (&[], &["methods", "lipmlp"]),
    ];
    for (more, parts) in cases {
        compare(&place, more).refused(2, parts);
        assert_eq!(place.names(), ["truth.anime"], "left behind by {more:?}");
    }
}

/// The method with the mistake is the second one: the first could have been trained for hours.
#[test]
fn a_mistake_in_any_recipe_is_told_before_the_first_method_is_trained() {
    let _turn = turn();
    let place = place();
    let cases: [(&str, &[&str]); 5] = [
        (
            "still=mlp,velocity.width=24",
            &["still", "velocity.width=24", "does nothing"],
        ),
        (
            "long=mlp,training.stepz=3",
            &["long", "training.stepz=3", "did you mean steps?"],
        ),
        (
            "no volume=quick,loss.divergence=-1",
            &["no volume", "loss.divergence=-1", "must be 0 or more"],
        ),
        (
            "many=mlp,training.batch=many",
            &["many", "training.batch=many", "must be"],
        ),
        (
            "blind=lipmlp,data.normals=none",
            &["blind", "data.normals=none", "lipmlp", "\"auto\""],
        ),
    ];
    for (variant, parts) in cases {
        compare(&place, &["--methods", "mlp", "--variant", variant]).refused(2, parts);
        assert_eq!(place.names(), ["truth.anime"], "left behind by {variant}");
    }
    let all = ["--methods", "mlp", "--set", "training.batch=63"];
    compare(&place, &all).refused(2, &["training.batch=63", "from 64"]);
    // A change for all must act in one of them.
    let idle = ["--methods", "mlp,eigenbasis", "--set", "velocity.width=24"];
    compare(&place, &idle).refused(2, &["velocity.width=24", "does nothing"]);
    assert_eq!(place.names(), ["truth.anime"]);
}

#[test]
fn pairs_are_frames_of_the_sequence_with_one_between() {
    let place = place();
    let cases: [(&[&str], &[&str]); 4] = [
        (&["--pairs", "0-9"], &["0-9", "truth has 5 frames, 0 to 4"]),
        (&["--pairs", "0-4,2-3"], &["2-3", "nothing lies between"]),
        (&["--pairs", "0-4,0-4"], &["0-4", "twice"]),
        (&["--pairs", "first"], &["first", "FROM-TO"]),
    ];
    for (more, parts) in cases {
        let command = [&with(SMALL, &["--methods", "mlp"]), more].concat();
        place.isomorph(&command).refused(2, parts);
    }
    let without = place.isomorph(&with(SMALL, &["--methods", "mlp"]));
    assert_eq!(without.code, Some(2), "{without:?}");
    assert!(without.stderr.contains("pairs are missing"), "{without:?}");
    let elsewhere = "compare --sequence nowhere.anime --pairs 0-4 --methods mlp";
    place
        .isomorph(&with(elsewhere, &[]))
        .refused(1, &["nowhere.anime", "No such file"]);
    assert_eq!(place.names(), ["truth.anime"]);
}

/// The first pair has frames enough, and could have been trained on for hours.
#[test]
fn every_pair_must_have_a_frame_to_be_measured() {
    let _turn = turn();
    let place = place();
    let sparse = "compare --sequence truth.anime --pairs 0-4,0-2 --methods mlp --every 2 \
         --set training.steps=1 --samples 500 --resolution 24 --quiet";
    place
        .isomorph(&with(sparse, &[]))
        .refused(2, &["every", "2", "0-2"]);
    assert_eq!(place.names(), ["truth.anime"]);
}
