//! The learner on small spheres: batches, the loop, what each method trains.

mod batch;
mod looped;
mod methods;

use std::sync::atomic::AtomicBool;

use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;

use super::*;

type B = Autodiff<NdArray>;

fn recipe(extra: &[&str]) -> Recipe {
    let text = "preset = \"quick\"\n[data]\nsource = \"a.ply\"\ntarget = \"b.ply\"\n";
    let small = [
        "data.correspondences=same-vertices",
        "implicit.geometry=network",
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
        "training.log-every=1",
        "checkpoint.every=4",
        "checkpoint.keep=2",
    ];
    let set: Vec<String> = small
        .iter()
        .chain(extra)
        .map(|text| (*text).to_owned())
        .collect();
    Recipe::parse(text, Path::new("recipe.toml"), &set).expect("a valid recipe")
}

/// Points of two spheres, the second moved along x.
fn pair() -> Pair {
    Pair::spheres(200, 200)
}

/// A learner of the small recipe with these changes, on two spheres.
fn learner(extra: &[&str]) -> Learner<B> {
    Learner::new(recipe(extra), pair(), Default::default()).expect("the spheres have all it needs")
}

/// Our method with the other geometry.
const FLOW: &str = "implicit.geometry=flow";

/// Trains in a folder until done or until `stop_after` steps; the events.
fn train(learner: &mut Learner<B>, folder: &Path, stop_after: Option<usize>) -> Vec<Event> {
    let (stop, mut events) = (AtomicBool::new(false), Vec::new());
    let mut emit = |event: Event| {
        if let Event::Tick { step } = event {
            stop.store(Some(step) == stop_after, Ordering::Relaxed);
        }
        events.push(event);
        Ok(())
    };
    learner
        .run(folder, &stop, &mut emit)
        .expect("a small run trains");
    events
}
