//! `compare`: methods side by side, one result file each, and a comparison that goes on where it stopped.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant, SystemTime};

use serde_json::Value;

use crate::support::command::with;
use crate::support::run::json;
use crate::support::sequence::Sequence;
use crate::support::workplace::{Ended, Workplace, names, turn};

/// What every comparison here is called with: one frame measured coarsely, on the one backend that all methods
/// run on. These changes act in all of them.
pub(crate) const SMALL: &str = "compare --sequence truth.anime --samples 500 --resolution 24 --every 2 \
     --backend flex --set data.points=2000";

/// Methods under their own names with small networks, each with the keys that act in it.
const MLP: [&str; 2] = [
    "--variant",
    "mlp=mlp,implicit.depth=3,implicit.width=32,training.batch=200",
];
const SDF_BLEND: [&str; 2] = [
    "--variant",
    "sdf-blend=sdf-blend,implicit.depth=3,implicit.width=32,training.batch=200",
];
const EIGENBASIS: [&str; 2] = [
    "--variant",
    "eigenbasis=eigenbasis,training.correspondence-batch=40",
];
const QUICK: [&str; 2] = [
    "--variant",
    "quick=quick,implicit.depth=3,implicit.width=32,velocity.depth=2,velocity.width=24,\
     training.batch=200,training.correspondence-batch=40",
];

/// A folder with the tiny sequence as `truth.anime`.
pub(crate) fn place() -> Workplace {
    let place = Workplace::new();
    place.write("truth.anime", Sequence::tiny().anime());
    place
}

/// A comparison of twenty steps on one thread, where every sum has its order.
pub(crate) fn compare(place: &Workplace, more: &[&str]) -> Ended {
    let pair = with(SMALL, &["--pairs", "0-4", "--set", "training.steps=20"]);
    place.on_one_thread(&[&pair, more].concat())
}

/// The file of a method in the results.
fn result(place: &Workplace, method: &str) -> Value {
    json(&place.path(&format!("results/truth/0-4.{method}.json")))
}

/// The weights of the first network of a result.
fn parameters(result: &Value) -> u64 {
    result["networks"][0]["parameters"]
        .as_u64()
        .expect("a number")
}

/// Whether a table of Markdown has a row of a method.
fn has_row(table: &str, method: &str) -> bool {
    let row = format!("| {method} ");
    table.lines().any(|line| line.starts_with(&row))
}

/// When the newest checkpoint of a method was written.
fn trained_at(place: &Workplace, method: &str) -> SystemTime {
    let run = format!("runs/compare/truth/0-4/{method}");
    let state = place.run(&run).newest().join("state.json");
    let data = fs::metadata(state).expect("a state");
    data.modified().expect("a time")
}

#[test]
fn two_methods_leave_a_table_a_figure_and_a_file_each() {
    let _turn = turn();
    let place = place();
    let ended = compare(&place, &[MLP, EIGENBASIS].concat()).succeeded();
    assert_eq!(place.names(), ["results", "runs", "truth.anime"]);
    let files = "0-4.eigenbasis.json 0-4.mlp.json comparison.json error.svg quality.svg table.md";
    let folder = place.path("results/truth");
    assert_eq!(names(&folder), with(files, &[]));
    let runs = ["eigenbasis", "mlp", "source.ply", "target.ply"];
    assert_eq!(names(&place.path("runs/compare/truth/0-4")), runs);
    let read = |name: &str| fs::read_to_string(folder.join(name)).expect("a file of text");
    let table = read("table.md");
    assert_eq!(ended.stdout, table, "what is printed is what is kept");
    for row in ["mlp", "eigenbasis", "linear", "floor"] {
        assert!(has_row(&table, row), "no row {row} in\n{table}");
    }
    let figure = read("error.svg");
    assert!(figure.starts_with("<svg") && figure.trim_end().ends_with("</svg>"));
    assert!(figure.contains("mlp") && figure.contains("eigenbasis"));
}

/// Nothing is trained, nothing measured, and no number changes in its last digit.
#[test]
fn a_comparison_that_is_done_is_printed_again_from_what_is_kept() {
    let _turn = turn();
    let place = place();
    let methods = [MLP, EIGENBASIS].concat();
    compare(&place, &methods).succeeded();
    let read = |name: &str| fs::read_to_string(place.path("results/truth").join(name));
    let kept = || ["comparison.json", "0-4.mlp.json"].map(|name| read(name).expect("a file"));
    let (before, trained) = (kept(), trained_at(&place, "mlp"));
    let again = compare(&place, &[&methods[..], &["--json"]].concat()).succeeded();
    assert_eq!(again.stderr, "", "something was done again");
    assert_eq!(trained_at(&place, "mlp"), trained, "trained again");
    let after = kept();
    // Not assert_eq!, which would print every line of both.
    for (before, after) in before.iter().zip(&after) {
        let differs = before
            .lines()
            .zip(after.lines())
            .find(|(before, after)| before != after);
        assert!(before == after, "{differs:?}");
    }
    let printed: Value = serde_json::from_str(&again.stdout).expect("JSON");
    assert_eq!(
        printed,
        serde_json::from_str::<Value>(&after[0]).expect("JSON")
    );
    let rows = &printed["pairs"][0]["methods"];
    assert_eq!(
        [&rows[0]["method"], &rows[1]["method"]],
        ["mlp", "eigenbasis"]
    );
    assert_eq!(printed["missing"], Value::Array(Vec::new()));
    // The one has a field and moves nothing, the other the reverse.
    let has = |row: usize, kind: &str| rows[row]["mean"].get(kind).is_some();
    assert_eq!((has(0, "surface"), has(0, "carried")), (true, false));
    assert_eq!((has(1, "surface"), has(1, "carried")), (false, true));
}

/// Whether a method is trained or measured in a comparison, as it says itself.
fn begins(ended: &Ended, method: &str) -> bool {
    ended.stderr.contains(&format!("truth 0-4: {method}\n"))
}

#[test]
fn a_method_that_is_added_is_the_only_one_that_is_done() {
    let _turn = turn();
    let place = place();
    compare(&place, &[MLP, EIGENBASIS].concat()).succeeded();
    let before = ["mlp", "eigenbasis"].map(|method| result(&place, method));
    let ended = compare(&place, &[MLP, SDF_BLEND, EIGENBASIS].concat()).succeeded();
    let done = ["mlp", "sdf-blend", "eigenbasis"].map(|method| begins(&ended, method));
    assert_eq!(done, [false, true, false], "{}", ended.stderr);
    assert_eq!(
        ["mlp", "eigenbasis"].map(|method| result(&place, method)),
        before
    );
    assert!(has_row(&ended.stdout, "sdf-blend"), "{}", ended.stdout);
}

#[test]
fn a_result_that_is_damaged_or_of_other_data_is_made_again_with_a_note() {
    let _turn = turn();
    let place = place();
    let methods = [MLP, EIGENBASIS].concat();
    compare(&place, &methods).succeeded();
    let (before, trained) = (result(&place, "mlp"), trained_at(&place, "mlp"));

    let file = "results/truth/0-4.mlp.json";
    let whole = fs::read(place.path(file)).expect("a file");
    place.write(file, &whole[..whole.len() / 2]);
    let ended = compare(&place, &methods).succeeded();
    let note = format!("note: {file}: damaged");
    assert!(ended.stderr.starts_with(&note), "{}", ended.stderr);
    assert!(
        ended.stderr.contains("mlp on 0-4 is done again"),
        "{}",
        ended.stderr
    );
    assert!(
        begins(&ended, "mlp") && !begins(&ended, "eigenbasis"),
        "{}",
        ended.stderr
    );
    assert_eq!(result(&place, "mlp")["evaluation"], before["evaluation"]);
    assert_eq!(
        trained_at(&place, "mlp"),
        trained,
        "measured only: its run is whole"
    );

    let denser = ["--set", "data.points=2100"];
    let ended = compare(&place, &[MLP, denser].concat()).succeeded();
    let note = format!("note: {file}: made with another recipe, data or evaluation");
    assert!(ended.stderr.starts_with(&note), "{}", ended.stderr);
    assert_ne!(result(&place, "mlp")["evaluation"], before["evaluation"]);
    assert_ne!(
        trained_at(&place, "mlp"),
        trained,
        "not trained on the new points"
    );
}

#[test]
fn a_variant_is_a_row_of_its_own_and_its_changes_win_over_those_for_all() {
    let _turn = turn();
    let place = place();
    let wider =
        "wider mlp=mlp,implicit.depth=3,implicit.width=48,training.batch=200,training.steps=12";
    let more = [&MLP[..], &["--variant", wider, "--json"]].concat();
    let ended = compare(&place, &more).succeeded();
    let comparison: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    let methods = &comparison["pairs"][0]["methods"];
    let row = |k: usize| (methods[k]["method"].as_str(), methods[k]["steps"].as_u64());
    assert_eq!(
        [row(0), row(1)],
        [(Some("mlp"), Some(20)), (Some("wider mlp"), Some(12))]
    );
    // Four inputs, three hidden layers of n units, one output, each with its biases.
    let weights = |n: u64| (4 + 1) * n + 2 * (n + 1) * n + n + 1;
    assert_eq!(
        [&methods[0], &methods[1]].map(parameters),
        [32, 48].map(weights)
    );
    let file = methods[1]["file"].as_str().expect("a name");
    let kept = json(&place.path("results/truth").join(file));
    let recipe = kept["recipe"].as_str().expect("a recipe");
    assert!(recipe.contains("\nwidth = 48\n"), "{recipe}");
    let table = fs::read_to_string(place.path("results/truth/table.md")).expect("a table");
    assert!(
        table.lines().any(|line| line.starts_with("| wider mlp ")),
        "{table}"
    );
}

#[test]
fn a_change_for_all_methods_counts_where_it_acts() {
    let _turn = turn();
    let place = place();
    let share = ["--set", "training.band-share=0.5"];
    compare(&place, &[MLP, EIGENBASIS, share].concat()).succeeded();
    let recipe = |method: &str| result(&place, method)["recipe"].to_string();
    assert!(recipe("mlp").contains("band-share = 0.5"));
    // Which samples no space at all.
    assert!(!recipe("eigenbasis").contains("band-share"));
}

/// The sphere that f starts from lies outside the box, and one step does not bring it in. A method whose
/// surface vanishes is a result like any other, and no reason to lose the others.
#[test]
fn a_method_without_a_surface_is_a_row_without_its_numbers() {
    let _turn = turn();
    let place = place();
    let gone =
        "gone=mlp,implicit.depth=3,implicit.width=32,training.steps=1,implicit.sphere-radius=9";
    let methods = [&MLP[..], &["--variant", gone, "--json"]].concat();
    let ended = compare(&place, &methods).succeeded();
    let comparison: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    let rows = &comparison["pairs"][0]["methods"];
    for (row, method, without) in [(0, "mlp", 0), (1, "gone", 1)] {
        let row = &rows[row];
        assert_eq!(row["method"], method);
        assert_eq!(
            (&row["frames"], &row["without_surface"]),
            (&1.into(), &without.into())
        );
        assert_eq!(
            row["mean"].get("surface").is_some(),
            without == 0,
            "{method}"
        );
    }
    let table = fs::read_to_string(place.path("results/truth/table.md")).expect("a table");
    assert!(has_row(&table, "gone"), "{table}");
}

/// A comparison of some seconds that can be stopped in the middle of either of its methods.
fn longer(results: &'static str) -> Vec<&'static str> {
    let work = if results == "whole" {
        "whole-runs"
    } else {
        "cut-runs"
    };
    let methods = [MLP, QUICK, ["--output", results], ["--work", work]].concat();
    let more = with(
        "--pairs 0-4 --quiet --set training.steps=300 --set training.log-every=5 \
         --set checkpoint.every=25",
        &methods,
    );
    with(SMALL, &more)
}

fn start(place: &Workplace, arguments: &[&str]) -> Child {
    let mut command = place.command(arguments);
    command
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command.spawn().expect("the program starts")
}

/// Waits until a method has a checkpoint and trains on; a minute is far more than it takes.
fn wait_for_checkpoint(run: &Path) {
    let checkpoints = run.join("checkpoints");
    let start = Instant::now();
    let is_there = |name: &String| name.starts_with("step-");
    while !(checkpoints.is_dir() && names(&checkpoints).iter().any(is_there)) {
        assert!(
            start.elapsed() < Duration::from_secs(60),
            "no checkpoint in {}",
            run.display()
        );
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// On one thread every sum has its order, and so the numbers are the same to the last digit.
#[cfg(unix)]
#[test]
fn a_comparison_that_is_killed_and_interrupted_ends_in_the_same_numbers() {
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    let _turn = turn();
    let place = place();
    place.on_one_thread(&longer("whole")).succeeded();
    let run = |method: &str| -> PathBuf { place.path(&format!("cut-runs/truth/0-4/{method}")) };

    let mut child = start(&place, &longer("cut"));
    wait_for_checkpoint(&run("mlp"));
    child.kill().expect("SIGKILL");
    child.wait().expect("a child that was killed");
    assert!(
        !place.path("cut/truth/0-4.mlp.json").exists(),
        "the method was done before the kill"
    );

    let mut child = start(&place, &longer("cut"));
    wait_for_checkpoint(&run("quick"));
    let pid = i32::try_from(child.id()).expect("a process number");
    kill(Pid::from_raw(pid), Signal::SIGINT).expect("a signal");
    assert_eq!(child.wait().expect("a child").code(), Some(130));
    let done = names(&place.path("cut/truth"));
    assert_eq!(
        done,
        [
            "0-4.mlp.json",
            "comparison.json",
            "error.svg",
            "quality.svg",
            "table.md"
        ]
    );
    let kept = json(&place.path("cut/truth/comparison.json"));
    assert_eq!(
        kept["missing"][0]["method"], "quick",
        "what is not done is told"
    );

    let ended = place.on_one_thread(&longer("cut")).succeeded();
    assert!(!ended.stderr.contains(": mlp\n"), "{}", ended.stderr);
    for method in ["mlp", "quick"] {
        let [found, wanted] = ["cut", "whole"]
            .map(|results| json(&place.path(&format!("{results}/truth/0-4.{method}.json"))));
        assert_eq!(found["evaluation"], wanted["evaluation"], "{method}");
        assert_eq!(
            (&found["steps"], &found["digest"]),
            (&wanted["steps"], &wanted["digest"])
        );
    }
    let left = names(&run("quick").join("checkpoints"));
    let whole = |name: &String| name.starts_with("step-");
    assert!(left.iter().all(whole), "torn: {left:?}");
}
