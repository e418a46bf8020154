//! A run held against the true frames between its two shapes.

use serde::Serialize;

use super::measure::{Ruler, measure};
use super::prepare;
use super::stop::StopFlag;
use super::trained::Trained;
use crate::atomic::write_atomically;
use crate::error::{Error, Result};
use crate::evaluate::{
    Drift, Evaluation, GroundTruth, KeysEvaluation, Options, Reference, Span, mean_squared_error,
};
use crate::event::Event;
use crate::shape::{Keyframes, Normalisation};

/// How closely to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EvaluateOptions {
    /// Points sampled on each surface.
    pub samples: usize,
    /// Every n-th frame between the ends is evaluated.
    pub every: usize,
    /// Cells along the longest side of the box in which a surface is found; as in the recipe without it.
    pub resolution: Option<usize>,
}

impl Default for EvaluateOptions {
    /// The protocol's.
    fn default() -> Self {
        let Options { samples, every, .. } = Options::default();
        Self {
            samples,
            every,
            resolution: None,
        }
    }
}

impl EvaluateOptions {
    pub(super) fn of_reference(&self) -> Options {
        Options {
            samples: self.samples,
            every: self.every,
            ..Options::default()
        }
    }
}

impl Trained {
    /// Measures the run against the frames strictly between `from` and `to`, which must be those that it
    /// was trained on, and leaves the numbers of every frame in its folder, in `evaluation.json`.
    ///
    /// # Errors
    /// Of kind [`Interruption`](crate::ErrorKind::Interruption) if the stop flag was set; other frames than
    /// those of the run; an option out of range.
    pub fn evaluate(
        &self,
        truth: &GroundTruth,
        [from, to]: [usize; 2],
        options: &EvaluateOptions,
        stop: &StopFlag,
        mut on_event: impl FnMut(&Event),
    ) -> Result<Evaluation> {
        let span = truth.span(from, to)?;
        let recipe = self.recipe();
        // Only the points are looked at: what corresponds to what plays no part.
        let keyframes = prepare::points_only(recipe, &self.learned().coordinates)?;
        if keyframes.keys.len() != 2 {
            let count = keyframes.keys.len();
            return Err(Error::usage(format!(
                "the run has {count} key frames: name the frames that they are, with --keys"
            )));
        }
        let [source, target] = [0, 1].map(|k| keyframes.given_points(k));
        truth.check_ends(span, &keyframes.normalisation, &source, &target)?;
        let normalisation = true_frame(truth, span)?;
        let reference = Reference::new(truth, span, &normalisation, options.of_reference())?;
        let ruler = Ruler {
            reference: &reference,
            normalisation,
            resolution: options.resolution.unwrap_or(recipe.result.resolution),
            smallest_component: recipe.result.smallest_component,
            within: [0.0, 1.0],
            stop,
        };
        let evaluation = measure(self.learned(), &ruler, &mut on_event)?;
        self.keep(&evaluation)?;
        Ok(evaluation)
    }

    /// Measures a run through many key frames, which are the frames `keys` of the truth, against all frames between
    /// them, and leaves the numbers in its folder, in `evaluation.json`. Two key frames are many enough.
    ///
    /// # Errors
    /// Of kind [`Interruption`](crate::ErrorKind::Interruption) if the stop flag was set; other frames than those of
    /// the run; an option out of range.
    pub fn evaluate_keys(
        &self,
        truth: &GroundTruth,
        keys: &[usize],
        options: &EvaluateOptions,
        stop: &StopFlag,
        mut on_event: impl FnMut(&Event),
    ) -> Result<KeysEvaluation> {
        let recipe = self.recipe();
        let keyframes = prepare::points_only(recipe, &self.learned().coordinates)?;
        if keys.len() != keyframes.keys.len() {
            return Err(Error::usage(format!(
                "{} frames for the {} key frames of the run: give one for each",
                keys.len(),
                keyframes.keys.len()
            )));
        }
        let spans = true_spans(truth, keys, &keyframes)?;
        let shapes: Vec<_> = keys.iter().map(|key| truth.shape(*key)).collect();
        let shapes: Vec<&_> = shapes.iter().collect();
        let normalisation = Normalisation::joint(&shapes)?;
        let times: Vec<f64> = keyframes.keys.iter().map(|key| key.time).collect();
        let mut segments = Vec::with_capacity(spans.len());
        for (span, two) in spans.iter().zip(times.windows(2)) {
            // What lies before and after says when everything is where.
            let own_times = Options {
                align: false,
                ..options.of_reference()
            };
            let reference = Reference::between_keys(truth, *span, keys, &normalisation, own_times)?;
            let ruler = Ruler {
                reference: &reference,
                normalisation,
                resolution: options.resolution.unwrap_or(recipe.result.resolution),
                smallest_component: recipe.result.smallest_component,
                within: [two[0], two[1]],
                stop,
            };
            segments.push(measure(self.learned(), &ruler, &mut on_event)?);
        }
        let all = segments.iter().flat_map(|segment| segment.frames.clone());
        let evaluation = KeysEvaluation {
            keys: keys.to_vec(),
            mean: Evaluation::of(all.collect()).mean,
            drift: self.drift(truth, keys, &normalisation)?,
            segments,
        };
        self.keep(&evaluation)?;
        Ok(evaluation)
    }

    /// Leaves numbers in the run's folder.
    fn keep(&self, evaluation: &impl Serialize) -> Result<()> {
        let text = serde_json::to_string(evaluation)? + "\n";
        let file = self.path().join("evaluation.json");
        Ok(write_atomically(&file, |out| {
            out.write_all(text.as_bytes())
        })?)
    }

    /// How far vertices that are carried from the first key frame are from the true ones.
    fn drift(
        &self,
        truth: &GroundTruth,
        keys: &[usize],
        normalisation: &Normalisation,
    ) -> Result<Option<Drift>> {
        let learned = self.learned();
        if learned.motion().is_err() {
            return Ok(None);
        }
        let (first, last) = (keys[0], keys[keys.len() - 1]);
        let times = self.key_times();
        let clock = self.clock();
        // Each frame's time in the run: frames are even between two key frames.
        let mut frames = Vec::new();
        for (two, key_times) in keys.windows(2).zip(times.windows(2)) {
            for frame in two[0] + 1..=two[1] {
                let share = (frame - two[0]) as f64 / (two[1] - two[0]) as f64;
                let own = key_times[0] + share * (key_times[1] - key_times[0]);
                frames.push((frame, clock.unit(own)?));
            }
        }
        let coordinates = &learned.coordinates;
        let apply = |frame: usize, unit: f64| -> Vec<[f32; 3]> {
            let place = coordinates.at(unit);
            let vertices = truth.vertices(frame).iter();
            vertices.map(|x| place.apply(*x)).collect()
        };
        let start = apply(first, 0.0);
        let units: Vec<f64> = frames.iter().map(|(_, unit)| *unit).collect();
        let path = learned.path(&start, &units)?;
        // From the units of the run to those in which everything else is measured.
        let off = |a: &[[f32; 3]], b: &[[f32; 3]], unit: f64| {
            let scale = normalisation.scale * coordinates.at(unit).invert_length(1.0);
            scale * mean_squared_error(a, b).sqrt()
        };
        let between: Vec<f64> = (frames.iter().zip(&path))
            .filter(|((frame, _), _)| !keys.contains(frame))
            .map(|((frame, unit), carried)| off(carried, &apply(*frame, *unit), *unit))
            .collect();
        let arrived = &path[path.len() - 1];
        let back = learned.carry(arrived, 1.0, 0.0)?;
        Ok(Some(Drift {
            mean: between.iter().sum::<f64>() / between.len() as f64,
            last: off(arrived, &apply(last, 1.0), 1.0),
            there_and_back: off(&back, &start, 0.0),
        }))
    }
}

/// From each of these frames of a truth to the next, if they are the key frames of a run.
///
/// # Errors
/// Frames that are not those of the run, or that have none between them.
pub(super) fn true_spans(
    truth: &GroundTruth,
    frames: &[usize],
    keyframes: &Keyframes,
) -> Result<Vec<Span>> {
    let spans: Vec<Span> = frames
        .windows(2)
        .map(|two| truth.span(two[0], two[1]))
        .collect::<std::result::Result<_, _>>()?;
    for (k, span) in spans.iter().enumerate() {
        let [source, target] = [k, k + 1].map(|k| keyframes.given_points(k));
        truth.check_ends(*span, &keyframes.normalisation, &source, &target)?;
    }
    Ok(spans)
}

/// The coordinates in which everything is measured: those of the true ends.
pub(super) fn true_frame(truth: &GroundTruth, span: Span) -> Result<Normalisation> {
    let (source, target) = (truth.shape(span.from()), truth.shape(span.to()));
    Ok(Normalisation::joint(&[&source, &target])?)
}
