"""What is done to the inputs: swapped correspondences, sparse and incomplete clouds.

Everything here is a pure function of arrays and of a random generator. Shares are exact: 5 % of
1000 pairs are 50 pairs, each of which is wrong afterwards.
"""

import zlib
from dataclasses import dataclass

import numpy as np

from . import PaperError
from .sequences import area_vectors, unit, vertex_normals


def generator(seed: int, *stream: object) -> np.random.Generator:
    """The random numbers of one purpose: all of them follow from the seed, none shifts another."""
    return np.random.default_rng([seed, zlib.crc32(repr(stream).encode())])


def same_vertex_pairs(vertices: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 2) pairs of a vertex with itself, in increasing order."""
    if count > vertices:
        raise PaperError(f"{count} pairs wanted, {vertices} vertices there; take a finer sequence")
    chosen = np.sort(rng.choice(vertices, count, replace=False))
    return np.stack([chosen, chosen], axis=1)


def nearest(points: np.ndarray, query: np.ndarray, rank: int) -> np.ndarray:
    """The index of each query's rank-th nearest point, 0 the nearest; of equals, the first."""
    found = np.empty(len(query), np.int64)
    # Blocks bound the memory of the distance matrix.
    for start in range(0, len(query), 256):
        block = query[start : start + 256]
        squared = ((block[:, None, :] - points[None, :, :]) ** 2).sum(2)
        found[start : start + 256] = np.argsort(squared, axis=1, kind="stable")[:, rank]
    return found


def locally_swapped(
    pairs: np.ndarray, target: np.ndarray, share: float, rng: np.random.Generator, rank: int = 5
) -> np.ndarray:
    """A share of the pairs gets the target of its rank-th nearest neighbouring pair.

    Neighbours are those among the known pairs' own targets, as the paper's appendix has it ("swap
    them with their 5th nearest neighbour correspondences"); `target` is (vertices, 3).
    """
    if rank >= len(pairs):
        raise PaperError(
            f"neighbour {rank} of {len(pairs)} pairs does not exist; at least {rank + 1} needed"
        )
    wrong = rng.permutation(len(pairs))[: count_of(share, len(pairs))]
    known = target[pairs[:, 1]]
    swapped = pairs.copy()
    swapped[wrong, 1] = pairs[nearest(known, known[wrong], rank), 1]
    return swapped


def globally_swapped(pairs: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """The targets of a share of the pairs are permuted, so that none of them keeps its own."""
    wrong = rng.permutation(len(pairs))[: count_of(share, len(pairs))]
    if len(wrong) == 1:
        raise PaperError(
            f"a share of {share} of {len(pairs)} pairs is one pair, which has none to swap with"
        )
    swapped = pairs.copy()
    # One cycle in a random order leaves no fixed point.
    swapped[wrong, 1] = pairs[np.roll(wrong, 1), 1]
    return swapped


def count_of(share: float, total: int) -> int:
    """How many of a total a share is."""
    if not 0 <= share <= 1:
        raise PaperError(f"share = {share}: must be 0 to 1")
    return round(share * total)


@dataclass(frozen=True)
class Samples:
    """Places on a triangle mesh, on whichever frame of it: a triangle each and three weights."""

    triangles: np.ndarray
    """(n, 3) vertex indices"""
    weights: np.ndarray
    """(n, 3) barycentric coordinates"""

    def on(self, values: np.ndarray) -> np.ndarray:
        """(n, 3) values of the vertices, interpolated."""
        return np.einsum("nk,nkd->nd", self.weights, values[self.triangles])

    def take(self, chosen: np.ndarray) -> "Samples":
        """Some of the places, by indices or by a mask."""
        return Samples(self.triangles[chosen], self.weights[chosen])


def sampled(
    vertices: np.ndarray, triangles: np.ndarray, count: int, rng: np.random.Generator
) -> Samples:
    """So many places, uniform by the area that the triangles have with these vertices."""
    areas = np.linalg.norm(area_vectors(vertices, triangles), axis=1)
    chosen = rng.choice(len(triangles), count, p=areas / areas.sum())
    root, split = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1 - root, root * (1 - split), root * split], axis=1)
    return Samples(triangles[chosen], weights)


@dataclass(frozen=True)
class Hole:
    """The side of a ball about a surface point that faces the way the surface does there.

    The other side of a thin limb stays, so that a hole is a hole and not an amputation.
    """

    centre: np.ndarray
    normal: np.ndarray
    radius: float

    def holds(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(n,) whether each point is missing."""
        near = np.linalg.norm(points - self.centre, axis=1) < self.radius
        return near & (normals @ self.normal > 0)


# Disjoint would be 2; a margin is left between holes.
APART = 2.2
# Placing at random may waste the room that there is, so it is tried so often.
PLACINGS = 100


def apart(frames: tuple, order: np.ndarray, most: int, distance: float) -> list[int]:
    """The first vertices of an order that are so far from each other in every frame."""
    chosen: list[int] = []
    for vertex in order:
        away = [np.linalg.norm(frame[chosen] - frame[vertex], axis=1) for frame in frames]
        if all((each >= distance).all() for each in away):
            chosen.append(int(vertex))
        if len(chosen) == most:
            break
    return chosen


def different_holes(
    frames: tuple[np.ndarray, np.ndarray],
    triangles: np.ndarray,
    count: int,
    radius: float,
    rng: np.random.Generator,
) -> tuple[list[Hole], list[Hole]]:
    """So many holes in each of two frames, all of them in different places of the surface.

    Their centres are at least `APART` radii apart in both frames, whichever frame they are cut out
    of, so that no place is missing from both.
    """
    for _ in range(PLACINGS):
        centres = apart(frames, rng.permutation(len(frames[0])), 2 * count, APART * radius)
        if len(centres) == 2 * count:
            break
    else:
        raise PaperError(
            f"{2 * count} holes of radius {radius:.3g} do not fit on the shape; make them smaller"
        )
    normals = [vertex_normals(frame, triangles) for frame in frames]
    holes = [
        [Hole(frame[vertex], normal[vertex], radius) for vertex in chosen]
        for frame, normal, chosen in zip(
            frames, normals, (centres[:count], centres[count:]), strict=True
        )
    ]
    return holes[0], holes[1]


def outside(holes: list[Hole], points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(n,) whether each point is in none of the holes."""
    missing = np.zeros(len(points), bool)
    for hole in holes:
        missing |= hole.holds(points, normals)
    return ~missing


@dataclass(frozen=True)
class Clouds:
    """Two clouds with normals, and pairs of their points that correspond exactly."""

    source: tuple[np.ndarray, np.ndarray]
    target: tuple[np.ndarray, np.ndarray]
    pairs: np.ndarray


def corresponding_clouds(
    frames: tuple[np.ndarray, np.ndarray],
    triangles: np.ndarray,
    counts: tuple[int, int],
    pairs: int,
    rng: np.random.Generator,
    kept: tuple = (None, None),
) -> Clouds:
    """Clouds sampled from two frames; the first `pairs` points of both are the same places.

    `kept` says per frame which places are sampled: a function of (points, normals) to a mask. The
    counts are met all the same. The pairs are drawn by the first frame's area, all other points by
    their own frame's, so neither cloud is more than a little denser anywhere for being paired. A
    smaller count from the same generator gives the first points of the larger one.
    """
    everywhere = lambda points, normals: np.ones(len(points), bool)
    kept = tuple(keep or everywhere for keep in kept)
    normals = [vertex_normals(frame, triangles) for frame in frames]

    def keeps(side: int, places: Samples) -> np.ndarray:
        return kept[side](places.on(frames[side]), unit(places.on(normals[side])))

    # Three to one is room enough for what the holes take away.
    shared = sampled(frames[0], triangles, 3 * pairs, rng)
    shared = shared.take(np.flatnonzero(keeps(0, shared) & keeps(1, shared))[:pairs])
    clouds = []
    for side, count in enumerate(counts):
        more = sampled(
            frames[side], triangles, 3 * max(counts), generator(int(rng.integers(2**31)), side)
        )
        more = more.take(np.flatnonzero(keeps(side, more))[: count - pairs])
        if len(shared.weights) < pairs or len(more.weights) < count - pairs:
            raise PaperError(
                "most of the surface is missing, so the clouds have too few points; cut less away"
            )
        places = Samples(
            *(
                np.concatenate([getattr(part, name) for part in (shared, more)])
                for name in ("triangles", "weights")
            )
        )
        clouds.append((places.on(frames[side]), unit(places.on(normals[side]))))
    return Clouds(clouds[0], clouds[1], np.stack([np.arange(pairs)] * 2, axis=1))
