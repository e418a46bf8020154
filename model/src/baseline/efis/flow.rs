//! `Phi_t`, a chain of couplings, and `flow(x; s -> t) = Phi_t(Phi_s^-1(x))`.

use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::coupling::{CarriedJet, Coupling, CouplingConfig, PARAMETERS, Way};
use crate::autodiff::ModelBackend;
use crate::flow::Motion;
use crate::nets::apart;

/// Which coordinates stay in the couplings of one round: each alone, then each two.
const MASKS: [[bool; 3]; 6] = [
    [true, false, false],
    [false, true, false],
    [false, false, true],
    [true, true, false],
    [true, false, true],
    [false, true, true],
];

/// The shape of a [`CouplingFlow`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CouplingFlowConfig {
    /// Rounds of six couplings, at least 1; the source has 2.
    pub rounds: usize,
    /// Columns of both hidden layers of each network; the source has 128.
    pub width: usize,
    /// Frequency of the sines; the source has 60.
    pub omega: f64,
}

impl CouplingFlowConfig {
    /// A flow close to the identity, the same on every backend for one seed.
    ///
    /// # Panics
    /// If `rounds` is 0.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> CouplingFlow<B> {
        assert!(self.rounds > 0, "CouplingFlowConfig: rounds 0: at least 1");
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let masks = (0..self.rounds).flat_map(|_| MASKS);
        let couplings = masks.enumerate().map(|(k, stays)| {
            let config = CouplingConfig {
                stays,
                width: self.width,
                omega: self.omega,
            };
            config.init(k as u64 * PARAMETERS, rng, device)
        });
        let flow = CouplingFlow {
            couplings: couplings.collect(),
        };
        apart(flow, "CouplingFlow")
    }
}

/// An invertible map of space for each time.
#[derive(Module, Debug)]
pub struct CouplingFlow<B: Backend> {
    couplings: Vec<Coupling<B>>,
}

impl<B: ModelBackend> CouplingFlow<B> {
    /// `Phi_t(z)`.
    ///
    /// # Shapes
    /// `z`: `[n, 3]`; `t`: `[n, 1]`; result `[n, 3]`.
    pub fn forward(&self, z: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let carry = |x, coupling: &Coupling<B>| coupling.carry(x, t.clone(), Way::Forward);
        self.couplings.iter().fold(z, carry)
    }

    /// `Phi_t^-1(x)`, exact up to rounding; shapes as in [`Self::forward`].
    pub fn inverse(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let carry = |x, coupling: &Coupling<B>| coupling.carry(x, t.clone(), Way::Inverse);
        self.couplings.iter().rev().fold(x, carry)
    }

    /// `flow(x; from -> to)`, each point with times of its own; shapes as in [`Self::forward`].
    pub fn between(&self, x: Tensor<B, 2>, from: Tensor<B, 2>, to: Tensor<B, 2>) -> Tensor<B, 2> {
        self.forward(self.inverse(x, from), to)
    }

    /// [`Self::forward`] of what has derivatives already, which are carried on.
    pub fn forward_jet(&self, z: CarriedJet<B>, t: Tensor<B, 2>) -> CarriedJet<B> {
        let carry = |x, coupling: &Coupling<B>| coupling.carry_jet(x, t.clone(), Way::Forward);
        self.couplings.iter().fold(z, carry)
    }

    /// [`Self::forward_jet`] with the derivatives by `t` beside those that are there.
    pub fn forward_jet_with_rate(&self, z: CarriedJet<B>, t: Tensor<B, 2>) -> CarriedJet<B> {
        self.forward_jet(z.with_time(), t)
    }

    /// [`Self::inverse`] of what has derivatives already, which are carried on.
    pub fn inverse_jet(&self, x: CarriedJet<B>, t: Tensor<B, 2>) -> CarriedJet<B> {
        let carry = |x, coupling: &Coupling<B>| coupling.carry_jet(x, t.clone(), Way::Inverse);
        self.couplings.iter().rev().fold(x, carry)
    }

    /// Where points with the times of both ends are there: the source's at time 0, the target's at time 1.
    pub(super) fn to_both_ends(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> [Tensor<B, 2>; 2] {
        let z = self.inverse(x, t.clone());
        [0.0, 1.0].map(|end| self.forward(z.clone(), t.full_like(end)))
    }
}

impl<B: ModelBackend> Motion<B> for CouplingFlow<B> {
    fn carry(&self, x: Tensor<B, 2>, from: f64, to: f64) -> Tensor<B, 2> {
        if from == to {
            return x;
        }
        let [from, to] = [from, to].map(|time| at(&x, time));
        self.between(x, from, to)
    }

    /// `dPhi_t/dt` of what is at `x`.
    fn velocity(&self, x: Tensor<B, 2>, time: f64) -> Option<Tensor<B, 2>> {
        let t = at(&x, time);
        let z = CarriedJet::start(self.inverse(x, t.clone()));
        Some(self.forward_jet_with_rate(z, t).rate())
    }

    /// Each from where the points are in the flow's own space.
    fn path(&self, x: Tensor<B, 2>, times: &[f64]) -> Vec<Tensor<B, 2>> {
        let z = self.inverse(x.clone(), at(&x, 0.0));
        let place = |time: &f64| {
            if *time == 0.0 {
                x.clone()
            } else {
                self.forward(z.clone(), at(&x, *time))
            }
        };
        times.iter().map(place).collect()
    }
}

/// One time for all points.
fn at<B: Backend>(x: &Tensor<B, 2>, time: f64) -> Tensor<B, 2> {
    Tensor::full([x.dims()[0], 1], time, &x.device())
}
