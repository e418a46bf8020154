"""A run that was trained, opened."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import webbrowser
from pathlib import Path
from typing import Any, Callable

import numpy as np

from . import _native
from ._progress import in_notebook, listener
from ._shape import rows


class Surface(tuple):
    """A surface: vertices `(n, 3)` and faces `(m, 3)`, to be unpacked; unit normals `(n, 3)` in `normals`."""

    normals: np.ndarray

    def __new__(cls, vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray) -> Surface:
        made = super().__new__(cls, (vertices, faces))
        made.normals = normals
        return made

    @property
    def vertices(self) -> np.ndarray:
        """`(n, 3)`, float64, in the coordinates of the shapes."""
        return self[0]

    @property
    def faces(self) -> np.ndarray:
        """`(m, 3)`, uint32, counter-clockwise from outside."""
        return self[1]

    def __getnewargs__(self):
        return (*self, self.normals)

    def __repr__(self) -> str:
        return f"<isomorph surface of {len(self[0])} vertices and {len(self[1])} faces>"


class Run:
    """The motion between two shapes, or through more. Times are 0 (the source) to 1 (the target), or in the unit of the
    recipe's key frames. Coordinates are those of the shapes. `notes` has what was assumed, decided and doubted on the way.

    Several threads may use one run. A copy, and what is unpickled, opens the folder again.
    """

    def __init__(self, native: _native.Run, notes: list[str] | None = None):
        self._native = native
        #: What was assumed, decided and doubted on the way, one sentence each.
        self.notes = notes or []

    @property
    def path(self) -> Path:
        """The folder of the run."""
        return Path(self._native.path())

    @property
    def times(self) -> list[float]:
        """The times of the key frames: `[0.0, 1.0]`, or those that the recipe gives."""
        return self._native.key_times()

    def _half_way(self, t: float | None) -> float:
        return (self.times[0] + self.times[-1]) / 2 if t is None else float(t)

    @property
    def recipe(self) -> str:
        """The recipe, every key with its value, as TOML."""
        return self._native.recipe()

    @property
    def metrics(self) -> list[dict]:
        """The logged steps: `step`, `seconds`, `total`, `terms` and more."""
        return [json.loads(line) for line in self._native.metrics()]

    def surface(self, t: float | None = None, resolution: int = 192) -> Surface:
        """The surface at a time.

        Args:
            t: the time; half-way without it.
            resolution: cells of the grid along the longest side of the box, 8 to 2048.

        Returns:
            `vertices (n, 3)` float64 and `faces (m, 3)` uint32, to be unpacked; `.normals (n, 3)` float32 beside them.

        Raises:
            ValueError: a time or a resolution out of range.
        """
        return Surface(*self._native.surface(self._half_way(t), resolution))

    def carry(self, points: Any, start: float | None = None, end: float | None = None) -> np.ndarray:
        """Moves points along the motion.

        Args:
            points: `(n, 3)`, where they are at time `start`. float64 in C order is read without a copy.
            start: the time at which they are given; that of the first shape without it.
            end: the time to which they are moved; that of the last shape without it.

        Returns:
            Where they are at time `end`, `(n, 3)` float64.

        Raises:
            ValueError: a time out of range, another shape of array.
        """
        first, *_, last = self.times
        start, end = (first if start is None else float(start)), (last if end is None else float(end))
        return self._native.carry(rows("points", points, np.float64), start, end)

    def velocity(self, points: Any, t: float | None = None) -> np.ndarray:
        """The velocity of what is at some points.

        Args:
            points: `(n, 3)`.
            t: the time; half-way without it.

        Returns:
            `(n, 3)` float64, in units of length per unit of time.

        Raises:
            ValueError: a time out of range, another shape of array.
        """
        return self._native.velocity(rows("points", points, np.float64), self._half_way(t))

    def distance(self, points: Any, t: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        """The signed distance of points from the surface at a time.

        Args:
            points: `(n, 3)`.
            t: the time; half-way without it.

        Returns:
            The distances `(n,)`, negative inside, and their gradients `(n, 3)`, float64.

        Raises:
            ValueError: a time out of range, another shape of array.
        """
        return self._native.distance(rows("points", points, np.float64), self._half_way(t))

    def save_glb(
        self,
        path: str | os.PathLike[str],
        what: str | None = None,
        frames: int = 25,
        resolution: int | None = None,
        compact: bool = False,
        on_event: Callable[[dict], object] | None = None,
        progress: bool | None = None,
    ) -> Path:
        """Writes an animated glTF, for Blender and browsers.

        Args:
            path: the file; it must end in `.glb`.
            what: "carried", the source's own mesh moving, or "surface", a surface at each time; "carried" where the
                source is a mesh, without it.
            frames: how many times, evenly from the first shape to the last.
            resolution: see `surface`; as in the recipe without it.
            compact: positions in 16 bits: half of the size, and fewer programs read it.
            on_event: see `morph`.
            progress: see `morph`.

        Returns:
            The path.

        Raises:
            ValueError: another ending; "carried" of a cloud.
        """
        if what not in (None, "carried", "surface"):
            raise ValueError(f'what = {what!r}: must be "carried" or "surface"')
        path = Path(path)
        if path.suffix.lower() != ".glb":
            raise ValueError(f"{path}: must end in .glb")
        path.parent.mkdir(parents=True, exist_ok=True)
        # Beside its place, so that it is moved there whole.
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".isomorph-") as folder:
            with listener(on_event, progress) as heard:
                self._native.animate(folder, frames, resolution, compact, heard)
            made = {name: Path(folder) / f"{name}.glb" for name in ("carried", "surface")}
            if what == "carried" and not made[what].exists():
                raise ValueError('what = "carried": the source is a point cloud; take "surface"')
            chosen = what or ("carried" if made["carried"].exists() else "surface")
            shutil.move(made[chosen], path)
        return path

    def page(self) -> Path:
        """The page that plays the run in a browser, made anew where it is old."""
        return Path(self._native.page())

    def show(self, height: int = 600) -> Any:
        """Shows the page: in a notebook within it, else in the browser.

        Args:
            height: of the frame in a notebook, in pixels.

        Returns:
            What a notebook shows; None elsewhere.
        """
        page = self.page()
        if in_notebook():
            from html import escape

            from IPython.display import HTML

            text = escape(page.read_text("utf-8"), quote=True)
            return HTML(f'<iframe srcdoc="{text}" width="100%" height="{int(height)}" frameborder="0"></iframe>')
        webbrowser.open(page.resolve().as_uri())
        return None

    def __fspath__(self) -> str:
        return str(self.path)

    def __reduce__(self):
        return (open, (str(self.path.resolve()),))

    def __repr__(self) -> str:
        return f"<isomorph run {self.path}>"


def open(run: str | os.PathLike[str], *, backend: str = "flex", device: str | None = None) -> Run:
    """Opens the newest checkpoint of a run, whoever made it.

    Args:
        run: its folder.
        backend: see `morph`.
        device: see `morph`.

    Returns:
        The run.

    Raises:
        ValueError: no run, or one without a checkpoint; a backend or a device that is not there.
    """
    return Run(_native.open(os.fspath(run), backend, device))
