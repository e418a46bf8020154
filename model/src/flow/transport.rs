//! What travels along `V` with the points: normals, and gradients of fields that `V` carries.

use burn::tensor::Tensor;

use super::trajectory::{Integrator, Steps, integrate};
use crate::autodiff::ModelBackend;
use crate::operators::{Operators, VelocityField, length};

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
    net: &dyn VelocityField<B>,
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
    net: &dyn VelocityField<B>,
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
    // One state, so that every stage of the integrator evaluates `V` and the product at the same points.
    let state = Tensor::cat(vec![x, gradient], 1);
    let state = integrate(rhs, state, from, to, steps, integrator);
    let gradient = state.clone().slice([0..count, 3..6]);
    (state.slice([0..count, 0..3]), gradient)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::autodiff::Activation;
    use crate::nets::{ImplicitNet, VelocityNet, VelocityNetConfig};
    use crate::operators::{ImplicitJet, VelocityJet, VelocityRequest};
    use crate::testing::{Plain, assert_close, column, host, points};

    /// A network that no operator of these tests reads.
    fn still() -> VelocityNet<Plain> {
        let config = VelocityNetConfig {
            depth: 1,
            width: 2,
            activation: Activation::Softplus { beta: 8.0 },
            frequencies: 0,
            skip: 0,
            time_dependent: false,
        };
        config.init(11, &Default::default())
    }

    /// `V = (y, 0, 0)`: what the transport of normals can be checked on in closed form.
    struct Shear;

    impl Operators for Shear {
        fn implicit_jet<B: ModelBackend>(
            &self,
            _: &ImplicitNet<B>,
            _: Tensor<B, 2>,
            _: Tensor<B, 2>,
        ) -> ImplicitJet<B> {
            unreachable!("the transport of normals does not need f")
        }

        fn velocity_jet<B: ModelBackend>(
            &self,
            _: &dyn VelocityField<B>,
            _: Tensor<B, 2>,
            _: Tensor<B, 2>,
            _: VelocityRequest,
        ) -> VelocityJet<B> {
            unreachable!("the transport of normals needs one product only")
        }

        fn pulled_back<B: ModelBackend>(
            &self,
            _: &dyn VelocityField<B>,
            x: Tensor<B, 2>,
            _: Tensor<B, 2>,
            w: Tensor<B, 2>,
        ) -> (Tensor<B, 2>, Tensor<B, 2>) {
            let n = x.dims()[0];
            let zero = Tensor::zeros([n, 1], &x.device());
            let velocity = vec![x.slice([0..n, 1..2]), zero.clone(), zero.clone()];
            let pulled = vec![zero.clone(), w.slice([0..n, 0..1]), zero];
            (Tensor::cat(velocity, 1), Tensor::cat(pulled, 1))
        }
    }

    #[test]
    fn a_shear_carries_normals_as_covectors() {
        let net = still();
        let (x, n) = (
            points(&[[0.2, 0.5, 0.0]; 2]),
            points(&[[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]]),
        );
        let (from, to) = (column(&[0.0; 2]), column(&[0.5; 2]));
        let (steps, method) = (Steps::Even(3), Integrator::Midpoint);
        let (x, n) = transport(&Shear, &net, x, n, from, to, steps, method);
        // The flow is linear in time, so the midpoint rule is exact: n = (1, -t, 0) before normalising.
        let root = 1.25f64.sqrt();
        assert_close(
            host(x),
            vec![0.45, 0.5, 0.0, 0.45, 0.5, 0.0],
            1e-6,
            "positions",
        );
        assert_close(
            host(n),
            vec![1.0 / root, -0.5 / root, 0.0, 0.0, 0.6, 0.8],
            1e-6,
            "normals",
        );
    }
}
