//! The derivatives of a velocity of B-splines: sums over the same nodes with other weights.
//!
//! They are exact and cost little more than the value, so that both ways of differentiating
//! ([`Derivatives`]) come to this one.

use burn::tensor::Tensor;

use super::{Derivatives, VelocityField, VelocityJet, VelocityRequest};
use crate::autodiff::ModelBackend;
use crate::nets::SplineVelocity;
use crate::nets::spline_velocity::{Rows, at_time};

impl<B: ModelBackend> VelocityField<B> for SplineVelocity<B> {
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
        let [n, _] = x.dims();
        let rows = if request.laplacian {
            Rows::Laplacian
        } else {
            Rows::Slopes
        };
        let sums = self.sums(x, rows);
        let columns = sums.dims()[2];
        let rate = request.rate.then(|| match columns {
            3 => Tensor::zeros([n, 3], &t.device()),
            // The derivative of 2 t - 1.
            _ => sums.clone().slice([0..n, 0..1, 3..6]).reshape([n, 3]) * 2.0,
        });
        let here = at_time(sums, t);
        let row = |k: usize| here.clone().slice([0..n, k..k + 1, 0..3]).reshape([n, 3]);
        VelocityJet {
            value: row(0),
            jacobian: here.clone().slice([0..n, 1..4, 0..3]).swap_dims(1, 2),
            laplacian: request.laplacian.then(|| row(4)),
            rate,
        }
    }

    fn pulled_back(
        &self,
        _: Derivatives,
        x: Tensor<B, 2>,
        t: Tensor<B, 2>,
        w: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>) {
        let [n, _] = x.dims();
        let here = at_time(self.sums(x, Rows::Slopes), t);
        let value = here.clone().slice([0..n, 0..1, 0..3]).reshape([n, 3]);
        // Row `k` of the block is dV / dx_k.
        let slopes = here.slice([0..n, 1..4, 0..3]);
        let pulled = (slopes * w.reshape([n, 1, 3])).sum_dim(2).reshape([n, 3]);
        (value, pulled)
    }
}
