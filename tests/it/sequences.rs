//! Motions through more than two shapes: from files to surfaces, in the user's own time.

use std::fs;

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::run::{frames, json};
use crate::support::sequence::Sequence;
use crate::support::workplace::{Workplace, names, turn};

/// Small surfaces and a solver with few samples.
pub(crate) const SMALL: [&str; 8] = [
    "--set",
    "result.resolution=32",
    "--set",
    "spline.band=1000",
    "--set",
    "data.points=2000",
    "--set",
    "spline.spacing=0.15",
];

/// A sphere that falls faster and faster, at these times; `scan-TIME.ply`.
pub(crate) fn falling(times: &[u32]) -> Workplace {
    let place = Workplace::new();
    for time in times {
        let way = 0.05 * f64::from(time * time);
        let sphere = Mesh::sphere(1.0, 3).map(|x| [x[0], x[1], x[2] - way]);
        place.write(&format!("scan-{time}.ply"), ply::text(&sphere));
    }
    place
}

pub(crate) fn mean_z(mesh: &Mesh) -> f64 {
    mesh.vertices.iter().map(|x| x[2]).sum::<f64>() / mesh.vertices.len() as f64
}

#[test]
fn files_of_a_folder_become_one_smooth_motion_in_their_own_time() {
    let _turn = turn();
    let place = falling(&[0, 1, 2, 10]);
    // Out of the order of letters, and one of them left out.
    place.write(
        "recipe.toml",
        "preset = \"instant\"\n[data]\nsequence = \"scan-*.ply\"\nkeys = [0, 1, 2]\n\
         correspondences = \"same-vertices\"\n",
    );
    let trained = place
        .isomorph(&[&["train", "recipe.toml", "--run", "run"], &SMALL[..]].concat())
        .succeeded();
    assert!(
        trained.stderr.contains("key frames of"),
        "{}",
        trained.stderr
    );
    let run = place.run("run");
    let listed = json(&run.path("meshes/frames.json"));
    let listed = listed.as_array().expect("a list");
    let keys: Vec<(f64, u64)> = (listed.iter())
        .filter_map(|frame| Some((frame["time"].as_f64()?, frame["key"].as_u64()?)))
        .collect();
    assert_eq!(
        keys,
        [(0.0, 0), (1.0, 1), (2.0, 2)],
        "each key frame has its surface"
    );
    // The truth half-way is -.05 * 1.5^2 = -.1125; straight lines would be at -.125.
    let times = ["--times", "1.5", "--carry", "-o", "half", "--quiet"];
    place
        .isomorph(&[&["extract", "run"], &times[..]].concat())
        .succeeded();
    let half = &frames(&place.path("half"))[0];
    assert_eq!(half.time, 1.5);
    for file in ["half/surface-000.ply", "half/carried-000.ply"] {
        let found = mean_z(&ply::Ply::read(&place.path(file)).mesh());
        assert!((found + 0.1125).abs() < 6e-3, "{file}: {found}");
    }
    // From the last key frame back to the first.
    let back = [
        "--times",
        "0,2",
        "--carry",
        "--carry-from",
        "2",
        "-o",
        "back",
        "--quiet",
    ];
    place
        .isomorph(&[&["extract", "run"], &back[..]].concat())
        .succeeded();
    let at = |file: &str| mean_z(&ply::Ply::read(&place.path(file)).mesh());
    assert!(at("back/carried-000.ply").abs() < 6e-3);
    assert!(
        (at("back/carried-001.ply") + 0.2).abs() < 1e-5,
        "its own vertices"
    );
    // Points go from the first key frame to the last.
    let warp = ["warp", "run", "--points", "scan-0.ply", "-o", "moved.ply"];
    place.isomorph(&warp).succeeded();
    assert!((at("moved.ply") + 0.2).abs() < 6e-3, "{}", at("moved.ply"));
    let beyond = ["extract", "run", "--times", "3"];
    place
        .isomorph(&beyond)
        .refused(2, &["time 3", "must be 0 to 2"]);
    let page = fs::read_to_string(run.path("report.html")).expect("a page");
    assert!(page.contains("\"clock\":[0.0,2.0]") && page.contains("through 3 key frames"));
}

#[test]
fn morph_takes_any_number_of_files_and_their_times() {
    let _turn = turn();
    let place = falling(&[0, 1, 3]);
    let morph = ["morph", "scan-0.ply", "scan-1.ply", "scan-3.ply"];
    let more = ["--times", "0,1,3", "--frames", "4"];
    let ended = place
        .isomorph(&[&morph[..], &more, &SMALL].concat())
        .succeeded();
    for said in [
        "since all files have the same faces",
        "times: 0, 1, 3; the motion is smooth through all files",
        // 5 % of the points, between any two neighbours.
        "3 key frames of 2,000 points, 200 correspondences",
    ] {
        assert!(ended.stderr.contains(said), "{said}: {}", ended.stderr);
    }
    let run = place.run("runs/scan-0-scan-3");
    assert_eq!(
        names(&run.path("meshes")),
        ["carried.glb", "frames.json", "preview.png", "surface.glb"]
    );
    let two = ["--times", "0,1", "-o", "other"];
    place
        .isomorph(&[&morph[..], &two].concat())
        .refused(2, &["2 times for 3 files"]);
    let preset = ["--preset", "paper", "-o", "other"];
    place
        .isomorph(&[&morph[..], &preset].concat())
        .refused(2, &["takes two key frames, not 3", "instant"]);
}

#[test]
fn networks_learn_one_motion_through_all_key_frames_and_go_on_where_they_stopped() {
    let _turn = turn();
    let place = falling(&[0, 1, 2]);
    place.write(
        "recipe.toml",
        "preset = \"quick\"\n[data]\nsequence = \"scan-*.ply\"\npoints = 2000\n\
         correspondences = \"same-vertices\"\n[training]\nsteps = 300\nbatch = 600\n\
         [implicit]\nwidth = 48\ndepth = 3\n[velocity]\nwidth = 48\ndepth = 3\n\
         [result]\nframes = 3\nresolution = 32\n[checkpoint]\nevery = 150\nkeep = 2\n",
    );
    let trained = place
        .isomorph(&["train", "recipe.toml", "--run", "run"])
        .succeeded();
    for said in ["3 key frames of", "end fields"] {
        assert!(trained.stderr.contains(said), "{said}: {}", trained.stderr);
    }
    assert!(!trained.stderr.contains("without splines"));
    let run = place.run("run");
    let listed = json(&run.path("meshes/frames.json"));
    let listed = listed.as_array().expect("a list");
    let keys: Vec<(f64, u64)> = (listed.iter())
        .filter_map(|frame| Some((frame["time"].as_f64()?, frame["key"].as_u64()?)))
        .collect();
    assert_eq!(keys, [(0.0, 0), (1.0, 1), (2.0, 2)]);
    // The truth is -.05 t^2; straight lines would be at -.125 at 1.5.
    let at = ["--times", "1,1.5", "--carry", "-o", "half", "--quiet"];
    place
        .isomorph(&[&["extract", "run"], &at[..]].concat())
        .succeeded();
    for (file, wanted) in [
        ("half/surface-000.ply", -0.05),
        ("half/surface-001.ply", -0.1125),
        ("half/carried-000.ply", -0.05),
        ("half/carried-001.ply", -0.1125),
    ] {
        let found = mean_z(&ply::Ply::read(&place.path(file)).mesh());
        assert!((found - wanted).abs() < 0.02, "{file}: {found}, {wanted}");
    }
    // From the checkpoint in the middle, to the same bytes.
    let last = "checkpoints/step-000300/velocity.mpk";
    let wanted = fs::read(run.path(last)).expect("the last checkpoint");
    fs::remove_dir_all(run.path("checkpoints/step-000300")).expect("it is there");
    place.isomorph(&["resume", "run", "--quiet"]).succeeded();
    assert!(fs::read(run.path(last)).expect("again") == wanted);
    // .ci/run has scripts/read_run.py find the same f and V in such a file.
    place
        .isomorph(&["export", "run", "-o", "networks.safetensors"])
        .succeeded();
    let exported = fs::read(place.path("networks.safetensors")).expect("a file");
    let length = u64::from_le_bytes(exported[..8].try_into().expect("eight bytes")) as usize;
    let header = String::from_utf8_lossy(&exported[8..8 + length]);
    for name in ["end.0002.mlp.layers.0.weight", "velocity.mlp.layers.3.bias"] {
        assert!(header.contains(&format!("\"{name}\"")), "{name}: {header}");
    }
}

#[test]
fn an_animation_has_the_pace_that_is_asked_for() {
    let _turn = turn();
    let place = falling(&[0, 1, 2]);
    let morph = ["morph", "scan-0.ply", "scan-1.ply", "scan-2.ply", "--quiet"];
    place.isomorph(&[&morph[..], &SMALL].concat()).succeeded();
    let extract = [
        "extract",
        "runs/scan-0-scan-2",
        "--quiet",
        "--resolution",
        "24",
    ];
    let eased = [
        "--ease",
        "smooth",
        "--fps",
        "2",
        "--seconds",
        "2",
        "-o",
        "smooth",
    ];
    place.isomorph(&[&extract[..], &eased].concat()).succeeded();
    let times: Vec<f64> = (frames(&place.path("smooth")).iter())
        .map(|frame| frame.time)
        .collect();
    assert_eq!(times, [0.0, 0.3125, 1.0, 1.6875, 2.0]);
    place.write("ease.csv", "0,0\n1,2\n3,2\n");
    let held = [
        "--ease", "ease.csv", "--frames", "4", "--format", "glb", "-o", "held",
    ];
    place.isomorph(&[&extract[..], &held].concat()).succeeded();
    let times: Vec<f64> = (frames(&place.path("held")).iter())
        .map(|frame| frame.time)
        .collect();
    assert_eq!(times, [0.0, 2.0, 2.0, 2.0]);
    place.write("wrong.csv", "0,0\n1,2\n3,1\n");
    let wrong = ["--ease", "wrong.csv"];
    place
        .isomorph(&[&extract[..], &wrong].concat())
        .refused(2, &["wrong.csv:3", "goes back"]);
}

#[test]
fn a_sequence_is_measured_against_all_frames_between_its_key_frames() {
    let _turn = turn();
    let place = Workplace::new();
    // The whole way grows with the square of the frame.
    let sphere = Mesh::sphere(1.0, 3);
    let fallen = |k: i32| {
        let way = 0.03 * f64::from(k * k);
        sphere.clone().map(|x| [x[0], x[1], x[2] - way])
    };
    let falling = Sequence((0..9).map(fallen).collect());
    place.write("fall.anime", falling.anime());
    let of = |keys: &str| {
        format!(
            "preset = \"instant\"\n[data]\nsequence = \"fall.anime\"\nkeys = {keys}\n\
             correspondences = \"same-vertices\"\n"
        )
    };
    let measured = |keys: &str, run: &str| {
        place.write("recipe.toml", of(&format!("[{keys}]")));
        let train = [
            "train",
            "recipe.toml",
            "--quiet",
            "--run",
            run,
            "--set",
            "result.frames=0",
        ];
        place.isomorph(&[&train[..], &SMALL].concat()).succeeded();
        let evaluate = [
            "evaluate",
            run,
            "--ground-truth",
            "fall.anime",
            "--keys",
            keys,
        ];
        let few = ["--samples", "2000", "--quiet"];
        let table = place.isomorph(&[&evaluate[..], &few].concat()).succeeded();
        assert!(
            table.stdout.contains("drift of vertices"),
            "{}",
            table.stdout
        );
        json(&place.run(run).path("evaluation.json"))
    };
    let many = measured("0,3,6,8", "many");
    let rmse = |kind: &str| {
        many["mean"][kind]["tracked_rmse"]
            .as_f64()
            .expect("a number")
    };
    // Straight lines cannot see that the speed grows.
    assert!(
        rmse("carried") < 0.5 * rmse("linear"),
        "{} {}",
        rmse("carried"),
        rmse("linear")
    );
    assert!(rmse("natural") < 0.5 * rmse("linear"));
    assert_eq!(many["segments"].as_array().map(Vec::len), Some(3));
    let drift = many["drift"]["mean"].as_f64().expect("a number");
    assert!(drift < rmse("linear"), "{drift}");
    let keys = ["evaluate", "many", "--ground-truth", "fall.anime", "--keys"];
    place
        .isomorph(&[&keys[..], &["0,3,8"]].concat())
        .refused(2, &["3 frames for the 4 key frames"]);
    place
        .isomorph(&[&keys[..], &["0,2,6,8"]].concat())
        .refused(1, &["frame 2"]);
    let pair = [
        "evaluate",
        "many",
        "--ground-truth",
        "fall.anime",
        "--from",
        "0",
        "--to",
        "8",
    ];
    place.isomorph(&pair).refused(2, &["--keys"]);
    // The page holds each surface against the truth at its time, and all key frames against theirs.
    let ends = |from, to| {
        let truth = ["--ground-truth", "fall.anime", "--from", from, "--to", to];
        place.isomorph(&[&["view", "many", "--no-browser"], &truth[..]].concat())
    };
    ends("0", "8").succeeded();
    ends("1", "8").refused(2, &["between two frames of the ground truth"]);
}

#[test]
fn a_sequence_that_was_stopped_ends_in_the_same_field() {
    let _turn = turn();
    let place = falling(&[0, 1, 2]);
    place.write(
        "recipe.toml",
        "preset = \"instant\"\n[data]\nsequence = \"scan-*.ply\"\ncorrespondences = \"match\"\n\
         [checkpoint]\nevery = 2\nkeep = 9\n",
    );
    let train = [
        "train",
        "recipe.toml",
        "--run",
        "whole",
        "--set",
        "result.frames=0",
    ];
    place.isomorph(&[&train[..], &SMALL].concat()).succeeded();
    let whole = place.run("whole");
    // Pairs were found for each interval, and are kept with the run.
    for file in ["pairs-0000.csv", "pairs-0001.csv"] {
        assert!(whole.path(file).is_file(), "{file}");
    }
    let cut = place.run("cut");
    whole.cut_at(4, &cut);
    for file in ["pairs-0000.csv", "pairs-0001.csv"] {
        fs::copy(whole.path(file), cut.path(file)).expect("copied");
    }
    place.isomorph(&["resume", "cut", "--quiet"]).succeeded();
    assert!(
        cut.networks() == whole.networks(),
        "the same field, bit for bit"
    );
}

#[test]
fn an_interval_without_pairs_is_named_and_the_others_stand() {
    let _turn = turn();
    let place = falling(&[0, 1]);
    // Eight corners, and no vertex of a sphere comes near one of them.
    let cube = Mesh::bar([1.6; 3], 1.6).map(|[x, y, z]| [x, y, z - 0.2]);
    place.write("scan-2.ply", ply::text(&cube));
    place.write(
        "recipe.toml",
        "preset = \"instant\"\n[data]\nsequence = \"scan-*.ply\"\ncorrespondences = \"match\"\n\
         [checkpoint]\nevery = 2\nkeep = 9\n",
    );
    let train = ["train", "recipe.toml", "--set", "result.frames=0", "--run"];
    let trained = place
        .isomorph(&[&train[..], &["run"], &SMALL].concat())
        .succeeded()
        .stderr;
    for part in [
        "pairs from key frame 0 to 1 in ",
        "from key frame 1 to key frame 2 the surfaces alone lead, without pairs: ",
        "scan-2.ply: no pair of vertices",
    ] {
        assert!(trained.contains(part), "{part:?} in {trained}");
    }
    let whole = place.run("run");
    let stored = [0, 1].map(|k| whole.path(&format!("pairs-000{k}.csv")).is_file());
    assert_eq!(stored, [true, false]);
    // It goes on in the same way.
    let cut = place.run("cut");
    whole.cut_at(4, &cut);
    fs::copy(whole.path("pairs-0000.csv"), cut.path("pairs-0000.csv")).expect("copied");
    place.isomorph(&["resume", "cut", "--quiet"]).succeeded();
    assert!(
        cut.networks() == whole.networks(),
        "the same field, bit for bit"
    );
    // Where nothing else leads, there is no run.
    let two = ["two", "--quiet", "--set", "data.keys=[1, 2]"];
    place
        .isomorph(&[&train[..], &two, &SMALL].concat())
        .refused(1, &["scan-2.ply: no pair of vertices"]);
    assert!(!place.path("two").exists());
}

#[test]
fn splines_and_shapes_are_exported_with_a_description() {
    let _turn = turn();
    let place = falling(&[0, 1, 3]);
    let morph = [
        "morph",
        "scan-0.ply",
        "scan-1.ply",
        "scan-3.ply",
        "--times",
        "0,1,3",
    ];
    place
        .isomorph(&[&morph[..], &["-o", "run", "--frames", "2"], &SMALL].concat())
        .succeeded();
    let export = ["export", "run", "-o", "run.safetensors"];
    place.isomorph(&export).succeeded();
    let file = fs::read(place.path("run.safetensors")).expect("a file");
    let length = u64::from_le_bytes(file[..8].try_into().expect("eight bytes")) as usize;
    let header: serde_json::Value = serde_json::from_slice(&file[8..8 + length]).expect("a header");
    let about = header["__metadata__"]["isomorph"].as_str().expect("text");
    let about: serde_json::Value = serde_json::from_str(about).expect("a description");
    assert_eq!(about["geometry"], "splines");
    assert_eq!(about["clock"], serde_json::json!([0.0, 3.0]));
    let intervals = about["splines"]["intervals"].as_array().expect("a list");
    assert_eq!(intervals.len(), 2);
    assert_eq!(intervals[1]["to"], 1.0);
    for (s, interval) in intervals.iter().enumerate() {
        let sides = &header[format!("velocity.{s}.coefficients")]["shape"];
        let cells = interval["cells"].as_array().expect("three").iter();
        let nodes = cells.map(|count| count.as_u64().expect("a count") + 2);
        let functions = interval["time_functions"].as_array().expect("a list").len() as u64;
        let wanted: Vec<u64> = nodes.chain([functions, 3]).collect();
        assert_eq!(*sides, serde_json::json!(wanted));
    }
    assert_eq!(header["shape.2.triangles"]["dtype"], "U32");
}

#[test]
fn a_table_names_each_point_in_every_key_frame() {
    let _turn = turn();
    let place = Workplace::new();
    // The vertices of each file stand in another order.
    let sphere = Mesh::sphere(1.0, 3);
    let count = sphere.vertices.len();
    let rank = |k: usize, step: usize| (k * step) % count;
    for (key, step) in [1, 5, 7].into_iter().enumerate() {
        let mut moved = sphere.clone();
        for k in 0..count {
            let x = sphere.vertices[k];
            let turned = 0.4 * key as f64;
            let (sin, cos) = turned.sin_cos();
            let at = [cos * x[0] - sin * x[1], sin * x[0] + cos * x[1], 1.3 * x[2]];
            moved.vertices[rank(k, step)] = at;
        }
        for triangle in &mut moved.triangles {
            for corner in triangle {
                *corner = rank(*corner as usize, step) as u32;
            }
        }
        place.write(&format!("scan-{key}.ply"), ply::text(&moved));
    }
    let line = |k: usize| match k % 10 {
        0 => format!("{k},-1,{}\n", rank(k, 7)),
        _ => format!("{k},{},{}\n", rank(k, 5), rank(k, 7)),
    };
    let table: String = (0..count).map(line).collect();
    place.write("points.csv", format!("first,second,third\n{table}"));
    let files = ["init", "scan-0.ply", "scan-1.ply", "scan-2.ply"];
    let known = ["--correspondences", "points.csv"];
    let recipe = place.isomorph(&[&files[..], &known].concat()).succeeded();
    place.write("recipe.toml", &recipe.stdout);
    let train = ["train", "recipe.toml", "--run", "run", "--set"];
    let all = ["data.correspondence-fraction=1", "--set", "result.frames=0"];
    let ended = place
        .isomorph(&[&train[..], &all, &SMALL].concat())
        .succeeded();
    let said = "have no partner (-1)";
    assert!(ended.stderr.contains(said), "{}", ended.stderr);
    // A sphere says nothing of a turn about its axis; the points do.
    let warp = ["warp", "run", "--points", "scan-0.ply", "-o", "moved.ply"];
    place.isomorph(&warp).succeeded();
    let moved = ply::Ply::read(&place.path("moved.ply")).mesh();
    let truth = ply::Ply::read(&place.path("scan-2.ply")).mesh();
    let off = |k: usize| {
        let (a, b) = (moved.vertices[k], truth.vertices[rank(k, 7)]);
        (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
    };
    let mean = (0..count).map(off).sum::<f64>() / count as f64;
    assert!(mean < 0.03, "{mean}");
    place.write("points.csv", "0,1,2\n3,4\n");
    place
        .isomorph(&[&files[..], &known].concat())
        .refused(1, &["points.csv:2", "-1 where the point is not known"]);
}
