//! One affine coupling: some coordinates stay, and decide with the time how the others are scaled and shifted.
//!
//! ```text
//! forward   y_i = x_i exp(s_i) + u_i       inverse   x_i = (y_i - u_i) exp(-s_i)       log |det J| = sum_i s_i
//! ```
//!
//! for the coordinates `i` that move, with `s` and `u` functions of the others and of `t`. The derivatives of `s` and
//! `u` by what they read are one or two tangents and that of time. The chain rule then gives those of a whole chain of
//! couplings, so no tangent of the chain passes through a network.

use burn::module::Module;
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};
use rand_chacha::ChaCha8Rng;

use crate::autodiff::{Activation, Lanes, ModelBackend};
use crate::nets::{Mlp, MlpConfig, initial, renumbered};

/// The output layers' share of their usual initial size: the flow starts close to the identity.
const OUTPUT: f64 = 1e-3;

/// The column of the time among what the networks read.
const TIME: usize = 3;

/// Where points are, and how that depends on where and when they began.
#[derive(Clone, Debug)]
pub struct CarriedJet<B: Backend> {
    /// Positions, `[n, 3]`.
    pub value: Tensor<B, 2>,
    /// Per coordinate of the position its derivatives by the three of the start, and by the last time where that was
    /// requested: `[n, 3]` or `[n, 4]`.
    pub rows: [Tensor<B, 2>; 3],
    /// `log |det J|` of the derivatives by the start, `[n, 1]`.
    pub log_det: Tensor<B, 2>,
}

impl<B: Backend> CarriedJet<B> {
    /// Points before they move.
    pub fn start(x: Tensor<B, 2>) -> Self {
        let [n, _] = x.dims();
        let device = x.device();
        let unit = |k: usize| one_hot(n, 3, k, &device);
        Self {
            rows: [0, 1, 2].map(unit),
            log_det: Tensor::zeros([n, 1], &device),
            value: x,
        }
    }

    /// With a column of zeros for the derivatives by time: nothing has depended on it yet.
    #[must_use]
    pub(super) fn with_time(self) -> Self {
        let column = self.log_det.zeros_like();
        Self {
            rows: self
                .rows
                .map(|row| Tensor::cat(vec![row, column.clone()], 1)),
            ..self
        }
    }

    /// `J^T w`: the gradient by the start of what has the gradient `w` here, `[n, 3]`.
    pub fn pulled_back(&self, w: Tensor<B, 2>) -> Tensor<B, 2> {
        let [n, _] = w.dims();
        let part = |i: usize| {
            let own = self.rows[i].clone().slice([0..n, 0..3]);
            own * w.clone().slice([0..n, i..i + 1])
        };
        part(0) + part(1) + part(2)
    }

    /// The derivative by the last time, `[n, 3]`.
    ///
    /// # Panics
    /// If it was not requested.
    pub fn rate(&self) -> Tensor<B, 2> {
        let columns = self.rows.clone().map(|row| {
            let [n, width] = row.dims();
            assert_eq!(width, TIME + 1, "rows without a derivative by time");
            row.slice([0..n, TIME..TIME + 1])
        });
        Tensor::cat(columns.into(), 1)
    }
}

/// The shape of one coupling.
#[derive(Clone, Copy, Debug)]
pub(super) struct CouplingConfig {
    /// Which coordinates stay.
    pub stays: [bool; 3],
    /// Columns of both hidden layers.
    pub width: usize,
    /// Frequency of the sines.
    pub omega: f64,
}

/// Parameter tensors of a coupling: a weight and a bias for each of three layers of two networks.
pub(super) const PARAMETERS: u64 = 12;

impl CouplingConfig {
    /// A coupling close to the identity, its parameters numbered from `first + 1`.
    pub(super) fn init<B: ModelBackend>(
        &self,
        first: u64,
        rng: &mut ChaCha8Rng,
        device: &B::Device,
    ) -> Coupling<B> {
        let config = MlpConfig {
            inputs: TIME + 1,
            outputs: 3,
            depth: 2,
            width: self.width,
            activation: Activation::Sine { omega: self.omega },
            skip: 0,
        };
        let mut net = |first: u64| {
            let layers = initial::sine(&config, self.omega, OUTPUT, rng);
            renumbered(config.init(&layers, device), first)
        };
        Coupling {
            scale: net(first),
            shift: net(first + PARAMETERS / 2),
            stays: self.stays,
        }
    }
}

/// An affine coupling.
#[derive(Module, Debug)]
pub(super) struct Coupling<B: Backend> {
    scale: Mlp<B>,
    shift: Mlp<B>,
    #[module(skip)]
    stays: [bool; 3],
}

/// The way through a coupling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Forward,
    Inverse,
}

impl<B: ModelBackend> Coupling<B> {
    /// Where `x`, `[n, 3]`, goes at times `t`, `[n, 1]`.
    pub(super) fn carry(&self, x: Tensor<B, 2>, t: Tensor<B, 2>, way: Way) -> Tensor<B, 2> {
        let [s, u] = self.read(&x, t, &[]).map(|mut blocks| blocks.remove(0));
        match way {
            Way::Forward => x * s.exp() + u,
            Way::Inverse => (x - u) * (-s).exp(),
        }
    }

    /// The same with derivatives; those by time where the rows have a column for it.
    pub(super) fn carry_jet(&self, x: CarriedJet<B>, t: Tensor<B, 2>, way: Way) -> CarriedJet<B> {
        let by_time = x.rows[0].dims()[1] > TIME;
        let mut reads: Vec<usize> = (0..3).filter(|k| self.stays[*k]).collect();
        if by_time {
            reads.push(TIME);
        }
        let [s, u] = self.read(&x.value, t, &reads);
        let (value, factor, log_det) = match way {
            Way::Forward => {
                let factor = s[0].clone().exp();
                let value = x.value.clone() * factor.clone() + u[0].clone();
                (value, factor, x.log_det + s[0].clone().sum_dim(1))
            }
            Way::Inverse => {
                let factor = (-s[0].clone()).exp();
                let value = (x.value.clone() - u[0].clone()) * factor.clone();
                (value, factor, x.log_det - s[0].clone().sum_dim(1))
            }
        };
        // By each coordinate that stays, and by time: of x exp(s) + u, or of (x - u) exp(-s).
        let slopes = reads
            .iter()
            .zip(s.into_iter().zip(u).skip(1))
            .map(|(k, (s, u))| {
                let slope = match way {
                    Way::Forward => x.value.clone() * factor.clone() * s + u,
                    Way::Inverse => -(value.clone() * s + u * factor.clone()),
                };
                (*k, slope)
            });
        let slopes: Vec<_> = slopes.collect();
        let rows = [0, 1, 2].map(|i| {
            if self.stays[i] {
                x.rows[i].clone()
            } else {
                moved_row(i, &x.rows, &factor, &slopes)
            }
        });
        CarriedJet {
            value,
            rows,
            log_det,
        }
    }

    /// `s` and `u`, each followed by its derivatives by the columns `reads`; zero for coordinates that stay,
    /// `[n, 3]` each.
    fn read(&self, x: &Tensor<B, 2>, t: Tensor<B, 2>, reads: &[usize]) -> [Vec<Tensor<B, 2>>; 2] {
        let device = x.device();
        let mask = |value: bool| {
            let kept = self.stays.map(|stays| f32::from(u8::from(stays == value)));
            Tensor::<B, 2>::from_data(TensorData::new(kept.to_vec(), [1, 3]), &device)
        };
        let [n, _] = x.dims();
        let mut blocks = vec![Tensor::cat(vec![x.clone() * mask(true), t], 1)];
        blocks.extend(reads.iter().map(|k| one_hot(n, TIME + 1, *k, &device)));
        let input = Tensor::cat(blocks, 0);
        let moves = mask(false);
        [&self.scale, &self.shift].map(|net| {
            let swept = sweep(net, input.clone(), reads.len());
            swept
                .into_iter()
                .map(|block| block * moves.clone())
                .collect()
        })
    }
}

/// The derivatives of coordinate `i` after the coupling, from those of all coordinates before it.
fn moved_row<B: Backend>(
    i: usize,
    rows: &[Tensor<B, 2>; 3],
    factor: &Tensor<B, 2>,
    slopes: &[(usize, Tensor<B, 2>)],
) -> Tensor<B, 2> {
    let [n, width] = rows[0].dims();
    let column = |tensor: &Tensor<B, 2>| tensor.clone().slice([0..n, i..i + 1]);
    let mut row = rows[i].clone() * column(factor);
    for (k, slope) in slopes {
        row = row
            + if *k == TIME {
                column(slope) * one_hot(1, width, TIME, &factor.device())
            } else {
                rows[*k].clone() * column(slope)
            };
    }
    row
}

/// The output of a network and its tangents, of an input with its tangents stacked below it.
fn sweep<B: ModelBackend>(net: &Mlp<B>, input: Tensor<B, 2>, tangents: usize) -> Vec<Tensor<B, 2>> {
    let lanes = Lanes {
        tangents,
        laplacian: false,
    };
    let n = input.dims()[0] / lanes.blocks();
    let mut hidden = input;
    for layer in net.hidden() {
        let z = layer.linear(hidden);
        hidden = net.activation().jet(z, layer.bias.val(), lanes);
    }
    let out = net.output().linear(hidden);
    let block = |k: usize| out.clone().slice([k * n..(k + 1) * n, 0..3]);
    // The bias moves the value and no derivative.
    let value = block(0) + net.output().bias.val();
    std::iter::once(value)
        .chain((1..lanes.blocks()).map(block))
        .collect()
}

/// `[n, columns]`, 1 in column `k`.
fn one_hot<B: Backend>(n: usize, columns: usize, k: usize, device: &B::Device) -> Tensor<B, 2> {
    let row = (0..columns).map(|column| if column == k { 1.0f32 } else { 0.0 });
    let row: Vec<f32> = row.collect();
    let values = row.iter().copied().cycle().take(n * columns);
    Tensor::from_data(
        TensorData::new(values.collect::<Vec<_>>(), [n, columns]),
        device,
    )
}
