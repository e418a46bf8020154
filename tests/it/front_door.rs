//! The front door: the library as other programs use it, and the command line as one of these programs.
//!
//! The binary is a crate of its own, of `src/main.rs` and `src/cli`, and so it can use nothing of the library
//! that is not public; neither can these tests, which are a third crate. What a text can add is that the
//! binary takes no way round: no file of the library is compiled into it, and no package below is used.

use std::fs;
use std::path::{Path, PathBuf};

use isomorph::{Backend, ErrorKind, Event, Recipe, Session, Shape, Trained};

use crate::support::mesh::{Mesh, distance, length};
use crate::support::workplace::turn;

/// `main.rs` and every file under `cli`.
fn sources() -> Vec<PathBuf> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = vec![source.join("main.rs")];
    let mut folders = vec![source.join("cli")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                found.push(path);
            }
        }
    }
    found
}

/// What a line of the command line may not hold, if it holds any of it.
fn way_round(line: &str) -> Option<&'static str> {
    let code = line.split("//").next().unwrap_or_default();
    let own = code.replace("crate::cli", "");
    let ways = [
        "isomorph_training",
        "isomorph_model",
        "burn",
        "include!",
        "../",
    ];
    let ways = ways.into_iter().filter(|way| code.contains(way));
    ways.chain(own.contains("crate::").then_some("crate::"))
        .next()
}

#[test]
fn the_command_line_uses_the_public_api_alone() {
    let files = sources();
    assert!(files.len() > 10, "{files:?}");
    for path in &files {
        let text = fs::read_to_string(path).expect("a file of text");
        for (number, line) in text.lines().enumerate() {
            let way = way_round(line);
            assert_eq!(way, None, "{}:{}: {line}", path.display(), number + 1);
        }
    }
    let main = fs::read_to_string(&files[0]).expect("a file of text");
    let modules = main
        .lines()
        .filter(|line| line.trim_start().starts_with("mod "));
    assert!(modules.eq(["mod cli;"]), "{main}");
    // The net has no hole.
    assert_eq!(way_round("use crate::session::Session;"), Some("crate::"));
    assert_eq!(
        way_round("use isomorph_training::recipe;"),
        Some("isomorph_training")
    );
    assert_eq!(way_round("use crate::cli::Terminal; // burn"), None);
}

/// Two spheres, and networks that train in a second.
const RECIPE: &str = "\
preset = \"quick\"
data.source = \"a.ply\"
data.target = \"b.ply\"
data.correspondences = \"same-vertices\"
data.points = 1000
implicit.depth = 3
implicit.width = 32
velocity.depth = 2
velocity.width = 24
training.steps = 60
training.batch = 200
training.correspondence-batch = 40
result.frames = 0
";

/// What a program does with the library from its first shape to its last number.
fn program(folder: &Path) -> Result<(), isomorph::Error> {
    let sphere = Mesh::sphere(1.0, 3).vertices;
    let away: Vec<[f64; 3]> = sphere.iter().map(|x| [x[0] + 0.5, x[1], x[2]]).collect();
    Shape::cloud(sphere.clone()).write(folder.join("a.ply"))?;
    Shape::cloud(away.clone()).write(folder.join("b.ply"))?;

    // Train, and stop after step 20.
    let run = folder.join("run");
    let recipe = Recipe::parse(RECIPE, &folder.join("recipe.toml"), &[])?;
    let mut session = Session::prepare(recipe, &run, Backend::Flex)?;
    let stop = session.stop_flag();
    let stopped = session.train(|event| {
        if matches!(event, Event::Tick { step: 20 }) {
            stop.set();
        }
    });
    let error = stopped.err().expect("it was stopped");
    assert_eq!(error.kind(), ErrorKind::Interruption, "{error}");

    // Go on to the last step.
    let mut steps = Vec::new();
    Session::resume(&run, &[], Backend::Flex)?.train(|event| {
        if let Event::Tick { step } = event {
            steps.push(*step);
        }
    })?;
    assert!(steps.iter().copied().eq(21..=60), "{steps:?}");

    // Ask what was learned.
    let trained = Trained::open(&run, Backend::Flex)?;
    let surface = trained.surface(0.5, 32)?;
    assert!(surface.mesh.triangles.len() > 100 && surface.components == 1);
    let moved = trained.carry(&sphere, 0.0, 1.0)?;
    let before = mean(sphere.iter().zip(&away).map(|(a, b)| distance(*a, *b)));
    let after = mean(moved.iter().zip(&away).map(|(a, b)| distance(*a, *b)));
    // From 0.5 to 0.018, as the command line measures it.
    assert!(before > 0.49 && after < 0.1, "{after} instead of {before}");
    let velocities = trained.velocity(&sphere, 0.0)?;
    assert!(velocities.iter().all(|v| length(*v).is_finite()));
    assert!(mean(velocities.iter().map(|v| v[0])) > 0.0, "backwards");
    // In the middle, on the surface, and near the edge of the box.
    let found = trained.distance(&[[0.0; 3], [1.0, 0.0, 0.0], [1.9, 0.0, 0.0]], 0.0)?;
    let [inside, on, outside] = found.distances[..] else {
        panic!("{found:?}");
    };
    assert!(
        inside < -0.5 && on.abs() < 0.15 && outside > 0.5,
        "{found:?}"
    );
    assert!(found.gradients[1][0] > 0.5, "{found:?}");
    Ok(())
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

#[test]
fn a_short_program_trains_stops_resumes_extracts_carries_and_measures() {
    let _turn = turn();
    let folder = tempfile::tempdir().expect("a temporary folder");
    program(folder.path()).expect("a program that runs");
}

#[test]
fn what_a_program_may_not_do_is_an_error_of_its_kind_in_the_librarys_own_words() {
    let _turn = turn();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let kind_of = |error: isomorph::Error| {
        let text = error.to_string();
        assert!(!text.contains("--") && !text.contains('`'), "{text}");
        error.kind()
    };
    let nowhere = Trained::open(folder.path().join("nowhere"), Backend::Flex);
    assert_eq!(nowhere.err().map(kind_of), Some(ErrorKind::Usage));
    let missing = Shape::read(folder.path().join("none.ply"));
    assert_eq!(missing.err().map(kind_of), Some(ErrorKind::Input));
    let device = Backend::Flex.on("discrete:1");
    assert_eq!(device.err().map(kind_of), Some(ErrorKind::Usage));
    program(folder.path()).expect("a program that runs");
    let trained = Trained::open(folder.path().join("run"), Backend::Flex).expect("a run");
    let early = trained.surface(-0.5, 32);
    assert_eq!(early.err().map(kind_of), Some(ErrorKind::Usage));
    let coarse = trained.surface(0.5, 1);
    assert_eq!(coarse.err().map(kind_of), Some(ErrorKind::Usage));
}
