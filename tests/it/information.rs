//! `info` on every kind of thing, `bench`, and the help texts.

use serde_json::Value;

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::workplace::{Workplace, turn};

/// The word or words after a label at the start of a line.
#[track_caller]
fn field<'a>(text: &'a str, label: &str) -> &'a str {
    let after = |line: &'a str| {
        let (first, rest) = line.split_once(' ')?;
        (first == label).then_some(rest.trim())
    };
    let found = text.lines().find_map(after);
    found.unwrap_or_else(|| panic!("no {label:?} in {text}"))
}

#[test]
fn info_measures_a_mesh() {
    let place = Workplace::new();
    let bar = Mesh::bar([1.0, 0.25, 0.5], 0.125);
    place.write("bar.ply", ply::text(&bar));
    let text = place.isomorph(&["info", "bar.ply"]).succeeded().stdout;
    assert!(text.starts_with("bar.ply: mesh\n"), "{text}");
    assert_eq!(field(&text, "vertices"), bar.vertices.len().to_string());
    assert_eq!(field(&text, "triangles"), bar.triangles.len().to_string());
    // Exact: 2 (1/4 + 1/2 + 1/8) and 1/8, and the same with more digits.
    assert_eq!(
        (field(&text, "area"), field(&text, "volume")),
        ("1.75000", "0.125000")
    );
    assert_eq!(field(&text, "closed"), "yes");
    let open = Mesh {
        triangles: bar.triangles[1..].to_vec(),
        ..bar
    };
    place.write("open.ply", ply::text(&open));
    let text = place.isomorph(&["info", "open.ply"]).succeeded().stdout;
    assert_eq!(field(&text, "closed"), "no");
}

#[test]
fn info_reads_an_obj_of_quadrilaterals_and_a_cloud() {
    let place = Workplace::new();
    place.write(
        "square.obj",
        "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\n",
    );
    let text = place.isomorph(&["info", "square.obj"]).succeeded().stdout;
    assert_eq!(
        (field(&text, "triangles"), field(&text, "area")),
        ("2", "4.00000")
    );
    place.write("cloud.ply", ply::cloud(&Mesh::sphere(1.0, 5).vertices));
    let text = place.isomorph(&["info", "cloud.ply"]).succeeded().stdout;
    assert!(text.starts_with("cloud.ply: point cloud\n"), "{text}");
    let area = field(&text, "area").split(' ').next().expect("a number");
    let area: f64 = area.parse().expect("a number");
    // Estimated from the density: a tenth is what an estimate may be off.
    let exact = 4.0 * std::f64::consts::PI;
    assert!(
        (area / exact - 1.0).abs() < 0.1,
        "{area} instead of {exact}"
    );
}

#[test]
fn info_counts_the_frames_of_a_sequence() {
    let place = Workplace::new();
    // Three frames of a tetrahedron, in DeformingThings4D's layout.
    let mut bytes = Vec::new();
    for count in [3, 4, 4_i32] {
        bytes.extend(count.to_le_bytes());
    }
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0_f32],
    ];
    bytes.extend(corners.iter().flatten().flat_map(|part| part.to_le_bytes()));
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2_i32]];
    bytes.extend(faces.iter().flatten().flat_map(|index| index.to_le_bytes()));
    bytes.extend(
        [0.5_f32; 2 * 4 * 3]
            .iter()
            .flat_map(|part| part.to_le_bytes()),
    );
    place.write("walk.anime", &bytes);
    let text = place.isomorph(&["info", "walk.anime"]).succeeded().stdout;
    assert!(text.contains("3 frames, 4 vertices, 4 triangles"), "{text}");
    place.write("torn.anime", &bytes[..bytes.len() - 1]);
    place
        .isomorph(&["info", "torn.anime"])
        .refused(1, &["torn.anime: "]);
}

#[test]
fn info_says_where_a_run_stands() {
    let _turn = turn();
    let place = Workplace::tiny(&["training.steps = 4", "checkpoint.every = 2"]);
    place.train("run", &["--backend", "ndarray"]);
    let text = place.isomorph(&["info", "run"]).succeeded().stdout;
    assert!(text.starts_with("run: run\n"), "{text}");
    assert_eq!(field(&text, "checkpoints"), "at steps 2, 4");
    assert_eq!(field(&text, "steps"), "4 of 4");
    assert!(field(&text, "backend").contains("ndarray"), "{text}");
    assert!(field(&text, "f").starts_with("3 x 32"), "{text}");
    assert!(field(&text, "source").ends_with("source.ply"), "{text}");
}

#[test]
fn every_command_has_help_that_names_its_defaults() {
    let place = Workplace::new();
    let cases: &[(&str, &[&str])] = &[
        (
            "train",
            &["--force", "--set", "section.key=value", "[default: runs/"],
        ),
        (
            "resume",
            &["newest checkpoint", "--set", "section.key=value"],
        ),
        (
            "extract",
            &[
                "[default: 9]",
                "[default: ply]",
                "[default: meshes/",
                "[default: result.resolution]",
            ],
        ),
        (
            "match",
            &[
                "--aligned",
                "--pairs",
                "[default: pairs.csv]",
                "[default: 0.5]",
            ],
        ),
        ("pick", &["--pairs", "--no-browser", "--page", "--force"]),
        ("clean", &["--output", "[default: 5]", "[default: 0.005]"]),
        ("normals", &["--output", "point out of the shape"]),
        (
            "init",
            &["[default: none]", "[default: default; instant", "--all"],
        ),
        ("info", &["recipe", "run"]),
        ("bench", &["--json"]),
        ("completions", &["bash", "zsh", "fish"]),
        ("man", &["--output"]),
    ];
    let overview = place.isomorph(&["--help"]).succeeded().stdout;
    for (command, parts) in cases {
        assert!(
            overview.contains(&format!("\n  {command} ")),
            "no {command} in {overview}"
        );
        let help = place.isomorph(&[command, "--help"]).succeeded().stdout;
        for part in *parts {
            assert!(
                help.to_lowercase().contains(part),
                "{command}: no {part:?} in {help}"
            );
        }
    }
    assert!(overview.contains("First steps"), "{overview}");
}

#[test]
fn shells_and_man_are_given_all_commands() {
    let place = Workplace::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let text = place.isomorph(&["completions", shell]).succeeded().stdout;
        for word in ["morph", "extract", "--smallest-component", "self-test"] {
            let word = if shell == "fish" {
                word.trim_start_matches("--")
            } else {
                word
            };
            assert!(text.contains(word), "{shell}: no {word}");
        }
    }
    let page = place.isomorph(&["man"]).succeeded().stdout;
    assert!(
        page.contains(".TH isomorph 1") && page.contains("isomorph\\-train"),
        "{page}"
    );
    place.isomorph(&["man", "--output", "man1"]).succeeded();
    for page in ["isomorph.1", "isomorph-train.1", "isomorph-batch-run.1"] {
        let text = std::fs::read_to_string(place.path("man1").join(page)).expect(page);
        assert!(text.contains(".SH SYNOPSIS"), "{page}: {text}");
    }
    let train = std::fs::read_to_string(place.path("man1/isomorph-train.1")).expect("it was read");
    assert!(train.contains("resume\\-if\\-exists"), "{train}");
}

#[test]
fn the_help_of_what_computes_names_the_default_backend() {
    let place = Workplace::new();
    for command in ["train", "resume", "extract"] {
        let help = place.isomorph(&[command, "--help"]).succeeded().stdout;
        assert!(
            help.contains("--backend") && help.contains("[default: flex]"),
            "{help}"
        );
    }
    let version = place.isomorph(&["--version"]).succeeded().stdout;
    assert!(
        version.starts_with("isomorph ") && version.contains('.'),
        "{version}"
    );
}

#[test]
fn bench_reports_the_cost_of_a_step_as_json() {
    let _turn = turn();
    let place = Workplace::new();
    let bench = ["bench", "--size", "small", "--backend", "flex", "--json"];
    let ended = place.isomorph(&bench).succeeded();
    let report: Value = serde_json::from_str(&ended.stdout).expect("one object of JSON");
    assert_eq!(
        (&report["backend"], &report["size"]),
        (&"flex".into(), &"small".into())
    );
    let phases = &report["phases"];
    for value in [
        &phases["warm_up"]["seconds_per_step"],
        &phases["warm_up"]["gflop_per_step"],
        &phases["joint"]["seconds_per_step"],
        &phases["joint"]["gflop_per_step"],
        &report["peak_bytes"],
        &report["matmul_gflops"],
    ] {
        assert!(
            value.as_f64().is_some_and(|number| number > 0.0),
            "{report}"
        );
    }
    assert_eq!(place.names(), [""; 0], "a bench leaves nothing");
}

#[test]
fn bench_times_the_step_of_a_preset_as_well() {
    let _turn = turn();
    let place = Workplace::new();
    let bench = ["bench", "--size", "quick", "--repeats", "1"];
    let ended = place.isomorph(&[&bench[..], &["--json"]].concat());
    let report: Value = serde_json::from_str(&ended.succeeded().stdout).expect("one object");
    let cost = |name: &str| report["phases"]["joint"][name].as_f64();
    assert!(cost("seconds_per_step") > Some(0.0), "{report}");
    // 2200 points through 66,000 weights, six times two operations each: 1.7 GFLOP; V is the rest.
    let gflop = cost("gflop_per_step").expect("a number");
    assert!((1.7..10.0).contains(&gflop), "{gflop}");
    assert!(report["phases"].get("warm_up").is_none(), "{report}");
    let table = place.isomorph(&bench).succeeded().stdout;
    assert!(table.contains("\njoint "), "{table}");
    assert!(!table.contains("warm-up"), "{table}");
}

#[test]
fn bench_takes_changes_of_its_recipe_and_says_which() {
    let _turn = turn();
    let place = Workplace::new();
    let gflop = |batch: &str| {
        let set = format!("training.batch={batch}");
        let bench = [
            "bench",
            "--size",
            "small",
            "--repeats",
            "1",
            "--json",
            "--set",
        ];
        let ended = place.isomorph(&[&bench[..], &[&set]].concat()).succeeded();
        let report: Value = serde_json::from_str(&ended.stdout).expect("one object of JSON");
        assert_eq!(report["set"], Value::from(vec![set]));
        assert!(report["threads"].as_u64().is_some_and(|count| count > 0));
        report["phases"]["joint"]["gflop_per_step"]
            .as_f64()
            .expect("a number")
    };
    // The correspondences are as many in both, so it is less than twice.
    let ratio = gflop("1000") / gflop("500");
    assert!((1.2..2.0).contains(&ratio), "{ratio}");
    let bad = place.isomorph(&["bench", "--set", "training.batch=7"]);
    bad.refused(2, &["training.batch", "7"]);
}
