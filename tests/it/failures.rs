//! What goes wrong around a run gives one clear line, and nothing is left under a final name.

use std::process::Command;

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::workplace::{Ended, Workplace, names, turn};

/// Small surfaces and a solver with few samples.
const SMALL: [&str; 6] = [
    "--set",
    "result.resolution=32",
    "--set",
    "spline.band=1000",
    "--set",
    "data.points=1000",
];

/// Two spheres of equal vertices.
fn spheres() -> Workplace {
    let place = Workplace::new();
    for (name, by) in [("a", 0.0), ("b", 0.2)] {
        let sphere = Mesh::sphere(1.0, 3).map(|[x, y, z]| [x + by, y, z]);
        place.write(&format!("{name}.ply"), ply::text(&sphere));
    }
    place
}

fn morph(place: &Workplace, files: [&str; 2], more: &[&str]) -> Ended {
    let command = ["morph", files[0], files[1], "--frames", "2"];
    place.isomorph(&[&command[..], &SMALL, more].concat())
}

#[test]
fn a_folder_that_cannot_be_written_is_one_line() {
    let _turn = turn();
    let place = spheres();
    // The kernel's own folder takes no files, not even root's.
    morph(&place, ["a.ply", "b.ply"], &["-o", "/proc/run", "--quiet"]).refused(1, &["/proc/run"]);
    place.write("taken", "a file");
    morph(&place, ["a.ply", "b.ply"], &["-o", "taken/run", "--quiet"]).refused(1, &["taken/run"]);
}

/// Writes fail as they do on a full disk, from a size on: the limit of the process, whose signal is ignored.
#[test]
fn a_disk_that_fills_up_is_one_line_and_leaves_no_half_files() {
    let _turn = turn();
    let place = spheres();
    for blocks in ["8", "40", "200"] {
        let program = place.command(&[]).get_program().to_owned();
        let mut command = Command::new("sh");
        let limited = "trap '' XFSZ; ulimit -f \"$1\"; shift; exec \"$@\"";
        command
            .args(["-c", limited, "sh", blocks])
            .arg(program)
            .args([
                "morph", "a.ply", "b.ply", "-o", "run", "--frames", "2", "--quiet", "--force",
            ])
            .args(["--set", "result.resolution=96"])
            .current_dir(place.path(""));
        let ended = Ended::from(command.output().expect("a shell"));
        ended.refused(1, &["File too large"]);
        let folders = ["run", "run/checkpoints", "run/meshes"];
        for folder in folders.map(|name| place.path(name)) {
            if folder.is_dir() {
                let left = names(&folder);
                assert!(
                    left.iter()
                        .all(|name| !name.starts_with(".step") && !name.contains("tmp")),
                    "{blocks}: {left:?}"
                );
            }
        }
        assert!(!place.path("run/meshes/surface.glb").exists(), "{blocks}");
    }
}

#[test]
fn without_a_browser_a_line_says_where_the_page_is() {
    let _turn = turn();
    let place = spheres();
    morph(&place, ["a.ply", "b.ply"], &["-o", "run"]).succeeded();
    let mut command = place.command(&["view", "run"]);
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WSL_DISTRO_NAME"] {
        command.env_remove(name);
    }
    let ended = Ended::from(command.output().expect("the program starts"));
    assert!(
        ended.stderr.contains("no browser was opened") && ended.stderr.lines().count() == 1,
        "{ended:?}"
    );
}

#[test]
fn shapes_that_have_nothing_in_common_are_said_to_be_doubtful() {
    let _turn = turn();
    let place = spheres();
    let comb = |x: [f64; 3]| {
        let tooth = (12.0 * x[0]).sin();
        [3.0 * x[0], 0.2 * x[1], 0.3 * x[2] * (1.2 + tooth)]
    };
    place.write("comb.ply", ply::text(&Mesh::sphere(1.0, 4).map(comb)));
    let ended = morph(
        &place,
        ["a.ply", "comb.ply"],
        &["-o", "run", "--pairs", "match"],
    );
    // Either no pair is sure, which is an error with a cure, or what was found is doubted.
    let said = ["doubtful: ", "no pair"].map(|text| ended.stderr.contains(text));
    assert!(said.contains(&true), "{ended:?}");
    assert!(ended.stderr.contains("--pairs"), "{ended:?}");
}

#[test]
fn ten_materials_come_back_moving_and_colours_of_another_kind_do_no_harm() {
    let _turn = turn();
    let place = Workplace::new();
    let sphere = Mesh::sphere(1.0, 3);
    for (name, by) in [("a", 0.0), ("b", 0.2)] {
        let mut obj = String::new();
        let mut ply = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement \
             face {}\nproperty list uchar int vertex_indices\nproperty list uchar uchar colours\nend_header\n",
            sphere.vertices.len(),
            sphere.triangles.len()
        );
        for [x, y, z] in &sphere.vertices {
            obj += &format!("v {} {y} {z}\n", x + by);
            ply += &format!("{} {y} {z}\n", x + by);
        }
        for (k, [a, b, c]) in sphere.triangles.iter().enumerate() {
            obj += &format!("usemtl paint-{}\nf {} {} {}\n", k % 10, a + 1, b + 1, c + 1);
            let colours = format!(" {k}", k = k % 256).repeat(30);
            ply += &format!("3 {a} {b} {c} 30{colours}\n");
        }
        place.write(&format!("{name}.obj"), obj);
        place.write(&format!("{name}.ply"), ply);
    }
    morph(&place, ["a.obj", "b.obj"], &["-o", "painted"]).succeeded();
    let file = std::fs::read(place.path("painted/meshes/carried.glb")).expect("an animation");
    let text = String::from_utf8_lossy(&file);
    for k in 0..10 {
        assert!(text.contains(&format!("paint-{k}")), "material {k}");
    }
    morph(&place, ["a.ply", "b.ply"], &["-o", "coloured"]).succeeded();
}

#[test]
fn a_large_mesh_has_a_page_of_a_few_megabytes() {
    let _turn = turn();
    let place = Workplace::new();
    for (name, by) in [("a", 0.0), ("b", 0.2)] {
        let sphere = Mesh::sphere(1.0, 8).map(|[x, y, z]| [x + by, y, z]);
        place.write(&format!("{name}.ply"), ply::text(&sphere));
    }
    morph(&place, ["a.ply", "b.ply"], &["-o", "run", "--quiet"]).succeeded();
    let page = std::fs::metadata(place.path("run/report.html")).expect("a page");
    assert!(page.len() < 6_000_000, "{} bytes", page.len());
}

#[test]
fn a_run_that_takes_too_much_memory_is_refused_with_the_number_that_would_do() {
    let _turn = turn();
    let place = spheres();
    let limited = |limit: &str| {
        let options = ["-o", "run", "--quiet", "--memory-limit", limit];
        morph(&place, ["a.ply", "b.ply"], &options)
    };
    let refused = limited("100MiB");
    refused.refused(2, &["up to", "MiB", "100 MiB are allowed", "data.points"]);
    assert!(!place.path("run").exists());
    let said = &refused.stderr;
    let enough = said
        .split("up to ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next());
    let enough = format!("{}MiB", enough.expect("a number"));
    limited(&enough).succeeded();
    // It has taken no more than was foreseen.
    let metrics = std::fs::read_to_string(place.path("run/metrics.jsonl")).expect("metrics");
    let peak = metrics.split("\"peak_memory_bytes\":").last();
    let peak = peak.and_then(|rest| rest.split(['}', ',']).next());
    let peak: u64 = peak.and_then(|text| text.parse().ok()).expect("a peak");
    let enough: u64 = enough.trim_end_matches("MiB").parse().expect("a number");
    assert!(peak <= enough << 20, "{peak} of {enough} MiB");
    let misread = limited("1 apple");
    assert_eq!(misread.code, Some(2), "{misread:?}");
    assert!(misread.stderr.contains("--memory-limit"), "{misread:?}");
}
