//! A device held against a processor before it trains: burn has open reports of wrong matrix products on some
//! drivers, and a run would only look slow to learn.

use std::fmt;
use std::time::Instant;

use isomorph_training::engine::Engine;
use isomorph_training::method;
use isomorph_training::probe::{Operation, Reading};
use serde::Serialize;

use super::learner::LearnerError;
use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::recipe::Recipe;

/// How far the results of an operation may lie from those of a processor: the length of the difference over the
/// length of the result. Two processors differ by at most 3e-6 (f32 with sums in another order); products of
/// numbers of 16 bits, or in TF32, by 3e-4 and more, wrong ones by about 1.
const ALLOWED: f64 = 1e-4;

/// The same of gradients, which pass through many operations.
const ALLOWED_GRADIENT: f64 = 1e-3;

/// An array of weights with less than this share of the gradient is held against the share, since what is nearly
/// nothing is all rounding.
const LEAST_SHARE: f64 = 0.01;

/// A device and what its operations gave.
#[derive(Clone, Debug, Serialize)]
pub struct SelfTest {
    /// The backend's own name.
    pub backend: String,
    /// The device's own name.
    pub device: String,
    /// The operations, in the order in which a step needs them.
    pub operations: Vec<Checked>,
    /// Wall-clock seconds that the device took, kernels compiled.
    pub seconds: f64,
}

/// An operation, and how far its result lies from that of a processor.
#[derive(Clone, Debug, Serialize)]
pub struct Checked {
    /// What was computed, with its shapes.
    pub what: String,
    /// The length of the difference over the length of the processor's result; of gradients the worst of all
    /// arrays of weights. Not finite where the result is not.
    pub off: f64,
    /// What is allowed.
    pub allowed: f64,
}

impl SelfTest {
    /// The operation that is furthest beyond what is allowed, if any is.
    pub fn wrong(&self) -> Option<&Checked> {
        let beyond = self.operations.iter().filter(|checked| checked.is_wrong());
        beyond.max_by(|a, b| a.excess().total_cmp(&b.excess()))
    }

    /// The largest deviation.
    pub fn worst(&self) -> f64 {
        let all = self.operations.iter().map(|checked| checked.off);
        all.fold(0.0, f64::max)
    }
}

impl Checked {
    /// Whether it lies further off than allowed.
    pub fn is_wrong(&self) -> bool {
        self.off.is_nan() || self.off > self.allowed
    }

    fn excess(&self) -> f64 {
        match self.off.is_nan() {
            true => f64::INFINITY,
            false => self.off / self.allowed,
        }
    }
}

/// Holds a backend's device against a processor, with the networks and points of a recipe.
///
/// # Errors
/// A backend that cannot be opened, and a build without one that runs on processors.
pub fn self_test(backend: &Backend, recipe: &Recipe) -> Result<SelfTest> {
    let engine = backend.open()?;
    let reference = reference().ok_or_else(|| {
        Error::usage(
            "self-test: this build has no backend that runs on processors to compare with; build with the feature flex",
        )
    })?;
    Ok(compare(&*engine, &*reference, recipe))
}

/// The test before the first step on a device that is no processor: a note that it passed.
///
/// # Errors
/// [`LearnerError::WrongNumbers`].
pub(super) fn before_training(
    engine: &dyn Engine,
    recipe: &Recipe,
) -> std::result::Result<Option<String>, LearnerError> {
    if engine.is_processor() || method::spline::is_solved(recipe) {
        return Ok(None);
    }
    let Some(reference) = reference() else {
        let note =
            "the device was not compared with a processor: this build has no backend for one";
        return Ok(Some(note.to_owned()));
    };
    let test = compare(engine, &*reference, recipe);
    match test.wrong() {
        Some(wrong) => Err(LearnerError::WrongNumbers {
            device: test.device.clone(),
            what: wrong.what.clone(),
            off: wrong.off,
            allowed: wrong.allowed,
        }),
        None => Ok(Some(format!(
            "{} computes what a processor does: {} operations of this run agree within {:.0e} ({:.1} s)",
            test.device,
            test.operations.len(),
            test.worst(),
            test.seconds
        ))),
    }
}

/// What devices are held against.
fn reference() -> Option<Box<dyn Engine>> {
    let processors = [Backend::Flex, Backend::Ndarray];
    processors.iter().find_map(|backend| backend.open().ok())
}

fn compare(engine: &dyn Engine, reference: &dyn Engine, recipe: &Recipe) -> SelfTest {
    let clock = Instant::now();
    let found = engine.readings(recipe);
    let seconds = clock.elapsed().as_secs_f64();
    let wanted = reference.readings(recipe);
    SelfTest {
        backend: engine.backend(),
        device: engine.device(),
        operations: found.iter().zip(&wanted).map(checked).collect(),
        seconds,
    }
}

fn checked((found, wanted): (&Reading, &Reading)) -> Checked {
    Checked {
        what: format!("{} ({})", name(wanted.operation), wanted.shape),
        off: deviation(&found.parts, &wanted.parts),
        allowed: match wanted.operation {
            Operation::Product | Operation::Activation | Operation::Sums => ALLOWED,
            Operation::GradientOfF | Operation::GradientOfV => ALLOWED_GRADIENT,
        },
    }
}

fn name(operation: Operation) -> &'static str {
    match operation {
        Operation::Product => "matrix product",
        Operation::Activation => "activation",
        Operation::Sums => "sums of columns",
        Operation::GradientOfF => "gradient of f",
        Operation::GradientOfV => "gradient of V",
    }
}

/// The worst part: the length of its difference over its own length.
fn deviation(found: &[Vec<f32>], wanted: &[Vec<f32>]) -> f64 {
    let sizes = |parts: &[Vec<f32>]| parts.iter().map(Vec::len).collect::<Vec<_>>();
    if sizes(found) != sizes(wanted) {
        return f64::NAN;
    }
    let length = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
    let own = |part: &Vec<f32>| length(&mut part.iter().map(|&v| f64::from(v)));
    let whole = length(&mut wanted.iter().map(own));
    let parts = found.iter().zip(wanted).map(|(found, wanted)| {
        let pairs = found.iter().zip(wanted);
        let off = length(&mut pairs.map(|(&a, &b)| f64::from(a) - f64::from(b)));
        off / own(wanted).max(LEAST_SHARE * whole)
    });
    // A part that is not a number makes the whole so; the maximum of two numbers passes over it.
    parts.fold(0.0, |worst: f64, off| {
        match worst.is_nan() || off.is_nan() {
            true => f64::NAN,
            false => worst.max(off),
        }
    })
}

impl fmt::Display for SelfTest {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "{} on {}: {:.1} s",
            self.device, self.backend, self.seconds
        )?;
        for checked in &self.operations {
            let verdict = match checked.is_wrong() {
                true => "WRONG",
                false => "ok",
            };
            writeln!(
                formatter,
                "  {:56} off by {:8.1e}, allowed {:.0e}: {verdict}",
                checked.what, checked.off, checked.allowed
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe() -> Recipe {
        let mut recipe = Recipe::between("a.ply", "b.ply").expect("two names");
        for key in [
            "preset=quick",
            "training.batch=64",
            "implicit.width=16",
            "velocity.width=8",
            "loss.smoothness=1",
        ] {
            recipe.with(key).expect("a key");
        }
        recipe
    }

    /// A change of readings.
    type Change = fn(&mut Vec<Reading>);

    /// An engine of a processor that claims to be a device, with readings that are changed.
    struct Device {
        inner: Box<dyn Engine>,
        change: Change,
    }

    impl Engine for Device {
        fn backend(&self) -> String {
            "a GPU".to_owned()
        }

        fn device(&self) -> String {
            "Card 9".to_owned()
        }

        fn is_processor(&self) -> bool {
            false
        }

        fn method(
            &self,
            recipe: &Recipe,
            bounds: &isomorph_training::data::Bounds,
        ) -> std::result::Result<
            Box<dyn isomorph_training::engine::Trainer>,
            isomorph_training::engine::NotHere,
        > {
            self.inner.method(recipe, bounds)
        }

        fn readings(&self, recipe: &Recipe) -> Vec<Reading> {
            let mut readings = self.inner.readings(recipe);
            (self.change)(&mut readings);
            readings
        }

        fn product_rate(&self) -> f64 {
            self.inner.product_rate()
        }
    }

    fn device(backend: Backend, change: Change) -> Device {
        Device {
            inner: backend.open().expect("it is compiled in"),
            change,
        }
    }

    #[test]
    fn two_processors_agree_in_all_operations_far_below_what_is_allowed() {
        let test = self_test(&Backend::Ndarray, &recipe()).expect("a test");
        assert!(test.wrong().is_none(), "{test}");
        let names: Vec<&str> = test.operations.iter().map(|c| c.what.as_str()).collect();
        assert_eq!(
            names,
            [
                "matrix product (64 x 16 by 16 x 16)",
                "activation (64 x 16)",
                "sums of columns (64 x 16)",
                "matrix product (64 x 8 by 8 x 8)",
                "activation (64 x 8)",
                "sums of columns (64 x 8)",
                "gradient of f (64 points, 5 layers of 16)",
                "gradient of V (64 points, 4 layers of 8)",
            ]
        );
        for checked in &test.operations {
            assert!(checked.off < 0.3 * checked.allowed, "{test}");
        }
        assert!(test.worst() > 0.0, "the readings are those of one backend");
    }

    #[test]
    fn wrong_numbers_end_training_before_its_first_step_with_a_sentence() {
        // One row of a product, one array of a gradient, one number that is none.
        let changes: [(Change, &str); 3] = [
            (
                |readings| readings[0].parts[0][..16].fill(0.0),
                "matrix product (64 x 16 by 16 x 16)",
            ),
            (
                |readings| {
                    let part = &mut readings[7].parts[2];
                    part.iter_mut().for_each(|value| *value *= 1.01);
                },
                "gradient of V (64 points, 4 layers of 8)",
            ),
            (
                |readings| readings[4].parts[0][5] = f32::NAN,
                "activation (64 x 8)",
            ),
        ];
        for (change, what) in changes {
            let error = before_training(&device(Backend::Flex, change), &recipe())
                .expect_err("a device that computes wrong numbers")
                .to_string();
            assert!(error.contains("Card 9") && error.contains(what), "{error}");
            assert!(error.contains("--backend flex"), "{error}");
        }
    }

    #[test]
    fn a_right_device_is_said_to_be_so_and_processors_and_splines_need_no_test() {
        let right = device(Backend::Ndarray, |_| ());
        let note = before_training(&right, &recipe()).expect("it is right");
        let note = note.expect("a note");
        assert!(
            note.starts_with("Card 9 computes what a processor does: 8 operations"),
            "{note}"
        );
        let mut solved = recipe();
        solved.with("preset=instant").expect("a preset");
        let wrong = device(Backend::Flex, |readings| readings[0].parts[0].fill(9.0));
        assert!(before_training(&wrong, &solved).expect("not run").is_none());
        let flex = Backend::Flex.open().expect("it is compiled in");
        assert!(
            before_training(&*flex, &recipe())
                .expect("not run")
                .is_none()
        );
    }
}
