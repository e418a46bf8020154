//! All that may be `V`: a network, its part between two of many key frames, or a spline.

use burn::tensor::Tensor;

use super::{Derivatives, VelocityJet, VelocityRequest, forward, nested, reverse};
use crate::autodiff::ModelBackend;
use crate::nets::{IntervalVelocity, VelocityNet};

/// A velocity field `V(x, t)` with its derivatives by the inputs.
///
/// All results are differentiable by what the field is made of, and by the positions where those are tracked.
///
/// # Shapes
/// `x`: `[n, 3]`, normalised; `t`: `[n, 1]`, in `[0, 1]`; `w`: `[n, 3]`.
pub trait VelocityField<B: ModelBackend>: Send + Sync + std::fmt::Debug {
    /// `V`, `[n, 3]`, normalised units per unit of time.
    fn forward(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2>;

    /// `V`, `J`, and what `request` names.
    fn jet(
        &self,
        way: Derivatives,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        request: VelocityRequest,
    ) -> VelocityJet<B>;

    /// `V` and `J^T w`, `[n, 3]` each.
    fn pulled_back(
        &self,
        way: Derivatives,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        w: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>);
}

impl<B: ModelBackend> VelocityField<B> for VelocityNet<B> {
    fn forward(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.forward(x, t)
    }

    fn jet(
        &self,
        way: Derivatives,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        request: VelocityRequest,
    ) -> VelocityJet<B> {
        let mut jet = match way {
            Derivatives::Nested => nested::velocity_jet(self, x, t, request),
            Derivatives::Forward => forward::velocity_jet(self, x, t, request),
        };
        if request.rate && !self.time_dependent {
            jet.rate = Some(jet.value.zeros_like());
        }
        jet
    }

    fn pulled_back(
        &self,
        way: Derivatives,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        w: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>) {
        match way {
            Derivatives::Nested => nested::pulled_back(self, x, t, w),
            Derivatives::Forward => reverse::pulled_back(self, x, t, w),
        }
    }
}

/// Both ways of differentiating come to the sweeps: nesting would repeat what only the last layer adds.
impl<B: ModelBackend> VelocityField<B> for IntervalVelocity<B> {
    fn forward(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.forward(x, t)
    }

    fn jet(
        &self,
        _: Derivatives,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        request: VelocityRequest,
    ) -> VelocityJet<B> {
        forward::interval_jet(self, x, t, request)
    }

    fn pulled_back(
        &self,
        _: Derivatives,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        w: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>) {
        reverse::interval_pulled_back(self, x, t, w)
    }
}
