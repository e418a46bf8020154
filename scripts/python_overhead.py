#!/usr/bin/env python3
"""Measures what the package for Python adds to the program: `python3 scripts/python_overhead.py`.

The same recipe is trained by `isomorph train` and by `isomorph.train`, in turns, each in a process of its own. It prints
the medians of the seconds that training took, of the processes as a whole, and of a million points that go in and out.
The two ways must end in the same checkpoint. It needs the package installed, and the program (--isomorph).
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CODE = "import isomorph, sys; isomorph.train(sys.argv[1], sys.argv[2], settings={'result.frames': 0})"
POINTS = """
import isomorph, numpy as np, sys, time
run = isomorph.open(sys.argv[1])
points = np.zeros((1_000_000, 3))
seconds = []
for _ in range(11):
    start = time.perf_counter()
    run.carry(points, 0.0, 0.0)
    seconds.append(time.perf_counter() - start)
print(sorted(seconds)[5])
"""


def trained(command: list[str], run: Path) -> tuple[float, float]:
    """Seconds of the process, and of the training as its log has them."""
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=ROOT)
    whole = time.perf_counter() - start
    last = (run / "metrics.jsonl").read_text("utf-8").strip().splitlines()[-1]
    return whole, json.loads(last)["seconds"]


def checkpoint(run: Path) -> dict[str, bytes]:
    newest = max((run / "checkpoints").iterdir())
    return {path.name: path.read_bytes() for path in newest.iterdir() if path.suffix == ".mpk"}


def ratios(measured: dict[str, list[tuple[float, float]]]) -> tuple[float, float]:
    """Python over the program: of the processes, of the trainings; medians of what ran in one turn."""
    turns = list(zip(measured["program"], measured["python"], strict=True))
    return tuple(statistics.median(python[k] / program[k] for program, python in turns) for k in (0, 1))


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--isomorph", default=str(ROOT / "target/release/isomorph"), help="the program")
    arguments.add_argument("--recipe", default="data/fox/quick.toml", help="relative to the project")
    arguments.add_argument("--turns", type=int, default=5)
    given = arguments.parse_args()
    measured: dict[str, list[tuple[float, float]]] = {"program": [], "python": []}
    with tempfile.TemporaryDirectory() as place:
        for turn in range(given.turns):
            runs = {name: Path(place) / f"{name}-{turn}" for name in measured}
            commands = {
                "program": [given.isomorph, "train", given.recipe, "--run", str(runs["program"]), "--quiet",
                            "--set", "result.frames=0"],
                "python": [sys.executable, "-c", CODE, given.recipe, str(runs["python"])],
            }
            # Whoever is second has warmer files: they take turns.
            for name in list(measured)[:: 1 if turn % 2 == 0 else -1]:
                measured[name].append(trained(commands[name], runs[name]))
            if checkpoint(runs["program"]) != checkpoint(runs["python"]):
                print("the two ways end in other checkpoints", file=sys.stderr)
                return 1
        points = subprocess.run([sys.executable, "-c", POINTS, str(Path(place) / "python-0")], check=True,
                                capture_output=True, text=True)
    for name, seconds in measured.items():
        whole, training = (statistics.median(each[k] for each in seconds) for k in (0, 1))
        print(f"{name:8} {whole:6.2f} s in all, {training:6.2f} s of training")
    whole, training = ratios(measured)
    print(f"python over the program, medians of {given.turns} turns: {whole:.3f} in all, {training:.3f} of training")
    print(f"a million points in and out: {1000 * float(points.stdout):.0f} ms")
    return 0


if __name__ == "__main__":
    sys.exit(main())
