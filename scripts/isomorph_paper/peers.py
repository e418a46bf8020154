"""Registrations that PyPI has: where the vertices of one mesh go on another one.

Each is called as its documentation has it, in an interpreter that has the package (`peer_worker.py`).
Nothing of a package is imported here until it is called, so that a missing one stops no other.

| name | package | reads |
|---|---|---|
| cpd | pycpd, Coherent Point Drift (Myronenko and Song 2010) | points |
| cpd-pairs | probreg, the same with known pairs (Golyanik et al. 2016) | points and pairs |
| nricp-amberg | trimesh, non-rigid iterative closest points (Amberg et al. 2007) | meshes and pairs |
| nricp-sumner | trimesh, by Sumner and Popovic 2004 | meshes and pairs |
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# Points of either shape that Coherent Point Drift gets: its time grows by their cube, its memory by
# their square.
POINTS = 2_000


@dataclass(frozen=True)
class Shapes:
    """What a registration is given: two meshes in normalised units, and pairs of their vertices."""

    source: np.ndarray
    """(n, 3)"""
    source_triangles: np.ndarray
    target: np.ndarray
    """(m, 3), in an order of their own"""
    target_triangles: np.ndarray
    pairs: np.ndarray
    """(pairs, 2) indices of a source and a target vertex"""


@dataclass(frozen=True)
class Peer:
    """One registration, as it is called."""

    name: str
    packages: tuple[str, ...]
    """What pip installs for it, its own package first."""
    settings: str
    """For the reader of the table."""
    register: Callable[[Shapes], np.ndarray]
    """The (n, 3) places of the source's vertices."""
    imports: Callable[[], object]
    """Loads its package, so that no clock counts it; raises what is wrong with it."""


@dataclass(frozen=True)
class Drift:
    """The points that Coherent Point Drift works on, in its units: mean 0 and mean square 1."""

    source: np.ndarray
    target: np.ndarray
    pairs: int
    """So many first points of both correspond, row by row."""
    all_source: np.ndarray
    centre: np.ndarray
    size: float

    def back(self, points: np.ndarray) -> np.ndarray:
        """The same points in the units of the shapes."""
        return points * self.size + self.centre


def drift(shapes: Shapes, points: int = POINTS) -> Drift:
    """All pairs and random other vertices, so many in all of either shape."""
    rng = np.random.default_rng(0)

    def chosen(known: np.ndarray, count: int) -> np.ndarray:
        others = np.setdiff1d(np.arange(count), known)
        more = min(max(points - len(known), 0), len(others))
        return np.concatenate([known, rng.choice(others, more, replace=False)])

    centre = shapes.source.mean(axis=0)
    size = float(np.sqrt(((shapes.source - centre) ** 2).sum(axis=1).mean()))
    unit = lambda places: (places - centre) / size
    sides = zip((shapes.source, shapes.target), shapes.pairs.T)
    source, target = (unit(side[chosen(known, len(side))]) for side, known in sides)
    return Drift(source, target, len(shapes.pairs), unit(shapes.source), centre, size)


def gaussian(points: np.ndarray, centres: np.ndarray, width: float) -> np.ndarray:
    """(points, centres) values of the kernel of Coherent Point Drift, `exp(-d^2 / (2 width^2))`."""
    squared = (points**2).sum(1)[:, None] - 2 * points @ centres.T + (centres**2).sum(1)
    return np.exp(-np.maximum(squared, 0) / (2 * width**2))


def cpd(shapes: Shapes) -> np.ndarray:
    from pycpd import DeformableRegistration

    given = drift(shapes)
    registration = DeformableRegistration(X=given.target, Y=given.source)
    registration.register()
    # The displacement is a sum of kernels about the points: it moves all other vertices as well.
    kernels = gaussian(given.all_source, given.source, registration.beta)
    return given.back(given.all_source + kernels @ registration.W)


# The defaults of probreg (beta 2, alpha 1e-8) end farther from the target than where they began:
# its kernels are float32, and pairs as reliable as that make weights of a million.
CONSTRAINED = {"beta": 0.2, "alpha": 1e-2}
CONSTRAINED_UNTIL = {"maxiter": 50, "tol": 1e-5}


def cpd_pairs(shapes: Shapes) -> np.ndarray:
    from probreg import cpd as coherent, math_utils

    given = drift(shapes)
    known = np.arange(given.pairs)
    found = coherent.registration_cpd(
        given.source,
        given.target,
        "nonrigid_constrained",
        idx_source=known,
        idx_target=known,
        **CONSTRAINED,
        **CONSTRAINED_UNTIL,
    )
    kernels = math_utils.rbf_kernel(given.all_source, given.source, CONSTRAINED["beta"])
    return given.back(given.all_source + kernels @ found.transformation.w)


def nricp(kind: str) -> Callable[[Shapes], np.ndarray]:
    """A non-rigid registration of trimesh by its name there, with its own settings."""

    def register(shapes: Shapes) -> np.ndarray:
        import trimesh

        # `process` would merge and reorder vertices.
        mesh = lambda vertices, triangles: trimesh.Trimesh(vertices, triangles, process=False)
        source, target = shapes.pairs.T
        return getattr(trimesh.registration, kind)(
            mesh(shapes.source, shapes.source_triangles),
            mesh(shapes.target, shapes.target_triangles),
            source_landmarks=source,
            target_positions=shapes.target[target],
        )

    return register


def load_pycpd() -> None:
    import pycpd  # noqa: F401


def load_probreg() -> None:
    import probreg  # noqa: F401


def load_trimesh() -> None:
    import networkx  # noqa: F401
    import rtree  # noqa: F401
    import trimesh.registration  # noqa: F401


TRIMESH = ("trimesh", "scipy", "rtree", "networkx")
PEERS = (
    Peer(
        "cpd",
        ("pycpd",),
        f"defaults of the package, {POINTS} points of either shape, no pairs",
        cpd,
        load_pycpd,
    ),
    Peer(
        "cpd-pairs",
        ("probreg",),
        f"beta 0.2, alpha 0.01, at most 50 iterations to 1e-5, {POINTS} points of either shape",
        cpd_pairs,
        load_probreg,
    ),
    Peer("nricp-amberg", TRIMESH, "defaults of the package", nricp("nricp_amberg"), load_trimesh),
    Peer("nricp-sumner", TRIMESH, "defaults of the package", nricp("nricp_sumner"), load_trimesh),
)


def named(name: str) -> Peer:
    """The registration of this name."""
    return next(peer for peer in PEERS if peer.name == name)
