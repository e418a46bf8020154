"""One training step: the objective's gradient by all weights, clipping, Adam; one jitted function.

The terms and weights are those of the preset `paper` that are not zero, in the phases that
`isomorph bench` times (`src/training/network_step.rs`).
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from . import networks
from .sizes import Size

# loss.*, training.* of the preset `paper`.
LEVEL_SET, LAMBDA_L = 100.0, 1.0
SMOOTHNESS, ALPHA, GAMMA = 20.0, 0.01, 1.0
DIVERGENCE = 20.0
MATCHING, MATCHING_WARM_UP = 200.0, 100.0
DATA, NORMALS, EIKONAL = 200.0, 20.0, 10.0
LEARNING_RATE, CLIP = 5e-3, 100.0
BETA_1, BETA_2, EPSILON = 0.9, 0.999, 1e-8

Tree = Any


def length(rows):
    """Of each row, `[n, 1]`; its gradient is finite at a row of zeros."""
    return jnp.sqrt((rows * rows).sum(1, keepdims=True) + 1e-12)


def dot(a, b):
    """Of each row, `[n, 1]`."""
    return (a * b).sum(1, keepdims=True)


def objective(nets: Tree, batch: Tree, steps: int, phase: str, shared: bool, jets=networks):
    """The weighted sum of the terms; `jets` gives the derivatives of the networks."""
    joint = phase == "joint"
    matching, arrived = carried_along(nets["v"], batch, steps, joint, jets)
    if joint and shared:
        still = jax.lax.stop_gradient(arrived)
    else:
        constants = jax.lax.stop_gradient(nets["v"])
        times = batch["start_times"], batch["stops"]
        still = jets.carry(constants, batch["starts"], *times, steps)
    x, t = collocation(batch, still)
    v, columns, laplacian = jets.velocity_jet(nets["v"], x)
    divergence = sum(column[:, k] for k, column in enumerate(columns))
    total = (MATCHING if joint else MATCHING_WARM_UP) * matching
    total += SMOOTHNESS * length(GAMMA * v - ALPHA * laplacian).mean()
    total += DIVERGENCE * jnp.abs(divergence).mean()
    if joint:
        total += implicit_terms(nets["f"], batch, (x, t), arrived, (v, columns), jets)
    return total


def carried_along(weights: Tree, batch: Tree, steps: int, joint: bool, jets):
    """The matching term, and in the joint phase the carried points, tracked by V's weights."""
    sources, targets = batch["matched_source"], batch["matched_target"]
    zeros, ones = jnp.zeros_like(sources[:, :1]), jnp.ones_like(sources[:, :1])
    x, start, stop = [sources, targets], [zeros, ones], [ones, zeros]
    if joint:
        x, start, stop = (
            [*x, batch["starts"]],
            [*start, batch["start_times"]],
            [*stop, batch["stops"]],
        )
    there = jets.carry(weights, *map(jnp.concatenate, (x, start, stop)), steps)
    marks = jnp.concatenate([targets, sources])
    return length(there[: len(marks)] - marks).mean(), there[len(marks) :]


def collocation(batch: Tree, still):
    """Positions and times: the band near the carried points first, then the box."""
    band = len(batch["offsets"])
    repeats = -(-band // len(still))
    near, times = (jnp.tile(a, (repeats, 1))[:band] for a in (still, batch["stops"]))
    return (
        jnp.concatenate([near + batch["offsets"], batch["uniform"]]),
        jnp.concatenate([times, batch["uniform_times"]]),
    )


def implicit_terms(weights: Tree, batch: Tree, at, arrived, of_v, jets):
    """The terms of f: one evaluation of its jet at all points of the batch."""
    (x, t), (v, columns) = at, of_v
    ends, end = len(batch["ends"]), len(batch["ends"]) + len(x)
    f, gradient, rate = jets.implicit_jet(
        weights,
        jnp.concatenate([batch["ends"], x, arrived]),
        jnp.concatenate([batch["end_times"], t, batch["stops"]]),
    )
    slope = length(gradient)
    normal = gradient / slope
    n = normal[ends:end]
    # J n and R = -<J n, n>.
    along = sum(column * n[:, k : k + 1] for k, column in enumerate(columns))
    residual = rate[ends:end] + dot(v, gradient[ends:end])
    residual -= LAMBDA_L * f[ends:end] * dot(along, n)
    # The means over the two shapes are added: twice the mean of both.
    total = DATA * 2 * jnp.abs(f[:ends]).mean()
    total += NORMALS * (1 - dot(normal[:ends], batch["end_normals"])).mean()
    total += EIKONAL * jnp.square(slope - 1).mean()
    return total + LEVEL_SET * jnp.abs(residual).mean()


def fresh(size: Size, phase: str) -> Tree:
    """Weights and Adam's moments of the networks that the phase trains."""
    rng = np.random.default_rng(0)
    nets = {"v": networks.initial(size.v, True, rng)}
    if phase == "joint":
        nets["f"] = networks.initial(size.f, False, rng)
    zeros = lambda: jax.tree.map(jnp.zeros_like, nets)
    return {"nets": nets, "first": zeros(), "second": zeros(), "made": jnp.zeros((), jnp.float32)}


def clipped(gradients: Tree) -> Tree:
    """Of one network: scaled down to the norm CLIP where it is longer."""
    squares = sum(jnp.square(g).sum() for g in jax.tree.leaves(gradients))
    factor = jnp.minimum(CLIP / (jnp.sqrt(squares) + 1e-12), 1)
    return jax.tree.map(lambda g: g * factor, gradients)


def advance(state: Tree, batch: Tree, *, steps: int, phase: str, shared: bool) -> Tree:
    """The state after one step of Adam (Kingma and Ba 2015)."""
    slopes = jax.grad(objective)(state["nets"], batch, steps, phase, shared)
    slopes = {name: clipped(of) for name, of in slopes.items()}
    made = state["made"] + 1
    rate = LEARNING_RATE / (1 - BETA_1**made)
    correction = 1 / (1 - BETA_2**made)
    first = jax.tree.map(lambda m, g: BETA_1 * m + (1 - BETA_1) * g, state["first"], slopes)
    second = jax.tree.map(lambda s, g: BETA_2 * s + (1 - BETA_2) * g * g, state["second"], slopes)
    nets = jax.tree.map(
        lambda w, m, s: w - rate * m / (jnp.sqrt(s * correction) + EPSILON),
        state["nets"],
        first,
        second,
    )
    return {"nets": nets, "first": first, "second": second, "made": made}


def compiled(size: Size, phase: str, shared: bool, state: Tree, batch: Tree):
    """`advance` for this size and phase, its state donated."""
    options = {"steps": size.time_steps, "phase": phase, "shared": shared}
    step = jax.jit(lambda state, batch: advance(state, batch, **options), donate_argnums=0)
    return step.lower(state, batch).compile()
