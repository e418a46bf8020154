#!/usr/bin/env python3
"""What a run has learned, in numpy: reads what `isomorph export` writes, and gives f and V at points.

    isomorph export runs/fox-quick -o networks.safetensors
    python3 scripts/read_run.py networks.safetensors [--check field.npz]

Prints what the file holds. With --check it compares f and V with those that `isomorph field` wrote of
the same run, and fails if they differ by more than 1e-5 in normalised units. `Run` is made to be
copied: it needs numpy alone. Points are `[n, 3]` in the coordinates of the shapes, times those of the run's shapes. Of
splines f is the blend of two signed distances, which are computed triangle by triangle here: slowly.
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
            kind, number = {"F32": ("<f4", np.float64), "U32": ("<u4", np.int64)}[entry["dtype"]]
            array = np.frombuffer(data[first:last], kind).reshape(entry["shape"])
            self.arrays[name] = array.astype(number)
        frame = self.about["normalisation"]
        self.centre, self.scale = np.array(frame["centre"]), frame["scale"]
        self.first, last = self.about["clock"]
        self.span = last - self.first
        self.splines = self.about.get("splines")
        # From each key frame to the next: of networks there are none where there are two.
        self.intervals = (self.splines or self.about).get("intervals")
        if self.about["placements"]:
            raise ValueError("shapes were laid onto each other (data.align): use `isomorph field`")

    def velocity(self, points: np.ndarray, t: float) -> np.ndarray:
        """V, in the shapes' unit per unit of time."""
        return self._v(self._normalised(points), self._unit(t)) / self.scale / self.span

    def distance(self, points: np.ndarray, t: float) -> np.ndarray:
        """f, in the shapes' unit, negative inside."""
        x, t = self._normalised(points), self._unit(t)
        if self.splines:
            return self._blend(x, t) / self.scale
        if self.about["geometry"] == "network":
            return self._f("implicit", x, t) / self.scale
        if self.intervals:
            k, part = self._part(t)
            own = (t - part["from"]) / (part["to"] - part["from"])
            weight = own**2 * (3 - 2 * own)
            g = self._f(f"end.{k:04}", self._carried(x, t, part["from"]), 0.0)
            h = self._f(f"end.{k + 1:04}", self._carried(x, t, part["to"]), 0.0)
            return ((1 - weight) * g + weight * h) / self.scale
        g = self._f("source", self._carried(x, t, 0.0), 0.0)
        h = self._f("target", self._carried(x, t, 1.0), 0.0)
        return ((1 - t) * g + t * h) / self.scale

    def carried(self, points: np.ndarray, start: float, end: float) -> np.ndarray:
        """Where points that are at `points` at time `start` are at time `end`."""
        x, start, end = self._normalised(points), self._unit(start), self._unit(end)
        return points + (self._carried(x, start, end) - x) / self.scale

    def _unit(self, t: float) -> float:
        return (t - self.first) / self.span

    def _normalised(self, points: np.ndarray) -> np.ndarray:
        return (np.asarray(points, np.float64) - self.centre) * self.scale

    def _carried(self, x: np.ndarray, start: float, end: float) -> np.ndarray:
        """Runge-Kutta steps of order 4, each span of time with its share of them."""
        if self.intervals:
            parts = self.intervals
            for part in parts if start <= end else parts[::-1]:
                a, b = (np.clip(t, part["from"], part["to"]) for t in (start, end))
                if a != b:
                    own = [(t - part["from"]) / (part["to"] - part["from"]) for t in (a, b)]
                    # The interval's own field, also at its very ends.
                    x = self._steps(x, a, b, abs(own[1] - own[0]) * part["steps"], part)
            return x
        return self._steps(x, start, end, abs(end - start) * (self.about["flow_steps"] or 32))

    def _steps(self, x, start, end, share, part=None):
        steps = max(1, int(np.ceil(share)))
        dt = (end - start) / steps
        for k in range(steps):
            t = start + k * dt
            a = self._v(x, t, part)
            b = self._v(x + dt / 2 * a, t + dt / 2, part)
            c = self._v(x + dt / 2 * b, t + dt / 2, part)
            d = self._v(x + dt * c, t + dt, part)
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

    def _v(self, x: np.ndarray, t: float, part: dict | None = None) -> np.ndarray:
        if self.splines:
            return self._spline(x, t, part or self._part(t)[1])
        about = self.about["networks"]["velocity"]
        if "cells" in about:
            return self._trained_spline(x, t, about)
        features = self._encoded(x, about["frequencies"])
        if self.intervals:
            return self._in_turns(self._mlp("velocity", features), t, part or self._part(t)[1])
        if about["time_dependent"]:
            features = np.hstack([features, np.full((len(x), 1), t - 0.5)])
        return self._mlp("velocity", features)

    def _part(self, t: float) -> tuple[int, dict]:
        """The interval of a time: the last one that has begun."""
        parts = self.intervals
        k = max((k for k, part in enumerate(parts) if part["from"] <= t), default=0)
        return k, parts[k]

    def _in_turns(self, outputs: np.ndarray, t: float, part: dict) -> np.ndarray:
        """The outputs that act in an interval, by its functions of time."""
        first = 3 * self.intervals.index(part)
        own = (t - part["from"]) / (part["to"] - part["from"])
        weights = np.array(part["time_functions"]) @ own ** np.arange(3)
        v = np.einsum("nka,k->na", outputs[:, first : first + 9].reshape(-1, 3, 3), weights)
        return v / (part["to"] - part["from"])

    def _trained_spline(self, x: np.ndarray, t: float, grid: dict) -> np.ndarray:
        """Splines beside end fields that are networks: of the polynomials 1 and 2 t - 1."""
        c = self.arrays["velocity.coefficients"].reshape(*grid["nodes"], -1, 3)
        functions = np.array([1.0, 2 * t - 1])[: c.shape[3]]
        return self._on_grid(x, np.einsum("xyzka,k->xyza", c, functions), grid)

    def _spline(self, x: np.ndarray, t: float, part: dict) -> np.ndarray:
        """Polynomials in the interval's own time."""
        c = self.arrays[f"velocity.{self.intervals.index(part)}.coefficients"]
        own = (t - part["from"]) / (part["to"] - part["from"])
        c = np.einsum("xyzka,k->xyza", c, np.array(part["time_functions"]) @ own ** np.arange(3))
        # The coefficients are of the interval's own time.
        return self._on_grid(x, c, part) / (part["to"] - part["from"])

    @staticmethod
    def _on_grid(x: np.ndarray, c: np.ndarray, grid: dict) -> np.ndarray:
        """Quadratic B-splines with coefficients `[nodes x, nodes y, nodes z, 3]`."""
        place = np.clip((x - grid["lower"]) / grid["spacing"], 0, grid["cells"])
        cell = np.minimum(place.astype(int), np.array(grid["cells"]) - 1)
        u = place - cell
        weights = np.stack([(1 - u) ** 2 / 2, 0.5 + u * (1 - u), u**2 / 2])
        v = np.zeros((len(x), 3))
        for i, j, k in np.ndindex(3, 3, 3):
            share = weights[i, :, 0] * weights[j, :, 1] * weights[k, :, 2]
            v += share[:, None] * c[cell[:, 0] + i, cell[:, 1] + j, cell[:, 2] + k]
        return v

    def _blend(self, x: np.ndarray, t: float) -> np.ndarray:
        """The distances of the shapes before and after, where the point comes from and goes to."""
        k, part = self._part(t)
        if any(self.splines["partial"][k : k + 2]):
            raise ValueError("a shape is known in part: its blend is more than this script knows")
        own = (t - part["from"]) / (part["to"] - part["from"])
        weight = own if len(self.intervals) == 1 else own**2 * (3 - 2 * own)
        g = self._signed(k, self._carried(x, t, part["from"]))
        h = self._signed(k + 1, self._carried(x, t, part["to"]))
        return (1 - weight) * g + weight * h

    def _signed(self, shape: int, x: np.ndarray) -> np.ndarray:
        """The signed distance of a closed mesh, or of an open sheet of some thickness."""
        points, triangles = (self.arrays[f"shape.{shape}.{of}"] for of in ("points", "triangles"))
        at_once = max(1, 2_000_000 // len(triangles))
        chunks = [x[k : k + at_once] for k in range(0, len(x), at_once)]
        found = np.concatenate([signed_distance(chunk, points[triangles]) for chunk in chunks])
        # Exports of before know no sheets.
        thickness = self.splines.get("thickness", [None] * (shape + 1))[shape]
        return found if thickness is None else np.abs(found) - thickness / 2

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


def signed_distance(x: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Distances of points from triangles `[m, 3, 3]`, negative where the winding number is over 1/2."""
    d = corners[None] - x[:, None, None]
    a, b, c = d[:, :, 0], d[:, :, 1], d[:, :, 2]
    nearest = np.full(len(x), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        edge = q - p
        along = -(p * edge).sum(-1) / np.maximum((edge**2).sum(-1), 1e-30)
        off = p + np.clip(along, 0, 1)[..., None] * edge
        nearest = np.minimum(nearest, (off**2).sum(-1).min(1))
    normal = np.cross(b - a, c - a)
    inside = [(np.cross(p, q) * normal).sum(-1) >= 0 for p, q in ((a, b), (b, c), (c, a))]
    square = (a * normal).sum(-1) ** 2 / np.maximum((normal**2).sum(-1), 1e-30)
    plane = np.where(np.logical_and.reduce(inside), square, np.inf)
    nearest = np.minimum(nearest, plane.min(1))
    # Van Oosterom and Strackee, "The solid angle of a plane triangle", 1983.
    la, lb, lc = (np.sqrt((p**2).sum(-1)) for p in (a, b, c))
    volume = (a * np.cross(b, c)).sum(-1)
    below = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    winding = np.arctan2(volume, below).sum(1) / (2 * np.pi)
    return np.where(winding > 0.5, -1, 1) * np.sqrt(nearest)


def check(run: Run, path: Path) -> float:
    """The largest difference from a grid of `isomorph field`, in normalised units."""
    grid = np.load(path)
    points = np.stack(np.meshgrid(grid["x"], grid["y"], grid["z"], indexing="ij"), -1)
    points, worst = points.reshape(-1, 3), 0.0
    for k, t in enumerate(grid["times"]):
        f = run.distance(points, t) - grid["f"][k].reshape(-1)
        v = run.velocity(points, t) - grid["velocity"][k].reshape(-1, 3)
        worst = max(worst, np.abs(f).max(), np.abs(v).max() * run.span)
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
