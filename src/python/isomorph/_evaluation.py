"""Runs held against true frames."""

from __future__ import annotations

import json
import os
from typing import Any, Callable, Sequence

import numpy as np

from . import _native
from ._progress import listener
from ._run import Run
from ._shape import Shape, indices, is_path, rows


class Evaluation:
    """How close a run comes to true frames. Printed, it is a table.

    Lengths are in normalised units, in which the mean surface area of the two ends is 1. `data` has all numbers, as
    `isomorph evaluate --json` prints them.
    """

    def __init__(self, data: dict, table: str):
        self.data = data
        self._table = table

    @property
    def mean(self) -> dict:
        """The means over all frames: `surface` and `carried` of the run, `linear` and `floor`.

        Each has `chamfer`, `hausdorff`, `tracked_rmse` and more. `linear` is straight lines between all true vertices.
        `floor` is two samplings of the truth.
        """
        return self.data["mean"]

    @property
    def frames(self) -> list[dict]:
        """The numbers of each frame between the ends: `frame`, `time`, and what `mean` has."""
        parts = self.data.get("segments", [self.data])
        return [frame for part in parts for frame in part["frames"]]

    def __str__(self) -> str:
        return self._table

    def __repr__(self) -> str:
        return f"<isomorph evaluation at {len(self.frames)} frames>\n{self._table}"


def evaluate(
    run: Run,
    frames: Any,
    keys: Sequence[int] | None = None,
    *,
    faces: Any = None,
    samples: int = 100_000,
    every: int = 1,
    resolution: int | None = None,
    on_event: Callable[[dict], object] | None = None,
    progress: bool | None = None,
) -> Evaluation:
    """Measures a run against true frames: meshes with the same vertices in the same order.

    The numbers are also written to `evaluation.json` in the run.

    Args:
        run: what was trained on some of the frames.
        frames: the path of a `.anime` file or of a folder of meshes; or meshes, or an array `(frames, n, 3)` of vertices
            with `faces`.
        keys: the numbers of the frames that the run was trained on, counted from 0: the first and the last without it.
        faces: `(m, 3)`, where `frames` are vertices alone.
        samples: points sampled on each surface, 100 to 10,000,000.
        every: only every n-th frame is measured.
        resolution: cells of the grid along the longest side of the box, 8 to 2048; as in the recipe without it.
        on_event: see `morph`.
        progress: see `morph`.

    Returns:
        The numbers, and a table of them.

    Raises:
        ValueError: fewer than three frames, frames that are not of one mesh, frames that the run was not trained on.
    """
    if not 100 <= samples <= 10_000_000:
        raise ValueError(f"samples = {samples}: must be 100 to 10000000")
    if every < 1:
        raise ValueError(f"every = {every}: must be 1 or more")
    truth = _native.Frames.read(os.fspath(frames)) if is_path(frames) else in_memory(frames, faces)
    keys = [0, len(truth) - 1] if keys is None else [int(key) for key in keys]
    if len(keys) < 2 or min(keys) < 0:
        raise ValueError(f"keys = {keys}: must be two numbers of frames or more, from 0 on")
    with listener(on_event, progress) as heard:
        text, table = _native.evaluate(run._native, truth, keys, samples, every, resolution, heard)
    return Evaluation(json.loads(text), table)


def in_memory(frames: Any, faces: Any) -> _native.Frames:
    """Frames from arrays or meshes."""
    if faces is None:
        shapes = [Shape.of(frame) for frame in frames]
        if not shapes or any(shape.faces is None for shape in shapes):
            raise ValueError("frames: vertices alone; give faces=, or meshes")
        for number, shape in enumerate(shapes):
            if not np.array_equal(shape.faces, shapes[0].faces):
                raise ValueError(f"frames: {number} has other faces than 0; all must be of one mesh")
        return _native.Frames.of([shape.vertices for shape in shapes], shapes[0].faces)
    vertices = [rows(f"frame {number}", frame, np.float64) for number, frame in enumerate(frames)]
    least = min((len(frame) for frame in vertices), default=0)
    return _native.Frames.of(vertices, indices("faces", faces, least))
