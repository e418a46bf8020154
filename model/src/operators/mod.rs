//! Derivatives of the networks by their inputs, differentiable once more by the weights.
//!
//! | file | how |
//! |---|---|
//! | [`nested`] | repeated autodiff: the network is lifted onto further levels of autodiff and differentiated there |
//! | [`forward`] | one sweep of ordinary operations that carries value, tangents and Laplacian through `V` |
//! | [`reverse`] | one written-out reverse sweep, for `grad f` and `J^T w`, where one output direction is wanted |
//!
//! Both ways stand behind one trait, [`Operators`], and must agree to f32 rounding. Naming: a *jet* is a
//! value together with its derivatives at the same points.

pub mod forward;
pub mod nested;
pub mod reverse;

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::backend::ModelBackend;
use crate::implicit_net::ImplicitNet;
use crate::trajectory::{Integrator, Steps, integrate};
use crate::velocity_net::VelocityNet;

/// `f` and its first derivatives.
#[derive(Clone, Debug)]
pub struct ImplicitJet<B: Backend> {
    /// `f`, `[n, 1]`.
    pub value: Tensor<B, 2>,
    /// `grad f` by the position, `[n, 3]`.
    pub gradient: Tensor<B, 2>,
    /// `f_t`, the partial derivative by time, `[n, 1]`.
    pub rate: Tensor<B, 2>,
}

impl<B: Backend> ImplicitJet<B> {
    /// `|grad f|`, `[n, 1]`.
    pub fn slope(&self) -> Tensor<B, 2> {
        length(self.gradient.clone())
    }

    /// `n = grad f / |grad f|`, `[n, 3]`.
    pub fn normal(&self) -> Tensor<B, 2> {
        self.gradient.clone() / self.slope()
    }

    /// Rows `start .. end`.
    pub fn rows(&self, start: usize, end: usize) -> Self {
        Self {
            value: self.value.clone().slice([start..end, 0..1]),
            gradient: self.gradient.clone().slice([start..end, 0..3]),
            rate: self.rate.clone().slice([start..end, 0..1]),
        }
    }
}

/// `V` and its derivatives.
#[derive(Clone, Debug)]
pub struct VelocityJet<B: Backend> {
    /// `V`, `[n, 3]`.
    pub value: Tensor<B, 2>,
    /// `J[i, k] = dV_i / dx_k`, `[n, 3, 3]`.
    pub jacobian: Tensor<B, 3>,
    /// The Laplacian of each component, `[n, 3]`, where it was asked for.
    pub laplacian: Option<Tensor<B, 2>>,
    /// `dV/dt`, `[n, 3]`, where it was asked for; zero for a stationary field.
    pub rate: Option<Tensor<B, 2>>,
}

impl<B: Backend> VelocityJet<B> {
    /// `div V = tr J`, `[n, 1]`.
    pub fn divergence(&self) -> Tensor<B, 2> {
        let n = self.value.dims()[0];
        let entry = |i: usize| self.jacobian.clone().slice([0..n, i..i + 1, i..i + 1]);
        (entry(0) + entry(1) + entry(2)).reshape([n, 1])
    }

    /// `J w`, the derivative of V along `w` (`[n, 3]`), `[n, 3]`.
    pub fn along(&self, w: Tensor<B, 2>) -> Tensor<B, 2> {
        let [n, _] = w.dims();
        (self.jacobian.clone() * w.reshape([n, 1, 3]))
            .sum_dim(2)
            .reshape([n, 3])
    }

    /// The strain rate `(J + J^T) / 2`, `[n, 3, 3]`.
    pub fn strain_rate(&self) -> Tensor<B, 3> {
        (self.jacobian.clone() + self.jacobian.clone().swap_dims(1, 2)) * 0.5
    }

    /// The first `end` rows.
    pub fn first(&self, end: usize) -> Self {
        let rows = |tensor: &Tensor<B, 2>| tensor.clone().slice([0..end, 0..3]);
        Self {
            value: rows(&self.value),
            jacobian: self.jacobian.clone().slice([0..end, 0..3, 0..3]),
            laplacian: self.laplacian.as_ref().map(rows),
            rate: self.rate.as_ref().map(rows),
        }
    }
}

/// Which of the dearer derivatives of `V` are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VelocityRequest {
    /// The Laplacian: the smoothness term.
    pub laplacian: bool,
    /// `dV/dt`: the steadiness term.
    pub rate: bool,
}

/// The derivatives that the objective is made of, at `[n, 3]` positions and `[n, 1]` times.
///
/// All results are differentiable by the weights, and by the positions where those are tracked.
pub trait Operators {
    /// `f`, `grad f`, `f_t`.
    fn implicit_jet<B: ModelBackend>(
        &self,
        net: &ImplicitNet<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
    ) -> ImplicitJet<B>;

    /// `V`, `J`, and what `request` names.
    fn velocity_jet<B: ModelBackend>(
        &self,
        net: &VelocityNet<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        request: VelocityRequest,
    ) -> VelocityJet<B>;

    /// `V` and `J^T w` for one direction `w`, `[n, 3]`, per point: a vector-Jacobian product.
    fn pulled_back<B: ModelBackend>(
        &self,
        net: &VelocityNet<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        w: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>);
}

/// The two implementations, chosen by the recipe's `training.derivatives`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivatives {
    /// Repeated autodiff through the backend.
    Nested,
    /// Sweeps of ordinary operations: forward mode for `V`, a written-out reverse sweep for `f`.
    Forward,
}

impl Operators for Derivatives {
    fn implicit_jet<B: ModelBackend>(
        &self,
        net: &ImplicitNet<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
    ) -> ImplicitJet<B> {
        match self {
            Self::Nested => nested::implicit_jet(net, x, t),
            Self::Forward => reverse::implicit_jet(net, x, t),
        }
    }

    fn velocity_jet<B: ModelBackend>(
        &self,
        net: &VelocityNet<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        request: VelocityRequest,
    ) -> VelocityJet<B> {
        let mut jet = match self {
            Self::Nested => nested::velocity_jet(net, x, t, request),
            Self::Forward => forward::velocity_jet(net, x, t, request),
        };
        if request.rate && !net.time_dependent {
            jet.rate = Some(jet.value.zeros_like());
        }
        jet
    }

    fn pulled_back<B: ModelBackend>(
        &self,
        net: &VelocityNet<B>,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        w: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>) {
        match self {
            Self::Nested => nested::pulled_back(net, x, t, w),
            Self::Forward => reverse::pulled_back(net, x, t, w),
        }
    }
}

/// Carries positions and surface normals along `V` together:
/// `dx/dt = V(x, t)`, `dn/dt = -J^T n`, the normals renormalised at the end.
///
/// # Shapes
/// `x`, `n`: `[n, 3]`; `from`, `to`: `[n, 1]`.
#[expect(
    clippy::too_many_arguments,
    reason = "one trajectory and one method, both spelled out"
)]
pub fn transport<B: ModelBackend>(
    operators: &impl Operators,
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    n: Tensor<B, 2>,
    from: Tensor<B, 2>,
    to: Tensor<B, 2>,
    steps: Steps,
    integrator: Integrator,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let (x, n) = transport_gradient(operators, net, x, n, from, to, steps, integrator);
    (x, n.clone() / length(n))
}

/// Carries positions and the gradients of a field that `V` carries: [`transport`] without the last step.
///
/// The gradient of what moves with `V` is a covector, hence the transposed Jacobian: if `f(phi(x, t), t)`
/// stays what it was, `grad f` at `phi(x, t)` is what arrives.
#[expect(clippy::too_many_arguments, reason = "as for `transport`")]
pub fn transport_gradient<B: ModelBackend>(
    operators: &impl Operators,
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    gradient: Tensor<B, 2>,
    from: Tensor<B, 2>,
    to: Tensor<B, 2>,
    steps: Steps,
    integrator: Integrator,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let count = x.dims()[0];
    let rhs = |state: Tensor<B, 2>, t: Tensor<B, 2>| {
        let x = state.clone().slice([0..count, 0..3]);
        let gradient = state.slice([0..count, 3..6]);
        let (velocity, pulled) = operators.pulled_back(net, x, t, gradient);
        Tensor::cat(vec![velocity, -pulled], 1)
    };
    let state = Tensor::cat(vec![x, gradient], 1);
    let state = integrate(rhs, state, from, to, steps, integrator);
    let gradient = state.clone().slice([0..count, 3..6]);
    (state.slice([0..count, 0..3]), gradient)
}

/// The length of each row, `[n, c]` to `[n, 1]`; its gradient is finite at a row of zeros.
pub fn length<B: Backend>(rows: Tensor<B, 2>) -> Tensor<B, 2> {
    ((rows.clone() * rows).sum_dim(1) + 1e-12).sqrt()
}

#[cfg(test)]
mod tests;
