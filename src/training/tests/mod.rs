//! Methods on small spheres: their samples, what each trains, which keys act.

mod acting;
mod guided;
mod methods;
mod optimiser;
mod samples;
mod sequence;

use std::path::Path;
use std::sync::Arc;

use burn::optim::GradientsParams;
use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;

use crate::data::TrainingData;
use crate::engine::{AllMethods, MethodSet};
use crate::method::{METHODS, Method, MethodSpec};
use crate::posed::{self, Slopes};
use crate::recipe::{Recipe, VelocityKind};
use crate::report::TermReport;
use crate::samples::{Drawn, Part};

type B = Autodiff<NdArray>;

/// The default method and the paper's.
const FLOW: &str = "implicit.geometry=flow";
const NETWORK: &str = "implicit.geometry=network";

/// What makes a recipe small.
const SMALL: [&str; 15] = [
    "data.correspondences=same-vertices",
    "implicit.activation=softplus",
    "implicit.beta=100",
    "training.velocity-until=0.7",
    "training.integrator=midpoint",
    "training.time-steps=3",
    "implicit.depth=2",
    "implicit.width=8",
    "velocity.depth=2",
    "velocity.width=8",
    "training.batch=88",
    "training.correspondence-batch=8",
    "training.steps=10",
    "training.optimiser=adam",
    "training.guided-until=0",
];

/// A small recipe with these changes; what of it does nothing in the changed method is dropped.
fn recipe(extra: &[&str]) -> Recipe {
    let text = "preset = \"quick\"\n[data]\nsource = \"a.ply\"\ntarget = \"b.ply\"\n";
    let small = SMALL.map(str::to_owned);
    let mut recipe = Recipe::parse(text, Path::new("recipe.toml"), &small).expect("a recipe");
    let extra: Vec<String> = extra.iter().map(|text| (*text).to_owned()).collect();
    recipe.with_all(&extra).expect("changes of it");
    recipe
}

/// What makes the small recipe this method, with few modes and deformations.
fn overrides(spec: &MethodSpec) -> Vec<String> {
    let mut overrides = vec![format!("method.name={}", spec.name)];
    overrides.extend(
        spec.geometry
            .map(|kind| format!("implicit.geometry={kind}")),
    );
    overrides.extend(spec.velocity.map(|kind| format!("velocity.kind={kind}")));
    let small = match spec.name {
        "eigenbasis" => &["eigenbasis.modes=2"][..],
        "nfgp" => &["nfgp.deformations=2", "nfgp.blocks=1"],
        "efis" => &["efis.width=8"],
        _ => &[],
    };
    overrides.extend(small.iter().map(|text| (*text).to_owned()));
    overrides
}

/// The methods that are trained here: what is solved for has its tests where it is solved.
fn trained() -> impl Iterator<Item = &'static MethodSpec> {
    let solved = |spec: &MethodSpec| spec.velocity == Some(VelocityKind::Spline);
    METHODS.iter().copied().filter(move |spec| !solved(spec))
}

/// The small recipe of a method with these changes.
fn recipe_of(spec: &MethodSpec, extra: &[&str]) -> Recipe {
    let own = overrides(spec);
    let own = own.iter().map(String::as_str);
    recipe(&own.chain(extra.iter().copied()).collect::<Vec<_>>())
}

/// Points of two spheres, the second moved along x, with a guide.
fn data() -> TrainingData {
    let mut data = TrainingData::spheres(200, 200);
    data.guide = Some(Arc::new(guided::Turning));
    data
}

fn build(recipe: &Recipe, data: &TrainingData) -> Box<dyn Method<B>> {
    let built = AllMethods::build::<B>(recipe, &data.bounds, &Default::default());
    built.expect("all methods are among them")
}

/// The terms and gradients of one part of a step's samples.
fn solve(
    method: &dyn Method<B>,
    data: &TrainingData,
    drawn: &Drawn,
    step: usize,
    part: Part,
) -> (Vec<TermReport>, Vec<GradientsParams>) {
    let posed = method.objective(data, &drawn.part(part), step);
    posed.solve(part.of, true)
}

/// Makes one step, undivided; the terms.
fn advance(method: &mut dyn Method<B>, data: &TrainingData, step: usize) -> Vec<TermReport> {
    let drawn = method.draw(data, step);
    let (terms, gradients) = solve(method, data, &drawn, step, Part::WHOLE);
    method.descend(step, &mut Slopes::new(vec![gradients]));
    terms
}

/// The records of the networks, without those of the optimisers, which list the same states in an order of
/// their own.
fn networks(method: &dyn Method<B>) -> Vec<(String, Vec<u8>)> {
    let mut files = method.records().expect("encodes").0;
    files.retain(|(file, _)| !file.ends_with("-optimiser.mpk"));
    files
}
