//! The velocity through many key frames: a Velocity-Net whose last layer changes with time,
//!
//! ```text
//! V(x, t) = sum_k B_k(t) V_k(x)
//! ```
//!
//! Its outputs are velocities per mean interval, so that they are as large as those between two shapes whatever the number
//! of key frames. `B_k` are the quadratic B-splines in time whose breaks are the key frames, `V_k` the outputs of one perceptron. So
//! `V` and its rate are continuous at every key frame, and the number of functions of time grows with that of the key
//! frames. From one key frame to the next three of them act. What a step of training costs there depends on no other:
//! [`SequenceVelocity::interval`].

use burn::module::{Module, Param, ParamId};
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use isomorph_spline::quadratics;

use super::velocity_net::{VelocityNet, VelocityNetConfig};
use crate::autodiff::ModelBackend;
use crate::nets::mlp::Dense;

/// Functions of time that act between two key frames.
const ACTING: usize = 3;

/// The shape of a [`SequenceVelocity`].
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceVelocityConfig {
    /// The network. It depends on time through its last layer, whatever `time_dependent` says.
    pub velocity: VelocityNetConfig,
    /// The times of the key frames, ascending, at least two.
    pub times: Vec<f64>,
}

impl SequenceVelocityConfig {
    /// A network close to zero, the same on every backend for one seed.
    ///
    /// # Panics
    /// If there are fewer than two times, or they do not ascend.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> SequenceVelocity<B> {
        let ascend = self.times.windows(2).all(|two| two[0] < two[1]);
        assert!(
            self.times.len() >= 2 && ascend,
            "two times or more, ascending"
        );
        let velocity = VelocityNetConfig {
            time_dependent: false,
            ..self.velocity
        };
        let functions = self.times.len() + 1;
        SequenceVelocity {
            net: velocity.init_with(3 * functions, seed, device),
            times: self.times.clone(),
        }
    }
}

/// `V(x, t)` through many key frames.
#[derive(Module, Debug)]
pub struct SequenceVelocity<B: Backend> {
    /// All `V_k` side by side.
    net: VelocityNet<B>,
    #[module(skip)]
    times: Vec<f64>,
}

/// The part of it between two key frames, over a time from 0 to 1: the velocity per length of the interval.
#[derive(Clone, Debug)]
pub struct IntervalVelocity<B: Backend> {
    /// The three `V_k` that act, side by side.
    pub(crate) net: VelocityNet<B>,
    /// Each function of time as `a + b t + c t^2`.
    functions: [[f64; 3]; ACTING],
}

/// The network with what `of` makes of weights and biases of its output layer, one column for each output.
fn with_output<B: ModelBackend>(
    net: &VelocityNet<B>,
    of: impl Fn(Tensor<B, 2>) -> Tensor<B, 2>,
) -> VelocityNet<B> {
    let mut net = net.clone();
    let output = net.mlp.output();
    let made = |param: &Param<Tensor<B, 2>>| Param::initialized(param.id, of(param.val()));
    let output = Dense {
        weight: made(&output.weight),
        bias: made(&output.bias),
    };
    net.mlp.put_output(output);
    net
}

impl<B: ModelBackend> SequenceVelocity<B> {
    /// The times of the key frames.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The network of all `V_k` side by side.
    pub fn net(&self) -> &VelocityNet<B> {
        &self.net
    }

    /// The weight matrices between two hidden layers.
    pub fn hidden_weights(&self) -> Vec<ParamId> {
        self.net.hidden_weights()
    }

    /// The part from key frame `s` to the next. Gradients of what is made of it reach this network.
    ///
    /// # Panics
    /// If there is no such interval.
    pub fn interval(&self, s: usize) -> IntervalVelocity<B> {
        let columns = 3 * s..3 * (s + ACTING);
        IntervalVelocity {
            net: with_output(&self.net, |all| {
                let rows = all.dims()[0];
                all.slice([0..rows, columns.clone()])
            }),
            functions: quadratics(&self.times, s),
        }
    }

    /// This velocity through further key frames: up to the last of its own nothing changes, and beyond them `V` comes to
    /// rest. `times` are those of all key frames; the first ones are this velocity's own, in any unit and from any
    /// beginning.
    ///
    /// # Panics
    /// If there are fewer times than this velocity has.
    #[must_use]
    pub fn through(&self, times: &[f64]) -> Self {
        let last = self.times.len() - 2;
        let further = times.len() - self.times.len();
        let [before, after] = [&self.times[..], times].map(|times| quadratics(times, last));
        // Another mean interval is another unit. The last function bends as far as it did between these two.
        let (unit, bend) = (before[0][0] / after[0][0], before[2][2] / after[2][2]);
        let net = with_output(&self.net, |all| {
            let [rows, columns] = all.dims();
            let own = all.clone() * unit;
            let [second, third] = [columns - 6, columns - 3];
            let part = |of: &Tensor<B, 2>, from: usize| of.clone().slice([0..rows, from..from + 3]);
            let bent = (part(&all, third) - part(&all, second)) * bend;
            let kept = own.clone().slice([0..rows, 0..third]);
            let rest = Tensor::zeros([rows, 3 * further], &all.device());
            Tensor::cat(vec![kept, part(&own, second) + bent, rest], 1)
        });
        Self {
            net,
            times: times.to_vec(),
        }
    }
}

impl<B: ModelBackend> IntervalVelocity<B> {
    /// The functions of time that act, as `a + b t + c t^2` with `t` from 0 to 1: those of the outputs of this interval's
    /// number and of the two after it.
    pub fn functions(&self) -> &[[f64; 3]; ACTING] {
        &self.functions
    }

    /// `V(x, t)`.
    ///
    /// # Shapes
    /// `x`: `[n, 3]`, normalised; `t`: `[n, 1]`, from 0 to 1 within the interval; result `[n, 3]`, normalised
    /// units per length of the interval.
    pub fn forward(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let unused = t.clone();
        self.at_time(&self.net.forward(x, unused), &t)
    }

    /// The sum over the functions of time, `[n, 9]` to `[n, 3]`; `t`: `[n, 1]`.
    pub(crate) fn at_time(&self, outputs: &Tensor<B, 2>, t: &Tensor<B, 2>) -> Tensor<B, 2> {
        self.sum(outputs, |[a, b, c]| (t.clone() * c + b) * t.clone() + a)
    }

    /// The same with the derivatives of these functions.
    pub(crate) fn at_rate(&self, outputs: &Tensor<B, 2>, t: &Tensor<B, 2>) -> Tensor<B, 2> {
        self.sum(outputs, |[_, b, c]| t.clone() * (2.0 * c) + b)
    }

    /// A vector for each of the functions, `[n, 3]` to `[n, 9]`: the transpose of [`Self::at_time`].
    pub(crate) fn spread(&self, w: &Tensor<B, 2>, t: &Tensor<B, 2>) -> Tensor<B, 2> {
        let each = |[a, b, c]: [f64; 3]| w.clone() * ((t.clone() * c + b) * t.clone() + a);
        Tensor::cat(self.functions.map(each).to_vec(), 1)
    }

    fn sum(
        &self,
        outputs: &Tensor<B, 2>,
        weight: impl Fn([f64; 3]) -> Tensor<B, 2>,
    ) -> Tensor<B, 2> {
        let [n, _] = outputs.dims();
        let part = |k: usize| {
            let of = outputs.clone().slice([0..n, 3 * k..3 * k + 3]);
            of * weight(self.functions[k])
        };
        part(0) + part(1) + part(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::autodiff::Activation;
    use crate::objective::Objective;
    use crate::operators::{Derivatives, Operators, VelocityJet, VelocityRequest};
    use crate::testing::learning::check_gradients;
    use crate::testing::{Plain, Train, assert_close, column, host, points, shaken};

    const POINTS: [[f64; 3]; 3] = [[0.1, -0.3, 0.25], [-0.42, 0.05, 0.31], [0.2, 0.4, -0.15]];
    const FULL: VelocityRequest = VelocityRequest {
        laplacian: true,
        rate: true,
    };

    fn net<B: ModelBackend>(times: &[f64], frequencies: usize, skip: usize) -> SequenceVelocity<B> {
        let config = SequenceVelocityConfig {
            velocity: VelocityNetConfig {
                depth: 3,
                width: 12,
                activation: Activation::Sine { omega: 2.0 },
                frequencies,
                skip,
                // Not read.
                time_dependent: true,
            },
            times: times.to_vec(),
        };
        shaken(config.init(5, &Default::default()), 0.3)
    }

    fn jet(velocity: &IntervalVelocity<Plain>, t: f64) -> VelocityJet<Plain> {
        Derivatives::Forward.velocity_jet(velocity, points(&POINTS), column(&[t; 3]), FULL)
    }

    /// The network whose last layer is what it is at a time, or the rate of that.
    fn frozen(velocity: &IntervalVelocity<Plain>, weights: [f64; ACTING]) -> VelocityNet<Plain> {
        with_output(&velocity.net, |all| {
            let rows = all.dims()[0];
            let part = |k: usize| all.clone().slice([0..rows, 3 * k..3 * k + 3]) * weights[k];
            part(0) + part(1) + part(2)
        })
    }

    #[test]
    fn at_each_time_it_is_the_network_with_the_last_layer_of_that_time() {
        for (frequencies, skip) in [(0, 0), (2, 1)] {
            let velocity = net(&[0.0, 0.2, 0.5, 1.0], frequencies, skip).interval(1);
            for t in [0.0, 0.3, 1.0] {
                let label = format!("{frequencies} {skip} {t}");
                let found = jet(&velocity, t);
                let at = frozen(
                    &velocity,
                    velocity.functions.map(|[a, b, c]| a + t * (b + t * c)),
                );
                let (x, times) = (points::<Plain>(&POINTS), column(&[t; 3]));
                let ways = [Derivatives::Forward, Derivatives::Nested];
                let wanted = ways.map(|way| way.velocity_jet(&at, x.clone(), times.clone(), FULL));
                for wanted in wanted {
                    let close = |a, b| assert_close(a, b, 2e-5, &label);
                    close(host(found.value.clone()), host(wanted.value));
                    close(host(found.jacobian.clone()), host(wanted.jacobian));
                    let [own, other] = [&found.laplacian, &wanted.laplacian].map(Option::clone);
                    close(host(own.expect("asked for")), host(other.expect("too")));
                }
                let rate = frozen(
                    &velocity,
                    velocity.functions.map(|[_, b, c]| b + 2.0 * t * c),
                );
                let wanted = host(rate.forward(x.clone(), times.clone()));
                let own = found.rate.expect("asked for");
                assert_close(host(own), wanted, 2e-5, &label);
                let w = points(&[[0.3, -1.0, 0.5], [1.0, 0.0, 0.0], [0.0, 0.2, -0.4]]);
                let way = Derivatives::Forward;
                let own = way.pulled_back(&velocity, x.clone(), times.clone(), w.clone());
                let wanted = way.pulled_back(&at, x.clone(), times.clone(), w);
                assert_close(host(own.0), host(wanted.0), 2e-5, &label);
                assert_close(host(own.1), host(wanted.1), 2e-5, &label);
                let forward = velocity.forward(x, times);
                assert_close(host(forward), host(found.value), 2e-5, &label);
            }
        }
    }

    #[test]
    fn it_and_its_rate_are_continuous_at_key_frames() {
        let times = [0.0, 0.2, 0.5, 1.0];
        let net = net::<Plain>(&times, 0, 0);
        for s in 0..2 {
            let length = |s: usize| times[s + 1] - times[s];
            let in_time = |s: usize, t: f64| {
                let jet = jet(&net.interval(s), t);
                let rate = jet.rate.expect("asked for") / length(s).powi(2);
                (host(jet.value / length(s)), host(rate))
            };
            let (before, after) = (in_time(s, 1.0), in_time(s + 1, 0.0));
            assert!(before.0.iter().any(|v| v.abs() > 0.05), "{before:?}");
            assert_close(before.0, after.0, 1e-4, "V");
            assert_close(before.1, after.1, 1e-3, "its rate");
        }
    }

    #[test]
    fn through_further_key_frames_it_is_the_same_up_to_its_last_one() {
        let times = [0.0, 0.2, 0.5, 1.0];
        let net = net::<Plain>(&times, 0, 0);
        // In another unit, from another beginning.
        let grown = net.through(&[10.0, 12.0, 15.0, 20.0, 21.0, 29.0]);
        for s in 0..3 {
            for t in [0.0, 0.3, 1.0] {
                let [own, other] = [&net, &grown].map(|net| host(jet(&net.interval(s), t).value));
                assert!(own.iter().any(|v| v.abs() > 0.02), "{own:?}");
                assert_close(other, own, 1e-5, &format!("{s} {t}"));
            }
        }
        let rests = host(jet(&grown.interval(4), 1.0).value);
        assert_close(rests, vec![0.0; 9], 1e-12, "at the end");
        assert_eq!(grown.times().len(), 6);
    }

    #[test]
    fn functions_that_are_equal_are_a_velocity_that_is_constant_in_time() {
        // The functions sum up to the length of the interval over the mean one.
        let times = [0.0, 0.2, 0.5, 1.0];
        for s in 0..3 {
            let functions = net::<Plain>(&times, 0, 0).interval(s).functions;
            for t in [0.0, 0.4, 1.0] {
                let sum: f64 = functions.iter().map(|[a, b, c]| a + t * (b + t * c)).sum();
                assert!((sum - 3.0 * (times[s + 1] - times[s])).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn gradients_of_an_interval_reach_the_weights_of_all_layers() {
        // Two key frames: all functions act.
        check_gradients(&net::<Train>(&[0.0, 1.0], 0, 0), |net| {
            let t = column(&[0.1, 0.5, 0.9]);
            let way = Derivatives::Forward;
            let jet = way.velocity_jet(&net.interval(0), points(&POINTS), t, FULL);
            let mut objective = Objective::new();
            objective.add("value", 1.0, || jet.value.square().mean());
            objective.add("jacobian", 1.0, || jet.jacobian.square().mean());
            let rate = jet.rate.expect("asked for");
            objective.add("rate", 1.0, || rate.square().mean());
            objective
        });
    }

    #[test]
    #[should_panic(expected = "ascending")]
    fn times_that_do_not_ascend_are_refused() {
        net::<Plain>(&[0.0, 0.5, 0.5], 0, 0);
    }
}
