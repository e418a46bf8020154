//! The flow's geometry through more than two key frames: one end field for each, and one velocity field through all
//! of them, whose last layer changes with time.
//!
//! A step is made between two neighbouring key frames, in a time from 0 to 1 there ([`crate::turns`]). It is the step
//! of two shapes, and costs as much whatever the number of key frames. What makes it one motion is that each function of
//! time of `V` reaches over several intervals, and the other layers of `V` over all.
//!
//! Terms are as those of splines through many key frames: matching and on-surface are means of each interval, and the
//! regularisers are integrals over time, whose unit is the mean interval ([`scaled`]).
//!
//! Where key frames are appended to a run, its end fields stay as they are, and `V` goes on from what it was. Half of the
//! steps are then made between the new key frames.

use std::io;

use burn::module::{AutodiffModule, Module};
use burn::tensor::Tensor;
use isomorph_model::flow::end_fields::{EndFields, end_field};
use isomorph_model::{
    FlowGeometry, Geometry, ImplicitNet, SequenceVelocity, SequenceVelocityConfig, TrainBackend,
};

use super::flow::{self, Made};
use super::{Method, Through, Trainee};
use crate::data::{Bounds, TrainingData};
use crate::posed::{Posed, Slopes};
use crate::recipe::{LossRecipe, Recipe};
use crate::records::{RecordError, Records};
use crate::report::{Phase, Rates};
use crate::samples::{self, Drawn};
use crate::schedule::Schedule;
use crate::settings::Settings;
use crate::tensors::rows;
use crate::turns::turn_among;
use crate::weights::{IntervalWeights, Weights};

/// The learning rates of `V` where key frames are appended, over those of its first steps: at the first rates the motion
/// between the key frames before is lost and has to be found again.
const GROWN_RATE: f64 = 0.3;

/// The end fields, the velocity field and how they are trained.
pub(super) struct EndsThroughKeys<B: TrainBackend> {
    settings: Settings,
    /// Those of each interval.
    of_intervals: Vec<Settings>,
    schedule: Schedule,
    device: B::Device,
    /// What holds all shapes and the space around them.
    bounds: Bounds,
    /// The times of the key frames, 0 to 1.
    times: Vec<f64>,
    /// One for each key frame.
    ends: Vec<Trainee<B, ImplicitNet<B>>>,
    velocity: Trainee<B, SequenceVelocity<B>>,
    /// Of the first so many key frames all is learned: those before they were more.
    known: usize,
}

/// The weights of an interval of length `h`, where the mean of all is 1, for a velocity per length of the interval:
/// `V_own(x, u) = h V(x, t)`, so that the integral over time of the square of `grad V` is that of `grad V_own` over `h`,
/// and of the square of its rate that over `h^3`.
fn scaled(loss: &LossRecipe, h: f64) -> LossRecipe {
    LossRecipe {
        strain: loss.strain / h,
        smoothness: loss.smoothness / h,
        screw: loss.screw / h.powi(3),
        ..loss.clone()
    }
}

impl<B: TrainBackend> EndsThroughKeys<B> {
    /// All networks as the recipe's seed makes them; `bounds` encloses all shapes, normalised.
    pub(super) fn new(recipe: &Recipe, bounds: &Bounds, device: &B::Device) -> Self {
        let settings = Settings::new(recipe);
        let training = &settings.training;
        let times = recipe.data.unit_times();
        let end = |k: usize| {
            let net = end_field(settings.implicit, k, training.seed, device);
            let hidden = net.hidden_weights();
            Trainee::of_field(&format!("end-{k:04}"), net, hidden, training, device)
        };
        let ends: Vec<_> = (0..times.len()).map(end).collect();
        let config = SequenceVelocityConfig {
            velocity: settings.velocity,
            times: times.clone(),
        };
        // The end fields take `seed` and those after it.
        let seed = training.seed.wrapping_add(times.len() as u64);
        let velocity = config.init(seed, device);
        let hidden = velocity.hidden_weights();
        let mean = 1.0 / (times.len() - 1) as f64;
        let of_intervals = times.windows(2).map(|ends| Settings {
            loss: scaled(&settings.loss, (ends[1] - ends[0]) / mean),
            ..settings.clone()
        });
        Self {
            of_intervals: of_intervals.collect(),
            schedule: Schedule::new(training),
            bounds: bounds.padded(training.box_margin as f32),
            velocity: Trainee::of_motion("velocity", velocity, hidden, training, device),
            device: device.clone(),
            times,
            ends,
            settings,
            known: 0,
        }
    }

    fn valid_ends(&self) -> Vec<ImplicitNet<B::InnerBackend>> {
        self.ends.iter().map(Trainee::valid).collect()
    }

    /// Points that decide how finely the flow is followed.
    fn probes(&self) -> Tensor<B::InnerBackend, 2> {
        rows(&flow::lattice(&self.bounds), &self.device)
    }

    /// The interval of a step.
    fn interval(&self, step: usize) -> usize {
        let intervals = self.times.len() - 1;
        turn_among(self.settings.training.seed, step, intervals, self.known)
    }
}

impl<B: TrainBackend> Method<B> for EndsThroughKeys<B> {
    fn phase(&self, step: usize) -> Phase {
        flow::phase(&self.schedule, step)
    }

    fn rates(&self, step: usize) -> Rates {
        let rates = flow::rates(&self.settings, &self.schedule, step);
        Rates {
            velocity: rates.velocity * if self.known > 0 { GROWN_RATE } else { 1.0 },
            ..rates
        }
    }

    fn parts(&self) -> usize {
        samples::parts(self.settings.training.batch)
    }

    fn draw(&self, data: &TrainingData, step: usize) -> Drawn {
        let data = data.interval(self.interval(step));
        flow::draw(&self.settings, self.phase(step), data, step)
    }

    fn objective(&self, data: &TrainingData, drawn: &Drawn, step: usize) -> Posed<B> {
        let s = self.interval(step);
        let [source, target] = [s, s + 1].map(|k| self.ends[k].replica());
        let ends = EndFields::beside(source.clone(), target.clone());
        let velocity = self.velocity.replica();
        let (v, still) = (velocity.interval(s), self.velocity.valid().interval(s));
        let made = Made {
            settings: &self.of_intervals[s],
            schedule: &self.schedule,
            phase: self.phase(step),
            device: &self.device,
            ends: &ends,
            v: &v,
            still: &still,
        };
        let objective = made.objective(data.interval(s), drawn, step);
        Posed::new(objective).by(source).by(target).by(velocity)
    }

    fn descend(&mut self, step: usize, slopes: &mut Slopes) {
        let clip = self.settings.training.clip;
        let (s, phase, rates) = (self.interval(step), self.phase(step), self.rates(step));
        for end in 0..2 {
            let slopes = slopes.take(end);
            // A shape that is learned does not depend on those that come after it.
            if s + end >= self.known {
                self.ends[s + end].advance(slopes, rates.implicit, clip);
            }
        }
        if phase != Phase::ImplicitOnly {
            self.velocity.advance(slopes.take(2), rates.velocity, clip);
        }
    }

    fn networks(&self) -> Vec<(&'static str, usize)> {
        let ends = self.ends.iter().map(|end| end.net.num_params()).sum();
        vec![("end fields", ends), ("V", self.velocity.net.num_params())]
    }

    fn records(&self) -> io::Result<Records> {
        let mut records = Records::default();
        for end in &self.ends {
            end.record(&mut records)?;
        }
        self.velocity.record(&mut records)?;
        Ok(records)
    }

    fn restore(&mut self, records: &Records) -> Result<(), RecordError> {
        for end in &mut self.ends {
            end.restore(records)?;
        }
        self.velocity.restore(records)
    }

    fn grow(&mut self, records: &Records, known: usize) -> Result<(), RecordError> {
        // The V of two shapes depends on time in another way.
        if known <= 2 {
            return Ok(());
        }
        for end in &mut self.ends[..known] {
            end.restore(records)?;
        }
        let config = SequenceVelocityConfig {
            velocity: self.settings.velocity,
            times: self.times[..known].to_vec(),
        };
        let form = config.init(self.settings.training.seed, &self.device);
        let before = self.velocity.loaded(form, records)?;
        let grown = SequenceVelocity::<B>::from_inner(before.valid().through(&self.times));
        // As a record: what is put in directly would not be trained.
        let form = self.velocity.net.clone();
        self.velocity.net = form.load_record(grown.into_record());
        self.spare(known);
        Ok(())
    }

    fn spare(&mut self, known: usize) {
        self.known = if known > 2 { known } else { 0 };
    }

    fn weights(&self) -> Option<Weights> {
        let (ends, velocity) = (self.valid_ends(), self.velocity.valid());
        let mut weights = Weights::default();
        for (k, end) in ends.iter().enumerate() {
            weights.add(&format!("end.{k:04}"), end);
        }
        weights.add("velocity", velocity.net());
        let between = self.times.windows(2).enumerate().map(|(s, two)| {
            let v = velocity.interval(s);
            let (functions, probes) = (*v.functions(), self.probes());
            let ends = EndFields::beside(ends[s].clone(), ends[s + 1].clone());
            IntervalWeights {
                ends: [two[0], two[1]],
                functions,
                steps: FlowGeometry::new(ends, v, probes).steps(),
            }
        });
        weights.intervals = between.collect();
        Some(weights)
    }

    fn geometry(&self) -> Option<Box<dyn Geometry<B::InnerBackend>>> {
        None
    }

    fn motion(&self) -> Option<Box<dyn isomorph_model::Motion<B::InnerBackend>>> {
        None
    }

    fn through(&self) -> Option<Through<B::InnerBackend>> {
        let ends = self.valid_ends();
        let velocity = self.velocity.valid();
        let (lattice, device) = (flow::lattice(&self.bounds), self.device.clone());
        let part = move |s: usize| {
            let ends = EndFields::beside(ends[s].clone(), ends[s + 1].clone());
            let (v, probes) = (velocity.interval(s), rows(&lattice, &device));
            let geometry: Box<dyn Geometry<B::InnerBackend>> =
                Box::new(FlowGeometry::new(ends, v.clone(), probes).eased());
            let motion: Box<dyn isomorph_model::Motion<B::InnerBackend>> = Box::new(v);
            (geometry, motion)
        };
        Some(Through {
            times: self.times.clone(),
            part: Box::new(part),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_regularisers_follow_the_length_of_an_interval() {
        let recipe = Recipe::between("a.ply", "b.ply").expect("two files");
        let loss = Settings::new(&recipe).loss;
        let long = scaled(&loss, 2.0);
        assert_eq!(long.strain, loss.strain / 2.0);
        assert_eq!(long.screw, loss.screw / 8.0);
        assert_eq!(long.divergence, loss.divergence);
        assert_eq!(long.matching, loss.matching);
        assert_eq!(scaled(&loss, 1.0), loss);
    }
}
