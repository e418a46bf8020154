//! Tests of the store: what comes back, what is done again and why.

use super::super::testing::{ODD_LABEL, entry};
use super::*;

const PAIR: FramePair = FramePair { from: 0, to: 18 };

fn store() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let store = Store::open(folder.path(), "fox_survey").expect("a store");
    (folder, store)
}

fn note(lookup: Lookup) -> String {
    match lookup {
        Lookup::Unusable { note } => note,
        other => panic!("must be unusable, is {other:?}"),
    }
}

#[test]
fn what_is_recorded_is_found_again() {
    let (_folder, store) = store();
    for label in [
        "quick",
        ODD_LABEL,
        "../../escape",
        "CON",
        ".",
        "",
        &"long ".repeat(60),
    ] {
        let entry = entry(PAIR, label, Some(0.25), None);
        assert_eq!(store.find(PAIR, label, "0123"), Lookup::Missing, "{label}");
        store.record(&entry).expect("recorded");
        match store.find(PAIR, label, "0123") {
            // To the last bit of every number.
            Lookup::Done(found) => assert_eq!(*found, entry, "{label}"),
            other => panic!("{label}: {other:?}"),
        }
    }
    // One file each, all in the folder of the sequence.
    assert_eq!(fs::read_dir(store.folder()).expect("a folder").count(), 7);
}

#[test]
fn labels_that_differ_only_where_a_file_name_cannot_are_two() {
    let names = ["a/b", "a b", "a_b"].map(|label| file_name(PAIR, label));
    assert_eq!(names[2], "0-18.a_b.json");
    assert!(names[0] != names[1] && names[1] != names[2], "{names:?}");
}

#[test]
fn a_damaged_file_is_not_done_and_is_replaced() {
    let (_folder, store) = store();
    let entry = entry(PAIR, "quick", Some(0.25), None);
    store.record(&entry).expect("recorded");
    let path = store.folder().join(file_name(PAIR, "quick"));
    let whole = fs::read(&path).expect("there");
    for kept in [0, whole.len() / 2, whole.len() - 3] {
        fs::write(&path, &whole[..kept]).expect("cut");
        let note = note(store.find(PAIR, "quick", "0123"));
        assert!(note.contains("0-18.quick.json: damaged ("), "{note}");
        assert!(note.ends_with("quick on 0-18 is done again"), "{note}");
    }
    store.record(&entry).expect("recorded");
    assert!(matches!(store.find(PAIR, "quick", "0123"), Lookup::Done(_)));
}

#[test]
fn other_inputs_and_other_versions_are_done_again_and_the_note_says_why() {
    let (_folder, store) = store();
    let entry = entry(PAIR, "quick", Some(0.25), None);
    store.record(&entry).expect("recorded");
    let other = note(store.find(PAIR, "quick", "4567"));
    assert!(
        other.contains("another recipe, data or evaluation"),
        "{other}"
    );

    let path = store.folder().join(file_name(PAIR, "quick"));
    let text = fs::read_to_string(&path).expect("there");
    let changed = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        fs::write(&path, text.replacen(from, to, 1)).expect("written");
        note(store.find(PAIR, "quick", "0123"))
    };
    let format = changed("\"format\":1", "\"format\":2");
    assert!(
        format.contains("format 2, this program reads 1"),
        "{format}"
    );
    let version = changed(
        &format!("\"isomorph\":\"{VERSION}\""),
        "\"isomorph\":\"0.0.1\"",
    );
    assert!(version.contains("made by isomorph 0.0.1"), "{version}");
    let elsewhere = changed("\"sequence\":\"fox_survey\"", "\"sequence\":\"bear_walk\"");
    assert!(
        elsewhere.contains("holds quick on 0-18 of bear_walk"),
        "{elsewhere}"
    );
}

#[test]
fn a_result_that_json_cannot_hold_is_refused_and_the_old_one_stays() {
    let (_folder, store) = store();
    let good = entry(PAIR, "quick", Some(0.25), None);
    store.record(&good).expect("recorded");
    let bad = entry(PAIR, "quick", Some(f64::NAN), None);
    let refused = store.record(&bad).expect_err("not a number").to_string();
    assert!(refused.contains("quick on 0-18"), "{refused}");
    assert!(matches!(store.find(PAIR, "quick", "0123"), Lookup::Done(_)));
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("file");
    fs::write(&file, "in the way").expect("written");
    let refused = Store::open(&file, "fox_survey")
        .expect_err("no folder")
        .to_string();
    assert!(refused.contains("fox_survey"), "{refused}");
}
