#!/usr/bin/env python3
"""How the true paths of vertices leave the straight lines between their ends, and how a run's do.

    python3 scripts/bow.py SEQUENCE.anime FROM TO RUN [--binary PATH] [--known N]

Two frames do not determine how fast each vertex goes in between. A motion that bends limbs as little as
possible may bow to the other side than the true one: a paw that is lifted on its way bows up, and a leg
that swings without bending at the knee bows down. This prints, for each frame between, in normalised units
(mean area of the ends 1), root mean squares over the vertices:

    along   the difference of the truth from the straight line, in the direction of that line: timing
    across  the same, at right angles to it: the bow
    ours    both of the run, from the truth
    cosine  between the run's bow and the true one, over the vertices that move by more than .08;
            1: to the same side, -1: to the other
    whole   both parts together: of the line, of the run, and of the run without its error at the target,
            which is taken out in proportion to the time: what is lost on the way and not at arrival

The last line is how well N given vertices determine where all others arrive: the error of a smooth function
through N of them, chosen at random (biharmonic splines; 1000 as `compare` gives).

RUN is a run on that pair whose source has the sequence's vertices, such as those that `isomorph compare`
leaves in runs/compare/NAME/FROM-TO/METHOD. Needs numpy.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

from gallery import read_ply
from isomorph_paper import PaperError
from isomorph_paper.sequences import Sequence, read_sequence, rms

# Vertices that move by less have no direction worth the name.
MOVES = 0.08


@dataclass(frozen=True)
class Bow:
    """Of one frame: root mean squares over the vertices, and the cosine."""

    along: float
    across: float
    ours_along: float
    ours_across: float
    cosine: float
    line: float
    ours: float
    ours_but_for_arrival: float


def parts(vectors: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The parts of vectors in these unit directions and at right angles to them."""
    along = (vectors * directions).sum(axis=1, keepdims=True) * directions
    return along, vectors - along


def bow(
    ends: tuple[np.ndarray, np.ndarray],
    time: float,
    truth: np.ndarray,
    run: np.ndarray,
    arrived: np.ndarray,
) -> Bow:
    """How `truth` and `run`, positions at `time`, leave the lines between the ends; (vertices, 3) each.

    `arrived`: where the run is at time 1.
    """
    start, end = ends
    way = end - start
    length = np.linalg.norm(way, axis=1)
    directions = way / np.maximum(length, 1e-300)[:, None]
    line = start + time * way
    along, across = parts(truth - line, directions)
    ours_along, ours_across = parts(run - truth, directions)
    moved = length > MOVES
    _, bent = parts(run - line, directions)
    inner = (bent[moved] * across[moved]).sum()
    norms = np.linalg.norm(bent[moved]) * np.linalg.norm(across[moved])
    cosine = float(inner / norms) if norms > 0 else float("nan")
    return Bow(
        along=rms(along),
        across=rms(across),
        ours_along=rms(ours_along),
        ours_across=rms(ours_across),
        cosine=cosine,
        line=rms(truth - line),
        ours=rms(run - truth),
        ours_but_for_arrival=rms(run - time * (arrived - end) - truth),
    )


def vertices(path: Path) -> np.ndarray:
    """The vertices of a PLY as isomorph writes it, or of an OBJ."""
    if path.suffix != ".obj":
        return read_ply(path)[0]
    lines = (line.split() for line in path.read_text().splitlines())
    return np.array([words[1:4] for words in lines if words[:1] == ["v"]], float)


def carried(binary: str, run: Path, times: list[float]) -> list[np.ndarray]:
    """The source's vertices at the times, in the units of the sequence."""
    with tempfile.TemporaryDirectory() as folder:
        words = [binary, "extract", str(run), "--times", ",".join(f"{time:.6f}" for time in times)]
        words += ["--resolution", "32", "--carry", "--quiet", "-o", folder]
        try:
            subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
        except (OSError, subprocess.CalledProcessError) as reason:
            raise PaperError(f"{binary} extract: failed ({reason})") from reason
        entries = json.loads((Path(folder) / "frames.json").read_text())
        return [vertices(Path(folder) / entry["carried"]) for entry in entries]


def bows(sequence: Sequence, pair: tuple[int, int], paths: list[np.ndarray]) -> list[Bow]:
    """Of every frame strictly between; `paths` are the run's vertices at their times and at time 1."""
    first, last = pair
    ends = [sequence.frames[frame] for frame in pair]
    scale = sequence.unit_scale(pair)
    found = []
    arrived = paths[-1] * scale
    for frame, run in zip(range(first + 1, last), paths[:-1], strict=True):
        if len(run) != len(ends[0]):
            raise PaperError(
                f"the run carries {len(run)} vertices, the sequence has {len(ends[0])}"
            )
        time = (frame - first) / (last - first)
        start, end, truth, run = (each * scale for each in (*ends, sequence.frames[frame], run))
        found.append(bow((start, end), time, truth, run, arrived))
    return found


def spline_miss(start: np.ndarray, end: np.ndarray, known: int, seed: int = 0) -> float:
    """The root mean square by which splines through some vertices' motions miss all; (vertices, 3) each.

    The biharmonic splines of three dimensions: distances to the known vertices, and an affine function.
    """
    _, places = np.unique(start, axis=0, return_index=True)
    chosen = np.random.default_rng(seed).permutation(places)[:known]
    centres, motion = start[chosen], (end - start)[chosen]

    def matrix(points: np.ndarray) -> np.ndarray:
        away = np.linalg.norm(points[:, None] - centres[None], axis=2)
        return np.hstack([away, np.ones((len(points), 1)), points])

    affine = matrix(centres)[:, len(centres) :]
    below = np.hstack([affine.T, np.zeros((4, 4))])
    system = np.vstack([matrix(centres), below])
    weights = np.linalg.solve(system, np.vstack([motion, np.zeros((4, 3))]))
    return rms(matrix(start) @ weights - (end - start))


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sequence", type=Path)
    parser.add_argument("pair", type=int, nargs=2, metavar=("FROM", "TO"))
    parser.add_argument("run", type=Path)
    parser.add_argument("--binary", default="isomorph")
    parser.add_argument("--known", type=int, default=1000, metavar="N")
    given = parser.parse_args(words)
    if given.known < 5:
        parser.error(f"--known {given.known}: must be 5 or more")
    first, last = given.pair
    try:
        sequence = read_sequence(given.sequence)
        if not 0 <= first < last - 1 < len(sequence.frames) - 1:
            most = len(sequence.frames) - 1
            raise PaperError(f"{first} {last}: must be frames of 0 to {most}, with some between")
        times = [(frame - first) / (last - first) for frame in range(first + 1, last + 1)]
        found = bows(sequence, (first, last), carried(given.binary, given.run, times))
    except PaperError as error:
        print(f"bow.py: {error}", file=sys.stderr)
        return 1
    print("frame  along  across  ours: along  across  cosine  whole: line   ours   but for arrival")
    row = "{:>5}  {:.4f} {:.4f}        {:.4f} {:.4f}  {:6.2f}         {:.4f} {:.4f} {:.4f}"
    for frame, one in zip(range(first + 1, last), found, strict=True):
        print(row.format(frame, *astuple(one)))
    print(row.format("mean", *np.mean([astuple(one) for one in found], axis=0)))
    scale = sequence.unit_scale((first, last))
    start, end = (sequence.frames[frame] * scale for frame in given.pair)
    miss = spline_miss(start, end, given.known)
    print(f"splines through {given.known} of {len(start)} vertices miss the target by {miss:.4f}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
