"""The training step of `isomorph bench` in JAX. `scripts/jax_step.py` is the command.

sizes.py     networks and numbers of samples of each size, operations of a step: needs no JAX
samples.py   the batches, drawn by numpy on two spheres of points: needs no JAX
networks.py  encoding, perceptron, the jets of f and V, trajectories
step.py      the objective of each phase, clipping, Adam: one jitted function
check.py     all of it against jax.jacfwd, jax.hessian and a softplus without rules of our own

What is repeated here is what `src/training/network_step.rs` does with the preset `paper`
(`src/training/recipe/keys.rs`); whoever changes it there changes it here.
"""


class YardstickError(Exception):
    """Something that the user can put right; the message says how."""
