#!/usr/bin/env python3
"""Times the training step of `isomorph bench`, written in JAX: the yardstick of our own speed.

    python3 scripts/jax_step.py [--size small|shipped|paper] [--phase joint|warm-up|both]
                                [--repeats N] [--threads N] [--share-trajectories] [--json]
    python3 scripts/jax_step.py --check [--size S]

The step is that of `isomorph bench --derivatives forward`: the same networks, numbers of points,
trajectories and terms, float32, on the CPU; one jitted function with donated buffers whose V,
Jacobian and Laplacian come from one forward sweep. The batches are drawn by numpy before the clock
starts, ours within a step: that favours JAX.

The first step is reported apart, with its compilation; the median of the others counts. Compare
with `isomorph bench` on the same cores (--threads N, or taskset for both), one after the other, on
a machine that does nothing else.

With --share-trajectories the band's centres are the tracked trajectories as constants, instead of
being carried a second time without a graph: the same numbers for 2 to 5 % less work.

--check compares the derivatives with jax.jacfwd and jax.hessian on a few points, in float64.

Needs JAX (`pip install jax`). Exit status: 0 done, 1 failed, 2 usage.
"""

import argparse
import importlib.util
import json
import os
import sys
import time
from typing import Any, Callable

from isomorph_jax import YardstickError
from isomorph_jax.sizes import PHASES, SIZES, Size, flop_per_step

TESTED = "0.10.2"

# Batches that a run goes through in turn: no two steps in a row have the same one.
BATCHES = 4


def arguments(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("--size", choices=SIZES, default="small", help="networks and points (default: small)")
    add("--phase", choices=("joint", "warm-up", "both"), default="both", help="default: both")
    add("--repeats", type=int, default=5, help="steps timed in each phase (default: 5)")
    add("--threads", type=int, help="cores to run on (default: all that the process may use)")
    add("--share-trajectories", action="store_true", help="carry no point twice")
    add("--check", action="store_true", help="verify the derivatives instead of timing them")
    add("--json", action="store_true", help="print JSON")
    options = parser.parse_args(words)
    for name in ("repeats", "threads"):
        value = getattr(options, name)
        if value is not None and not 1 <= value <= 1000:
            parser.error(f"--{name} = {value}: must be 1 to 1000")
    return options


def phases(options: argparse.Namespace) -> list[str]:
    """The phases asked for, by the names in bench's JSON."""
    wanted = options.phase.replace("-", "_")
    return [phase for phase in PHASES if wanted in (phase, "both")]


def keep_to(threads: int | None) -> int:
    """Limits this process to so many cores; how many it has then.

    XLA makes its pools as large as the set of cores that the process may run on, when it starts.
    """
    if not hasattr(os, "sched_setaffinity"):
        if threads is not None:
            raise YardstickError(
                f"--threads = {threads}: this system cannot bind a process to cores; leave it out"
            )
        return os.cpu_count() or 1
    cores = sorted(os.sched_getaffinity(0))
    if threads is None:
        return len(cores)
    if threads > len(cores):
        raise YardstickError(
            f"--threads = {threads}: this process may run on {len(cores)} cores; ask for as many"
        )
    os.sched_setaffinity(0, cores[:threads])
    return threads


def require_jax() -> None:
    """A YardstickError where JAX is missing."""
    if importlib.util.find_spec("jax") is None:
        raise YardstickError(
            "jax: not installed, and this step is written in it; run "
            f"`{sys.executable} -m pip install jax=={TESTED}` (the version that it was tested with)"
        )


def median(values: list[float]) -> float:
    """The upper one of the two in the middle, as in bench.rs."""
    return sorted(values)[len(values) // 2]


def seconds(work: Callable[[], Any]) -> tuple[float, Any]:
    """How long `work` took until its result was there, and the result."""
    import jax

    start = time.perf_counter()
    made = jax.block_until_ready(work())
    return time.perf_counter() - start, made


def matmul_rate() -> float:
    """GFLOP per second of a product of 4000 x 512 by 512 x 512, the median of seven."""
    import jax
    import numpy as np

    rng = np.random.default_rng(0)
    a, b = (jax.device_put(rng.random((rows, 512), np.float32)) for rows in (4000, 512))
    product = jax.jit(lambda a, b: a @ b)
    multiply = lambda: seconds(lambda: product(a, b))[0]
    multiply()
    return 2 * 4000 * 512 * 512 / 1e9 / median([multiply() for _ in range(7)])


def measure(size: Size, phase: str, repeats: int, shared: bool, rate: float) -> dict[str, float]:
    """What a step of one phase costs."""
    import jax
    import numpy as np
    from isomorph_jax import samples, step

    rng = np.random.default_rng(1)
    batches = [jax.device_put(samples.draw(size.samples, rng)) for _ in range(BATCHES)]
    state = step.fresh(size, phase)
    jax.block_until_ready((state, batches))
    compile_seconds, advance = seconds(
        lambda: step.compiled(size, phase, shared, state, batches[0])
    )
    first, state = seconds(lambda: advance(state, batches[0]))
    taken = []
    for k in range(repeats):
        each, state = seconds(lambda: advance(state, batches[(k + 1) % BATCHES]))
        taken.append(each)
    if not all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(state["nets"])):
        raise YardstickError(f"{phase}: weights that are not finite after {repeats + 1} steps")
    gflop = flop_per_step(size, phase, shared) / 1e9
    return {
        "seconds_per_step": median(taken),
        "first_step_seconds": compile_seconds + first,
        "compile_seconds": compile_seconds,
        "gflop_per_step": gflop,
        "xla_gflop_per_step": advance.cost_analysis()["flops"] / 1e9,
        "efficiency": gflop / median(taken) / rate,
    }


def peak_bytes() -> int | None:
    """Peak resident memory, of JAX and all; None where the system does not say."""
    try:
        with open("/proc/self/status") as status:
            lines = [line for line in status if line.startswith("VmHWM:")]
    except OSError:
        return None
    return int(lines[0].split()[1]) * 1024 if lines else None


def bench(options: argparse.Namespace, threads: int) -> dict[str, Any]:
    """All that is printed; `phases` and what they hold are called as in bench's JSON."""
    import jax
    import jaxlib

    rate = matmul_rate()
    size, repeats, shared = SIZES[options.size], options.repeats, options.share_trajectories
    costs = {phase: measure(size, phase, repeats, shared, rate) for phase in phases(options)}
    return {
        "backend": "jax",
        "size": size.name,
        "derivatives": "forward",
        "phases": costs,
        "peak_bytes": peak_bytes(),
        "matmul_gflops": rate,
        "shared_trajectories": shared,
        "threads": threads,
        "jax": jax.__version__,
        "jaxlib": jaxlib.__version__,
    }


def show(measured: dict[str, Any]) -> None:
    peak = measured["peak_bytes"]
    print(
        f"jax {measured['jax']}, jaxlib {measured['jaxlib']}, {measured['threads']} threads, "
        f"{measured['size']}, forward derivatives; "
        f"matrix product {measured['matmul_gflops']:.0f} GFLOP/s; "
        f"peak memory {'unknown' if peak is None else f'{peak / 1e6:.0f} MB'}"
    )
    print("phase      s/step   first step   compiling   GFLOP/step   by XLA   efficiency")
    for phase, cost in measured["phases"].items():
        print(
            f"{phase.replace('_', '-'):9} {cost['seconds_per_step']:7.4f} "
            f"{cost['first_step_seconds']:12.3f} {cost['compile_seconds']:11.3f} "
            f"{cost['gflop_per_step']:12.2f} {cost['xla_gflop_per_step']:8.2f} "
            f"{cost['efficiency']:12.2f}"
        )


def main(words: list[str]) -> int:
    options = arguments(words)
    try:
        require_jax()
        # Before JAX is imported: it counts the cores once.
        threads = keep_to(options.threads)
        import jax

        jax.config.update("jax_platforms", "cpu")
        if options.check:
            from isomorph_jax import check

            check.run(SIZES[options.size])
            return 0
        measured = bench(options, threads)
    except YardstickError as error:
        print(f"jax_step.py: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(json.dumps(measured))
    else:
        show(measured)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
