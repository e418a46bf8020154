#!/usr/bin/env python3
"""Measures a preset by the whole protocol: seven pairs of frames, several seeds, against its goals.

    python3 scripts/protocol.py [--method NAME] [--seeds 0,1,2] [--every N] [--out DIR] [--table]

Calls `isomorph compare` for every sequence, which leaves what it measured in --work and does not
repeat what is done: an interrupted command goes on where it stopped. From all that is there it
writes DIR/NAME.json, all numbers in compact form, and DIR/NAME.md, a table of means and ranges over
the seeds with every goal that is missed. With --table nothing is trained: the table is made again
from DIR/NAME.json.

Needs numpy. Exit status: 0 done, whether or not goals are met; 1 failed; 2 usage; 130 interrupted.
"""

import argparse
import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from isomorph_paper import PaperError, command_line, compact, experiments, record, runs
from isomorph_paper.command_line import ROOT
from isomorph_paper.report import entry, mean_of
from isomorph_paper.sequences import Sequence, read_sequence, write_atomically


@dataclass(frozen=True)
class Figure:
    """One number of a pair: a column of the table, and what it should be."""

    title: str
    ours: Callable[[dict], float | None]
    """From the mean of one seed."""
    lines: Callable[[dict], float | None] | None = None
    """The same of the straight lines."""
    share: float = 1.0
    """The most that ours should be of the lines'."""
    factor: float = 1.0
    digits: int = 3


def against_lines(title: str, kind: str, *path: str, **more: float) -> Figure:
    return Figure(title, entry(kind, *path), entry("linear", *path), **more)


CD, HD = "chamfer_squared", "hausdorff"
FIGURES = (
    against_lines("CD x10^3", "surface", CD, factor=1e3, digits=4),
    against_lines("HD", "surface", HD, digits=4),
    against_lines("CD aligned", "surface", "aligned", CD, factor=1e3, digits=4),
    against_lines("HD aligned", "surface", "aligned", HD, digits=4),
    against_lines(
        "vertices aligned x10^2", "carried", "aligned", "tracked_rmse", share=0.8, factor=1e2
    ),
)
VOLUME = entry("surface", "volume_ratio")
VOLUME_WITHIN = 0.01


@dataclass(frozen=True)
class Measured:
    """All seeds on one pair."""

    sequence: str
    pair: tuple[int, int]
    entries: dict[int, dict]
    swell: float
    """The true volume over that on a straight line between its ends, mean over the frames."""

    @property
    def name(self) -> str:
        return f"{self.sequence} {self.pair[0]}-{self.pair[1]}"

    def values(self, of: Callable[[dict], float | None]) -> list[float]:
        """One number of every seed that has it."""
        found = (of(each["evaluation"]["mean"]) for each in self.entries.values())
        return [value for value in found if value is not None]

    @property
    def most_pieces(self) -> float | None:
        """Of any frame of any seed."""
        frames = (frame for each in self.entries.values() for frame in each["evaluation"]["frames"])
        pieces = [(frame.get("surface") or {}).get("components") for frame in frames]
        return None if not pieces or None in pieces else max(pieces)


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--method", default="default", help="a preset or method of `isomorph compare`")
    add("--seeds", default="0,1,2", help="of the training, with commas between")
    add("--every", type=int, default=4, help="every so many frames are measured")
    command_line.add_binary(parser)
    add("--out", type=Path, default=ROOT / "scripts/results/protocol", help="where results go")
    command_line.add_work(parser)
    command_line.add_table(parser)
    add("--dry-run", action="store_true", help="print the commands, make nothing")
    command_line.add_sequences(parser)
    options = parser.parse_args(words)
    try:
        options.seeds = [int(seed) for seed in options.seeds.split(",")]
    except ValueError:
        parser.error(f"--seeds = {options.seeds}: must be whole numbers with commas between")
    if min(options.seeds) < 0:
        parser.error(f"--seeds = {min(options.seeds)}: must be 0 or more")
    if options.every < 1:
        parser.error(f"--every = {options.every}: must be 1 or more")
    return options


def label(method: str, seed: int) -> str:
    """The label of a row of `compare`: the method's own where the seed is the recipe's."""
    return method if seed == 0 else f"{method}: seed {seed}"


def command(subject: experiments.Subject, options: argparse.Namespace) -> list[str]:
    """The call that measures all seeds on all pairs of a sequence."""
    words = [options.binary, "compare"]
    sequences = command_line.sequences(options)
    words += ["--sequence", str(sequences / f"{subject.sequence}.anime")]
    words += ["--pairs", ",".join(f"{first}-{last}" for first, last in subject.pairs)]
    for seed in options.seeds:
        keys = f",training.seed={seed}" if seed else ""
        words += ["--variant", f"{label(options.method, seed)}={options.method}{keys}"]
    return [*words, "--every", str(options.every), "--quiet", "-o", str(work(options))]


def work(options: argparse.Namespace) -> Path:
    """Where `compare` leaves what it measured."""
    return options.work / "protocol"


def collected(options: argparse.Namespace, words: list[str]) -> dict:
    """The compact form of what is there of the seeds on each pair, in the protocol's order."""
    found, swells = [], {}
    for subject in experiments.PROTOCOL:
        folder = work(options) / subject.sequence
        entries = runs.read_entries(folder) if folder.is_dir() else {}
        path = command_line.sequences(options) / f"{subject.sequence}.anime"
        sequence = read_sequence(path)
        for pair in subject.pairs:
            names = [label(options.method, seed) for seed in options.seeds]
            mine = [entries[(name, *pair)] for name in names if (name, *pair) in entries]
            for each in mine[:1]:
                frames = [frame["frame"] for frame in each["evaluation"]["frames"]]
                swells[subject.sequence, *pair] = {"swell": swell(sequence, pair, frames)}
            found += mine
    if not found:
        raise PaperError(f"{work(options)}: no result of {options.method!r}")
    command = shlex.join(["python3", "scripts/protocol.py", *words])
    how = {"method": options.method, **record.of(command, options.binary)}
    return compact.pack(found, how, swells)


def measurements(content: dict) -> list[Measured]:
    """The pairs of a compact form."""
    key_of = lambda each: (each["sequence"], each["from"], each["to"])
    pairs: dict[tuple, dict[int, dict]] = {}
    for each in compact.unpack(content):
        pairs.setdefault(key_of(each), {})[seed_of(each["method"])] = each
    return [
        Measured(each["sequence"], (each["from"], each["to"]), pairs[key_of(each)], each["swell"])
        for each in content["pairs"]
    ]


def seed_of(row: str) -> int:
    """The seed that `label` made a label of."""
    return int(row.rpartition(": seed ")[2]) if ": seed " in row else 0


def swell(sequence: Sequence, pair: tuple[int, int], frames: list[int]) -> float:
    """How much larger the true shape is than a volume that changes evenly between the ends."""
    first, last = (sequence.volume(frame) for frame in pair)
    share = lambda frame: (frame - pair[0]) / (pair[1] - pair[0])
    ratios = [sequence.volume(k) / (first + (last - first) * share(k)) for k in frames]
    return sum(ratios) / len(ratios)


def spread(values: list[float], factor: float, digits: int) -> str:
    """The mean, and the range in brackets where there are several values."""
    if not values:
        return "-"
    show = lambda value: f"{value * factor:.{digits}f}"
    text = show(mean_of(values))
    return f"{text} ({show(min(values))} to {show(max(values))})" if len(values) > 1 else text


def row(measured: Measured) -> list[str]:
    cells = [measured.name, str(len(measured.entries))]
    for figure in FIGURES:
        cells.append(spread(measured.values(figure.ours), figure.factor, figure.digits))
        cells.append(spread(measured.values(figure.lines)[:1], figure.factor, figure.digits))
    cells.append(spread(measured.values(VOLUME), 1.0, 3))
    cells.append(f"{measured.swell:.3f}")
    pieces = measured.most_pieces
    return [*cells, "-" if pieces is None else f"{pieces:.0f}"]


def misses(measured: Measured) -> list[str]:
    """The goals that the mean over the seeds does not reach, each by how much."""
    missed = []
    for figure in FIGURES:
        ours, lines = (mean_of(measured.values(of)) for of in (figure.ours, figure.lines))
        if ours is None or lines is None:
            missed.append(f"{figure.title}: not measured")
        elif ours > figure.share * lines:
            goal = f"at most {figure.share:g}" if figure.share < 1 else "at most 1"
            missed.append(f"{figure.title}: {ours / lines:.2f} of the lines', {goal}")
    volume = mean_of(measured.values(VOLUME))
    if volume is None or abs(volume - 1) > VOLUME_WITHIN:
        shown = "none" if volume is None else f"{volume:.3f}"
        missed.append(
            f"volume: {shown}, within {VOLUME_WITHIN:g} of 1 (the true one is {measured.swell:.3f} "
            "of that between its ends)"
        )
    if measured.most_pieces != 1:
        missed.append(f"pieces: up to {measured.most_pieces}, 1 at every frame")
    return missed


CAPTION = """\
Means over the frames strictly between the two that were seen with 5 % of their correspondences; of
the seeds mean (least to most). Normalised units, 100,000 samples. Lines: straight lines between all
true vertices. Aligned: at the best times in order. Volume: over the true one; swell: the true one
over that on a straight line between its ends, which two frames do not determine. Pieces: the most
of any frame of any seed."""


def markdown(content: dict) -> str:
    """The table, its legend, the goals that are missed, and how all was made."""
    all_pairs = measurements(content)
    heads = ["pair", "seeds"]
    for figure in FIGURES:
        heads += [figure.title, "lines"]
    heads += ["volume", "swell", "pieces"]
    rules = ["---", *("---:" for _ in heads[1:])]
    table = [heads, rules, *map(row, all_pairs)]
    goals = len(FIGURES) + 2
    listed = [(each.name, misses(each)) for each in all_pairs]
    missed = [f"* {name}: {'; '.join(texts)}." for name, texts in listed if texts]
    met = goals * len(all_pairs) - sum(len(texts) for _, texts in listed)
    dates = sorted(one["date"][:10] for each in all_pairs for one in each.entries.values())
    machine = content["machine"]
    parts = [
        f"# `{content['method']}` by the protocol",
        "\n".join(f"| {' | '.join(cells)} |" for cells in table),
        CAPTION,
        (
            f"Goals met: {met} of {goals * len(all_pairs)}. Missed:"
            if missed
            else "All goals are met."
        ),
        "\n".join(missed),
        f"Measured {dates[0]} to {dates[-1]}, on {machine['processor']}, {machine['cores']} cores. "
        f"Made by `{content['command']}`.",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def run(options: argparse.Namespace, words: list[str]) -> None:
    numbers = options.out / f"{options.method}.json"
    if options.table:
        content = compact.read(numbers)
    else:
        commands = [command(subject, options) for subject in experiments.PROTOCOL]
        if options.dry_run:
            print("\n".join(map(shlex.join, commands)))
            return
        for each in commands:
            runs.call_binary(each)
        content = collected(options, words)
        compact.write(numbers, content)
    text = markdown(content)
    write_atomically(options.out / f"{options.method}.md", text.encode())
    print(f"{options.out / options.method}.md\n\n{text}")


def main(words: list[str]) -> int:
    options = arguments(words)
    try:
        run(options, words)
    except PaperError as error:
        print(f"protocol.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("protocol.py: interrupted; the same command goes on from here", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
