//! One block `x + g(x)` of the invertible network, `g` a perceptron on the positional encoding `gamma`:
//!
//! ```text
//! g(x) = c (A_L s(… s(A_1 gamma(x) + b_1) …) + b_L),   A_k = W_k / max(1, |W_k|_S),   c = bound / Lip(gamma)
//! ```
//!
//! `s` is the ELU, `s(z) = z` for `z > 0` and `e^z - 1` below, of slope `min(1, e^z)`. The chain rule bounds
//! `Lip(g)` by `c Lip(gamma) prod |A_k|_2`. The
//! encoding's constant is known exactly: its squared derivative is `(1 + sum_j (cos^2 + sin^2)) / (2 m + 1)`,
//! so `Lip(gamma) = sqrt((m + 1) / (2 m + 1))` everywhere. And `|W|_S` is a Schatten norm, the 128-norm
//! of the singular values,
//!
//! ```text
//! |W|_S = (sum_i sigma_i^128)^(1/128) = | (W^T W)^32 |_F^(1/64),   |W|_2 <= |W|_S <= r^(1/128) |W|_2
//! ```
//!
//! taken by squaring `W^T W` five times (power iteration from every start at once; the "Gram iteration"
//! of Delattre et al. 2023). `Lip(g) <= bound` thus holds at every step and not only where a power iteration
//! has converged; there is no state to keep; the norm is smooth, and gradients pass through it. At most
//! it gives away `256^(1/128)`, 4 % per layer of width 256.
//!
//! A layer of norm 1 passes on most directions weaker than it got them, unless its singular values are alike.
//! Layers therefore start orthonormal: handles that bend a bar by 90 degrees were reached to 0.025 in as
//! many steps as left 0.040 from normal weights.

use burn::module::{Module, Param, ParamId};
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::config::{FixedPoint, NfgpConfig};
use crate::autodiff::{ModelBackend, product};
use crate::nets::encoding::{encode, encoded_width, encoding_derivatives};
use crate::nets::mlp::Dense;

/// The initial norm of the output layer: a block starts near the identity.
const INITIAL_OUTPUT: f64 = 0.01;

/// How often `W^T W` is squared.
const SQUARINGS: usize = 5;

/// Iterations of the inverse between two looks at how far the points still move, which make a device wait.
const LOOK_EVERY: usize = 4;

/// The parameters of one block.
#[derive(Module, Debug)]
pub(super) struct Block<B: Backend> {
    pub layers: Vec<Dense<B>>,
}

impl<B: ModelBackend> Block<B> {
    /// A block near the identity, its parameters numbered from `first + 1`.
    pub(super) fn init(
        config: &NfgpConfig,
        first: u64,
        rng: &mut ChaCha8Rng,
        device: &B::Device,
    ) -> Self {
        let parameter = |id: u64, values: Vec<f32>, shape: [usize; 2]| {
            let tensor = Tensor::from_data(TensorData::new(values, shape), device);
            // Numbered, so that a checkpoint depends on nothing but the seed.
            Param::initialized(ParamId::from(id), tensor.require_grad())
        };
        let layers = (0..=config.depth).map(|k| {
            let inputs = if k == 0 {
                encoded_width(config.frequencies)
            } else {
                config.width
            };
            let last = k == config.depth;
            let (outputs, norm) = if last {
                (3, INITIAL_OUTPUT)
            } else {
                (config.width, 1.0)
            };
            let id = first + 2 * k as u64;
            let weight = orthonormal(inputs, outputs, norm, rng);
            Dense {
                weight: parameter(id + 1, weight, [inputs, outputs]),
                bias: parameter(id + 2, vec![0.0; outputs], [1, outputs]),
            }
        });
        Self {
            layers: layers.collect(),
        }
    }

    /// The values of `other` under this block's own parameter numbers.
    pub(super) fn with_weights_of(&self, other: &Self) -> Self {
        let copy = |own: &Param<Tensor<B, 2>>, other: &Param<Tensor<B, 2>>| {
            Param::initialized(own.id, other.val().detach().require_grad())
        };
        let pairs = self.layers.iter().zip(&other.layers);
        let layers = pairs.map(|(own, other)| Dense {
            weight: copy(&own.weight, &other.weight),
            bias: copy(&own.bias, &other.bias),
        });
        Self {
            layers: layers.collect(),
        }
    }

    /// `g` with its layers normalised, tracked by the weights.
    pub(super) fn residual(&self, config: &NfgpConfig) -> Residual<B> {
        let m = config.frequencies as f64;
        let layers = self.layers.iter().map(|layer| {
            let weight = layer.weight.val();
            // A layer that keeps to its bound by itself is left as it is.
            let norm = spectral_bound(weight.clone()).clamp_min(1.0);
            (weight / norm, layer.bias.val())
        });
        Residual {
            layers: layers.collect(),
            frequencies: config.frequencies,
            scale: config.bound * ((2.0 * m + 1.0) / (m + 1.0)).sqrt(),
            bound: config.bound,
        }
    }
}

/// A random matrix `[rows, columns]` whose singular values are all `norm`, row-major: normal vectors along its
/// longer side, made orthonormal one after the other (Gram and Schmidt).
fn orthonormal(rows: usize, columns: usize, norm: f64, rng: &mut ChaCha8Rng) -> Vec<f32> {
    let (count, long) = (rows.min(columns), rows.max(columns));
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(count);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    while basis.len() < count {
        let mut vector: Vec<f64> = StandardNormal.sample_iter(&mut *rng).take(long).collect();
        for other in &basis {
            let along = product(&vector, other);
            let pairs = vector.iter_mut().zip(other);
            pairs.for_each(|(own, other)| *own -= along * other);
        }
        let length = product(&vector, &vector).sqrt();
        vector.iter_mut().for_each(|own| *own /= length);
        basis.push(vector);
    }
    let entry = |row: usize, column: usize| {
        let (vector, place) = if rows <= columns {
            (row, column)
        } else {
            (column, row)
        };
        (norm * basis[vector][place]) as f32
    };
    let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    places.map(|(row, column)| entry(row, column)).collect()
}

/// The ELU and its slope (Clevert et al. 2016), of ordinary operations: both can be differentiated.
fn elu_and_slope<B: Backend>(z: Tensor<B, 2>) -> (Tensor<B, 2>, Tensor<B, 2>) {
    // The exponential of nothing above 0 cannot overflow, and is the slope on both sides.
    let slope = z.clone().clamp_max(0.0).exp();
    (z.clamp_min(0.0) + slope.clone() - 1.0, slope)
}

/// `|W|_S` of a matrix of any shape, `[1, 1]`: never below its spectral norm.
///
/// `W^T W` and its squares are kept at Frobenius norm 1, which no f32 range can leave, and the norms
/// `a_j` that are divided away are put together again as `prod a_j^(1/2^j)`.
pub(super) fn spectral_bound<B: Backend>(weight: Tensor<B, 2>) -> Tensor<B, 2> {
    let [inputs, outputs] = weight.dims();
    // Both products have the same singular values other than zero: the smaller one is the cheaper.
    let (left, right) = if inputs < outputs {
        (weight.clone(), weight.transpose())
    } else {
        (weight.clone().transpose(), weight)
    };
    let mut gram = left.matmul(right);
    let mut norms = vec![frobenius(gram.clone())];
    for j in 0..SQUARINGS {
        gram = gram / norms[j].clone();
        gram = gram.clone().matmul(gram);
        norms.push(frobenius(gram.clone()));
    }
    let squared = norms
        .into_iter()
        .rev()
        .reduce(|later, own| own * later.sqrt());
    squared.expect("there is at least the norm of W^T W").sqrt()
}

/// `|A|_F`, `[1, 1]`; its gradient is finite where all is zero.
fn frobenius<B: Backend>(matrix: Tensor<B, 2>) -> Tensor<B, 2> {
    ((matrix.clone() * matrix).sum_dim(1).sum_dim(0) + 1e-30).sqrt()
}

/// `g` of one block, ready to be evaluated.
pub(super) struct Residual<B: Backend> {
    layers: Vec<(Tensor<B, 2>, Tensor<B, 2>)>,
    frequencies: usize,
    scale: f64,
    bound: f64,
}

impl<B: ModelBackend> Residual<B> {
    /// `g(x)`, `[n, 3]` to `[n, 3]`.
    pub(super) fn value(&self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        let mut h = encode(x, self.frequencies);
        let last = self.layers.len() - 1;
        for (k, (weight, bias)) in self.layers.iter().enumerate() {
            h = product(h, weight.clone()) + bias.clone();
            if k < last {
                h = elu_and_slope(h).0;
            }
        }
        h * self.scale
    }

    /// `g(x)` and its derivative along directions: `[n, 3]` and `[k n, 3]`, one direction after the other, to
    /// the same shapes.
    fn jet(&self, x: Tensor<B, 2>, lanes: Tensor<B, 2>) -> (Tensor<B, 2>, Tensor<B, 2>) {
        let (slope, _) = encoding_derivatives(x.clone(), self.frequencies);
        let mut h = encode(x, self.frequencies);
        // Every block of three columns of the encoding varies with the three coordinates. Not `repeat_dim`:
        // the backward of burn 0.21's is wrong where the repeated axis is longer than 1.
        let blocks = vec![lanes; 2 * self.frequencies + 1];
        let mut lanes = lanewise(Tensor::cat(blocks, 1), slope);
        let last = self.layers.len() - 1;
        for (k, (weight, bias)) in self.layers.iter().enumerate() {
            h = product(h, weight.clone()) + bias.clone();
            lanes = product(lanes, weight.clone());
            if k < last {
                let (value, slope) = elu_and_slope(h);
                h = value;
                lanes = lanewise(lanes, slope);
            }
        }
        (h * self.scale, lanes * self.scale)
    }

    /// The same, cut off from the graph.
    fn detached(&self) -> Self {
        let layers = self.layers.iter();
        Self {
            layers: layers
                .map(|(weight, bias)| (weight.clone().detach(), bias.clone().detach()))
                .collect(),
            ..*self
        }
    }

    /// The `x` with `x + g(x) = y`.
    fn invert(&self, y: Tensor<B, 2>, until: FixedPoint) -> Tensor<B, 2> {
        // From a step of length d on, all the later ones add up to at most d bound / (1 - bound).
        let short = until.tolerance * (1.0 - self.bound) / self.bound;
        let mut x = y.clone();
        for step in 1..=until.iterations {
            let next = y.clone() - self.value(x.clone());
            let look = step % LOOK_EVERY == 0;
            let moved = look.then(|| largest(next.clone() - x));
            x = next;
            if moved.is_some_and(|moved| moved <= short) {
                break;
            }
        }
        x
    }
}

/// Rows of `[k n, c]` times those of `[n, c]`, which repeat.
fn lanewise<B: Backend>(lanes: Tensor<B, 2>, slope: Tensor<B, 2>) -> Tensor<B, 2> {
    let ([rows, c], [n, _]) = (lanes.dims(), slope.dims());
    (lanes.reshape([rows / n, n, c]) * slope.reshape([1, n, c])).reshape([rows, c])
}

/// The length of the longest row, on the host; NaN if there is one.
pub(super) fn largest<B: Backend>(rows: Tensor<B, 2>) -> f64 {
    let squared = (rows.clone() * rows).sum_dim(1).into_data();
    let longest =
        squared.iter::<f64>().fold(
            0.0,
            |longest: f64, row| {
                if row.is_nan() { row } else { longest.max(row) }
            },
        );
    longest.sqrt()
}

/// All blocks of a deformation, ready to be evaluated.
pub(super) struct Normalised<B: Backend> {
    residuals: Vec<Residual<B>>,
}

impl<B: ModelBackend> Normalised<B> {
    pub(super) fn new(residuals: impl Iterator<Item = Residual<B>>) -> Self {
        Self {
            residuals: residuals.collect(),
        }
    }

    /// `D(x)`.
    pub(super) fn forward(&self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        let blocks = self.residuals.iter();
        blocks.fold(x, |x, residual| x.clone() + residual.value(x))
    }

    /// `D(x)` and `J w` for each of `K` directions `w`, `[n, 3]` each.
    pub(super) fn jet<const K: usize>(
        &self,
        x: Tensor<B, 2>,
        directions: [Tensor<B, 2>; K],
    ) -> (Tensor<B, 2>, [Tensor<B, 2>; K]) {
        let n = x.dims()[0];
        let start = (x, Tensor::cat(directions.into(), 0));
        let blocks = self.residuals.iter();
        let (value, lanes) = blocks.fold(start, |(x, lanes), residual| {
            let (value, pushed) = residual.jet(x.clone(), lanes.clone());
            (x + value, lanes + pushed)
        });
        let lane = |k: usize| lanes.clone().slice([k * n..(k + 1) * n, 0..3]);
        (value, std::array::from_fn(lane))
    }

    /// `D(x)` and the three columns of `J`, `[n, 3]` each.
    pub(super) fn jet_by_axes(&self, x: Tensor<B, 2>) -> (Tensor<B, 2>, [Tensor<B, 2>; 3]) {
        let [n, _] = x.dims();
        let axis = |k: usize| {
            let mut unit = [0.0; 3];
            unit[k] = 1.0;
            // `repeat_dim`, whose backward is wrong in burn 0.21, does no harm to constants.
            Tensor::<B, 1>::from_floats(unit, &x.device())
                .reshape([1, 3])
                .repeat_dim(0, n)
        };
        let axes = std::array::from_fn(axis);
        self.jet(x, axes)
    }

    /// `D^-1(y)`, untracked.
    pub(super) fn inverse(&self, y: Tensor<B, 2>, until: FixedPoint) -> Tensor<B, 2> {
        let blocks = self.residuals.iter().rev();
        blocks.fold(y.detach(), |y, residual| {
            residual.detached().invert(y, until)
        })
    }
}
