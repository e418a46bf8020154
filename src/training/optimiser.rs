//! What moves the weights of one network: Adam, or Muon and Adam, with the gradient's norm limited over all
//! of its weights together.
//!
//! Muon (Jordan et al. 2024, <https://kellerjordan.github.io/posts/muon/>) moves a matrix by the orthogonal
//! matrix nearest to its momentum: if `U S V^T` is the singular value decomposition of the momentum, by
//! about `U V^T`, which five steps of a Newton-Schulz iteration give. All directions of the matrix are
//! then learned equally fast. It is for matrices between hidden layers; Adam moves the others, and the biases.

use burn::module::{AutodiffModule, ModuleVisitor, Param, ParamId};
use burn::optim::adaptor::OptimizerAdaptor;
use burn::optim::{
    Adam, AdamConfig, AdjustLrFn, GradientsAccumulator, GradientsParams, Muon, MuonConfig,
    Optimizer,
};
use burn::tensor::Tensor;
use burn::tensor::backend::AutodiffBackend;
use isomorph_model::TrainBackend;

use crate::records::{RecordError, Records};

/// Adam's state for a network `M`.
type AdamOf<M, B> = OptimizerAdaptor<Adam, M, B>;

/// Muon's state for a network `M`.
type MuonOf<M, B> = OptimizerAdaptor<Muon<<B as AutodiffBackend>::InnerBackend>, M, B>;

/// The optimiser of a network `M`.
pub(crate) struct Optimiser<B: TrainBackend, M: AutodiffModule<B>> {
    adam: AdamOf<M, B>,
    muon: Option<ForHidden<B, M>>,
}

/// Muon for some of the matrices.
struct ForHidden<B: TrainBackend, M: AutodiffModule<B>> {
    muon: MuonOf<M, B>,
    hidden: Vec<ParamId>,
    /// Its learning rate over that of Adam.
    ratio: f64,
}

impl<B: TrainBackend, M: AutodiffModule<B>> Optimiser<B, M> {
    /// Adam with betas 0.9 and 0.999 and epsilon 1e-8 (Kingma and Ba 2015).
    pub(crate) fn adam() -> Self {
        Self {
            adam: fresh_adam(),
            muon: None,
        }
    }

    /// Muon with momentum 0.95 for the matrices `hidden`, Adam for the rest. `ratio` is Muon's learning
    /// rate over Adam's. A step of Muon has a root mean square of about 0.2 of its learning rate, as Adam's
    /// has in practice (Liu et al. 2025, "Muon is scalable for LLM training", Section 2.2).
    pub(crate) fn muon(hidden: Vec<ParamId>, ratio: f64) -> Self {
        Self {
            muon: Some(ForHidden {
                muon: fresh_muon(),
                hidden,
                ratio,
            }),
            ..Self::adam()
        }
    }

    /// One step against the sum of the gradients of a batch's parts, which is scaled down to the norm
    /// `clip` where it is longer. `rate` is the learning rate of Adam.
    ///
    /// `clip = 0` never scales. The norm stays on the device: nothing is read back.
    ///
    /// A weight that no term of the step depends on has no gradient and stays as it is.
    pub(crate) fn advance(
        &mut self,
        net: M,
        parts: Vec<GradientsParams>,
        rate: f64,
        clip: f64,
    ) -> M {
        let mut gradients = limited::<B, M>(&net, parts, clip);
        let net = match &mut self.muon {
            Some(hidden) => hidden.advance(net, &mut gradients, rate),
            None => net,
        };
        self.adam.step(rate, net, gradients)
    }

    /// Adds the states under the name of the network.
    pub(crate) fn record(&self, name: &str, records: &mut Records) -> std::io::Result<()> {
        records.push::<B>(adam_file(name), self.adam.to_record())?;
        match &self.muon {
            Some(hidden) => records.push::<B>(muon_file(name), hidden.muon.to_record()),
            None => Ok(()),
        }
    }

    /// Takes the states of a network of this name; `net` is the name of its record.
    pub(crate) fn restore(
        &mut self,
        name: &str,
        net: &str,
        records: &Records,
        device: &B::Device,
    ) -> Result<(), RecordError> {
        let adam = records.states::<B, _>(&adam_file(name), net, device)?;
        self.adam = fresh_adam::<B, M>().load_record(adam);
        if let Some(hidden) = &mut self.muon {
            let muon = records.states::<B, _>(&muon_file(name), net, device)?;
            hidden.muon = fresh_muon::<B, M>().load_record(muon);
        }
        Ok(())
    }
}

impl<B: TrainBackend, M: AutodiffModule<B>> ForHidden<B, M> {
    /// Moves the hidden matrices, and takes their gradients away.
    fn advance(&mut self, net: M, gradients: &mut GradientsParams, rate: f64) -> M {
        let mut own = GradientsParams::new();
        for id in &self.hidden {
            if let Some(gradient) = gradients.remove::<B::InnerBackend, 2>(*id) {
                own.register::<B::InnerBackend, 2>(*id, gradient);
            }
        }
        self.muon.step(self.ratio * rate, net, own)
    }
}

fn fresh_adam<B: TrainBackend, M: AutodiffModule<B>>() -> AdamOf<M, B> {
    AdamConfig::new().with_epsilon(1e-8).init()
}

fn fresh_muon<B: TrainBackend, M: AutodiffModule<B>>() -> MuonOf<M, B> {
    MuonConfig::new()
        .with_adjust_lr_fn(AdjustLrFn::MatchRmsAdamW)
        .init()
}

fn adam_file(name: &str) -> String {
    format!("{name}-optimiser.mpk")
}

fn muon_file(name: &str) -> String {
    format!("{name}-muon-optimiser.mpk")
}

/// The sum of the parts' gradients, scaled down to the norm `clip` where it is longer and `clip` is not 0.
fn limited<B: TrainBackend, M: AutodiffModule<B>>(
    net: &M,
    parts: Vec<GradientsParams>,
    clip: f64,
) -> GradientsParams {
    let mut sum = GradientsAccumulator::new();
    for part in parts {
        sum.accumulate(net, part);
    }
    let mut gradients = sum.grads();
    if clip == 0.0 {
        return gradients;
    }
    let mut squares = Squares {
        gradients: &gradients,
        sum: None,
    };
    net.visit(&mut squares);
    if let Some(sum) = squares.sum {
        let factor = (sum.sqrt() + 1e-12).recip().mul_scalar(clip).clamp_max(1.0);
        let mut scaled = Scaled {
            gradients: &mut gradients,
            factor,
        };
        net.visit(&mut scaled);
    }
    gradients
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
