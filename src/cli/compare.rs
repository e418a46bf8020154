//! `isomorph compare`: methods side by side on the pairs of a sequence, under one budget.
//!
//! ```text
//! RESULTS/fox_survey/            table.md, comparison.json, error.svg, one JSON per pair and method
//! WORK/fox_survey/0-18/          source.ply, target.ply: all that a method sees
//! WORK/fox_survey/0-18/quick/    its run, as `train` makes it
//! ```

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result};
use clap::Args;

use super::compared::{Compared, Made, open_or_create, stored_pairs};
use super::evaluate::{PrecisionArgs, true_frame};
use super::paired::{self, Prepared};
use super::{BackendArgs, Ending, QuietArgs, SetArgs, Usage, stop_on_interrupt, trained};
use crate::backend;
use crate::compare::{
    self, Entry, FramePair, Inputs, Lookup, Machine, MethodPlan, Plan, Request, Run, Store,
};
use crate::evaluate::{GroundTruth, Options, Reference, Span};
use crate::recipe::{Preset, Recipe};
use crate::report::{Reporter, Verbosity};
use crate::shape::Normalisation;
use crate::surface::write::{SurfaceFormat, SurfaceView, write_surface};

/// Compare methods on pairs of frames of a sequence, in one table and one figure
///
/// Each method sees the two frames of a pair and 1000 correspondences, and is measured on the frames
/// between. Presets of ours: quick, default, quality, paper. Others, on the networks and steps of quick: mlp,
/// sdf-blend, lipmlp, nise, nise-velocity, eigenbasis, nfgp. A pair that is done is not done again: the
/// command can be interrupted and repeated. Straight lines between all true vertices (linear) and the
/// sampling floor are in every table.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// The frames: a .anime sequence, or a folder of meshes in the order of their names
    #[arg(long, value_name = "SEQUENCE")]
    sequence: PathBuf,

    /// Pairs of frames, as in 0-18,20-47: the first and the last frame of each, counted from 0
    #[arg(long, value_name = "FROM-TO,...")]
    pairs: Option<String>,

    /// Methods, as in quick,lipmlp
    #[arg(long, value_name = "METHOD,...")]
    methods: Option<String>,

    /// A method with changes under a label of its own, as in 'no divergence=quick,loss.divergence=0'
    #[arg(long = "variant", value_name = "LABEL=METHOD,KEY=VALUE,...")]
    variants: Vec<String>,

    #[command(flatten)]
    set: SetArgs,

    #[command(flatten)]
    precision: PrecisionArgs,

    /// Folder for tables, figures and numbers
    #[arg(long, short, value_name = "DIR", default_value = "results")]
    output: PathBuf,

    /// Folder for the runs
    #[arg(long, value_name = "DIR", default_value = "runs/compare")]
    work: PathBuf,

    /// Print JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    place: BackendArgs,

    #[command(flatten)]
    quiet: QuietArgs,
}

/// Softplus networks, as the sources of these methods have them or leave open: sines would give a plain
/// network between its ends the freedom to dissolve.
const SOFT: [&str; 3] = [
    "implicit.activation=softplus",
    "implicit.beta=100",
    "training.learning-rate=2e-3",
];

/// The methods that are not presets, each with what it changes in `quick`.
const OTHERS: [(&str, &[&str]); 7] = [
    ("mlp", &SOFT),
    ("sdf-blend", &SOFT),
    ("lipmlp", &["training.learning-rate=2e-3"]),
    // Sines learn faster: at 2e-3 their fields fray.
    ("nise", &["training.learning-rate=5e-4"]),
    ("nise-velocity", &["training.learning-rate=5e-4"]),
    // Coefficients of one size each: the steps can be larger than a network's.
    ("eigenbasis", &["training.velocity-learning-rate=1e-2"]),
    // Its normalised layers learn slowly.
    ("nfgp", &["training.velocity-learning-rate=3e-3"]),
];

/// The words of `--methods`.
fn known() -> Vec<&'static str> {
    let presets = Preset::WORDS.iter().copied();
    presets
        .chain(OTHERS.iter().map(|(name, _)| *name))
        .collect()
}

pub(super) fn run(args: CompareArgs) -> Result<Ending> {
    let truth = GroundTruth::read(&args.sequence)?;
    let name = compare::sequence_name(&args.sequence);
    let plan = Plan::new(&Request {
        sequence: &name,
        frames: truth.frame_count(),
        pairs: args.pairs.as_deref(),
        methods: args.methods.as_deref(),
        variants: &args.variants,
        known: &known(),
    })?;
    backend::check(args.place.backend, args.place.device.as_deref())?;
    let bench = Bench {
        store: Store::at(&args.output, &name),
        work: args.work.join(&name),
        sequence: content(&truth),
        options: args.precision.options(),
        stop: stop_on_interrupt()?,
        truth,
        args,
    };
    bench.recipes(&plan)?;
    bench.store.create()?;
    let mut entries = Vec::new();
    for pair in &plan.pairs {
        if bench.pair(&plan, *pair, &mut entries)? == Ending::Interrupted {
            return Ok(Ending::Interrupted);
        }
    }
    let comparison = compare::write_report(&bench.store, &plan, &entries)?;
    if bench.args.json {
        println!("{}", serde_json::to_string(&comparison)?);
    } else {
        print!("{}", compare::table(&comparison));
    }
    Ok(Ending::Done)
}

/// All of a sequence that counts: its triangles and vertices.
fn content(truth: &GroundTruth) -> Vec<u8> {
    let triangles = truth.triangles().as_flattened().iter();
    let mut bytes: Vec<u8> = triangles.flat_map(|index| index.to_le_bytes()).collect();
    for frame in 0..truth.frame_count() {
        let coordinates = truth.vertices(frame).as_flattened().iter();
        bytes.extend(coordinates.flat_map(|coordinate| coordinate.to_le_bytes()));
    }
    bytes
}

/// What all pairs and methods of one comparison share.
struct Bench {
    args: CompareArgs,
    truth: GroundTruth,
    sequence: Vec<u8>,
    options: Options,
    store: Store,
    work: PathBuf,
    stop: Arc<AtomicBool>,
}

impl Bench {
    /// Tells the user something, unless only errors are wanted.
    fn say(&self, text: &str) {
        if self.args.quiet.verbosity() == Verbosity::Normal {
            eprintln!("{text}");
        }
    }

    /// Reads every recipe of the plan: what is wrong with one is said before hours of training.
    fn recipes(&self, plan: &Plan) -> Result<()> {
        let every = self.options.every;
        for pair in &plan.pairs {
            let between = pair.to - pair.from - 1;
            if every > between {
                return Err(Usage(format!(
                    "--every {every}: pair {pair} has {between} frames between its ends; must be 1 to \
                     {between}"
                ))
                .into());
            }
        }
        for method in &plan.methods {
            self.recipe(method, plan.pairs[0])
                .with_context(|| format!("method {}", method.label))?;
        }
        Ok(())
    }

    /// The recipe of a method on a pair.
    fn recipe(&self, method: &MethodPlan, pair: FramePair) -> Result<Recipe> {
        let preset = Preset::from_word(&method.method).unwrap_or(Preset::Quick);
        let text = format!(
            "preset = \"{preset}\"\n[data]\nsource = \"source.ply\"\ntarget = \"target.ply\"\n\
             correspondences = \"same-vertices\"\n[result]\nframes = 0\n"
        );
        let own = OTHERS.iter().find(|(name, _)| *name == method.method);
        let own = own.map_or_else(Vec::new, |(name, changes)| {
            let name = format!("method.name={name}");
            let changes = changes.iter().map(|change| (*change).to_owned());
            std::iter::once(name).chain(changes).collect()
        });
        let set = &self.args.set.overrides;
        let overrides: Vec<String> = [&own, set, &method.overrides].map(Vec::clone).concat();
        let path = std::path::absolute(self.folder(pair))?.join("recipe.toml");
        Ok(Recipe::parse(&text, &path, &overrides)?)
    }

    /// Where a pair's shapes and runs are.
    fn folder(&self, pair: FramePair) -> PathBuf {
        self.work.join(pair.to_string())
    }

    /// Where a method's run on a pair is.
    fn run(&self, method: &MethodPlan, pair: FramePair) -> PathBuf {
        self.folder(pair).join(compare::file_stem(&method.label))
    }

    /// Every method on one pair; the report is renewed after each.
    fn pair(&self, plan: &Plan, pair: FramePair, entries: &mut Vec<Entry>) -> Result<Ending> {
        self.write_ends(pair)?;
        let mut truth: Option<Truth> = None;
        for method in &plan.methods {
            let recipe = self.recipe(method, pair)?;
            let digest = self.digest(&recipe, pair)?;
            match self.store.find(pair, &method.label, &digest) {
                Lookup::Done(entry) => {
                    entries.push(*entry);
                    continue;
                }
                Lookup::Unusable { note } => self.say(&format!("note: {note}")),
                Lookup::Missing => {}
            }
            self.say(&format!("{} {pair}: {}", plan.sequence, method.label));
            let run = self.run(method, pair);
            let stored = stored_pairs(&run, &recipe);
            let prepared =
                paired::prepare(&recipe, stored.as_deref(), self.args.quiet.verbosity())?;
            let shapes = &prepared.pair;
            trained::check(&recipe, shapes).with_context(|| format!("method {}", method.label))?;
            let truth = match &mut truth {
                Some(known) => known,
                none => none.insert(self.truth_of(pair)?),
            };
            let (source, target) = (&shapes.source.points, &shapes.target.points);
            self.truth
                .check_ends(truth.span, &shapes.normalisation, source, target)?;
            let Some(made) = self.make(&run, (recipe, prepared), truth)? else {
                return Ok(Ending::Interrupted);
            };
            let entry = self.entry(plan, method, pair, digest, made);
            self.store.record(&entry)?;
            entries.push(entry);
            compare::write_report(&self.store, plan, entries)?;
        }
        Ok(Ending::Done)
    }

    /// The two frames as files, which are all that a method reads.
    fn write_ends(&self, pair: FramePair) -> Result<()> {
        let folder = self.folder(pair);
        std::fs::create_dir_all(&folder)
            .with_context(|| format!("{}: cannot be made", folder.display()))?;
        for (frame, name) in [(pair.from, "source.ply"), (pair.to, "target.ply")] {
            let view = SurfaceView {
                vertices: self.truth.vertices(frame),
                triangles: self.truth.triangles(),
                normals: None,
            };
            write_surface(view, &folder.join(name), SurfaceFormat::Ply)?;
        }
        Ok(())
    }

    fn digest(&self, recipe: &Recipe, pair: FramePair) -> Result<String> {
        let precision = &self.args.precision;
        let settings = [
            ("samples", self.options.samples.to_string()),
            ("every", self.options.every.to_string()),
            ("resolution", precision.resolution(recipe).to_string()),
            ("backend", self.args.place.backend.feature().to_owned()),
        ];
        let inputs = Inputs {
            recipe: &recipe.to_toml(),
            sequence: &self.sequence,
            pair,
            settings: &settings,
        };
        Ok(inputs.digest()?)
    }

    /// The truth between the ends of a pair; made once for all of its methods.
    fn truth_of(&self, pair: FramePair) -> Result<Truth> {
        let span = self.truth.span(pair.from, pair.to)?;
        let normalisation = true_frame(&self.truth, span)?;
        let reference = Reference::new(&self.truth, span, &normalisation, self.options)?;
        Ok(Truth {
            span,
            normalisation,
            reference: Arc::new(reference),
        })
    }

    /// Trains a method, or goes on with its training, and measures it; `None` if interrupted.
    fn make(
        &self,
        run: &Path,
        (recipe, prepared): (Recipe, Prepared),
        truth: &Truth,
    ) -> Result<Option<Made>> {
        let (run, checkpoint) = open_or_create(run, &recipe)?;
        let step = checkpoint.as_ref().map(|found| found.state.step);
        let mut reporter = Reporter::new(&run, step, self.args.quiet.verbosity())?;
        if let Some(matched) = prepared.keep(&run)? {
            reporter.handle(&matched)?;
        }
        let task = Compared {
            reporter,
            resolution: self.args.precision.resolution(&recipe),
            stop: Arc::clone(&self.stop),
            recipe,
            shapes: prepared.pair,
            run,
            checkpoint,
            reference: Arc::clone(&truth.reference),
            normalisation: truth.normalisation,
        };
        let place = &self.args.place;
        backend::run(place.backend, place.device.as_deref(), task)?
    }

    fn entry(
        &self,
        plan: &Plan,
        method: &MethodPlan,
        pair: FramePair,
        digest: String,
        made: Made,
    ) -> Entry {
        Entry {
            sequence: plan.sequence.clone(),
            pair,
            recipe: made.recipe.to_toml(),
            run: Run {
                method: method.label.clone(),
                digest,
                steps: made.recipe.training.steps,
                batch: made.recipe.training.batch,
                networks: made.networks,
                training_seconds: made.training_seconds,
                evaluation_seconds: made.evaluation_seconds,
                machine: Machine::this(),
                date: compare::now(),
                command: compare::command_line(std::env::args()),
            },
            evaluation: made.evaluation,
        }
    }
}

/// The true frames of a pair.
struct Truth {
    span: Span,
    normalisation: Normalisation,
    reference: Arc<Reference>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipe::MethodName;

    #[test]
    fn every_method_of_the_recipe_can_be_compared() {
        for name in MethodName::WORDS {
            let known = known();
            assert!(
                *name == "velocity-field" || known.contains(name),
                "{name}: {known:?}"
            );
        }
        for preset in Preset::WORDS {
            assert!(known().contains(preset), "{preset}");
        }
    }
}
