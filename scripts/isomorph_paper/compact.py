"""The compact form of results: one JSON file for an experiment, without a path of any machine.

`isomorph compare` writes one file per pair and method. `pack` merges them: what all methods of a
pair share is written once, numbers of frames become columns, and floats keep six digits. `unpack`
gives entries like those that were packed, so that tables are made from the compact form alone.

    {"format": 1, ...the record..., "commands": ["isomorph compare ..."], "pairs": [
      {"sequence": "fox_survey", "from": 0, "to": 18, "frame": [1, 2], "time": [.05, .11],
       "linear": SERIES, "floor": SERIES, "methods": [
        {"method": "quick", "seed": 0, "command": 0, ..., "surface": SERIES, "carried": SERIES}]}]}

SERIES is {"mean": {metric: number}, "frames": {metric: [a number for each frame]}}. `command` is an
index into `commands`.
"""

import json
import re
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from . import PaperError
from .sequences import write_atomically

FORMAT = 1
DIGITS = 6
NAME = "data.json"
# What all methods of a pair are compared with; the same for each of them.
REFERENCES = ("linear", "floor")
KINDS = ("surface", "carried")
KEPT = (
    "isomorph",
    "date",
    "machine",
    "steps",
    "batch",
    "networks",
    "training_seconds",
    "evaluation_seconds",
)
# Of single frames the numbers that tables and figures are made from; the means have all.
FRAME_METRICS = (
    "chamfer_squared",
    "hausdorff",
    "normal_consistency",
    "volume_ratio",
    "components",
    "slope_error",
    "tracked_rmse",
)
ALIGNED_METRICS = ("time", "chamfer_squared", "hausdorff", "tracked_rmse")
WIDTH = 110
# An absolute path: not the rest of a relative one, of an address or of a number.
PATH = re.compile(r"(?<![\w.~/:-])(?:[A-Za-z]:[\\/]|/)[^\s,;:'\"=/][^\s,;:'\"=]*")
# Folders that are the same in every checkout, and the cache of made inputs.
RELATIVE = ("scripts", "runs")
CACHE = "isomorph-paper"


def portable(value):
    """The same text, list or object, without the folders of one machine in it."""
    if isinstance(value, str):
        posix = lambda found: PurePosixPath(found.group().replace("\\", "/"))
        return PATH.sub(lambda found: shortened(posix(found)), value)
    if isinstance(value, list):
        return [portable(each) for each in value]
    if isinstance(value, dict):
        return {key: portable(each) for key, each in value.items()}
    return value


def shortened(path: PurePosixPath) -> str:
    """A path from the repository or the cache on; of any other the name alone."""
    parts = path.parts
    if CACHE in parts and path.suffix != ".anime":
        return "/".join(parts[parts.index(CACHE) + 1 :]) or CACHE
    # Copies of the program had names such as isomorph-a, so that builds did not get in their way.
    if re.fullmatch(r"isomorph(-[a-z])?", path.name):
        return "isomorph"
    for top in RELATIVE:
        if top in parts:
            return "/".join(parts[parts.index(top) :])
    return path.name


def rounded(value):
    """The same numbers to six significant digits."""
    if isinstance(value, float):
        short = float(f"{value:.{DIGITS}g}")
        return int(short) if short.is_integer() and abs(short) < 10**DIGITS else short
    if isinstance(value, (list, tuple)):
        return [rounded(each) for each in value]
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    return value


def columns(rows: list[dict | None]) -> dict:
    """Objects of the same keys as one object of columns; None is a row of None."""
    present = [row for row in rows if row is not None]
    keys = dict.fromkeys(key for row in present for key in row)
    found = {}
    for key in keys:
        values = [None if row is None else row.get(key) for row in rows]
        nested = any(isinstance(value, dict) for value in values)
        found[key] = columns(values) if nested else values
    return found


def rows_of(found: dict, count: int) -> list[dict | None]:
    """What `columns` was given. Rows of nothing but None become None."""
    rows: list[dict] = [{} for _ in range(count)]
    for key, values in found.items():
        values = rows_of(values, count) if isinstance(values, dict) else values
        for row, value in zip(rows, values, strict=True):
            row[key] = value
    empty = lambda row: all(value is None for value in row.values())
    return [None if empty(row) else row for row in rows]


def series(evaluation: dict, kind: str) -> dict | None:
    """The mean and the columns of one kind; None where a method has none."""
    mean = (evaluation.get("mean") or {}).get(kind)
    frames = [of_frame(frame.get(kind)) for frame in evaluation["frames"]]
    if mean is None and all(frame is None for frame in frames):
        return None
    return {"mean": mean, "frames": columns(frames)}


def of_frame(metrics: dict | None) -> dict | None:
    """What is kept of the metrics of one frame."""
    if metrics is None:
        return None
    kept = {key: metrics[key] for key in FRAME_METRICS if key in metrics}
    aligned = metrics.get("aligned")
    if aligned is not None:
        kept["aligned"] = {key: aligned[key] for key in ALIGNED_METRICS if key in aligned}
    return kept


def seed_of(entry: dict) -> int | None:
    """The seed of a result, from the recipe that it holds."""
    found = re.search(r"(?m)^seed = (\d+)", entry.get("recipe") or "")
    return int(found.group(1)) if found else entry.get("seed")


def pack(entries: Iterable[dict], record: dict, more: dict | None = None) -> dict:
    """The compact form of what `compare` measured.

    `record` says how it was made; `more` has further values of a pair by (sequence, from, to).
    """
    commands: list[str] = []
    pairs: dict[tuple, dict] = {}
    for entry in entries:
        key = (entry["sequence"], entry["from"], entry["to"])
        if key not in pairs:
            pairs[key] = new_pair(entry) | (more or {}).get(key, {}) | {"methods": []}
        pair = pairs[key]
        method = packed_method(entry, commands)
        for name in REFERENCES:
            own = rounded(series(entry["evaluation"], name))
            if own != pair[name]:
                method[name] = own
        times = [frame["frame"] for frame in entry["evaluation"]["frames"]]
        if times != pair["frame"]:
            raise PaperError(
                f"{entry['sequence']} {key[1]}-{key[2]}: {entry['method']!r} was measured on other "
                "frames than the first method; pack it on its own"
            )
        pair["methods"].append(method)
    content = {"format": FORMAT, **record, "commands": commands, "pairs": list(pairs.values())}
    return rounded(portable(content))


def new_pair(entry: dict) -> dict:
    """What the methods of a pair share, without the methods."""
    evaluation = entry["evaluation"]
    pair = {
        "sequence": entry["sequence"],
        "from": entry["from"],
        "to": entry["to"],
        "frame": [frame["frame"] for frame in evaluation["frames"]],
        "time": [frame["time"] for frame in evaluation["frames"]],
    }
    return pair | {name: rounded(series(evaluation, name)) for name in REFERENCES}


def end_of(end: dict) -> dict:
    """What is kept of one of the two ends that were seen."""
    kept = {key: end[key] for key in ("frame", "time")}
    for kind in (*KINDS, "floor"):
        metrics = of_frame(end.get(kind))
        if metrics is not None:
            metrics.pop("aligned", None)
        kept[kind] = metrics
    return kept


def packed_method(entry: dict, commands: list[str]) -> dict:
    """One result without what its pair shares; its command goes to the list of commands."""
    method = {"method": entry["method"], "seed": seed_of(entry)}
    method |= {key: entry[key] for key in KEPT if key in entry}
    command = entry.get("command")
    if command is not None:
        if command not in commands:
            commands.append(command)
        method["command"] = commands.index(command)
    if entry["evaluation"].get("ends") is not None:
        method["ends"] = [end_of(each) for each in entry["evaluation"]["ends"]]
    kinds = {kind: series(entry["evaluation"], kind) for kind in KINDS}
    return method | {kind: found for kind, found in kinds.items() if found is not None}


def unpack(content: dict) -> list[dict]:
    """The results in a compact form, each as `compare` writes it."""
    entries = []
    for pair in content["pairs"]:
        for method in pair["methods"]:
            found = {kind: method.get(kind, pair.get(kind)) for kind in (*KINDS, *REFERENCES)}
            entry = {key: pair[key] for key in ("sequence", "from", "to")}
            entry |= {key: value for key, value in method.items() if key not in found}
            if "command" in method:
                entry["command"] = content["commands"][method["command"]]
            entry["evaluation"] = evaluation(pair, found)
            if "ends" in method:
                entry["evaluation"]["ends"] = entry.pop("ends")
            entries.append(entry)
    return entries


def evaluation(pair: dict, found: dict) -> dict:
    """Frames and mean from the columns of each kind."""
    count = len(pair["frame"])
    none = [None] * count
    by_kind = {
        kind: rows_of(each["frames"], count) if each else none for kind, each in found.items()
    }
    frames = [
        {"frame": frame, "time": time, **{kind: rows[at] for kind, rows in by_kind.items()}}
        for at, (frame, time) in enumerate(zip(pair["frame"], pair["time"], strict=True))
    ]
    mean = {kind: each["mean"] if each else None for kind, each in found.items()}
    return {"frames": frames, "mean": mean}


def text(value, indent: int = 0) -> str:
    """JSON in which what is short, and what holds nothing but numbers, takes one line."""
    flat = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if not isinstance(value, (dict, list)) or len(flat) <= WIDTH:
        return flat
    within = value.values() if isinstance(value, dict) else value
    if not any(isinstance(each, (dict, list, str)) for each in within):
        return flat
    inner = "\n" + " " * (indent + 1)
    if isinstance(value, dict):
        parts = [f"{json.dumps(key)}: {text(each, indent + 1)}" for key, each in value.items()]
        return "{" + inner + f",{inner}".join(parts) + "\n" + " " * indent + "}"
    parts = [text(each, indent + 1) for each in value]
    return "[" + inner + f",{inner}".join(parts) + "\n" + " " * indent + "]"


def write(path: Path, content: dict) -> None:
    """Writes a compact form, or any other content, rounded and without paths of this machine."""
    write_atomically(path, (text(rounded(portable(content))) + "\n").encode())


def read(path: Path) -> dict:
    """Reads a file that `write` left; a PaperError says what is wrong with it."""
    try:
        content = json.loads(path.read_text("utf-8"))
    except OSError as reason:
        raise PaperError(
            f"{path}: cannot be read ({reason.strerror}); run without --table first"
        ) from reason
    except ValueError as reason:
        raise PaperError(f"{path}: not JSON ({reason}); delete it and run again") from reason
    if not isinstance(content, dict) or content.get("format", FORMAT) != FORMAT:
        raise PaperError(f"{path}: not of format {FORMAT}; these scripts and the file do not fit")
    return content
