"""Encoding, perceptron, and the derivatives of f and V, in a form that XLA does well.

The weights of a network are a list of `(weight, bias)`, `[inputs, outputs]` and `[outputs]`. The
activations have derivative rules of their own, so that the forward pass keeps one slope per unit
for the backward pass and no transcendental function is evaluated twice.
"""

import jax
import jax.numpy as jnp
import numpy as np

from .sizes import BETA, FREQUENCIES, Network

OCTAVES = 2.0 ** np.arange(FREQUENCIES) * np.pi
SCALE = (2 * FREQUENCIES + 1) ** -0.5

Weights = list[tuple[jax.Array, jax.Array]]


def softplus_and_slope(z):
    """`log(1 + exp(beta z)) / beta` and its derivative, by one tanh and one logarithm.

    With `u = beta z / 2` the slope is `(1 + tanh u) / 2` and the value `max(z, 0) -
    log((1 + |tanh u|) / 2) / beta`. On XLA's CPU the step takes a tenth less time than with an
    exponential and its quotient; the value is off by at most 1e-9 where float32 keeps 1 + tanh u.
    """
    u = jnp.tanh(0.5 * BETA * z)
    value = jnp.maximum(z, 0) - jnp.log(0.5 + 0.5 * jnp.abs(u)) / BETA
    return value, 0.5 + 0.5 * u


@jax.custom_vjp
def softplus(z):
    """The activation alone: trajectories."""
    return softplus_and_slope(z)[0]


softplus.defvjp(softplus_and_slope, lambda slope, g: (g * slope,))


@jax.custom_vjp
def sloped(z):
    """The activation and its slope: the two sweeps of f."""
    return softplus_and_slope(z)


def sloped_forward(z):
    value, slope = softplus_and_slope(z)
    return (value, slope), slope


def sloped_backward(slope, cotangents):
    of_value, of_slope = cotangents
    return (slope * (of_value + BETA * (1 - slope) * of_slope),)


sloped.defvjp(sloped_forward, sloped_backward)


@jax.custom_vjp
def bent(z, tangents, laplacian):
    """The activation of a value, its three tangents and its Laplacian.

    `s(z)`, `s' z_k`, `s' lap z + s'' sum_k z_k^2` (the forward Laplacian, Li et al. 2023).
    """
    return bent_forward(z, tangents, laplacian)[0]


def bent_forward(z, tangents, laplacian):
    value, slope = softplus_and_slope(z)
    squares = sum(tangent * tangent for tangent in tangents)
    bends = slope * (laplacian + BETA * (1 - slope) * squares)
    out = value, tuple(slope * tangent for tangent in tangents), bends
    return out, (slope, tangents, laplacian)


def bent_backward(kept, cotangents):
    slope, tangents, laplacian = kept
    of_value, of_tangents, of_laplacian = cotangents
    second = BETA * slope * (1 - slope)
    third = BETA * second * (1 - 2 * slope)
    squares = sum(tangent * tangent for tangent in tangents)
    along = sum(tangent * g for tangent, g in zip(tangents, of_tangents))
    of_z = slope * of_value + second * (along + laplacian * of_laplacian)
    of_z += third * squares * of_laplacian
    twice = 2 * second * of_laplacian
    backs = tuple(slope * g + twice * tangent for tangent, g in zip(tangents, of_tangents))
    return of_z, backs, slope * of_laplacian


bent.defvjp(bent_forward, bent_backward)


def encode(x):
    """`[n, 3]` to `[n, 39]`: x, then the sines and cosines of each octave, in blocks of three."""
    angles = x[:, None, :] * OCTAVES[:, None].astype(x.dtype)
    waves = jnp.stack([jnp.sin(angles), jnp.cos(angles)], axis=2)
    waves /= OCTAVES[:, None, None].astype(x.dtype)
    return jnp.concatenate([x, waves.reshape(len(x), -1)], axis=1) * SCALE


def encoding_derivatives(x):
    """First and second derivative of every column by the coordinate that it encodes; `[n, 39]`."""
    octaves = OCTAVES[:, None].astype(x.dtype)
    sine, cosine = jnp.sin(x[:, None, :] * octaves), jnp.cos(x[:, None, :] * octaves)
    first = jnp.stack([cosine, -sine], axis=2).reshape(len(x), -1)
    second = jnp.stack([-sine * octaves, -cosine * octaves], axis=2).reshape(len(x), -1)
    return (
        jnp.concatenate([jnp.ones_like(x), first], axis=1) * SCALE,
        jnp.concatenate([jnp.zeros_like(x), second], axis=1) * SCALE,
    )


def velocity(weights: Weights, x):
    """`V(x)`, `[n, 3]`."""
    hidden = encode(x)
    for weight, bias in weights[:-1]:
        hidden = softplus(hidden @ weight + bias)
    weight, bias = weights[-1]
    return hidden @ weight + bias


def velocity_jet(weights: Weights, x):
    """`V`, the columns of its Jacobian and its Laplacian by one forward sweep; five of `[n, 3]`.

    The lanes stay apart: stacked, they would be copied together and apart again at every layer.
    """
    first, laplacian = encoding_derivatives(x)
    axes = np.arange(first.shape[1]) % 3
    value = encode(x)
    tangents = tuple(first * (axes == k).astype(x.dtype) for k in range(3))
    for weight, bias in weights[:-1]:
        lanes = tuple(tangent @ weight for tangent in tangents)
        value, tangents, laplacian = bent(value @ weight + bias, lanes, laplacian @ weight)
    weight, bias = weights[-1]
    columns = tuple(tangent @ weight for tangent in tangents)
    return value @ weight + bias, columns, laplacian @ weight


def implicit_jet(weights: Weights, x, t):
    """`f`, `f_t` (`[n, 1]`) and `grad f` (`[n, 3]`) by a sweep forward and one back."""
    hidden = jnp.concatenate([encode(x), t], axis=1)
    slopes = []
    for weight, bias in weights[:-1]:
        hidden, slope = sloped(hidden @ weight + bias)
        slopes.append(slope)
    weight, bias = weights[-1]
    value = hidden @ weight + bias
    back = weight.T
    for (weight, _), slope in zip(weights[-2::-1], slopes[::-1]):
        back = (back * slope) @ weight.T
    by_column = back[:, :-1] * encoding_derivatives(x)[0]
    return value, by_column.reshape(len(x), -1, 3).sum(1), back[:, -1:]


def carry(weights: Weights, x, start, stop, steps: int):
    """Euler's method: each sample's own span of time in equal steps; unrolled."""
    h = (stop - start) / steps
    for _ in range(steps):
        x = x + velocity(weights, x) * h
    return x


def initial(network: Network, near_zero: bool, rng: np.random.Generator):
    """Weights of V (`near_zero`: He's, the output scaled by 0.01), or of f (nearly a sphere).

    f is not fitted to the sphere as `ImplicitNetConfig::init` does: a step takes no longer for it.
    """
    made = []
    for k, (inputs, outputs) in enumerate(network.layers()):
        last = k == network.depth
        weight = rng.standard_normal((inputs, outputs))
        bias = np.zeros(outputs)
        if near_zero:
            weight *= np.sqrt(2 / inputs) * (0.01 if last else 1)
        elif last:
            weight = np.sqrt(np.pi / inputs) + 1e-5 * weight
            bias -= 0.4
        else:
            weight *= np.sqrt(2 / outputs)
            if k == 0:
                weight[:3] /= SCALE
                weight[3:] = 0
        made.append((jnp.asarray(weight, jnp.float32), jnp.asarray(bias, jnp.float32)))
    return made
