//! A temporary folder in which the program runs, and how a command ended.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::mesh::Mesh;
use super::ply;
use super::run::Run;

/// A temporary folder; it goes away with everything in it.
pub(crate) struct Workplace(tempfile::TempDir);

impl Workplace {
    /// An empty one.
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// One with `source.ply`, `target.ply` and `recipe.toml`: the two shapes, equal in their vertices,
    /// and `preset = "quick"` with keys, each as in `training.steps=20`. Of keys that are given twice the
    /// last one counts.
    pub(crate) fn with_pair(source: &Mesh, target: &Mesh, keys: &[&str]) -> Self {
        let place = Self::new();
        place.write("source.ply", ply::text(source));
        place.write("target.ply", ply::text(target));
        let mut recipe = String::from(
            "preset = \"quick\"\ndata.source = \"source.ply\"\ndata.target = \"target.ply\"\n",
        );
        if source.vertices.len() == target.vertices.len() {
            recipe.push_str("data.correspondences = \"same-vertices\"\n");
        }
        let name = |key: &str| key.split([' ', '=']).next().map(str::to_owned);
        for (at, key) in keys.iter().enumerate() {
            if keys[at + 1..].iter().all(|later| name(later) != name(key)) {
                recipe.push_str(key);
                recipe.push('\n');
            }
        }
        place.write("recipe.toml", &recipe);
        place
    }

    /// A small sphere that moves by its radius and learns in milliseconds per step, with the preset `quick`
    /// as it ships, only smaller.
    pub(crate) fn tiny(keys: &[&str]) -> Self {
        Self::tiny_with(TINY, keys)
    }

    /// The same with other sizes: a method other than the default one has other networks, and a recipe holds
    /// no key that does nothing.
    pub(crate) fn tiny_with(sizes: &[&str], keys: &[&str]) -> Self {
        let sphere = Mesh::sphere(1.0, 3);
        let target = sphere.clone().map(|x| [x[0] + 1.0, x[1], x[2]]);
        Self::with_pair(&sphere, &target, &[sizes, keys].concat())
    }

    /// The path of a file in it.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file into it.
    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).expect("a file in a temporary folder");
    }

    /// A run in it.
    pub(crate) fn run(&self, name: &str) -> Run {
        Run(self.path(name))
    }

    /// The program with arguments, to be started in the folder.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isomorph"));
        command
            .current_dir(self.0.path())
            .args(arguments)
            // Without it some Vulkan and GL libraries complain on the program's standard error.
            .env("XDG_RUNTIME_DIR", self.0.path())
            .stdin(Stdio::null());
        command
    }

    /// Runs the program with arguments to its end.
    pub(crate) fn isomorph(&self, arguments: &[&str]) -> Ended {
        Ended::from(
            self.command(arguments)
                .output()
                .expect("the program starts"),
        )
    }

    /// Runs the program on one thread, where the order of every sum is fixed.
    pub(crate) fn on_one_thread(&self, arguments: &[&str]) -> Ended {
        let mut command = self.command(arguments);
        Ended::from(
            command
                .env("RAYON_NUM_THREADS", "1")
                .output()
                .expect("the program starts"),
        )
    }

    /// Runs `train recipe.toml` into a run, with more arguments, and holds it to success.
    pub(crate) fn train(&self, run: &str, arguments: &[&str]) -> Run {
        let fixed = ["train", "recipe.toml", "--quiet", "--run", run];
        self.isomorph(&[&fixed, arguments].concat()).succeeded();
        self.run(run)
    }

    /// The names in the folder, in order.
    pub(crate) fn names(&self) -> Vec<String> {
        names(self.0.path())
    }
}

/// The product as it ships: `quick` with nothing changed.
pub(crate) const SHIPPED: &[&str] = &[];

/// The paper's geometry, a second column beside [`SHIPPED`]: one network `f(x, t)` of softplus with all phases
/// of training, and a stationary `V`. A test puts these before its own keys.
pub(crate) const NETWORK: &[&str] = &[
    "implicit.geometry = \"network\"",
    "implicit.activation = \"softplus\"",
    "implicit.beta = 100",
    "velocity.time-dependent = false",
    "loss.screw = 0",
    "training.optimiser = \"adam\"",
    "training.learning-rate = 2e-3",
    "training.velocity-until = 0.7",
    "training.integrator = \"midpoint\"",
    "training.time-steps = 3",
];

/// Both, with their names.
pub(crate) const COLUMNS: [(&str, &[&str]); 2] = [("shipped", SHIPPED), ("network", NETWORK)];

/// Sizes with which a step takes milliseconds; all of them act in both columns.
pub(crate) const TINY: &[&str] = &[
    "implicit.depth = 3",
    "implicit.width = 32",
    "velocity.depth = 2",
    "velocity.width = 24",
    "data.points = 2000",
    "training.batch = 200",
    "training.correspondence-batch = 40",
    "result.frames = 0",
];

/// The names in a folder, in order.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.expect("an entry").file_name();
    let mut names: Vec<String> = entries
        .map(|entry| name(entry).into_string().expect("a name of text"))
        .collect();
    names.sort();
    names
}

/// How a command ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Its exit status; `None` if a signal ended it.
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).expect("text"),
            stderr: String::from_utf8(output.stderr).expect("text"),
        }
    }
}

impl Ended {
    /// Holds the command to success.
    #[track_caller]
    pub(crate) fn succeeded(self) -> Self {
        assert_eq!(self.code, Some(0), "{self:?}");
        self
    }

    /// Holds the command to one line of error with these parts in it, nothing else, and this status.
    #[track_caller]
    pub(crate) fn refused(&self, code: i32, parts: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert_eq!(self.stdout, "", "results of a command that failed");
        assert!(
            self.stderr.starts_with("error: ") && self.stderr.ends_with('\n'),
            "{self:?}"
        );
        assert_eq!(self.stderr.lines().count(), 1, "{self:?}");
        for part in parts {
            assert!(
                self.stderr.contains(part),
                "no {part:?} in {:?}",
                self.stderr
            );
        }
        // A cause that each level of an error repeats makes a line that nobody reads.
        let mut told: Vec<&str> = self.stderr.trim_end().split(": ").collect();
        told.retain(|part| part.contains(' '));
        for (at, part) in told.iter().enumerate() {
            assert!(
                !told[..at].contains(part),
                "{part:?} is told twice in {:?}",
                self.stderr
            );
        }
    }
}

/// Tests that train do so one after the other, since each uses all cores.
pub(crate) fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    // A test that failed in its turn has nothing to leave in disorder.
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}
