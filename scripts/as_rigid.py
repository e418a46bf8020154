#!/usr/bin/env python3
"""What rigidity alone gives: as-rigid-as-possible interpolation of the true meshes.

    python3 scripts/as_rigid.py [--every N] [--out DIR] [--sequences DIR] [--protocol FILE]
                                [--table]

On every pair of the protocol the two end meshes, all of whose vertices are known, are interpolated
so that each triangle turns evenly and stretches as little as its ends allow (rigid.py), and held
against the true frames between, beside the straight lines and what protocol.py has measured of a
preset, which is given 5 % of the vertices. Written to DIR: table.md and data.json. With --table the
table is made again from data.json.

CD: Chamfer squared; HD: Hausdorff; vertices: root mean square error; in normalised units (mean area
of the ends 1), 100,000 samples of each surface, means over the frames. Aligned: at the best of 129
times, in order. Needs numpy and scipy. Exit status: 0 done, 1 failed, 2 usage.
"""

import argparse
import json
import shlex
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from isomorph_paper import PaperError, command_line, compact, degrade, experiments, record
from isomorph_paper.command_line import ROOT
from isomorph_paper.report import mean_of
from isomorph_paper.rigid import AsRigid
from isomorph_paper.sequences import Sequence, digest, read_sequence, rms, write_atomically

SAMPLES = 100_000
TIMES = 129
# Factor and digits of each number in the table.
SHOWN = {
    "chamfer_squared": (1e3, 3),
    "hausdorff": (1, 3),
    "vertices": (1e2, 2),
    "vertices_aligned": (1e2, 2),
}
TITLES = {"lines": "straight lines", "as_rigid": "as rigid as possible", "preset": "`{}`"}
NOTE = """\
Each cell: Chamfer squared x 10^3 / Hausdorff / error of the vertices x 10^2 / the same at the best
times. Straight lines and "as rigid as possible" are given where every vertex ends, the preset 1000
of them."""
ABOUT = "What rigidity alone gives: the true meshes, interpolated as rigidly as possible."


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--every", type=int, default=4, help="every so many frames are measured")
    add("--out", type=Path, default=ROOT / "scripts/results/as-rigid", help="where results go")
    command_line.add_sequences(parser)
    command_line.add_table(parser)
    add(
        "--protocol",
        type=Path,
        default=ROOT / "scripts/results/protocol/default.json",
        help="what protocol.py measured of a preset, to stand beside",
    )
    options = parser.parse_args(words)
    if options.every < 1:
        parser.error(f"--every = {options.every}: must be 1 or more")
    return options


def distances(
    one: np.ndarray, other: np.ndarray, triangles: np.ndarray, rng: np.random.Generator
) -> tuple[float, float]:
    """Chamfer squared and Hausdorff distance of two surfaces, from samples of both."""
    points = [degrade.sampled(mesh, triangles, SAMPLES, rng).on(mesh) for mesh in (one, other)]
    ways = [cKDTree(points[1 - k]).query(points[k], workers=-1)[0] for k in (0, 1)]
    return sum(float((way**2).mean()) for way in ways), max(float(way.max()) for way in ways)


def in_order(costs: np.ndarray) -> np.ndarray:
    """(frames,) the times, none before the last, whose (frames, times) costs have the least sum."""
    best = np.zeros(costs.shape[1])
    sums = []
    for row in costs:
        sums.append(row + best)
        best = np.minimum.accumulate(sums[-1])
    chosen = []
    until = costs.shape[1]
    for total in reversed(sums):
        chosen.append(int(np.argmin(total[:until])))
        until = chosen[-1] + 1
    return np.array(chosen[::-1])


def measure(
    path: Callable[[float], np.ndarray],
    truth: list[np.ndarray],
    times: list[float],
    triangles: np.ndarray,
    rng: np.random.Generator,
) -> dict:
    """Of a path of the vertices, against the true ones at these times; means over them."""
    fine = [path(time) for time in np.linspace(0, 1, TIMES)]
    # The best times are those of the least squares, as their mean is.
    errors = np.array([[rms(each - frame) for each in fine] for frame in truth])
    aligned = errors[np.arange(len(truth)), in_order(errors**2)]
    own = [path(time) for time in times]
    apart = [distances(mesh, frame, triangles, rng) for mesh, frame in zip(own, truth)]
    return {
        "chamfer_squared": float(np.mean([chamfer for chamfer, _ in apart])),
        "hausdorff": float(np.mean([hausdorff for _, hausdorff in apart])),
        "vertices": float(np.mean([rms(mesh - frame) for mesh, frame in zip(own, truth)])),
        "vertices_aligned": float(aligned.mean()),
    }


def pair_of(sequence: Sequence, pair: tuple[int, int], every: int) -> dict:
    """Straight lines and the interpolation on one pair."""
    first, last = pair
    frames = list(range(first + every, last, every))
    if not frames:
        raise PaperError(f"--every = {every}: no frame of {sequence.name} {first}-{last} is left")
    triangles = sequence.triangles
    size = sequence.unit_scale(pair)
    source, target = (size * sequence.frames[frame] for frame in pair)
    truth = [size * sequence.frames[frame] for frame in frames]
    times = [(frame - first) / (last - first) for frame in frames]
    paths = {
        "lines": lambda time: (1 - time) * source + time * target,
        "as_rigid": AsRigid(source, target, triangles).at,
    }
    rng = degrade.generator(0, "as-rigid", sequence.name, *pair)
    found = {name: measure(path, truth, times, triangles, rng) for name, path in paths.items()}
    return {"sequence": sequence.name, "from": first, "to": last, "frames": frames} | found


def preset_of(protocol: Path) -> tuple[str, dict]:
    """The preset's name, and its means over the seeds by sequence and pair."""
    content = compact.read(protocol)
    try:
        means: dict[tuple, list[dict]] = {}
        for each in compact.unpack(content):
            key = (each["sequence"], each["from"], each["to"])
            means.setdefault(key, []).append(each["evaluation"]["mean"])
        return content["method"], {pair: preset_means(each) for pair, each in means.items()}
    except (KeyError, TypeError) as reason:
        raise PaperError(f"{protocol}: not what protocol.py writes ({reason!r})") from reason


def preset_means(seeds: list[dict]) -> dict:
    """The numbers of the table, from the means that `evaluate` gives of each seed."""
    return {
        "chamfer_squared": mean_of([seed["surface"]["chamfer_squared"] for seed in seeds]),
        "hausdorff": mean_of([seed["surface"]["hausdorff"] for seed in seeds]),
        "vertices": mean_of([seed["carried"]["tracked_rmse"] for seed in seeds]),
        "vertices_aligned": mean_of([seed["carried"]["aligned"]["tracked_rmse"] for seed in seeds]),
    }


def cell(found: dict | None) -> str:
    if found is None:
        return "-"
    shown = [f"{factor * found[key]:.{digits}f}" for key, (factor, digits) in SHOWN.items()]
    return " / ".join(shown)


def markdown(content: dict) -> str:
    """The table of data.json."""
    titles = ["frames", *(title.format(content["preset"]) for title in TITLES.values())]
    lines = [f"| {' | '.join(titles)} |", "| --- |" + " ---: |" * len(TITLES)]
    for row in content["rows"]:
        name = f"{row['sequence']} {row['from']}-{row['to']}"
        lines.append(f"| {' | '.join([name, *(cell(row[key]) for key in TITLES)])} |")
    how = record.made_by(content)
    return "\n".join(["# as rigid as possible", "", ABOUT, "", *lines, "", NOTE, "", how, ""])


def measured(options: argparse.Namespace, words: list[str]) -> dict:
    """All pairs of the protocol, and how they were measured."""
    preset, means = preset_of(options.protocol)
    rows, sequences = [], {}
    for subject in experiments.PROTOCOL:
        path = command_line.sequences(options) / f"{subject.sequence}.anime"
        sequence = read_sequence(path)
        sequences[sequence.name] = f"sha256 {digest(sequence.path)}"
        for pair in subject.pairs:
            row = pair_of(sequence, pair, options.every)
            rows.append(row | {"preset": means.get((sequence.name, *pair))})
            print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    return {
        "command": shlex.join(["python3", "scripts/as_rigid.py", *words]),
        "preset": preset,
        "rows": rows,
        "sequences": sequences,
        "date": record.now(),
        "machine": record.machine(),
    }


def run(options: argparse.Namespace, words: list[str]) -> None:
    numbers = options.out / compact.NAME
    if not options.table:
        compact.write(numbers, measured(options, words))
    text = markdown(compact.read(numbers))
    write_atomically(options.out / "table.md", text.encode())
    print(text)


def main(words: list[str]) -> int:
    options = arguments(words)
    try:
        run(options, words)
    except PaperError as error:
        print(f"as_rigid.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
