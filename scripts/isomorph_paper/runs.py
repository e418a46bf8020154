"""Calls `isomorph compare` and reads what it measured.

`compare` keeps one JSON file per pair and method under DIR/SEQUENCE and does not repeat what is
done, so an interrupted experiment goes on where it stopped. Those files lie in a work folder. Each
is an object with `sequence`, `from`, `to`, `method` and `evaluation`. compact.py merges them.
"""

import json
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from . import PaperError, inputs
from .experiments import OURS, PRESETS, Experiment, Row, Size, Subject

Pair = tuple[int, int]


@dataclass(frozen=True)
class Budget:
    """What every run of an experiment is given."""

    size: Size
    steps: int | None
    """None: those of each preset; so is the batch."""
    batch: int | None
    seed: int
    backend: str | None

    @property
    def keys(self) -> tuple[str, ...]:
        given = {"steps": self.steps, "batch": self.batch, "seed": self.seed}
        return tuple(f"training.{key}={value}" for key, value in given.items() if value is not None)


@dataclass(frozen=True)
class Call:
    """One command: some rows on some pairs of one sequence."""

    sequence: Path
    pairs: tuple[Pair, ...]
    rows: tuple[Row, ...]


def calls(experiment: Experiment, subject: Subject, sequence: Path, size: Size) -> list[Call]:
    """The commands of a subject.

    Rows that are run on fewer pairs come first: each call rewrites the tables and figures of
    `compare`, and the last ones are to be those of all pairs.
    """
    groups: dict[tuple[Pair, ...], list[Row]] = {}
    for row in experiment.rows_at(size):
        groups.setdefault(pairs_of(row, subject), []).append(row)
    groups.pop((), None)
    ordered = sorted(groups.items(), key=lambda group: len(group[0]))
    return [Call(sequence, pairs, tuple(rows)) for pairs, rows in ordered]


def pairs_of(row: Row, subject: Subject) -> tuple[Pair, ...]:
    """The pairs of a subject that a row is run on."""
    wanted = lambda pair: row.pair in (None, (subject.sequence, *pair))
    return tuple(pair for pair in subject.pairs if wanted(pair))


def variant(row: Row, experiment: Experiment, size: Size, data: tuple[str, ...]) -> str:
    """LABEL=METHOD,section.key=value,...: a row's own keys come after those of the experiment."""
    ours = row.method == OURS
    method = size.ours if ours else row.method
    network = size.network if ours and experiment.network else ()
    keys = [*network, *experiment.keys, *data, *row.keys]
    return ",".join([f"{row.label}={method}", *as_recorded(method, keys, size), *keys])


def as_recorded(method: str, keys: list[str], size: Size) -> tuple[str, ...]:
    """What makes `quick` what it was when the experiments were recorded: Adam, and no splines.

    Experiments of the presets as they are take it as it is.
    """
    if method != "quick" or size == PRESETS:
        return ()
    adam, unguided = "training.optimiser=adam", "training.guided-until=0"
    return (adam,) if "implicit.geometry=network" in keys else (adam, unguided)


def command(
    binary: str, call: Call, experiment: Experiment, budget: Budget, data: dict, results: Path
) -> list[str]:
    """The command line of a call; `data` has the recipe keys of each input."""
    words = [binary, "compare", "--sequence", str(call.sequence)]
    words += ["--pairs", ",".join(f"{first}-{last}" for first, last in call.pairs)]
    for row in call.rows:
        made = data[row.input] if row.input else ()
        words += ["--variant", variant(row, experiment, budget.size, made)]
    for key in budget.keys:
        words += ["--set", key]
    if not experiment.all_frames and budget.size.every > 1:
        words += ["--every", str(budget.size.every)]
    if budget.backend:
        words += ["--backend", budget.backend]
    return [*words, "--quiet", "-o", str(results)]


def planned(
    binary: str, experiment: Experiment, subject: Subject, budget: Budget, paths: "Paths"
) -> list[list[str]]:
    """The commands of a subject, whether or not its inputs have been made."""
    if subject.made_from is None:
        sequence = paths.sequences / f"{subject.sequence}.anime"
    else:
        sequence = paths.cache / f"{subject.sequence}.anime"
    wanted = {row.input for row in experiment.rows_at(budget.size) if row.input}
    data = {
        each: inputs.keys_of(inputs.folder_of(paths.cache, budget.seed, subject, each))
        for each in wanted
    }
    return [
        command(binary, call, experiment, budget, data, paths.results)
        for call in calls(experiment, subject, sequence, budget.size)
    ]


@dataclass(frozen=True)
class Paths:
    """Where things are: sequences, made inputs, and what `compare` leaves of this experiment."""

    sequences: Path
    cache: Path
    results: Path


def call_binary(words: list[str]) -> None:
    """Runs a command; its progress goes where ours goes."""
    print(f"$ {shlex.join(words)}", file=sys.stderr, flush=True)
    try:
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    except OSError as reason:
        raise PaperError(
            f"{words[0]}: cannot be started ({reason.strerror}); "
            "build it with `cargo build --release` or name it with --binary"
        ) from reason
    try:
        status = process.wait()
    except KeyboardInterrupt:
        # The terminal interrupted isomorph as well; it writes a checkpoint before it ends.
        process.wait()
        raise
    # 130 is isomorph's own status after an interruption, -2 that of a signal that it did not take.
    if status in (130, -2):
        raise KeyboardInterrupt
    if status:
        raise PaperError(f"{words[0]} compare: failed (status {status}); its message is above")


def answer(words: list[str]) -> dict:
    """The JSON that a command prints."""
    try:
        return json.loads(output(words))
    except ValueError as reason:
        raise PaperError(
            f"{shlex.join(words)}: an answer that is not understood ({reason!r}); "
            "does the binary fit these scripts?"
        ) from reason


def output(words: list[str]) -> str:
    """What a command prints on standard output."""
    print(f"$ {shlex.join(words)}", file=sys.stderr, flush=True)
    try:
        done = subprocess.run(words, capture_output=True, text=True)
    except OSError as reason:
        raise PaperError(f"{words[0]}: cannot be started ({reason.strerror})") from reason
    if done.returncode:
        raise PaperError(f"{shlex.join(words)}: failed: {done.stdout}{done.stderr.strip()}")
    return done.stdout


@dataclass(frozen=True)
class Measured:
    """What was measured of one row on one pair."""

    sequence: str
    pair: Pair
    row: Row
    entry: dict

    @property
    def mean(self) -> dict:
        return self.entry["evaluation"]["mean"]

    @property
    def frames(self) -> list[dict]:
        return self.entry["evaluation"]["frames"]


def measured(rows: list[Row], entries: list[dict]) -> list[Measured]:
    """Results with the rows that they are of; one of no row gets a row of its label alone.

    Results are kept when a row is taken out of an experiment, and their tables show them.
    """
    known = {row.label: row for row in rows}
    return [
        Measured(
            entry["sequence"],
            (entry["from"], entry["to"]),
            known.get(entry["method"]) or Row(entry["method"]),
            entry,
        )
        for entry in entries
    ]


def collect(experiment: Experiment, size: Size, results: Path) -> list[dict]:
    """All rows on all pairs, in the order of the experiment; a PaperError if one is missing."""
    found = []
    for subject in experiment.subjects:
        entries = read_entries(results / subject.sequence)
        for row in experiment.rows_at(size):
            for pair in pairs_of(row, subject):
                entry = entries.get((row.label, *pair))
                if entry is None:
                    raise PaperError(
                        f"{results / subject.sequence}: no result of {row.label!r} on frames "
                        f"{pair[0]}-{pair[1]}; does `isomorph compare` fit these scripts?"
                    )
                found.append(entry)
    return found


def read_entries(folder: Path) -> dict[tuple[str, int, int], dict]:
    """The results of a sequence by method and pair; of several, the newest."""
    entries: dict[tuple[str, int, int], dict] = {}
    for path in sorted(folder.rglob("*.json")):
        try:
            entry = json.loads(path.read_text("utf-8"))
        except ValueError as reason:
            raise PaperError(f"{path}: not JSON ({reason}); delete it and run again") from reason
        if not isinstance(entry, dict) or "evaluation" not in entry:
            continue
        key = (entry["method"], entry["from"], entry["to"])
        # An earlier version of the program may have left one with another digest.
        if key not in entries or entries[key].get("date", "") <= entry.get("date", ""):
            entries[key] = entry
    return entries
