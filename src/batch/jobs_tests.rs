//! Files of jobs: what they say, and what is refused.

use super::*;

/// A file of jobs in a folder with these files.
fn read(text: &str, files: &[&str]) -> Result<Batch> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for file in files {
        let path = folder.path().join(file);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, "").expect("a file");
    }
    let path = folder.path().join("jobs.toml");
    std::fs::write(&path, text).expect("a file");
    Batch::read(&path)
}

fn names(batch: &Batch) -> Vec<&str> {
    batch.jobs.iter().map(|job| &job.name[..]).collect()
}

#[test]
fn pairs_come_from_a_list_from_all_files_and_from_neighbours() {
    let files = [
        "scans/s1.ply",
        "scans/s2.ply",
        "scans/s10.ply",
        "a.ply",
        "b.ply",
    ];
    let text = "[[job]]\nsource = \"a.ply\"\ntarget = \"b.ply\"\n[[job]]\nname = \"walk\"\nsequence = \"walk.anime\"\n\
                keys = [0, 10]\n[all-pairs]\nfiles = \"scans/*.ply\"\n[neighbours]\nfiles = [\"a.ply\", \"s.ply\", \"t.ply\"]\n";
    let batch = read(text, &files).expect("jobs");
    assert_eq!(
        names(&batch),
        ["a-b", "walk", "s1-s2", "s1-s10", "s2-s10", "a-s", "s-t"],
        "files in the order in which people count"
    );
    assert_eq!(batch.preset(), Some("instant"));
    assert!(batch.folder.ends_with("runs/jobs"));
}

#[test]
fn recipes_have_the_keys_of_all_and_of_their_own() {
    let text = "preset = \"quick\"\nset = [\"result.frames=7\", \"training.seed=1\"]\n[[job]]\nsource = \"a.ply\"\n\
                target = \"b.ply\"\ncorrespondences = \"match\"\nset = [\"training.seed=3\"]\n";
    let batch = read(text, &[]).expect("jobs");
    let recipe = batch.recipe(&batch.jobs[0]).expect("a recipe");
    assert_eq!((recipe.result.frames, recipe.training.seed), (7, 3));
    assert_eq!(recipe.preset.word(), "quick");
    assert_eq!(
        recipe.data.between[0],
        isomorph_training::recipe::Correspondences::Match
    );
    let wrong = read(
        "set = [\"result.frame=7\"]\n[[job]]\nsource = \"a.ply\"\ntarget = \"b.ply\"\n",
        &[],
    );
    let batch = wrong.expect("it is looked at with its recipe");
    let said = batch
        .recipe(&batch.jobs[0])
        .expect_err("no such key")
        .to_string();
    assert!(said.contains("job a-b") && said.contains("frame"), "{said}");
}

#[test]
fn what_is_no_file_of_jobs_is_refused_with_its_line() {
    let said = |text: &str| read(text, &["x.ply"]).expect_err("refused").to_string();
    for (text, parts) in [
        ("presets = \"quick\"\n", &[":1: ", "presets"][..]),
        (
            "[[job]]\nsource = \"a.ply\"\n",
            &["job 1", "source and target"],
        ),
        ("[[job]]\nsource = 3\n", &[":2: "]),
        (
            "[all-pairs]\nfiles = \"*.ply\"\n",
            &["all-pairs", "1 files", "two or more"],
        ),
        ("", &["has no jobs"]),
        (
            "preset = \"a\"\nrecipe = \"b\"\n",
            &["a preset and a recipe"],
        ),
        (
            "[[job]]\nname = \"../x\"\nsource = \"a.ply\"\ntarget = \"b.ply\"\n",
            &["is no name"],
        ),
        (
            "[[job]]\nname = \"x\"\nsource = \"a.ply\"\ntarget = \"b.ply\"\n[[job]]\nname = \"x\"\nsequence = \"s.anime\"\n",
            &["2 jobs have the name \"x\""],
        ),
    ] {
        let found = said(text);
        assert!(parts.iter().all(|part| found.contains(part)), "{found}");
    }
}

#[test]
fn files_of_one_name_in_two_folders_are_told_apart() {
    let text = "[[job]]\nsource = \"x/1.ply\"\ntarget = \"x/2.ply\"\n[[job]]\nsource = \"y/1.ply\"\ntarget = \"y/2.ply\"\n";
    let batch = read(text, &[]).expect("jobs");
    assert_eq!(names(&batch), ["x_1-x_2", "y_1-y_2"]);
}

#[test]
fn a_file_of_pairs_is_beside_the_file_of_jobs() {
    let text = "[[job]]\nsource = \"a.ply\"\ntarget = \"b.ply\"\ncorrespondences = \"pairs.csv\"\n";
    let batch = read(text, &[]).expect("jobs");
    let recipe = batch.recipe(&batch.jobs[0]).expect("a recipe");
    let beside = batch.path.with_file_name("pairs.csv");
    assert_eq!(
        recipe.data.between[0],
        isomorph_training::recipe::Correspondences::File(beside)
    );
}
