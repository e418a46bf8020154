//! Checkpoints that are written, kept, damaged and swept away.

use super::*;

fn state(step: usize) -> State {
    State {
        format_version: FORMAT_VERSION,
        isomorph_version: String::new(),
        burn_version: String::new(),
        step,
        seconds: 0.0,
        seed: 0,
        backend: String::new(),
        normalisation: Normalisation {
            centre: [0.0; 3],
            scale: 1.0,
        },
        placements: Placements::default(),
        bounds: Bounds::of(&[[0.0; 3]]),
        grown: None,
        recipe: String::new(),
        files: BTreeMap::default(),
    }
}

fn records() -> Records {
    Records(vec![("a.mpk".to_owned(), b"content".to_vec())])
}

fn steps(folder: &Path) -> Vec<usize> {
    list(folder).into_iter().map(|(step, _)| step).collect()
}

#[test]
fn a_name_leads_to_a_file_beside_and_nowhere_else() {
    for (name, is) in [
        ("a.mpk", true),
        ("..", false),
        ("", false),
        ("../a.mpk", false),
        ("a/b.mpk", false),
        ("/a.mpk", false),
    ] {
        assert_eq!(is_plain(name), is, "{name:?}");
    }
}

#[test]
fn the_newest_are_kept_and_one_of_the_same_step_is_replaced() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("checkpoints");
    for step in [1, 2, 3] {
        let path = save(&folder, state(step), records(), 2).expect("saved");
        assert_eq!(path, folder.join(format!("step-00000{step}")));
    }
    assert_eq!(steps(&folder), [2, 3]);
    save(&folder, state(3), records(), 2).expect("saved again");
    assert_eq!(steps(&folder), [2, 3]);
    let left = fs::read_dir(&folder).expect("a folder").count();
    assert_eq!(left, 2, "something unfinished is left");
    let found = Checkpoint::newest(&folder).expect("whole");
    assert_eq!(found.state.step, 3);
    assert_eq!(found.records().expect("whole").0, records().0);
    // What an interrupted one left is swept away; what is no checkpoint stays.
    fs::create_dir(folder.join(format!("{TEMPORARY}abc"))).expect("a folder");
    fs::write(folder.join("notes.txt"), "mine").expect("a file");
    sweep(&folder, 1);
    assert_eq!(steps(&folder), [3]);
    assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 2);
}

#[test]
fn what_is_not_what_was_written_is_named() {
    let place = tempfile::tempdir().expect("a folder");
    let path = save(place.path(), state(1), records(), 1).expect("saved");
    let said = || {
        let records = Checkpoint::open(&path).expect("a state").records();
        records.expect_err("damaged").to_string()
    };
    fs::write(path.join("a.mpk"), "longer content").expect("a file");
    assert!(said().contains("14 bytes, 7 written"), "{}", said());
    fs::write(path.join("a.mpk"), "Content").expect("a file");
    assert!(said().contains("checksum"), "{}", said());
    fs::remove_file(path.join("a.mpk")).expect("a file");
    assert!(said().contains("a.mpk"), "{}", said());
    let mut later = state(1);
    later.format_version += 1;
    let path = save(place.path(), later, records(), 1).expect("saved");
    let said = Checkpoint::open(&path).expect_err("too new").to_string();
    assert!(said.contains("update isomorph"), "{said}");
}

#[test]
fn a_run_that_is_gone_is_not_made_again() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("run/checkpoints");
    let ended = save(&folder, state(1), records(), 1);
    assert!(matches!(ended, Err(CheckpointError::Gone(_))), "{ended:?}");
    // A file in the place of the folder is no run that is gone.
    fs::create_dir(place.path().join("run")).expect("a folder");
    fs::write(&folder, "a file").expect("a file");
    let ended = save(&folder, state(1), records(), 1);
    assert!(
        matches!(ended, Err(CheckpointError::Io { .. })),
        "{ended:?}"
    );
}
