"""A bar that turns as a whole about its middle: the true motion is known, however far it turns."""

import numpy as np

SIZES = np.array([1.6, 0.3, 0.3])
CELLS = np.array([44, 8, 8])
FRAMES = 9


def turning(angle: float) -> tuple[np.ndarray, np.ndarray]:
    """(frames, vertices, 3) positions at even angles from 0 to `angle` in radians, and the triangles."""
    vertices, triangles = box()
    frames = []
    for part in np.linspace(0, 1, FRAMES):
        c, s = np.cos(angle * part), np.sin(angle * part)
        # About an axis that is none of the grid's.
        frames.append(vertices @ about([1, 2, 3], c, s).T)
    return np.array(frames), triangles


def about(axis: list[float], c: float, s: float) -> np.ndarray:
    """The rotation about an axis by the angle of this cosine and sine."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + s * cross + (1 - c) * cross @ cross


def box() -> tuple[np.ndarray, np.ndarray]:
    """The bar's vertices on a grid, each once, and its triangles, outward."""
    numbers: dict[tuple[int, int, int], int] = {}
    number = lambda place: numbers.setdefault(tuple(place), len(numbers))
    triangles = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, CELLS[axis]):
            for i in range(CELLS[u]):
                for j in range(CELLS[v]):
                    corners = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        place = [0, 0, 0]
                        place[axis], place[u], place[v] = int(side), i + di, j + dj
                        corners.append(number(place))
                    a, b, c, d = corners if side else corners[::-1]
                    triangles += [(a, b, c), (a, c, d)]
    vertices = np.array(list(numbers)) / CELLS * SIZES - SIZES / 2
    return vertices, np.array(triangles)
