"""How results were made, so that anyone can make them again.

run.json claims the work folder of an experiment for its settings while it runs. The record goes
into the compact file when it is done.
"""

import datetime
import importlib.metadata
import json
import os
import platform
import subprocess
from pathlib import Path

from . import PaperError
from .runs import Budget
from .sequences import write_atomically

NAME = "run.json"


def settings(experiment: str, budget: Budget) -> dict:
    """What must be the same for results to lie in one folder."""
    return {
        "experiment": experiment,
        "size": budget.size.name,
        "preset": budget.size.ours,
        "steps": budget.steps,
        "batch": budget.batch,
        "seed": budget.seed,
        "backend": budget.backend or "default",
    }


def check(path: Path, wanted: dict) -> None:
    """A PaperError if a file records results of other settings: they would share one table."""
    if not path.exists():
        return
    try:
        found = json.loads(path.read_text("utf-8"))["settings"]
    except (ValueError, KeyError, TypeError) as reason:
        raise PaperError(
            f"{path}: not a record of this script; delete it, or set another --out and --work"
        ) from reason
    for key, value in wanted.items():
        if found.get(key) != value:
            raise PaperError(
                f"{path}: {key} = {found.get(key)!r}, now {value!r}; "
                "set another --out and --work, or delete the folder"
            )


def begin(folder: Path, wanted: dict) -> None:
    """Claims a work folder for these settings, so that no other run is mixed with this one."""
    check(folder / NAME, wanted)
    if not (folder / NAME).exists():
        content = {"settings": wanted, "state": "unfinished"}
        write_atomically(folder / NAME, (json.dumps(content, indent=1) + "\n").encode())


def of(command: str, binary: str) -> dict:
    """What was called, when, where and of which versions."""
    return {
        "command": command,
        "date": now(),
        "machine": machine(),
        "versions": versions(binary),
    }


def now() -> str:
    return datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds")


def machine() -> dict:
    return {
        "system": platform.platform(),
        "processor": processor(),
        "cores": (
            len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
        ),
    }


def made_by(how: dict) -> str:
    """The last line of a table: the command, the day and the machine of a record."""
    on = how["machine"]
    machine = f"{on['processor']}, {on['cores']} cores"
    return f"Made by `{how['command']}` on {how['date'][:10]}, {machine}."


def processor() -> str:
    """The processor's name; Linux alone says it in a file."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def versions(binary: str) -> dict:
    root = Path(__file__).parents[2]
    return {
        "isomorph": output([binary, "--version"]),
        "commit": output(["git", "-C", str(root), "rev-parse", "HEAD"]),
        "uncommitted changes": bool(
            output(["git", "-C", str(root), "status", "--porcelain", "-uno"])
        ),
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "matplotlib")},
    }


def version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def output(words: list[str]) -> str | None:
    """What a command prints, or None if it fails: a record is not worth losing results for."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
