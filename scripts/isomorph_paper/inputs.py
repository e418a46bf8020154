"""Makes the input files that the rows of an experiment ask for, outside the results folder.

Clouds of 20,000 points are large and follow from the seed, so that only their statistics are kept
with the results. Everything is written in the sequence's own coordinates.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import PaperError, bar, degrade, topology
from .experiments import PAIRS, POINTS, Input, Row, Subject
from .sequences import (
    Sequence,
    area,
    digest,
    read_sequence,
    write_cloud,
    write_mesh,
    write_pairs,
    write_sequence,
)

# By the square root of the area: a hole takes about 2 % of the area.
HOLE_RADIUS = 0.1


@dataclass(frozen=True)
class Files:
    """The inputs of one run, and what is to be kept of them with the results."""

    folder: Path
    statistics: dict


def keys_of(folder: Path) -> tuple[str, ...]:
    """The recipe keys that name the files of a folder; all pairs of its file are used."""
    return (
        f"data.source={folder / 'source.ply'}",
        f"data.target={folder / 'target.ply'}",
        f"data.correspondences={folder / 'pairs.csv'}",
        "data.correspondence-fraction=1",
    )


def sequence_of(subject: Subject, sequences: Path, cache: Path) -> Sequence:
    """The sequence of a subject: read, or made of another one into the cache."""
    if subject.made_from is None:
        return read_sequence(sequences / f"{subject.sequence}.anime")
    path = cache / f"{subject.sequence}.anime"
    if subject.made_from == "bar":
        return write_sequence(path, *bar.turning(math.radians(float(subject.sequence.split("_")[-1]))))
    human = read_sequence(sequences / f"{subject.made_from}.anime")
    return write_sequence(path, topology.feet_together(human), human.triangles)


def true_volumes(subjects: tuple[Subject, ...], truths: dict[str, Sequence]) -> dict:
    """Of each pair the volume of every frame from its first to its last, by the first one's."""
    found = {}
    for subject in subjects:
        truth = truths[subject.sequence]
        for first, last in subject.pairs:
            volumes = [truth.volume(frame) for frame in range(first, last + 1)]
            shares = [volume / volumes[0] for volume in volumes]
            found[subject.sequence, first, last] = {"volume": shares}
    return found


def folder_of(cache: Path, seed: int, subject: Subject, wanted: Input) -> Path:
    """Where the files of an input lie. Its path says what it is, so no two share one."""
    (first, last), *more = subject.pairs
    assert not more, f"{subject.sequence}: made inputs are of one pair"
    name = f"{subject.sequence}-{first}-{last}-{wanted.kind}-{wanted.amount:g}-seed-{seed}"
    folder = cache / name
    # `compare --variant` separates its keys by commas.
    if re.search("[,\n]", str(folder)):
        raise PaperError(
            f"{folder}: a path with a comma cannot be a recipe value here; set another --cache"
        )
    return folder


def make_all(
    rows: list[Row], subject: Subject, sequence: Sequence, seed: int, cache: Path
) -> dict[Input, Files]:
    """The files of each input that the rows ask for, made once however many rows share them."""
    wanted = dict.fromkeys(row.input for row in rows if row.input)
    return {each: make(each, subject, sequence, seed, cache) for each in wanted}


def make(wanted: Input, subject: Subject, sequence: Sequence, seed: int, cache: Path) -> Files:
    """Writes source.ply, target.ply and pairs.csv; the same seed gives the same bytes."""
    folder = folder_of(cache, seed, subject, wanted)
    for frame in subject.pairs[0]:
        if frame >= len(sequence.frames):
            raise PaperError(
                f"{sequence.path}: frame {frame} of {len(sequence.frames)}; another file is meant"
            )
    frames = tuple(sequence.frames[frame] for frame in subject.pairs[0])
    # Not the amount: rows of one sweep differ in nothing but it.
    rng = degrade.generator(seed, subject.sequence, subject.pairs, wanted.kind)
    statistics = MAKERS[wanted.kind](wanted.amount, frames, sequence.triangles, rng, folder)
    for name in ("source.ply", "target.ply", "pairs.csv"):
        statistics[f"sha256 of {name}"] = digest(folder / name)
    return Files(folder, statistics)


def swaps(swap):
    """The maker of swapped pairs: the frames' meshes, pairs of vertices, some of them wrong."""

    def maker(share, frames, triangles, rng, folder):
        right = degrade.same_vertex_pairs(len(frames[0]), PAIRS, rng)
        pairs = swap(right, frames[1], share, rng)
        write_mesh(folder / "source.ply", frames[0], triangles)
        write_mesh(folder / "target.ply", frames[1], triangles)
        write_pairs(folder / "pairs.csv", pairs)
        wrong = pairs[:, 1] != right[:, 1]
        size = np.sqrt(area(frames[1], triangles))
        moved = (
            np.linalg.norm(frames[1][pairs[wrong, 1]] - frames[1][right[wrong, 1]], axis=1) / size
        )
        mean = float(moved.mean()) if wrong.any() else 0.0
        return {
            "pairs": len(pairs),
            "wrong pairs": int(wrong.sum()),
            "mean error of the wrong, by sqrt(area)": mean,
        }

    return maker


def write_clouds(clouds: degrade.Clouds, folder: Path) -> dict:
    """Writes both clouds and their pairs."""
    write_cloud(folder / "source.ply", *clouds.source)
    write_cloud(folder / "target.ply", *clouds.target)
    write_pairs(folder / "pairs.csv", clouds.pairs)
    return {
        "source points": len(clouds.source[0]),
        "target points": len(clouds.target[0]),
        "pairs": len(clouds.pairs),
    }


def sparse(points, frames, triangles, rng, folder):
    """A dense source, a target of so many points."""
    clouds = degrade.corresponding_clouds(frames, triangles, (POINTS, int(points)), PAIRS, rng)
    return write_clouds(clouds, folder)


def holes(count, frames, triangles, rng, folder):
    """So many holes in each cloud, in different places."""
    kept, shares = (None, None), (0.0, 0.0)
    # The samples are the same with holes and without.
    cutting, sampling = rng.spawn(2)
    size = np.sqrt(area(frames[0], triangles))
    if count:
        radius = HOLE_RADIUS * size
        cut = degrade.different_holes(frames, triangles, int(count), radius, cutting)
        kept = tuple(
            lambda points, normals, cut=side: degrade.outside(cut, points, normals) for side in cut
        )
        shares = [
            missing_share(frame, triangles, keep, rng)
            for frame, keep in zip(frames, kept, strict=True)
        ]
    clouds = degrade.corresponding_clouds(
        frames, triangles, (POINTS, POINTS), PAIRS, sampling, kept
    )
    return write_clouds(clouds, folder) | {
        "holes in each": int(count),
        "radius by sqrt(area)": HOLE_RADIUS,
        "missing area of the source": shares[0],
        "missing area of the target": shares[1],
    }


def outer_surface(_, frames, triangles, rng, folder):
    """The source as it is; of the target, which overlaps itself, the outer surface alone."""

    def outer(points, normals):
        kept = np.ones(len(points), bool)
        # Feet overlap near the plane between them and nowhere else, and a winding number is dear.
        near = np.flatnonzero(
            (np.abs(points[:, 0]) < topology.REACH / 2) & (points[:, 1] < topology.CROTCH)
        )
        kept[near] = topology.on_outside(frames[1], triangles, points[near], normals[near])
        return kept

    clouds = degrade.corresponding_clouds(
        frames, triangles, (POINTS, POINTS), PAIRS, rng, (None, outer)
    )
    inner = missing_share(frames[1], triangles, outer, rng)
    return write_clouds(clouds, folder) | {"area of the target within itself": inner}


def missing_share(frame, triangles, keep, rng) -> float:
    """The share of a frame's area that is not kept, by 20,000 samples."""
    places = degrade.sampled(frame, triangles, POINTS, rng)
    normals = degrade.vertex_normals(frame, triangles)
    return float(1 - keep(places.on(frame), degrade.unit(places.on(normals))).mean())


MAKERS = {
    "local-swaps": swaps(degrade.locally_swapped),
    "global-swaps": swaps(lambda pairs, _, share, rng: degrade.globally_swapped(pairs, share, rng)),
    "sparse": sparse,
    "holes": holes,
    "outer-surface": outer_surface,
}
