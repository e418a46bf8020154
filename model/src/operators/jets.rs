//! Values together with their derivatives at the same points, and what follows from them point by point.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::length::length;

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
    /// The Laplacian of each component, `[n, 3]`, where it was requested.
    pub laplacian: Option<Tensor<B, 2>>,
    /// `dV/dt`, `[n, 3]`, where it was requested; zero for a stationary field.
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

/// Which of the dearer derivatives of `V` a jet has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VelocityRequest {
    /// The Laplacian: the smoothness term.
    pub laplacian: bool,
    /// `dV/dt`: the screw term.
    pub rate: bool,
}
