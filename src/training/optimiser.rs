//! Adam for one network, with the gradient's norm limited over all of its weights together.

use burn::module::{AutodiffModule, ModuleVisitor, Param};
use burn::optim::adaptor::OptimizerAdaptor;
use burn::optim::{Adam, AdamConfig, GradientsAccumulator, GradientsParams, Optimizer};
use burn::tensor::Tensor;
use burn::tensor::backend::AutodiffBackend;
use isomorph_model::TrainBackend;

/// Adam's state for a network `M`.
pub(crate) type AdamOf<M, B> = OptimizerAdaptor<Adam, M, B>;

/// A new optimiser: Adam with betas 0.9 and 0.999 and epsilon 1e-8 (Kingma and Ba 2015).
pub(crate) fn adam<B: TrainBackend, M: AutodiffModule<B>>() -> AdamOf<M, B> {
    AdamConfig::new().with_epsilon(1e-8).init()
}

/// One step of the optimiser against the sum of the gradients of a batch's parts, which is scaled down to
/// the norm `clip` where it is longer.
///
/// `clip = 0` never scales. The norm stays on the device: nothing is read back.
///
/// A weight that no term of the step depends on has no gradient and stays as it is.
pub(crate) fn advance<B: TrainBackend, M: AutodiffModule<B>>(
    optimiser: &mut AdamOf<M, B>,
    net: M,
    parts: Vec<GradientsParams>,
    rate: f64,
    clip: f64,
) -> M {
    let mut sum = GradientsAccumulator::new();
    for part in parts {
        sum.accumulate(&net, part);
    }
    let mut params = sum.grads();
    if clip > 0.0 {
        let mut squares = Squares {
            gradients: &params,
            sum: None,
        };
        net.visit(&mut squares);
        if let Some(sum) = squares.sum {
            let factor = (sum.sqrt() + 1e-12).recip().mul_scalar(clip).clamp_max(1.0);
            let mut scaled = Scaled {
                gradients: &mut params,
                factor,
            };
            net.visit(&mut scaled);
        }
    }
    optimiser.step(rate, net, params)
}

/// The squared norm of all gradients.
struct Squares<'a, B: AutodiffBackend> {
    gradients: &'a GradientsParams,
    sum: Option<Tensor<B::InnerBackend, 1>>,
}

impl<B: AutodiffBackend> ModuleVisitor<B> for Squares<'_, B> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<B, D>>) {
        if let Some(gradient) = self.gradients.get::<B::InnerBackend, D>(param.id) {
            let square = (gradient.clone() * gradient).sum();
            self.sum = Some(match self.sum.take() {
                None => square,
                Some(sum) => sum + square,
            });
        }
    }
}

/// Multiplies all gradients by one factor, `[1]`.
struct Scaled<'a, B: AutodiffBackend> {
    gradients: &'a mut GradientsParams,
    factor: Tensor<B::InnerBackend, 1>,
}

impl<B: AutodiffBackend> ModuleVisitor<B> for Scaled<'_, B> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<B, D>>) {
        if let Some(gradient) = self.gradients.remove::<B::InnerBackend, D>(param.id) {
            let factor = self.factor.clone().unsqueeze::<D>();
            self.gradients
                .register::<B::InnerBackend, D>(param.id, gradient * factor);
        }
    }
}
