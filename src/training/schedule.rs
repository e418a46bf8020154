//! Phases, ramps and learning rates: pure functions of the step, so that a resumed run continues on the
//! same curve.

use crate::recipe::{Schedule as Fall, TrainingRecipe};
use crate::report::Phase;

/// The first scale of the matching term over the last.
const FIRST_SCALE: f64 = 10.0;

/// The schedule of a run; all boundaries in steps.
#[derive(Clone, Debug)]
pub struct Schedule {
    steps: usize,
    guided_until: usize,
    warm_up: usize,
    ramp_until: usize,
    velocity_until: usize,
    training: TrainingRecipe,
}

impl Schedule {
    /// The recipe's shares turned into steps.
    pub fn new(training: &TrainingRecipe) -> Self {
        let steps = training.steps;
        let at = |share: f64| (share * steps as f64).round() as usize;
        Self {
            steps,
            guided_until: at(training.guided_until),
            warm_up: at(training.warm_up),
            ramp_until: at(training.ramp_until),
            velocity_until: at(training.velocity_until),
            training: training.clone(),
        }
    }

    /// The phase of a step, counted from 0.
    pub fn phase(&self, step: usize) -> Phase {
        match step {
            step if step < self.warm_up => Phase::WarmUp,
            step if step >= self.velocity_until => Phase::ImplicitOnly,
            step if step < self.ramp_until => Phase::Ramp,
            _ => Phase::Joint,
        }
    }

    /// Whether V learns in this step from a velocity field that is there already.
    pub fn is_guided(&self, step: usize) -> bool {
        step < self.guided_until
    }

    /// The share, 0 to 1, of the weights that tie `f` to `V`: 0 through the warm-up, then a linear ramp
    /// (the paper, "Warm up training"); all of it from the warm-up on where the ramp has no length.
    pub fn ramp(&self, step: usize) -> f64 {
        if step < self.warm_up {
            return 0.0;
        }
        match self.ramp_until - self.warm_up {
            0 => 1.0,
            span => ((step - self.warm_up) as f64 / span as f64).min(1.0),
        }
    }

    /// The scale beyond which the matching term lets go of a pair: from ten times the last one it falls, each
    /// step by the same factor, until the ramp ends. While it is large the term is nearly the squared
    /// distance, which has one minimum; as it shrinks what is then far off counts less and less (graduated
    /// non-convexity; Blake and Zisserman 1987). 0, which is the plain distance, stays 0.
    pub fn matching_scale(&self, last: f64, step: usize) -> f64 {
        let left = self.ramp_until.saturating_sub(step) as f64;
        last * FIRST_SCALE.powf(left / self.ramp_until.max(1) as f64)
    }

    /// The learning rate of the Implicit-Net.
    pub fn implicit_rate(&self, step: usize) -> f64 {
        self.rate(self.training.learning_rate, step, self.warm_up, self.steps)
    }

    /// The learning rate of the Velocity-Net.
    pub fn velocity_rate(&self, step: usize) -> f64 {
        self.rate(
            self.training.velocity_learning_rate,
            step,
            0,
            self.velocity_until,
        )
    }

    /// The learning rate of a network that starts at `first` and trains in steps `from .. until`.
    ///
    /// A cosine falls over that span; steps fall over the whole run
    /// (the paper's decay of 0.5 every 2000 of 10,000 steps).
    pub fn rate(&self, first: f64, step: usize, from: usize, until: usize) -> f64 {
        match self.training.schedule {
            Fall::Cosine => {
                let span = until.saturating_sub(from).max(1) as f64;
                let done = (step.saturating_sub(from) as f64 / span).min(1.0);
                let floor = self.training.final_learning_rate;
                let fall = 0.5 * (1.0 + (std::f64::consts::PI * done).cos());
                first * (floor + (1.0 - floor) * fall)
            }
            Fall::Step => {
                let every = (self.training.decay_every * self.steps as f64).max(1.0);
                first * self.training.decay.powf((step as f64 / every).floor())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipe::{Preset, Recipe};

    fn schedule(preset: Preset, changes: &[&str]) -> Schedule {
        let text =
            format!("preset = \"{preset}\"\n[data]\nsource = \"a.ply\"\ntarget = \"b.ply\"\n");
        let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
        let recipe = Recipe::parse(&text, std::path::Path::new("recipe.toml"), &changes);
        Schedule::new(&recipe.expect("a small valid recipe").training)
    }

    #[test]
    fn the_paper_preset_has_the_printed_schedule() {
        let paper = schedule(Preset::Paper, &[]);
        assert_eq!(paper.phase(1999), Phase::WarmUp);
        assert_eq!(paper.phase(2000), Phase::Ramp);
        assert_eq!(paper.phase(5000), Phase::Joint);
        assert_eq!(paper.phase(8000), Phase::ImplicitOnly);
        // Exact fractions of two: no rounding.
        assert_eq!(
            [1999, 3500, 5000, 9999].map(|step| paper.ramp(step)),
            [0.0, 0.5, 1.0, 1.0]
        );
        let steep = ["training.warm-up=0.5", "training.ramp-until=0.5"];
        let steep = schedule(Preset::Paper, &steep);
        assert_eq!([4999, 5000].map(|step| steep.ramp(step)), [0.0, 1.0]);
        let rates = [0, 1999, 2000, 9999].map(|step| paper.implicit_rate(step));
        assert_eq!(rates, [5e-3, 5e-3, 2.5e-3, 5e-3 / 16.0]);
    }

    #[test]
    fn the_guided_steps_end_where_their_share_does() {
        let half = ["training.steps=10", "training.guided-until=0.5"];
        let half = schedule(Preset::Quick, &half);
        let guided = (0..10).filter(|step| half.is_guided(*step));
        assert_eq!(guided.collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn a_cosine_falls_over_the_span_in_which_its_network_trains() {
        let quick = schedule(
            Preset::Quick,
            &[
                "training.steps=1000",
                "training.learning-rate=2e-3",
                "training.velocity-until=0.7",
            ],
        );
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a}, wanted {b}");
        close(quick.velocity_rate(0), 2e-3);
        close(quick.velocity_rate(350), 2e-3 * 0.51);
        close(quick.velocity_rate(700), 2e-3 * 0.02);
        close(quick.implicit_rate(300), 2e-3);
        close(quick.implicit_rate(1000), 2e-3 * 0.02);
        assert!((1..1000).all(|step| quick.implicit_rate(step) <= quick.implicit_rate(step - 1)));
    }

    #[test]
    fn the_scale_of_the_matching_falls_to_its_last_value_until_the_ramp_ends() {
        let quick = schedule(
            Preset::Quick,
            &["training.steps=1000", "training.ramp-until=0.5"],
        );
        let scales = [0, 250, 500, 999].map(|step| quick.matching_scale(0.1, step));
        // Halfway in ratio is halfway in steps.
        for (found, wanted) in scales.iter().zip([1.0, 0.1 * 10f64.sqrt(), 0.1, 0.1]) {
            assert!((found - wanted).abs() < 1e-12, "{scales:?}");
        }
        assert_eq!(
            quick.matching_scale(0.0, 0),
            0.0,
            "the plain distance stays it"
        );
        let at_once = schedule(
            Preset::Quick,
            &["training.ramp-until=0", "training.warm-up=0"],
        );
        assert_eq!(at_once.matching_scale(0.1, 0), 0.1);
    }
}
