"""Many runs from one list of jobs."""

from __future__ import annotations

import json
import os
import sys
import warnings
from pathlib import Path
from typing import Any, Callable, Iterable, Iterator, Mapping

from . import _native
from ._progress import listener
from ._run import Run, open
from ._work import IsomorphWarning, Kept, changes, toml


class Batch:
    """Many runs from one list of jobs, each in a process of its own, some at a time.

    What is done is not done again: a batch may be stopped, extended, and run again, here or by `isomorph batch`.

    Args:
        jobs: the path of a file of jobs, as `isomorph batch` reads it, or a list. In a list are pairs
            `(source, target)` of shapes, or dicts with `source` and `target`. `name`, `pairs` and `settings` are optional.
        folder: where the runs go, for jobs that are not a file.
        preset: of all runs, for jobs that are not a file.
        settings: keys of all recipes, for jobs that are not a file; see `morph`.

    Raises:
        ValueError: a file that cannot be read, two jobs of one name, a key or a value that no recipe has.
    """

    def __init__(
        self,
        jobs: str | os.PathLike[str] | Iterable[tuple[Any, Any] | Mapping[str, Any]],
        *,
        folder: str | os.PathLike[str] = "runs/batch",
        preset: str = "instant",
        settings: Mapping[str, Any] | None = None,
    ):
        if isinstance(jobs, (str, os.PathLike)):
            self._file = Path(jobs)
        else:
            self._file = written(list(jobs), Path(folder), preset, changes(settings))
        self._native = _native.Batch(str(self._file))

    @property
    def folder(self) -> Path:
        """Where the runs go."""
        return Path(self._native.folder())

    @property
    def names(self) -> list[str]:
        """The names of all jobs, in their order."""
        return self._native.names()

    def run(
        self,
        jobs_at_a_time: int | None = None,
        *,
        backend: str = "flex",
        device: str | None = None,
        on_event: Callable[[dict], object] | None = None,
        progress: bool | None = None,
    ) -> list[dict]:
        """Works through all jobs that are not done. A job that fails stops nothing else, and is a warning.

        Args:
            jobs_at_a_time: by the cores and the memory of this machine without it.
            backend: see `morph`.
            device: see `morph`.
            on_event: called with each of `job_started`, `job_done`, `job_failed` and `job_elsewhere`, a dict.
            progress: whether a bar is shown; see `morph`.

        Returns:
            Where each job stands; see `status`.

        Raises:
            ValueError: a backend or a device that is not there.
            KeyboardInterrupt: on Ctrl-C; jobs that were at work leave checkpoints.
        """
        if jobs_at_a_time is not None and jobs_at_a_time < 1:
            raise ValueError(f"jobs_at_a_time = {jobs_at_a_time}: must be 1 or more")
        place = str(Path(__file__).resolve().parent.parent)
        code = f"import sys; sys.path.insert(0, {place!r}); from isomorph._job import main; main()"
        command = [sys.executable, "-c", code, str(self._file.resolve()), backend, device or ""]
        with listener(on_event, progress, jobs=len(self)) as heard:
            self._native.run(command, jobs_at_a_time, backend, device, heard)
        found = self.status()
        for job in found:
            if job["state"] == "failed":
                warnings.warn(f"{job['name']} failed: {job.get('reason', '')}", IsomorphWarning, stacklevel=2)
        return found

    def status(self) -> list[dict]:
        """Where each job stands, by its folder alone.

        Returns:
            A dict for each job: `name`, `state` ("waiting", "running", "interrupted", "failed" with `reason`, or
            "done"), `step`, `steps`, `seconds`, `doubts` and more.
        """
        return [json.loads(text) for text in self._native.status()]

    def collect(self) -> list[dict]:
        """Gathers the figures of all runs, and writes `results.csv`, `.json`, `.parquet` and `index.html` into the folder.

        Returns:
            What `results.json` holds: a dict for each job, as of `status`, with `evaluation` where it was evaluated.

        Raises:
            isomorph.TrainingError: the folder cannot be written.
        """
        files = [Path(path) for path in self._native.collect()]
        found = next(path for path in files if path.suffix == ".json")
        return json.loads(found.read_text("utf-8"))

    def __getitem__(self, name: str) -> Run:
        """The run of a job, opened."""
        if name not in self.names:
            raise KeyError(name)
        return open(self.folder / name)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __reduce__(self):
        return (Batch, (str(self._file.resolve()),))

    def __repr__(self) -> str:
        return f"<isomorph batch of {len(self)} jobs in {self.folder}>"


def written(jobs: list, folder: Path, preset: str, common: list[str]) -> Path:
    """A file of jobs, `FOLDER.toml`, with shapes in memory kept beside it."""
    kept = Kept(folder)
    entries = []
    for number, job in enumerate(jobs, 1):
        job = dict(job) if isinstance(job, Mapping) else dict(zip(("source", "target"), job, strict=True))
        unknown = set(job) - {"source", "target", "name", "pairs", "settings"}
        if unknown or not {"source", "target"} <= set(job):
            raise ValueError(
                f"job {number}: {sorted(job)}: must be source and target and, as wanted, name, pairs, settings"
            )
        # Files are named from where we are, not from where the file of jobs is.
        entry = {end: os.path.abspath(kept.shape(job[end], f"{number}-{end}")) for end in ("source", "target")}
        if job.get("name"):
            entry["name"] = job["name"]
        pairs = kept.pairs(job.get("pairs"))
        if pairs is not None:
            is_file = pairs not in ("same-vertices", "match", "none")
            entry["correspondences"] = os.path.abspath(pairs) if is_file else pairs
        if job.get("settings"):
            entry["set"] = changes(job["settings"])
        entries.append(entry)
    head = toml({"folder": folder.absolute(), "preset": preset, "set": common})
    text = head + "".join("\n[[job]]\n" + toml(entry) for entry in entries)
    path = folder.with_name(folder.name + ".toml")
    path.parent.mkdir(parents=True, exist_ok=True)
    # Whole or not at all.
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    draft.write_text(text, "utf-8")
    draft.replace(path)
    return path
