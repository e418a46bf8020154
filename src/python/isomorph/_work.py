"""What takes time: training, pairs, normals."""

from __future__ import annotations

import os
import warnings
from hashlib import sha256
from pathlib import Path
from typing import Any, Callable, Iterable, Mapping, Sequence

import numpy as np

from . import _native
from ._progress import listener
from ._run import Run
from ._shape import Shape, ShapeLike, indices, is_path, name_of, rows


class IsomorphWarning(UserWarning):
    """Something speaks against a result."""


def morph(
    source: ShapeLike,
    target: ShapeLike,
    *more: ShapeLike,
    preset: str = "instant",
    times: Sequence[float] | None = None,
    pairs: Any = None,
    align: str = "auto",
    run: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    frames: int = 13,
    settings: Mapping[str, Any] | None = None,
    backend: str = "flex",
    device: str | None = None,
    on_event: Callable[[dict], object] | None = None,
    progress: bool | None = None,
) -> Run:
    """Computes the motion from one shape to another, or smoothly through more of them.

    Args:
        source: the shape at time 0; see `Shape.of` for what is a shape.
        target: the shape at time 1.
        more: further shapes, at the times 2, 3 and so on.
        preset: "instant" (seconds), "quick", "default" (minutes) or "quality".
        times: those of the shapes, in any unit, ascending; 0, 1, 2 and so on without it.
        pairs: corresponding points as an array `(n, 2)` of vertex numbers, or the path of a file. Or "same-vertices",
            "match" (found) or "none". Chosen by the shapes without it.
        align: how shapes are laid onto each other first: "none", "rigid", "similarity", or "auto", which does what is
            clearly needed. Results lie where the shapes do.
        run: the folder of the run; runs/SOURCE-TARGET without it.
        overwrite: whether a run that is there is replaced.
        frames: the number of surfaces that are written into the folder.
        settings: keys of the recipe, as in `{"training": {"steps": 2000}}` or `{"training.steps": 2000}`.
        backend: what does the arithmetic of networks: "flex" or "ndarray" on processors, "wgpu" on GPUs.
        device: of "wgpu": "default", "cpu", or a kind of GPU with an optional number, as in "discrete:1".
        on_event: called with each event of the work, a dict with the name `event`.
        progress: whether a bar of `tqdm` is shown; without it where nobody listens, `tqdm` is installed, and there is a
            terminal or a notebook.

    Returns:
        The run. Its `notes` have what was assumed and decided.

    Raises:
        ValueError: a shape, a key or a value that is wrong; a run that is there already.
        isomorph.TrainingError: work that failed.
        KeyboardInterrupt: on Ctrl-C; a checkpoint is left, and `resume` goes on.
    """
    run = Path(run) if run else Path("runs") / f"{name_of(source, 'source')}-{name_of(more[-1] if more else target, 'target')}"
    kept = Kept(run)
    files = [kept.shape(source, "source"), kept.shape(target, "target")]
    files += [kept.shape(shape, f"shape-{number}") for number, shape in enumerate(more, 2)]
    times = None if times is None else [float(time) for time in times]
    planned = _native.plan(files, times, preset, kept.pairs(pairs), align, frames, changes(settings))
    text, assumed, doubts = planned
    notes = list(assumed)
    for finding, cure in doubts:
        notes.append(f"doubtful: {finding}; {cure}")
        warnings.warn(f"{finding}; {cure}", IsomorphWarning, stacklevel=2)
    given = (text, str(run / "recipe.toml"), [], str(run), overwrite, backend, device)
    return work(lambda heard: _native.train(*given, heard), notes, on_event, progress)


def train(
    recipe: str | os.PathLike[str] | Mapping[str, Any],
    run: str | os.PathLike[str],
    *,
    overwrite: bool = False,
    settings: Mapping[str, Any] | None = None,
    backend: str = "flex",
    device: str | None = None,
    on_event: Callable[[dict], object] | None = None,
    progress: bool | None = None,
) -> Run:
    """Trains a recipe into a folder.

    Args:
        recipe: the path of a TOML file, TOML itself (with a line end in it), or nested dicts. Paths in it are relative to
            the file, else to the working directory.
        run: the folder of the run.
        overwrite: whether a run that is there is replaced.
        settings: see `morph`.
        backend: see `morph`.
        device: see `morph`.
        on_event: see `morph`.
        progress: see `morph`.

    Returns:
        The run.

    Raises:
        ValueError: a recipe or a file that is wrong; a run that is there already.
        isomorph.TrainingError: work that failed.
        KeyboardInterrupt: on Ctrl-C; a checkpoint is left, and `resume` goes on.
    """
    if isinstance(recipe, Mapping):
        text, origin = toml(recipe), Path.cwd() / "recipe.toml"
    elif isinstance(recipe, str) and "\n" in recipe:
        text, origin = recipe, Path.cwd() / "recipe.toml"
    else:
        origin = Path(recipe)
        try:
            text = origin.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as reason:
            raise ValueError(f"{origin}: cannot be read ({reason})") from None
    given = (text, str(origin), changes(settings), os.fspath(run), overwrite, backend, device)
    return work(lambda heard: _native.train(*given, heard), [], on_event, progress)


def resume(
    run: str | os.PathLike[str],
    *,
    append: Iterable[str | os.PathLike[str]] = (),
    times: Sequence[float] | None = None,
    pairs: str | os.PathLike[str] | None = None,
    settings: Mapping[str, Any] | None = None,
    backend: str = "flex",
    device: str | None = None,
    on_event: Callable[[dict], object] | None = None,
    progress: bool | None = None,
) -> Run:
    """Goes on with a run from its newest checkpoint, to the last step of its recipe.

    Args:
        run: the folder of the run, or a run.
        append: files of further shapes, which the motion goes on to after the run's last one. What is there is kept.
        times: their times, in the run's own unit; without them each is as far from the one before as the run's last two.
        pairs: what is known of their points: "same-vertices", "match", "none" or a file; without it as between the run's
            last two.
        settings: keys that change, such as `{"training.steps": 2000}`; see `morph`.
        backend: see `morph`.
        device: see `morph`.
        on_event: see `morph`.
        progress: see `morph`.

    Returns:
        The run.

    Raises:
        ValueError: no run, a key or a value that is wrong.
        isomorph.TrainingError: a key that a trained network cannot change; work that failed.
        KeyboardInterrupt: on Ctrl-C; a checkpoint is left.
    """
    known = None if pairs is None else os.fspath(pairs)
    appended = ([os.fspath(shape) for shape in append], None if times is None else list(times), known)
    given = (os.fspath(run), appended, changes(settings), backend, device)
    return work(lambda heard: _native.resume(*given, heard), [], on_event, progress)


def match(
    source: ShapeLike,
    target: ShapeLike,
    *,
    aligned: bool = False,
    confidence: float = 0.5,
    on_event: Callable[[dict], object] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Finds pairs of corresponding vertices of two shapes.

    Args:
        source: a shape; see `Shape.of`.
        target: the same thing in another pose or state.
        aligned: whether the shapes are in one frame, so that no turn is looked for.
        confidence: the least that a pair must have, 0 to 1.
        on_event: see `morph`.

    Returns:
        The pairs, `(n, 2)` numbers of vertices of the source and of the target, and how sure each is, `(n,)` from 0 to 1.

    Raises:
        ValueError: a shape that is wrong, or shapes that cannot be matched.
    """
    shapes = [Shape.of(source), Shape.of(target)]
    given = [(shape.vertices, shape.faces) for shape in shapes]
    with listener(on_event, False) as heard:
        return _native.match_shapes(*given, aligned, confidence, heard)


def estimate_normals(points: Any) -> np.ndarray:
    """Estimates the normals of a cloud.

    Args:
        points: `(n, 3)`.

    Returns:
        Unit vectors `(n, 3)`, out of the shape, float32.

    Raises:
        ValueError: another shape of array; too few points.
    """
    return _native.estimate_normals(rows("points", points, np.float64))


def work(do: Callable, notes: list[str], on_event, progress) -> Run:
    """Does something, gathers what is noted on the way, and warns of what speaks against the result."""
    doubtful = []

    def note(event: dict) -> None:
        if event["event"] == "note":
            notes.append(event["text"])
        elif event["event"] == "doubtful":
            doubtful.append(f"{event['finding']}; {event['cure']}")

    with listener(on_event, progress, also=note) as listens:
        native = do(listens)
    for text in doubtful:
        notes.append(f"doubtful: {text}")
        warnings.warn(text, IsomorphWarning, stacklevel=3)
    return Run(native, notes)


class Kept:
    """The files that a run needs of what is in memory: they lie in a folder beside it, named after it.

    Each is named after its content. So what an earlier run of the same folder was made of stays as it was, whatever
    becomes of the new one.
    """

    def __init__(self, run: Path):
        self.folder = run.parent / f"{run.name}.shapes"

    def shape(self, what: ShapeLike, name: str) -> str:
        if is_path(what):
            return os.fspath(what)
        shape = Shape.of(what)
        path = self.place(name, ".ply", shape.vertices, shape.faces, shape.normals)
        shape.save(path)
        return str(path)

    def pairs(self, pairs: Any) -> str | None:
        if pairs is None or isinstance(pairs, str):
            return pairs
        if is_path(pairs):
            return os.fspath(pairs)
        numbers = indices("pairs", pairs, 1 << 32, columns=2)
        path = self.place("pairs", ".csv", numbers)
        np.savetxt(path, numbers, fmt="%d", delimiter=",", header="source_index,target_index", comments="")
        return str(path)

    def place(self, name: str, ending: str, *arrays: np.ndarray | None) -> Path:
        digest = sha256()
        for array in arrays:
            digest.update(b"" if array is None else str(array.shape).encode() + array.tobytes())
        self.folder.mkdir(parents=True, exist_ok=True)
        return self.folder / f"{name}-{digest.hexdigest()[:12]}{ending}"


def changes(settings: Mapping[str, Any] | None) -> list[str]:
    """Keys of the recipe as the command line takes them: `training.steps=2000`."""
    return [f"{key}={word(value)}" for key, value in flat(settings or {})]


def flat(settings: Mapping[str, Any], before: str = ""):
    for key, value in settings.items():
        name = before + key.replace("_", "-")
        if isinstance(value, Mapping):
            yield from flat(value, f"{name}.")
        else:
            yield name, value


def word(value: Any) -> str:
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(quoted(each) for each in value) + "]"
    return str(value)


def toml(recipe: Mapping[str, Any]) -> str:
    """Nested dicts as TOML with dotted keys."""
    return "".join(f"{key} = {quoted(value)}\n" for key, value in flat(recipe))


def quoted(value: Any) -> str:
    if isinstance(value, (str, os.PathLike)):
        text = os.fspath(value).replace("\\", "\\\\").replace('"', '\\"')
        return f'"{text}"'
    if isinstance(value, np.generic):
        value = value.item()
    return word(value)
