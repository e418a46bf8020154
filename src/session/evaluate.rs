//! A run held against the true frames between its two shapes.

use super::measure::{Ruler, measure};
use super::prepare;
use super::stop::StopFlag;
use super::trained::Trained;
use crate::atomic::write_atomically;
use crate::error::Result;
use crate::evaluate::{Evaluation, GroundTruth, Options, Reference, Span};
use crate::event::Event;
use crate::shape::Normalisation;

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
        let keyframes = prepare::points_only(recipe)?;
        let [source, target] = [0, 1].map(|k| &keyframes.keys[k].cloud.points);
        truth.check_ends(span, &keyframes.normalisation, source, target)?;
        let normalisation = true_frame(truth, span)?;
        let reference = Reference::new(truth, span, &normalisation, options.of_reference())?;
        let ruler = Ruler {
            reference: &reference,
            normalisation,
            resolution: options.resolution.unwrap_or(recipe.result.resolution),
            smallest_component: recipe.result.smallest_component,
            stop,
        };
        let evaluation = measure(self.learned(), &ruler, &mut on_event)?;
        let text = serde_json::to_string(&evaluation)? + "\n";
        let file = self.path().join("evaluation.json");
        write_atomically(&file, |out| out.write_all(text.as_bytes()))?;
        Ok(evaluation)
    }
}

/// The coordinates in which everything is measured: those of the true ends.
pub(super) fn true_frame(truth: &GroundTruth, span: Span) -> Result<Normalisation> {
    let (source, target) = (truth.shape(span.from()), truth.shape(span.to()));
    Ok(Normalisation::joint(&[&source, &target])?)
}
