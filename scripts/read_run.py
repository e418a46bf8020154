#!/usr/bin/env python3
"""The networks of a run in numpy: reads what `isomorph export` writes, and gives f and V at points.

    isomorph export runs/fox-quick -o networks.safetensors
    python3 scripts/read_run.py networks.safetensors [--check field.npz]

Prints what the file holds. With --check it compares f and V with those that `isomorph field` wrote of
the same run, and fails if they differ by more than 1e-5 in normalised units. `Run` is made to be
copied: it needs numpy alone. Points are `[n, 3]` in the coordinates of the shapes, times 0 to 1.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np


class Run:
    def __init__(self, path: Path):
        data = Path(path).read_bytes()
        start = 8 + int.from_bytes(data[:8], "little")
        header = json.loads(data[8:start])
        self.about = json.loads(header.pop("__metadata__")["isomorph"])
        self.arrays = {}
        for name, entry in header.items():
            first, last = (start + offset for offset in entry["data_offsets"])
            array = np.frombuffer(data[first:last], "<f4").reshape(entry["shape"])
            self.arrays[name] = array.astype(np.float64)
        frame = self.about["normalisation"]
        self.centre, self.scale = np.array(frame["centre"]), frame["scale"]

    def velocity(self, points: np.ndarray, t: float) -> np.ndarray:
        """V, in the shapes' unit per unit of time."""
        return self._v(self._normalised(points), t) / self.scale

    def distance(self, points: np.ndarray, t: float) -> np.ndarray:
        """f, in the shapes' unit, negative inside."""
        x = self._normalised(points)
        if self.about["geometry"] == "network":
            return self._f("implicit", x, t) / self.scale
        g = self._f("source", self._carried(x, t, 0.0), 0.0)
        h = self._f("target", self._carried(x, t, 1.0), 0.0)
        return ((1 - t) * g + t * h) / self.scale

    def carried(self, points: np.ndarray, start: float, end: float) -> np.ndarray:
        """Where points that are at `points` at time `start` are at time `end`."""
        x = self._normalised(points)
        return points + (self._carried(x, start, end) - x) / self.scale

    def _normalised(self, points: np.ndarray) -> np.ndarray:
        return (np.asarray(points, np.float64) - self.centre) * self.scale

    def _carried(self, x: np.ndarray, start: float, end: float) -> np.ndarray:
        """Runge-Kutta steps of order 4, each span of time with its share of them."""
        steps = max(1, int(np.ceil(abs(end - start) * (self.about["flow_steps"] or 32))))
        dt = (end - start) / steps
        for k in range(steps):
            t = start + k * dt
            a = self._v(x, t)
            b = self._v(x + dt / 2 * a, t + dt / 2)
            c = self._v(x + dt / 2 * b, t + dt / 2)
            d = self._v(x + dt * c, t + dt)
            x = x + dt / 6 * (a + 2 * b + 2 * c + d)
        return x

    def _f(self, name: str, x: np.ndarray, t: float) -> np.ndarray:
        about = self.about["networks"][name]
        features = [self._encoded(x, about["frequencies"]), np.full((len(x), 1), t)]
        value = self._mlp(name, np.hstack(features))[:, 0]
        if about["activation"] == "sine":
            rounded = np.sqrt((x**2).sum(1) + 0.01)
            value = value + rounded - np.sqrt(about["sphere_radius"] ** 2 + 0.01)
        return value

    def _v(self, x: np.ndarray, t: float) -> np.ndarray:
        about = self.about["networks"]["velocity"]
        features = self._encoded(x, about["frequencies"])
        if about["time_dependent"]:
            features = np.hstack([features, np.full((len(x), 1), t - 0.5)])
        return self._mlp("velocity", features)

    @staticmethod
    def _encoded(x: np.ndarray, frequencies: int) -> np.ndarray:
        blocks = [x]
        for k in np.pi * 2.0 ** np.arange(frequencies):
            blocks += [np.sin(k * x) / k, np.cos(k * x) / k]
        return np.hstack(blocks) / np.sqrt(2 * frequencies + 1)

    def _mlp(self, name: str, features: np.ndarray) -> np.ndarray:
        about, x = self.about["networks"][name], features
        for k in range(about["depth"] + 1):
            if k == about["skip"] and k > 0:
                x = np.hstack([x, features]) / np.sqrt(2)
            layer = f"{name}.mlp.layers.{k}"
            x = x @ self.arrays[f"{layer}.weight"] + self.arrays[f"{layer}.bias"]
            if k == about["depth"]:
                return x
            beta = about["beta"]
            if about["activation"] == "sine":
                x = np.sin(beta * x)
            else:
                x = np.maximum(x, 0) + np.log1p(np.exp(-np.abs(beta * x))) / beta
        raise AssertionError("the output layer returns")


def check(run: Run, path: Path) -> float:
    """The largest difference from a grid of `isomorph field`, in normalised units."""
    grid = np.load(path)
    points = np.stack(np.meshgrid(grid["x"], grid["y"], grid["z"], indexing="ij"), -1)
    points, worst = points.reshape(-1, 3), 0.0
    for k, t in enumerate(grid["times"]):
        f = run.distance(points, t) - grid["f"][k].reshape(-1)
        v = run.velocity(points, t) - grid["velocity"][k].reshape(-1, 3)
        worst = max(worst, np.abs(f).max(), np.abs(v).max())
    return worst * run.scale


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("networks", type=Path, help="the file that isomorph export wrote")
    parser.add_argument("--check", type=Path, help="the file that isomorph field wrote of the run")
    options = parser.parse_args(words)
    run = Run(options.networks)
    for name, array in run.arrays.items():
        print(f"{name:40} {'x'.join(map(str, array.shape))}")
    if options.check:
        off = check(run, options.check)
        print(f"f and V differ from isomorph's by {off:.1e} at most, in normalised units")
        return int(off > 1e-5)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
