"""The step's derivatives against `jax.jacfwd`, `jax.hessian` and `jax.nn.softplus`, in float64.

The other side is written per point from the formulas, and takes every derivative by JAX's own
transformations: none of the sweeps and rules of `networks.py` is in it.
"""

from dataclasses import replace
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np

from . import YardstickError, networks, samples, step
from .sizes import BETA, FREQUENCIES, Size

# float64 rounding, 1e-16, times the growth of third derivatives through eight layers of beta 100:
# 7e-14 is what is found at size paper.
TOLERANCE = 1e-11
POINTS = 44


def encoded(x):
    """Of one point, `[3]` to `[39]`."""
    blocks = [x]
    for octave in range(FREQUENCIES):
        k = 2**octave * np.pi
        blocks += [jnp.sin(k * x) / k, jnp.cos(k * x) / k]
    return jnp.concatenate(blocks) / np.sqrt(2 * FREQUENCIES + 1)


def perceptron(weights, hidden):
    for weight, bias in weights[:-1]:
        hidden = jax.nn.softplus(BETA * (hidden @ weight + bias)) / BETA
    weight, bias = weights[-1]
    return hidden @ weight + bias


def velocity_jet(weights, x):
    of_point = lambda x: perceptron(weights, encoded(x))
    jacobian = jax.vmap(jax.jacfwd(of_point))(x)
    laplacian = jnp.trace(jax.vmap(jax.hessian(of_point))(x), axis1=2, axis2=3)
    return jax.vmap(of_point)(x), tuple(jacobian[:, :, k] for k in range(3)), laplacian


def implicit_jet(weights, x, t):
    of_point = lambda x, t: perceptron(weights, jnp.concatenate([encoded(x), t]))
    gradient, rate = jax.vmap(jax.jacfwd(lambda x, t: of_point(x, t)[0], (0, 1)))(x, t)
    return jax.vmap(of_point)(x, t), gradient, rate


def carry(weights, x, start, stop, steps):
    of_point = lambda x: perceptron(weights, encoded(x))
    for _ in range(steps):
        x = x + (stop - start) / steps * jax.vmap(of_point)(x)
    return x


REFERENCE = SimpleNamespace(velocity_jet=velocity_jet, implicit_jet=implicit_jet, carry=carry)


def in_double(tree):
    return jax.tree.map(lambda a: jnp.asarray(a, jnp.float64), tree)


def largest_difference(ours, theirs) -> float:
    """Of all pairs of arrays, each relative to the largest entry of the second."""
    pairs = zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True)
    relative = lambda a, b: float(jnp.abs(a - b).max() / jnp.abs(b).max())
    # numpy's maximum of a NaN is NaN, Python's is whatever came first.
    return float(np.max([relative(a, b) for a, b in pairs]))


def differences(size: Size) -> dict[str, float]:
    """By what is compared, at the networks of a size and a few points."""
    jax.config.update("jax_enable_x64", True)
    rng = np.random.default_rng(5)
    nets = in_double(step.fresh(size, "joint")["nets"])
    # Off the initial weights, where half of the derivatives are zero or alike.
    shaken = lambda w: w + 0.1 * w.std() * rng.standard_normal(w.shape) + 0.01 * rng.random()
    nets = jax.tree.map(shaken, nets)
    few = replace(samples.Samples.of(POINTS), matched=8)
    batch = in_double(samples.draw(few, rng))
    x, t = batch["uniform"], batch["uniform_times"]
    found = {
        "V, Jacobian, Laplacian": largest_difference(
            jax.jit(networks.velocity_jet)(nets["v"], x), jax.jit(velocity_jet)(nets["v"], x)
        ),
        "f, gradient, rate": largest_difference(
            jax.jit(networks.implicit_jet)(nets["f"], x, t), jax.jit(implicit_jet)(nets["f"], x, t)
        ),
    }
    for phase, shared in (("warm_up", False), ("joint", False), ("joint", True)):
        trained = nets if phase == "joint" else {"v": nets["v"]}
        of = lambda nets, jets: step.objective(nets, batch, 2, phase, shared, jets)
        slopes = lambda jets: jax.jit(jax.value_and_grad(lambda nets: of(nets, jets)))(trained)
        name = f"{phase} objective and its gradient" + (", shared trajectories" if shared else "")
        found[name] = largest_difference(slopes(networks), slopes(REFERENCE))
    return found


def run(size: Size) -> None:
    """Prints every difference; a YardstickError where one is too large (or not a number)."""
    found = differences(size)
    for name, difference in found.items():
        print(f"{difference:8.1e}  {name}")
    wrong = [name for name, difference in found.items() if not difference <= TOLERANCE]
    if wrong:
        raise YardstickError(
            f"--check: {', '.join(wrong)}: off by more than {TOLERANCE:g} of the largest entry"
        )
    print(f"all within {TOLERANCE:g} of the largest entry, at size {size.name}, in float64")
