"""As-rigid-as-possible interpolation of a mesh between two of its poses, every vertex known.

Each triangle's deformation is parted into a rotation and a stretch, F = R S (polar); at a time t it
would be exp(t log R) ((1 - t) I + t S), and the vertices are those whose triangles come nearest to
that, in least squares weighted by area (Alexa et al., SIGGRAPH 2000; as a Poisson equation Xu et
al., SPM 2005). Rotations of half a turn and more are taken the short way round.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from .sequences import area_vectors


class AsRigid:
    """Interpolates between `source` and `target`, (vertices, 3) each, of one connected mesh."""

    def __init__(self, source: np.ndarray, target: np.ndarray, triangles: np.ndarray):
        twice = np.linalg.norm(area_vectors(source, triangles), axis=1)
        # A triangle without area has no deformation.
        self.triangles = triangles[twice > 1e-9 * twice.mean()]
        self.ends = source, target
        self.areas = np.linalg.norm(area_vectors(source, self.triangles), axis=1) / 2
        self.gradients = hat_gradients(source, self.triangles)
        deformation = basis(target, self.triangles) @ np.linalg.inv(basis(source, self.triangles))
        u, sizes, v = np.linalg.svd(deformation)
        self.turns = Rotation.from_matrix(u @ v).as_rotvec()
        self.stretches = np.swapaxes(v, 1, 2) @ (sizes[:, :, None] * v)
        self.mass = self.scattered(np.repeat(self.areas[:, None], 3, axis=1))[:, None] / 3
        self.system = splu(self.matrix())

    def matrix(self):
        """The cotangent Laplacian, a little of the mass added where only the place is free."""
        entries = np.einsum("n,njc,nkc->njk", self.areas, self.gradients, self.gradients)
        rows, columns = (np.repeat(self.triangles, 3, axis=1), np.tile(self.triangles, (1, 3)))
        count = len(self.mass)
        diagonal = np.arange(count)
        # Vertices of no triangle have no mass, and stay where their line is.
        little = np.where(self.mass[:, 0] > 0, 1e-9 * self.mass[:, 0], 1.0)
        return coo_matrix(
            (
                np.concatenate([entries.ravel(), little]),
                (
                    np.concatenate([rows.ravel(), diagonal]),
                    np.concatenate([columns.ravel(), diagonal]),
                ),
            ),
            shape=(count, count),
        ).tocsc()

    def scattered(self, values: np.ndarray) -> np.ndarray:
        """The sum at every vertex of (triangles, 3, ...) values at the triangles' corners."""
        found = np.zeros((len(self.ends[0]), *values.shape[2:]))
        np.add.at(found, self.triangles, values)
        return found

    def at(self, time: float) -> np.ndarray:
        """(vertices, 3) positions; their centre of area moves on a straight line."""
        turn = Rotation.from_rotvec(time * self.turns).as_matrix()
        wanted = turn @ ((1 - time) * np.eye(3) + time * self.stretches)
        pulls = np.einsum("n,njc,ndc->njd", self.areas, self.gradients, wanted)
        line = (1 - time) * self.ends[0] + time * self.ends[1]
        found = self.system.solve(self.scattered(pulls))
        moved = found + self.centre(line) - self.centre(found)
        return np.where(self.mass > 0, moved, line)

    def centre(self, positions: np.ndarray) -> np.ndarray:
        return (self.mass * positions).sum(axis=0) / self.mass.sum()


def basis(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(triangles, 3, 3): two edges and the unit normal, as columns."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([b - a, c - a, normal / np.maximum(length, 1e-300)], axis=2)


def hat_gradients(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(triangles, 3, 3): the gradient of each corner's hat function."""
    corners = [vertices[triangles[:, corner]] for corner in range(3)]
    normal = area_vectors(vertices, triangles)
    squared = (normal**2).sum(axis=1, keepdims=True)
    opposite = [corners[(k + 2) % 3] - corners[(k + 1) % 3] for k in range(3)]
    return np.stack([np.cross(normal, edge) / squared for edge in opposite], axis=1)
