//! Initial weights, drawn on the host from a seed so that every backend starts from the same ones.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Uniform};

use super::mlp::{HostLayer, MlpConfig};
use crate::linear::{Until, conjugate_gradient};

/// Normal weights of standard deviation `sqrt(2 / inputs)` and zero biases (He et al. 2015), the
/// output layer scaled by `output_scale`.
pub(crate) fn he(config: &MlpConfig, output_scale: f64, rng: &mut ChaCha8Rng) -> Vec<HostLayer> {
    let depth = config.depth;
    let layers = config.layer_sizes().into_iter().enumerate();
    layers
        .map(|(k, (inputs, outputs))| {
            let scale = if k == depth { output_scale } else { 1.0 };
            let deviation = (2.0 / inputs as f64).sqrt() * scale;
            layer(
                inputs,
                outputs,
                normal(0.0, deviation, inputs * outputs, rng),
            )
        })
        .collect()
}

/// The sine networks' scheme (Sitzmann et al. 2020): uniform in `1 / inputs` in the first layer and
/// `sqrt(6 / inputs) / omega` later, the output layer scaled by `output_scale`.
pub(crate) fn sine(
    config: &MlpConfig,
    omega: f64,
    output_scale: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<HostLayer> {
    let depth = config.depth;
    let layers = config.layer_sizes().into_iter().enumerate();
    layers
        .map(|(k, (inputs, outputs))| {
            let later = (6.0 / inputs as f64).sqrt() / omega;
            // The first layer spreads angles over a few periods; later ones keep the spread of their inputs.
            let limit = match k {
                0 => 1.0 / inputs as f64,
                k if k == depth => later * output_scale,
                _ => later,
            };
            let mut made = layer(inputs, outputs, uniform(limit, inputs * outputs, rng));
            if k < depth {
                made.bias = uniform(1.0 / (inputs as f64).sqrt(), outputs, rng);
            }
            made
        })
        .collect()
}

/// Weights of a softplus network that make its output close to `|x| - radius` (Gropp et al. 2020):
/// hidden layers normal with standard deviation `sqrt(2 / outputs)`, the output layer constant.
///
/// Only the columns that hold `x` itself, the first three of the input, have weights, scaled by
/// `1 / encoding_scale`; those of the encoding's waves and of time start at zero.
pub(crate) fn sphere(
    config: &MlpConfig,
    encoding_scale: f64,
    radius: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<HostLayer> {
    let depth = config.depth;
    let layers = config.layer_sizes().into_iter().enumerate();
    layers
        .map(|(k, (inputs, outputs))| {
            if k == depth {
                let mean = (std::f64::consts::PI / inputs as f64).sqrt();
                let mut made = layer(inputs, outputs, normal(mean, 1e-5, inputs * outputs, rng));
                made.bias.fill(-radius as f32);
                return made;
            }
            let deviation = (2.0 / outputs as f64).sqrt();
            let mut weight = normal(0.0, deviation, inputs * outputs, rng);
            // The rows of the network's input: all of them in the first layer, the last at a skip.
            let first = if k == 0 { 0 } else { config.width };
            for (row, values) in weight.chunks_mut(outputs).enumerate().skip(first) {
                // A wave or a time with a weight of its own would bend the sphere from the start.
                let factor = if row < first + 3 {
                    1.0 / encoding_scale
                } else {
                    0.0
                };
                values.iter_mut().for_each(|value| *value *= factor as f32);
            }
            layer(inputs, outputs, weight)
        })
        .collect()
}

/// The change of an output layer's weights, then its bias, that brings its values closer by `missing`:
/// least squares over the rows of `hidden` (`[n, width]`, row-major), regularised towards no change.
pub(crate) fn ridge(hidden: &[f64], missing: &[f64]) -> Vec<f64> {
    let (n, width) = (missing.len(), hidden.len() / missing.len());
    let columns = width + 1;
    let row = |k: usize| {
        hidden[k * width..(k + 1) * width]
            .iter()
            .copied()
            .chain([1.0])
    };
    let mut matrix = vec![0.0; columns * columns];
    let mut right = vec![0.0; columns];
    for (k, wanted) in missing.iter().enumerate() {
        let features: Vec<f64> = row(k).collect();
        for (i, feature) in features.iter().enumerate() {
            right[i] += feature * wanted / n as f64;
            let line = &mut matrix[i * columns..(i + 1) * columns];
            line.iter_mut()
                .zip(&features)
                .for_each(|(m, other)| *m += feature * other / n as f64);
        }
    }
    // Features of neighbouring units are nearly alike, and without the ridge their weights could grow without
    // bound.
    let trace: f64 = (0..columns).map(|i| matrix[i * columns + i]).sum();
    (0..columns).for_each(|i| matrix[i * columns + i] += RIDGE * trace / columns as f64);
    let apply = |x: &[f64], image: &mut [f64]| {
        for (image, row) in image.iter_mut().zip(matrix.chunks(columns)) {
            *image = row.iter().zip(x).map(|(a, x)| a * x).sum();
        }
    };
    let until = Until {
        steps: 4 * columns,
        tolerance: RESIDUAL,
    };
    let mut change = vec![0.0; columns];
    conjugate_gradient(apply, &right, None, &mut change, until);
    change
}

/// The share of the mean diagonal that regularises [`ridge`]: below what f32 features resolve.
const RIDGE: f64 = 1e-6;

/// The share of the right-hand side that [`ridge`] leaves.
const RESIDUAL: f64 = 1e-10;

fn layer(inputs: usize, outputs: usize, weight: Vec<f32>) -> HostLayer {
    HostLayer {
        inputs,
        outputs,
        weight,
        bias: vec![0.0; outputs],
    }
}

fn normal(mean: f64, deviation: f64, count: usize, rng: &mut ChaCha8Rng) -> Vec<f32> {
    let normal = Normal::new(mean, deviation).expect("the deviation is finite and not negative");
    normal
        .sample_iter(rng)
        .take(count)
        .map(|value| value as f32)
        .collect()
}

fn uniform(limit: f64, count: usize, rng: &mut ChaCha8Rng) -> Vec<f32> {
    let uniform = Uniform::new_inclusive(-limit, limit).expect("the limit is finite, above 0");
    uniform
        .sample_iter(rng)
        .take(count)
        .map(|value| value as f32)
        .collect()
}
