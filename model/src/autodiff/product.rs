//! The product of two matrices as one differentiable operation, which a backend may override: burn-ndarray's
//! own runs at a quarter of the rate that the `gemm` crate reaches on the same processor, and burn-flex fills
//! each result with zeros first.

use burn::tensor::Tensor;
use burn::tensor::ops::FloatTensor;
use burn_autodiff::Autodiff;
use burn_autodiff::checkpoint::base::Checkpointer;
use burn_autodiff::checkpoint::strategy::CheckpointStrategy;
use burn_autodiff::grads::Gradients;
use burn_autodiff::ops::{Backward, Ops, OpsKind};

use super::backend::ModelBackend;
use super::lanes::{primitive, tensor};

/// `a b`.
///
/// # Shapes
/// `[m, k]` and `[k, n]` to `[m, n]`.
pub fn product<B: ModelBackend>(a: Tensor<B, 2>, b: Tensor<B, 2>) -> Tensor<B, 2> {
    let ([_, inner], [rows, _]) = (a.dims(), b.dims());
    assert_eq!(
        inner, rows,
        "columns of the left matrix and rows of the right one"
    );
    tensor(B::product(primitive(a), primitive(b)))
}

/// The backward pass: `g b^T` and `a^T g`.
#[derive(Debug)]
struct ProductBackward;

impl<B: ModelBackend> Backward<B, 2> for ProductBackward {
    /// The factors, each where the other is tracked.
    type State = (Option<FloatTensor<B>>, Option<FloatTensor<B>>);

    fn backward(self, ops: Ops<Self::State, 2>, grads: &mut Gradients, _: &mut Checkpointer) {
        let grad = grads.consume::<B>(&ops.node);
        let transposed = |matrix| B::float_transpose(matrix);
        let ([by_a, by_b], (a, b)) = (ops.parents, ops.state);
        if let Some((node, b)) = by_a.zip(b) {
            grads.register::<B>(node.id, B::product(grad.clone(), transposed(b)));
        }
        if let Some((node, a)) = by_b.zip(a) {
            grads.register::<B>(node.id, B::product(transposed(a), grad));
        }
    }
}

/// [`ModelBackend::product`] one level up.
pub(crate) fn tracked_product<B: ModelBackend, C: CheckpointStrategy>(
    a: FloatTensor<Autodiff<B, C>>,
    b: FloatTensor<Autodiff<B, C>>,
) -> FloatTensor<Autodiff<B, C>> {
    let nodes = [a.node.clone(), b.node.clone()];
    let prepared = Backward::<B, 2>::prepare::<C>(ProductBackward, nodes);
    match prepared.compute_bound().stateful() {
        OpsKind::Tracked(step) => {
            // The gradient of one factor needs the other. A factor beside a constant is not kept.
            let [tracks_a, tracks_b] = [&a, &b].map(|factor| !factor.node.requirement.is_none());
            let state = (
                tracks_b.then(|| a.primitive.clone()),
                tracks_a.then(|| b.primitive.clone()),
            );
            step.finish(state, B::product(a.primitive, b.primitive))
        }
        OpsKind::UnTracked(step) => step.finish(B::product(a.primitive, b.primitive)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, Train, assert_close, host, numbers};

    #[test]
    fn it_is_burns_own_for_matrices_and_transposed_ones_and_slices() {
        for (m, k, n) in [(1, 1, 1), (5, 3, 2), (70, 33, 129), (300, 200, 300)] {
            let label = format!("{m} x {k} x {n}");
            // Sums of k products of numbers up to 1, in f32.
            let tolerance = 1e-6 * k as f64;
            let (a, b) = (numbers::<Plain>(m, k, 0.1), numbers::<Plain>(k, n, 0.7));
            let wanted = host(a.clone().matmul(b.clone()));
            assert_close(
                host(product(a.clone(), b.clone())),
                wanted.clone(),
                tolerance,
                &label,
            );
            let swapped = product(b.clone().transpose(), a.clone().transpose()).transpose();
            assert_close(
                host(swapped),
                wanted,
                tolerance,
                &format!("{label}, transposed"),
            );
            if m > 2 && k > 1 {
                let part = a.clone().slice([1..m - 1, 0..k - 1]);
                let rest = b.slice([1..k, 0..n]);
                let wanted = host(part.clone().matmul(rest.clone()));
                assert_close(
                    host(product(part, rest)),
                    wanted,
                    tolerance,
                    &format!("{label}, slices"),
                );
            }
        }
    }

    #[test]
    fn no_rows_give_no_rows_and_no_terms_give_zeros() {
        assert_eq!(
            product(numbers::<Plain>(0, 3, 0.1), numbers(3, 2, 0.1)).dims(),
            [0, 2]
        );
        let sums = product(numbers::<Plain>(2, 0, 0.1), numbers(0, 2, 0.1));
        assert_eq!(host(sums), [0.0; 4]);
    }

    #[test]
    fn both_gradients_and_the_gradients_of_these_are_burns_own() {
        let gradients = |own: bool| {
            let up = |x: Tensor<Plain, 2>| Tensor::<Train, 2>::from_inner(x).require_grad();
            let (a, b) = (up(numbers(4, 3, 0.1)), up(numbers(3, 5, 0.7)));
            let lift = |x: &Tensor<Train, 2>| {
                Tensor::<Autodiff<Train>, 2>::from_inner(x.clone()).require_grad()
            };
            let (a2, b2) = (lift(&a), lift(&b));
            let out = if own {
                product(a2.clone(), b2.clone())
            } else {
                a2.clone().matmul(b2.clone())
            };
            let mut first = (out.clone() * out).sum().backward();
            let by_a = a2.grad_remove(&mut first).expect("depends on a");
            let by_b = b2.grad_remove(&mut first).expect("depends on b");
            let total = (by_a.clone() * by_a.clone()).sum() + (by_b.clone() * by_b.clone()).sum();
            let mut second = total.backward();
            [
                host(by_a.inner()),
                host(by_b.inner()),
                host(a.grad_remove(&mut second).expect("twice on a")),
                host(b.grad_remove(&mut second).expect("twice on b")),
            ]
        };
        for (own, burns) in gradients(true).into_iter().zip(gradients(false)) {
            // Sums of some dozen f32 up to 100.
            assert_close(own, burns, 1e-3, "gradient");
        }
    }

    #[test]
    fn a_factor_that_is_not_tracked_gets_no_gradient_and_hinders_none() {
        let a = numbers::<Train>(4, 3, 0.1).require_grad();
        let b = numbers::<Train>(3, 5, 0.7);
        let grads = product(a.clone(), b.clone()).sum().backward();
        let wanted = b.clone().sum_dim(1).transpose().inner();
        let by_a = host(a.grad(&grads).expect("tracked"));
        let wanted: Vec<f64> = host(wanted).repeat(4);
        assert_close(by_a, wanted, 1e-5, "by a");
        assert!(b.grad(&grads).is_none());
    }
}
