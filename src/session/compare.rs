//! Methods side by side on the pairs of a sequence, under one budget.
//!
//! ```text
//! RESULTS/fox_survey/            table.md, comparison.json, error.svg, quality.svg, one JSON per pair and
//!                                method
//! WORK/fox_survey/0-18/          source.ply, target.ply: all that a method sees
//! WORK/fox_survey/0-18/quick/    its run, as training makes it
//! ```

use std::path::PathBuf;

use isomorph_training::engine::Engine;
use isomorph_training::method::METHODS;

use super::compared::{Made, make, stored};
use super::evaluate::{EvaluateOptions, true_frame};
use super::learned;
use super::measure::Ruler;
use super::prepare;
use super::stop::StopFlag;
use crate::backend::Backend;
use crate::compare::{
    self, Comparison, Entry, FramePair, Inputs, Lookup, Machine, MethodPlan, Plan, Request, Run,
    Store,
};
use crate::error::{Error, Result};
use crate::evaluate::{GroundTruth, Reference, Span};
use crate::event::Event;
use crate::formats::{SurfaceFormat, write_surface};
use crate::geometry::Mesh;
use crate::recipe::{Preset, Recipe, RecipeError};
use crate::shape::Normalisation;

/// What to compare.
#[derive(Clone, Debug)]
pub struct CompareOptions {
    /// The frames: a `.anime` sequence, or a folder of meshes in the order of their names.
    pub sequence: PathBuf,
    /// Pairs of frames, as in `0-18,20-47`.
    pub pairs: Option<String>,
    /// Methods, as in `quick,lipmlp`: presets and names of methods.
    pub methods: Option<String>,
    /// Methods with changes under labels of their own, as in `no divergence=quick,loss.divergence=0`.
    pub variants: Vec<String>,
    /// Changes of every recipe, as in `training.steps=500`.
    pub changes: Vec<String>,
    /// How closely to look.
    pub precision: EvaluateOptions,
    /// Folder for tables, figures and numbers.
    pub output: PathBuf,
    /// Folder for the runs.
    pub work: PathBuf,
    /// Where networks are trained.
    pub backend: Backend,
    /// How the program was called, which every result keeps.
    pub command: String,
}

/// The methods that can be compared: presets and names of methods.
pub fn known() -> Vec<&'static str> {
    let baselines = METHODS.iter().filter(|spec| spec.is_baseline);
    let presets = Preset::WORDS.iter().copied();
    presets.chain(baselines.map(|spec| spec.name)).collect()
}

/// Compares methods on pairs of frames and leaves tables, figures and numbers in the output folder, renewed
/// after each. What is done is not done again: a comparison can be stopped, repeated and extended.
///
/// # Errors
/// Of kind [`Interruption`](crate::ErrorKind::Interruption) if the stop flag was set; a plan that cannot be
/// run as it was requested, before anything is trained.
pub fn compare(
    options: &CompareOptions,
    stop: &StopFlag,
    mut on_event: impl FnMut(&Event),
) -> Result<Comparison> {
    let truth = GroundTruth::read(&options.sequence)?;
    let name = compare::sequence_name(&options.sequence);
    let plan = Plan::new(&Request {
        sequence: &name,
        frames: truth.frame_count(),
        pairs: options.pairs.as_deref(),
        methods: options.methods.as_deref(),
        variants: &options.variants,
        known: &known(),
    })?;
    let bench = Bench {
        engine: options.backend.open()?,
        store: Store::at(&options.output, &name),
        work: options.work.join(&name),
        sequence: content(&truth),
        stop,
        truth,
        options,
    };
    bench.recipes(&plan)?;
    bench.store.create()?;
    let mut entries = Vec::new();
    for pair in &plan.pairs {
        bench.pair(&plan, *pair, &mut entries, &mut on_event)?;
    }
    Ok(compare::write_report(&bench.store, &plan, &entries)?)
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
struct Bench<'a> {
    options: &'a CompareOptions,
    engine: Box<dyn Engine>,
    truth: GroundTruth,
    sequence: Vec<u8>,
    store: Store,
    work: PathBuf,
    stop: &'a StopFlag,
}

impl Bench<'_> {
    /// Reads every recipe of the plan: what is wrong with one is said before hours of training.
    fn recipes(&self, plan: &Plan) -> Result<()> {
        let every = self.options.precision.every;
        for pair in &plan.pairs {
            let between = pair.to - pair.from - 1;
            if every > between {
                return Err(Error::usage(format!(
                    "every {every}: pair {pair} has {between} frames between its ends; must be 1 to \
                     {between}"
                )));
            }
        }
        self.shared_changes(plan)?;
        for method in &plan.methods {
            self.recipe(method, plan.pairs[0])?;
        }
        Ok(())
    }

    /// The recipe of a method on a pair. A change that all methods share counts where it acts.
    fn recipe(&self, method: &MethodPlan, pair: FramePair) -> Result<Recipe> {
        let acts = |change: &&String| {
            let alone = self.parsed(method, pair, std::slice::from_ref(*change));
            Ok::<_, Error>(!matches!(alone?, Err(RecipeError::Idle { .. })))
        };
        let mut changes = Vec::new();
        for change in &self.options.changes {
            if acts(&change)? {
                changes.push(change.clone());
            }
        }
        let recipe = self.parsed(method, pair, &changes)?.map_err(Error::from);
        recipe.map_err(|error| error.within(&format!("method {}", method.label)))
    }

    /// The recipe of a method on a pair with these changes beside its own.
    fn parsed(
        &self,
        method: &MethodPlan,
        pair: FramePair,
        changes: &[String],
    ) -> Result<std::result::Result<Recipe, RecipeError>> {
        let preset = Preset::from_word(&method.method).unwrap_or(Preset::Quick);
        let text = format!(
            "preset = \"{preset}\"\n[data]\nsource = \"source.ply\"\ntarget = \"target.ply\"\n\
             correspondences = \"same-vertices\"\n[result]\nframes = 0\n"
        );
        let own = METHODS.iter().find(|spec| spec.name == method.method);
        let own = own.map_or_else(Vec::new, |spec| spec.compare_overrides());
        let path = std::path::absolute(self.folder(pair))?.join("recipe.toml");
        let overrides = [&own[..], changes, &method.overrides].concat();
        Ok(Recipe::parse(&text, &path, &overrides))
    }

    /// Whether each change that all methods share acts in at least one of them.
    fn shared_changes(&self, plan: &Plan) -> Result<()> {
        let pair = plan.pairs[0];
        for change in &self.options.changes {
            let mut idle = None;
            for method in &plan.methods {
                match self.parsed(method, pair, std::slice::from_ref(change))? {
                    Err(error @ RecipeError::Idle { .. }) => idle = Some(error),
                    _ => {
                        idle = None;
                        break;
                    }
                }
            }
            if let Some(error) = idle {
                return Err(error.into());
            }
        }
        Ok(())
    }

    /// Where a pair's shapes and runs are.
    fn folder(&self, pair: FramePair) -> PathBuf {
        self.work.join(pair.to_string())
    }

    /// Every method on one pair; the report is renewed after each.
    fn pair(
        &self,
        plan: &Plan,
        pair: FramePair,
        entries: &mut Vec<Entry>,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<()> {
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
                Lookup::Unusable { note } => on_event(&Event::Note(note)),
                Lookup::Missing => {}
            }
            let what = format!("{} {pair}: {}", plan.sequence, method.label);
            on_event(&Event::Note(what));
            let truth = match &mut truth {
                Some(known) => known,
                none => none.insert(self.truth_of(pair)?),
            };
            let made = self.make(method, pair, &recipe, truth, on_event)?;
            let entry = self.entry(plan, method, pair, (digest, recipe), made);
            self.store.record(&entry)?;
            entries.push(entry);
            compare::write_report(&self.store, plan, entries)?;
        }
        Ok(())
    }

    /// One method on one pair.
    fn make(
        &self,
        method: &MethodPlan,
        pair: FramePair,
        recipe: &Recipe,
        truth: &Truth,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Made> {
        let run = self.folder(pair).join(compare::file_stem(&method.label));
        let stored = stored(&run, recipe);
        let shapes = prepare::read(recipe)?;
        let prepared = prepare::prepare(recipe, &shapes, stored.as_ref(), None, on_event)?;
        let keyframes = &prepared.keyframes;
        let name = format!("method {}", method.label);
        learned::check(recipe, &keyframes.normalisation).map_err(|error| error.within(&name))?;
        let [source, target] = [0, 1].map(|k| keyframes.given_points(k));
        self.truth
            .check_ends(truth.span, &keyframes.normalisation, &source, &target)?;
        let ruler = Ruler {
            reference: &truth.reference,
            normalisation: truth.normalisation,
            resolution: self.resolution(recipe),
            smallest_component: recipe.result.smallest_component,
            within: [0.0, 1.0],
            stop: self.stop,
        };
        make(&run, recipe, &prepared, &*self.engine, &ruler, on_event)
    }

    fn resolution(&self, recipe: &Recipe) -> usize {
        let precision = &self.options.precision;
        precision.resolution.unwrap_or(recipe.result.resolution)
    }

    /// The two frames as files, which are all that a method reads.
    fn write_ends(&self, pair: FramePair) -> Result<()> {
        let folder = self.folder(pair);
        for (frame, name) in [(pair.from, "source.ply"), (pair.to, "target.ply")] {
            let mesh = Mesh::new(
                self.truth.vertices(frame).to_vec(),
                self.truth.triangles().to_vec(),
            );
            write_surface(&mesh, &folder.join(name), SurfaceFormat::Ply)?;
        }
        Ok(())
    }

    fn digest(&self, recipe: &Recipe, pair: FramePair) -> Result<String> {
        let precision = &self.options.precision;
        let settings = [
            ("samples", precision.samples.to_string()),
            ("every", precision.every.to_string()),
            ("resolution", self.resolution(recipe).to_string()),
            ("backend", self.options.backend.name().to_owned()),
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
        let options = self.options.precision.of_reference();
        let reference = Reference::new(&self.truth, span, &normalisation, options)?;
        Ok(Truth {
            span,
            normalisation,
            reference,
        })
    }

    fn entry(
        &self,
        plan: &Plan,
        method: &MethodPlan,
        pair: FramePair,
        (digest, recipe): (String, Recipe),
        made: Made,
    ) -> Entry {
        Entry {
            sequence: plan.sequence.clone(),
            pair,
            recipe: recipe.to_toml(),
            run: Run {
                method: method.label.clone(),
                digest,
                steps: recipe.training.steps,
                batch: recipe.training.batch,
                networks: made.networks,
                training_seconds: made.training_seconds,
                evaluation_seconds: made.evaluation_seconds,
                machine: Machine::this(),
                date: compare::now(),
                command: self.options.command.clone(),
            },
            evaluation: made.evaluation,
        }
    }
}

/// The true frames of a pair.
struct Truth {
    span: Span,
    normalisation: Normalisation,
    reference: Reference,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_and_every_preset_can_be_compared() {
        let known = known();
        for spec in METHODS.iter().filter(|spec| spec.is_baseline) {
            assert!(known.contains(&spec.name), "{}: {known:?}", spec.name);
        }
        for preset in Preset::WORDS {
            assert!(known.contains(preset), "{preset}");
        }
    }
}
