#!/usr/bin/env python3
"""How well `isomorph match` finds correspondences, against the true ones of the sequences.

    python3 scripts/matching.py [--binary PATH] [--out DIR] [--sequences DIR] [--seed S]
                                [--only TEXT] [--cycles] [--table]

Each pair of frames is matched as two meshes, the target's vertices in a random order, and as two
clouds of 20,000 points sampled independently of each other, with normals. The program is given the
two files and nothing else. Written to DIR: table.md and data.json. With --cycles three frames are
matched instead, and the table is kept: whether cycles over them show which pairs are wrong. With
--table the table is made again from data.json.

Error: the distance between where a matched source vertex truly goes and the target vertex that it
is matched with, in normalised units (mean area of the two shapes 1). Needs numpy. Exit status: 0
done, 1 failed, 2 usage.
"""

import argparse
import json
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from isomorph_paper import PaperError, command_line, compact, cycles, degrade, experiments, record
from isomorph_paper.command_line import ROOT
from isomorph_paper.sequences import (
    Sequence,
    digest,
    read_sequence,
    unit,
    vertex_normals,
    write_atomically,
    write_cloud,
    write_mesh,
)

PAIRS = tuple(
    (subject.sequence, *pair) for subject in experiments.PROTOCOL for pair in subject.pairs
)
POINTS = 20_000
COLUMNS = (
    ("pairs", "pairs", "{:d}"),
    ("right", "right vertex", "{:.0%}"),
    ("median", "median error", "{:.4f}"),
    ("mean", "mean error", "{:.4f}"),
    ("quantile_95", "95 % error", "{:.4f}"),
    ("greatest", "greatest", "{:.3f}"),
    ("moved", "median motion", "{:.4f}"),
    ("coverage_source", "source covered", "{:.1%}"),
    ("coverage_target", "target covered", "{:.1%}"),
    ("cycle_median", "cycle median", "{:.4f}"),
    ("cycle_95", "cycle 95 %", "{:.4f}"),
    ("seconds", "seconds", "{:.0f}"),
)


ABOUT = """\
Correspondences found by `isomorph match` from the two end frames alone, against the true ones."""
LEGEND = """\
Lengths in normalised units (mean area 1). Meshes: both frames' own vertices, the target's in a
random order; the true vertex is among the candidates, so that an error below half of the
vertices' spacing (.015) shows as none. Clouds: 20,000 points of each frame, drawn
independently of each other; the true place is no candidate, and the point nearest to it is
.0035 away on average. Covered: within .05 of a matched vertex. Cycle: how far points come back
from where they began, source to target and back, without any truth."""


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    command_line.add_binary(parser)
    add("--out", type=Path, default=ROOT / "scripts/results/matching", help="where results go")
    command_line.add_sequences(parser)
    command_line.add_table(parser)
    add("--seed", type=int, default=0, help="of the inputs and of the matching")
    add("--only", default="", help="the rows whose name holds this text")
    add("--cycles", action="store_true", help="measure cycles over three frames, and keep the other rows")
    options = parser.parse_args(words)
    if options.seed < 0:
        parser.error(f"--seed = {options.seed}: must be 0 or more")
    return options


def meshes(sequence: Sequence, ends: tuple[int, int], folder: Path, seed: int) -> np.ndarray:
    """Writes two meshes; returns (source vertices, 3): where each truly goes."""
    first, second = (sequence.frames[frame] for frame in ends)
    order = degrade.generator(seed, "order", *ends).permutation(len(second))
    place = np.argsort(order)
    write_mesh(folder / "source.ply", first, sequence.triangles)
    write_mesh(folder / "target.ply", second[order], place[sequence.triangles])
    return second


def clouds(sequence: Sequence, ends: tuple[int, int], folder: Path, seed: int) -> np.ndarray:
    """Writes two clouds; returns (source points, 3): where each truly goes."""
    first, second = (sequence.frames[frame] for frame in ends)
    places = []
    for frame, name in ((first, "source.ply"), (second, "target.ply")):
        rng = degrade.generator(seed, "cloud", name, *ends)
        sampled = degrade.sampled(frame, sequence.triangles, POINTS, rng)
        normals = unit(sampled.on(vertex_normals(frame, sequence.triangles)))
        write_cloud(folder / name, sampled.on(frame), normals)
        places.append(sampled)
    return places[0].on(second)


def read_vertices(path: Path) -> np.ndarray:
    """(vertices, 3) positions of a binary PLY that this script has written."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    names = [line.split()[-1] for line in header.split(b"\n") if line.startswith(b"property float")]
    count = next(int(line.split()[-1]) for line in header.split(b"\n") if b"element vertex" in line)
    rows = np.frombuffer(body, "<f4", count * len(names)).reshape(count, len(names))
    return rows[:, :3].astype(np.float64)


def matched(binary: str, folder: Path, seed: int) -> tuple[dict, np.ndarray]:
    """What the program reports, and the (pairs, 2) indices that it writes."""
    command = [binary, "match", "source.ply", "target.ply", "--json", "--seed", str(seed)]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        reason = getattr(error, "stderr", "") or error
        raise PaperError(f"{shlex.join(command)}: {str(reason).strip()}") from error
    rows = np.loadtxt(folder / "pairs.csv", delimiter=",", skiprows=1, ndmin=2)
    return json.loads(done.stdout), rows[:, :2].astype(np.int64)


def measure(sequence: Sequence, ends: tuple[int, int], make, options) -> dict:
    """One row of the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = make(sequence, ends, folder, options.seed)
        report, pairs = matched(options.binary, folder, options.seed)
        source, target = (read_vertices(folder / f"{end}.ply") for end in ("source", "target"))
    scale = sequence.unit_scale(ends)
    error = scale * np.linalg.norm(target[pairs[:, 1]] - truth[pairs[:, 0]], axis=1)
    nearest = error < 1e-6
    return {
        "pairs": len(pairs),
        "of": len(source),
        "right": float(nearest.mean()) if make is meshes else None,
        "median": float(np.median(error)),
        "mean": float(error.mean()),
        "quantile_95": float(np.quantile(error, 0.95)),
        "greatest": float(error.max()),
        "moved": float(scale * np.median(np.linalg.norm(truth - source, axis=1))),
        "coverage_source": report["coverage"]["source"],
        "coverage_target": report["coverage"]["target"],
        "cycle_median": report["cycle"]["source"]["median"],
        "cycle_95": report["cycle"]["source"]["quantile_95"],
        "seconds": report["seconds"],
    }


def markdown(content: dict) -> str:
    """The table of data.json."""
    titles = ["frames", "as", *(title for _, title, _ in COLUMNS)]
    lines = [f"| {' | '.join(titles)} |", "| --- | --- |" + " ---: |" * len(COLUMNS)]
    for row in content["rows"]:
        cells = [f"{row['sequence']} {row['from']}-{row['to']}", row["inputs"]]
        values = [(row["found"][key], form) for key, _, form in COLUMNS]
        cells += ["-" if value is None else form.format(value) for value, form in values]
        lines.append(f"| {' | '.join(cells)} |")
    how = record.made_by(content)
    more = []
    if over := content.get("cycles"):
        more = [*cycles.markdown(over["rows"]), "", record.made_by(over), ""]
    return "\n".join(["# matching", "", ABOUT, "", *lines, "", LEGEND, "", how, "", *more])


def measured(options: argparse.Namespace, words: list[str]) -> dict:
    """All rows that --only leaves, and how they were measured."""
    rows, sequences = [], {}
    for name, start, end in PAIRS:
        sequence = read_sequence(command_line.sequences(options) / f"{name}.anime")
        for inputs, make in (("meshes", meshes), ("clouds", clouds)):
            if options.only not in f"{name} {start}-{end} {inputs}":
                continue
            sequences[name] = f"sha256 {digest(sequence.path)}"
            found = measure(sequence, (start, end), make, options)
            row = {"sequence": name, "from": start, "to": end, "inputs": inputs, "found": found}
            rows.append(row)
            print(json.dumps(row), file=sys.stderr, flush=True)
    return {
        "seed": options.seed,
        "rows": rows,
        "sequences": sequences,
        **record.of(shlex.join(["scripts/matching.py", *words]), options.binary),
    }


def with_cycles(content: dict, options: argparse.Namespace, words: list[str]) -> dict:
    """The same with cycles over three frames measured anew, and how they were measured."""
    place, rows = command_line.sequences(options), []
    for views in cycles.VIEWS:
        for frames in cycles.FRAMES:
            for name in cycles.SEQUENCES:
                sequence = read_sequence(place / f"{name}.anime")
                with tempfile.TemporaryDirectory() as folder:
                    rows += cycles.study(options.binary, sequence, frames, views, Path(folder))
    command = shlex.join(["scripts/matching.py", *words])
    return {**content, "cycles": {"rows": rows, **record.of(command, options.binary)}}


def main(words: list[str]) -> int:
    options = arguments(words)
    numbers = options.out / compact.NAME
    try:
        keeps = options.table or options.cycles
        content = compact.read(numbers) if keeps else measured(options, words)
        if options.cycles:
            content = with_cycles(content, options, words)
    except PaperError as error:
        print(f"matching.py: {error}", file=sys.stderr)
        return 1
    if not content["rows"]:
        print(f"matching.py: --only {options.only}: no row has this text", file=sys.stderr)
        return 2
    if not options.table:
        compact.write(numbers, content)
    text = markdown(compact.read(numbers))
    write_atomically(options.out / "table.md", text.encode())
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
