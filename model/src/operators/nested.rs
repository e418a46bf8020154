//! Derivatives by repeated autodiff.
//!
//! To differentiate by the input, the network and the input are lifted one level: from backend `B` to
//! `Autodiff<B>`, the weights as constants there. The gradient taken on that level is a tensor of `B`,
//! still tracked by whatever `B` tracks, weights included. The Laplacian needs a second lift.
//!
//! One backward per graph: several components or directions are stacked along the batch axis, summed to
//! one scalar, and sliced apart afterwards.

use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use burn_autodiff::Autodiff;

use super::jets::{ImplicitJet, VelocityJet, VelocityRequest};
use crate::autodiff::ModelBackend;
use crate::nets::{ImplicitNet, VelocityNet};

/// A copy of the tensor one level up, with a gradient there.
fn lift<B: ModelBackend>(tensor: Tensor<B, 2>) -> Tensor<Autodiff<B>, 2> {
    Tensor::from_inner(tensor).require_grad()
}

/// `f`, `grad f`, `f_t`: one forward and one backward on the level above.
pub fn implicit_jet<B: ModelBackend>(
    net: &ImplicitNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
) -> ImplicitJet<B> {
    let lifted = net.clone().train::<Autodiff<B>>().no_grad();
    let (x, t) = (lift(x), lift(t));
    let value = lifted.forward(x.clone(), t.clone());
    // Row `i` of `f` depends on row `i` of the input alone, so the gradient of the sum holds each row's own.
    let mut grads = value.clone().sum().backward();
    ImplicitJet {
        value: value.inner(),
        gradient: x
            .grad_remove(&mut grads)
            .expect("f depends on every position"),
        rate: t.grad_remove(&mut grads).expect("f depends on every time"),
    }
}

/// `V` and `J^T w`: one forward and one backward on the level above.
pub fn pulled_back<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    w: Tensor<B, 2>,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let lifted = net.clone().train::<Autodiff<B>>().no_grad();
    // Time is a constant here: nothing is differentiated by it.
    let x = lift(x);
    let value = lifted.forward(x.clone(), Tensor::from_inner(t));
    let mut grads = (value.clone() * Tensor::from_inner(w)).sum().backward();
    (
        value.inner(),
        x.grad_remove(&mut grads)
            .expect("V depends on every position"),
    )
}

/// `V`, `J`, and what `request` names.
pub fn velocity_jet<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    request: VelocityRequest,
) -> VelocityJet<B> {
    if request.laplacian {
        with_laplacian(net, x, t, request)
    } else {
        without_laplacian(net, x, t, request)
    }
}

/// Copies of the batch, one below the other.
///
/// Not `repeat_dim`: in burn 0.21 its backward adds up the wrong rows, without a word.
fn stacked<B: Backend>(rows: Tensor<B, 2>, copies: usize) -> Tensor<B, 2> {
    Tensor::cat(vec![rows; copies], 0)
}

/// Three copies of the batch, one per component of `V`; the gradient of copy `i` is row `i` of `J`.
fn without_laplacian<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    request: VelocityRequest,
) -> VelocityJet<B> {
    let n = x.dims()[0];
    let lifted = net.clone().train::<Autodiff<B>>().no_grad();
    let x = lift(stacked(x, 3));
    let t = lift(stacked(t, 3));
    let value = lifted.forward(x.clone(), t.clone());
    // One backward per graph: a second one over the same graph finds no gradients.
    let sum = components(&value, n, 1);
    let mut grads = sum.backward();
    let rows = x
        .grad_remove(&mut grads)
        .expect("V depends on every position");
    let rate = (request.rate && net.time_dependent).then(|| {
        let rates = t.grad_remove(&mut grads).expect("V depends on every time");
        side_by_side(&rates, n)
    });
    VelocityJet {
        value: value.inner().slice([0..n, 0..3]),
        jacobian: rows.reshape([3, n, 3]).swap_dims(0, 1),
        laplacian: None,
        rate,
    }
}

/// Nine copies, one per component `i` and direction `k`: a first backward gives `dV_i/dx` in each, a
/// second, on the level between, `d^2 V_i / dx_k^2` in column `k`.
fn with_laplacian<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    request: VelocityRequest,
) -> VelocityJet<B> {
    let n = x.dims()[0];
    let lifted = net.clone().train::<Autodiff<B>>().no_grad();
    // Two levels: the gradient of the first backward has to be differentiated on the second.
    let twice = lifted.train::<Autodiff<Autodiff<B>>>().no_grad();
    let x1 = lift(stacked(x, 9));
    let x2 = lift(x1.clone());
    let t2 = lift(Tensor::<Autodiff<B>, 2>::from_inner(stacked(t, 9)));
    let value = twice.forward(x2.clone(), t2.clone());
    let mut grads = components(&value, n, 3).backward();
    let first = x2
        .grad_remove(&mut grads)
        .expect("V depends on every position");
    let rate = (request.rate && net.time_dependent).then(|| {
        let rates = t2
            .grad_remove(&mut grads)
            .expect("V depends on every time")
            .inner();
        // The three copies of a component have the same rate.
        let each = |i: usize| rates.clone().slice([3 * i * n..(3 * i + 1) * n, 0..1]);
        Tensor::cat(vec![each(0), each(1), each(2)], 1)
    });
    // [component, direction, point, column]: the entry where the column is the direction.
    let diagonal = |k: usize| {
        let copies = first.clone().reshape([3, 3, n, 3]);
        copies.slice([0..3, k..k + 1, 0..n, k..k + 1]).sum()
    };
    let mut grads = (diagonal(0) + diagonal(1) + diagonal(2)).backward();
    let second = x1
        .grad_remove(&mut grads)
        .expect("a network with curvature")
        .reshape([3, 3, n, 3]);
    let along = |k: usize| second.clone().slice([0..3, k..k + 1, 0..n, k..k + 1]);
    let laplacian = (along(0) + along(1) + along(2))
        .reshape([3, n])
        .swap_dims(0, 1);
    // Row `i` of the Jacobian is the gradient in any of the three copies of component `i`.
    let rows = first
        .inner()
        .reshape([3, 3, n, 3])
        .slice([0..3, 0..1, 0..n, 0..3]);
    VelocityJet {
        value: value.inner().inner().slice([0..n, 0..3]),
        jacobian: rows.reshape([3, n, 3]).swap_dims(0, 1),
        laplacian: Some(laplacian),
        rate,
    }
}

/// The sum over all points of component `i` in its `copies` copies, over all `i`.
fn components<B: ModelBackend>(value: &Tensor<B, 2>, n: usize, copies: usize) -> Tensor<B, 1> {
    let rows = copies * n;
    let each = |i: usize| {
        value
            .clone()
            .slice([i * rows..(i + 1) * rows, i..i + 1])
            .sum()
    };
    each(0) + each(1) + each(2)
}

/// `[3 n, 1]`, component after component, as `[n, 3]`.
fn side_by_side<B: ModelBackend>(stacked: &Tensor<B, 2>, n: usize) -> Tensor<B, 2> {
    stacked.clone().reshape([3, n]).swap_dims(0, 1)
}
