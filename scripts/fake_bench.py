#!/usr/bin/env python3
"""Answers like `isomorph bench`, for test_scaling.py: the step takes as many seconds as it has GFLOP.

These are the points in thousands, times the square of the width in hundreds, times depth and time
steps, over the threads. Every call adds its arguments and its number of threads to the file
FAKE_LOG, a JSON list per line; a call with FAKE_FAILS among its arguments fails with status 1,
FAKE_THREADS is the number of threads that is answered instead of the true one, and FAKE_PEAK turns
the peak memory into null.
"""

import json
import os
import sys


def main(words):
    if words == ["--version"]:
        print("isomorph 0.0.0-fake")
        return 0
    threads = int(os.environ["RAYON_NUM_THREADS"])
    assert words[:2] == ["bench", "--json"], words
    with open(os.environ["FAKE_LOG"], "a") as log:
        log.write(json.dumps([*words, threads]) + "\n")
    if os.environ.get("FAKE_FAILS") in words:
        print("isomorph: bench: no memory", file=sys.stderr)
        return 1
    values = [words[at + 1] for at, word in enumerate(words) if word == "--set"]
    recipe = {key: int(value) for key, value in (each.split("=") for each in values)}
    assert recipe["implicit.width"] == recipe["velocity.width"]
    assert recipe["implicit.depth"] == recipe["velocity.depth"]
    gflop = recipe["training.batch"] / 1000 * (recipe["velocity.width"] / 100) ** 2
    gflop *= recipe["velocity.depth"] * recipe["training.time-steps"]
    phase = {
        "seconds_per_step": gflop / threads,
        "first_step_seconds": 2 * gflop / threads,
        "gflop_per_step": gflop,
        "efficiency": 0.5,
    }
    measured = {
        "backend": words[words.index("--backend") + 1],
        "size": "shipped",
        "derivatives": "forward",
        "threads": int(os.environ.get("FAKE_THREADS", threads)),
        "phases": {"warm_up": phase, "joint": phase},
        "peak_bytes": None if "FAKE_PEAK" in os.environ else 10**6 * recipe["training.batch"],
        "matmul_gflops": 2.0 * threads,
    }
    print(json.dumps(measured))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
