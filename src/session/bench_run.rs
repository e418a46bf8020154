//! What a whole run costs on this machine, stage by stage: the run is a real one, in a folder that is deleted.

use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use super::train::Session;
use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::event::{Event, Preparation};
use crate::formats::Shape;
use crate::geometry::Mesh;
use crate::recipe::Recipe;
use crate::{memory, processor};

/// The shapes of the run.
#[derive(Clone, Debug)]
pub enum Job {
    /// Those of a recipe, with its settings.
    Recipe(PathBuf),
    /// A rod, 1.6 long and 0.3 thick, that is bent to an arc, with the preset `instant` and the same vertices.
    Rod {
        /// Vertices of each mesh, 100 or more; rounded to whole rings.
        vertices: usize,
        /// Degrees between the directions of its ends after bending, 0 to 270.
        bend: f64,
    },
}

/// What to measure.
#[derive(Clone, Debug)]
pub struct BenchRun {
    /// The shapes.
    pub job: Job,
    /// How often; the median of each stage counts.
    pub repeats: usize,
    /// Changes of the recipe, as in `spline.spacing=0.1`.
    pub changes: Vec<String>,
    /// Where it is made.
    pub backend: Backend,
}

/// What a run costs.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredRun {
    /// The stages, in their order.
    pub stages: Vec<StageCost>,
    /// Of the whole run.
    pub whole: Cost,
    /// Vertices of the two shapes.
    pub vertices: Vec<usize>,
    /// The backend's own name.
    pub backend: String,
    /// Threads that work.
    pub threads: usize,
    /// Changes of the recipe.
    pub set: Vec<String>,
    /// Peak resident memory of the process, where the system says.
    pub peak_bytes: Option<u64>,
}

/// What a stage costs.
#[derive(Clone, Debug, Serialize)]
pub struct StageCost {
    /// What is done in it.
    pub name: &'static str,
    /// How much.
    #[serde(flatten)]
    pub cost: Cost,
}

/// A cost in its measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Cost {
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Seconds of processor time over all threads, where the system says.
    pub cpu_seconds: Option<f64>,
    /// Share of the whole run's wall-clock seconds, 0 to 1.
    pub share: f64,
}

/// Measures a run, as often as is asked for.
///
/// # Errors
/// A recipe or a change that is refused, a rod that is none, and what keeps a run from being made.
pub fn bench_run(options: &BenchRun) -> Result<MeasuredRun> {
    let place = tempfile::tempdir()?;
    let recipe = recipe(options, place.path())?;
    let mut runs = Vec::new();
    let (mut backend, mut vertices) = (String::new(), Vec::new());
    for _ in 0..options.repeats.max(1) {
        let mut clock = Clock::start();
        let run = place.path().join("run");
        let session = Session::prepare(recipe.clone(), &run, options.backend.clone())?;
        vertices = session.sizes();
        session.replacing().train(|event| {
            if let Event::Started { backend: name, .. } = event {
                backend.clone_from(name);
            }
            clock.observe(event);
        })?;
        runs.push(clock.end());
    }
    let stages = medians(&runs);
    Ok(MeasuredRun {
        whole: total(&stages),
        stages,
        vertices,
        backend,
        threads: rayon::current_num_threads(),
        set: options.changes.clone(),
        peak_bytes: memory::peak_memory_bytes(),
    })
}

/// The recipe of the run; the files of a rod go into `place`.
fn recipe(options: &BenchRun, place: &Path) -> Result<Recipe> {
    let (vertices, bend) = match &options.job {
        Job::Recipe(path) => return Ok(Recipe::read(path, &options.changes)?),
        Job::Rod { vertices, bend } => (*vertices, *bend),
    };
    if vertices < 100 || !(0.0..=270.0).contains(&bend) {
        return Err(Error::usage(format!(
            "a rod of {vertices} vertices, bent by {bend} degrees: must be 100 vertices or more, and 0 to 270 \
             degrees"
        )));
    }
    let [from, to] = ["straight.ply", "bent.ply"].map(|name| place.join(name));
    Shape::of(rod(vertices, 0.0)).write(&from)?;
    Shape::of(rod(vertices, bend.to_radians())).write(&to)?;
    let mut recipe = Recipe::between(&from, &to)?;
    recipe.with("preset=instant")?;
    recipe.with("data.correspondences=same-vertices")?;
    recipe.with_all(&options.changes)?;
    Ok(recipe)
}

/// When each stage of one run began, by wall clock and by processor time.
struct Clock(Vec<(&'static str, Instant, Option<f64>)>);

impl Clock {
    fn start() -> Self {
        let mut clock = Self(Vec::new());
        clock.begin("read files");
        clock
    }

    fn begin(&mut self, name: &'static str) {
        if self.0.last().is_none_or(|(last, ..)| *last != name) {
            self.0.push((name, Instant::now(), processor::seconds()));
        }
    }

    fn observe(&mut self, event: &Event) {
        match event {
            Event::Matching { .. } => self.begin("find pairs"),
            Event::Preparing(Preparation::Points) => self.begin("points and normals"),
            Event::Preparing(Preparation::Distances) => self.begin("exact distances"),
            Event::Started { .. } => self.begin("steps"),
            Event::Extracting { .. } => self.begin("surfaces"),
            Event::Drawing => self.begin("picture and page"),
            _ => {}
        }
    }

    fn end(mut self) -> Vec<(&'static str, Cost)> {
        self.begin("end");
        let pairs = self.0.windows(2);
        let cost = pairs.map(|pair| {
            let [(name, began, worked), (_, ended, at_end)] = [pair[0], pair[1]];
            let cost = Cost {
                seconds: ended.duration_since(began).as_secs_f64(),
                cpu_seconds: at_end.zip(worked).map(|(end, begin)| end - begin),
                share: 0.0,
            };
            (name, cost)
        });
        cost.collect()
    }
}

/// The median of each stage. All runs have the same stages.
fn medians(runs: &[Vec<(&'static str, Cost)>]) -> Vec<StageCost> {
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let stage = |(k, (name, _)): (usize, &(&'static str, Cost))| {
        let of_each = || runs.iter().map(move |run| run[k].1);
        let worked: Option<Vec<f64>> = of_each().map(|cost| cost.cpu_seconds).collect();
        StageCost {
            name,
            cost: Cost {
                seconds: median(of_each().map(|cost| cost.seconds).collect()),
                cpu_seconds: worked.map(median),
                share: 0.0,
            },
        }
    };
    let mut stages: Vec<StageCost> = runs[0].iter().enumerate().map(stage).collect();
    let whole = total(&stages).seconds;
    for stage in &mut stages {
        stage.cost.share = stage.cost.seconds / whole;
    }
    stages
}

fn total(stages: &[StageCost]) -> Cost {
    let worked: Option<Vec<f64>> = stages.iter().map(|stage| stage.cost.cpu_seconds).collect();
    Cost {
        seconds: stages.iter().map(|stage| stage.cost.seconds).sum(),
        cpu_seconds: worked.map(|each| each.iter().sum()),
        share: 1.0,
    }
}

/// A closed rod with round ends along x, bent about z by so many radians in all.
fn rod(vertices: usize, bend: f64) -> Mesh<f64> {
    // Twice as many points on a ring as rings, so that triangles are about as long as wide; two poles.
    let rings = ((vertices as f64 / 2.0).sqrt() as usize).max(6);
    let around = (vertices.saturating_sub(2) / rings).max(6);
    let bent = |[x, y, z]: [f64; 3]| {
        if bend == 0.0 {
            return [x, y, z];
        }
        let radius = LENGTH / bend;
        let (sin, cos) = (x / radius).sin_cos();
        [(radius - y) * sin, radius - (radius - y) * cos, z]
    };
    let mut points = vec![bent([-LENGTH / 2.0, 0.0, 0.0])];
    for ring in 1..=rings {
        let along = PI * ring as f64 / (rings + 1) as f64;
        for k in 0..around {
            let (sin, cos) = (TAU * k as f64 / around as f64).sin_cos();
            // An ellipsoid, widened to a rod.
            let wide = along.sin().sqrt() * THICKNESS / 2.0;
            points.push(bent([-LENGTH / 2.0 * along.cos(), wide * cos, wide * sin]));
        }
    }
    points.push(bent([LENGTH / 2.0, 0.0, 0.0]));
    let at = |ring: usize, k: usize| (1 + ring * around + k % around) as u32;
    let last = points.len() as u32 - 1;
    let mut triangles = Vec::new();
    for k in 0..around {
        triangles.push([0, at(0, k + 1), at(0, k)]);
        triangles.push([last, at(rings - 1, k), at(rings - 1, k + 1)]);
        for ring in 1..rings {
            let (low, high) = (ring - 1, ring);
            triangles.push([at(low, k), at(high, k + 1), at(high, k)]);
            triangles.push([at(low, k), at(low, k + 1), at(high, k + 1)]);
        }
    }
    Mesh::new(points, triangles)
}

/// Of the straight rod.
const LENGTH: f64 = 1.6;
const THICKNESS: f64 = 0.3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::EdgeSharing;

    #[test]
    fn a_rod_is_closed_keeps_its_volume_and_turns_its_ends() {
        let (straight, bent) = (rod(2000, 0.0), rod(2000, PI / 2.0));
        for mesh in [&straight, &bent] {
            assert!(EdgeSharing::of(mesh).is_closed());
            assert!((1900..=2000).contains(&mesh.vertices.len()));
        }
        // Bending keeps the volume: what is lost inside of the middle line is won outside.
        let ratio = bent.volume() / straight.volume();
        assert!(
            straight.volume() > 0.0 && (ratio - 1.0).abs() < 1e-2,
            "{ratio}"
        );
        let (first, last) = (bent.vertices[0], bent.vertices[bent.vertices.len() - 1]);
        let chord = (0..3).map(|axis| (last[axis] - first[axis]).powi(2));
        let chord = chord.sum::<f64>().sqrt();
        // The chord of a quarter of a circle of this length.
        assert!(
            (chord - LENGTH * 2.0 * 2.0_f64.sqrt() / PI).abs() < 1e-9,
            "{chord}"
        );
    }

    #[test]
    fn medians_are_taken_stage_by_stage_and_shares_add_up() {
        let cost = |seconds| Cost {
            seconds,
            cpu_seconds: Some(2.0 * seconds),
            share: 0.0,
        };
        let run = |a, b| vec![("a", cost(a)), ("b", cost(b))];
        let stages = medians(&[run(1.0, 9.0), run(3.0, 1.0), run(2.0, 2.0)]);
        assert_eq!(stages[0].cost.seconds, 2.0);
        assert_eq!(stages[1].cost.cpu_seconds, Some(4.0));
        assert_eq!([stages[0].cost.share, stages[1].cost.share], [0.5, 0.5]);
        assert_eq!(total(&stages).cpu_seconds, Some(8.0));
    }
}
