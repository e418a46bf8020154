"""Shapes: arrays, files, and the objects of other packages, none of which is needed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Union

import numpy as np

from . import _native

# A path, arrays, or an object that has vertices.
ShapeLike = Union["Shape", str, "os.PathLike[str]", np.ndarray, tuple, Any]


class Shape:
    """A mesh, or a point cloud, which has no faces.

    Args:
        vertices: numbers `(n, 3)`; float64 in C order is kept without a copy.
        faces: whole numbers `(m, 3)` from 0 to n - 1, counter-clockwise from outside.
        normals: `(n, 3)`.
        notes: what was decided about the contents of a file, one sentence each.

    Raises:
        ValueError: what is wrong with an array.
    """

    def __init__(self, vertices: Any, faces: Any = None, normals: Any = None, notes: list[str] | None = None):
        self.vertices = rows("vertices", vertices, np.float64)
        self.faces = None if faces is None or len(faces) == 0 else indices("faces", faces, len(self.vertices))
        self.normals = None if normals is None else rows("normals", normals, np.float32)
        if self.normals is not None and len(self.normals) != len(self.vertices):
            raise ValueError(f"normals: {len(self.normals)} for {len(self.vertices)} vertices")
        #: What was decided about the contents of a file, one sentence each.
        self.notes = notes or []

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Shape:
        """Reads a file: PLY, OBJ, STL, OFF, glTF, NPY, NPZ or text, by the ending of its name.

        Args:
            path: the file.

        Returns:
            The shape; its `notes` have what was decided about the file.

        Raises:
            ValueError: what is wrong with the file, and where.
        """
        return cls(*_native.read_shape(os.fspath(path)))

    @classmethod
    def of(cls, what: ShapeLike) -> Shape:
        """The shape that something is.

        Args:
            what: a shape; a path; points `(n, 3)`; a tuple of vertices, faces and normals; or an object of `trimesh`,
                `open3d`, `meshio` or `pyvista`. No other package is imported: an object needs the attributes alone.

        Returns:
            The shape.

        Raises:
            ValueError: what is none of these.
        """
        if isinstance(what, cls):
            return what
        if isinstance(what, (str, os.PathLike)):
            return cls.read(what)
        if isinstance(what, tuple) and 1 <= len(what) <= 3 and np.ndim(what[0]) == 2:
            return cls(*what)
        for known in (of_pyvista, of_meshio, of_open3d, of_trimesh):
            found = known(what)
            if found is not None:
                return cls(*found)
        if np.ndim(what) == 2:
            return cls(what)
        raise ValueError(
            f"{type(what).__name__}: no shape; give a path, points (n, 3), (vertices, faces), or an object of "
            "trimesh, open3d, meshio or pyvista"
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a file, PLY or OBJ, by the ending of its name.

        Args:
            path: the file.

        Raises:
            ValueError: another ending.
            isomorph.TrainingError: the file cannot be written.
        """
        _native.write_shape(os.fspath(path), self.vertices, self.faces, self.normals)

    def __repr__(self) -> str:
        if self.faces is None:
            return f"<isomorph cloud of {len(self.vertices)} points>"
        return f"<isomorph mesh of {len(self.vertices)} vertices and {len(self.faces)} faces>"


def rows(name: str, values: Any, kind: type) -> np.ndarray:
    """Numbers `(n, 3)`, contiguous; float64 that is so already is not copied."""
    try:
        array = np.ascontiguousarray(values, dtype=kind)
    except (TypeError, ValueError) as reason:
        raise ValueError(f"{name}: not an array of numbers ({reason})") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name}: shape {array.shape}: must be (n, 3)")
    return array


def indices(name: str, values: Any, below: int, columns: int = 3) -> np.ndarray:
    """Whole numbers `(n, columns)` below a count."""
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{name}: shape {array.shape}: must be (n, {columns})")
    if array.dtype.kind not in "iu":
        whole = array.astype(np.int64)
        if array.dtype.kind != "f" or not np.array_equal(whole, array):
            raise ValueError(f"{name}: {array.dtype}: must be whole numbers")
        array = whole
    if array.size and (array.min() < 0 or array.max() >= below):
        raise ValueError(f"{name}: {array.min()} to {array.max()}: must be 0 to {below - 1}")
    return np.ascontiguousarray(array, dtype=np.uint32)


def of_trimesh(what: Any):
    """A Trimesh, or a PointCloud."""
    if not hasattr(what, "vertices"):
        return None
    return np.asarray(what.vertices), getattr(what, "faces", None)


def of_open3d(what: Any):
    """A TriangleMesh, or a PointCloud with or without normals."""
    # A Trimesh has triangles too, which are corners and no numbers of vertices.
    if hasattr(what, "triangles") and hasattr(what, "vertices") and not hasattr(what, "faces"):
        return np.asarray(what.vertices), np.asarray(what.triangles)
    if hasattr(what, "points") and hasattr(what, "normals") and not hasattr(what, "cells"):
        points, normals = np.asarray(what.points), np.asarray(what.normals)
        return points, None, normals if len(normals) == len(points) and len(points) else None
    return None


def of_meshio(what: Any):
    """A Mesh with triangles and quadrangles."""
    cells = getattr(what, "cells_dict", None)
    if not isinstance(cells, dict) or not hasattr(what, "points"):
        return None
    faces = [np.asarray(cells["triangle"])] if "triangle" in cells else []
    if "quad" in cells:
        quads = np.asarray(cells["quad"])
        faces += [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    points = np.asarray(what.points)
    if points.shape[1] == 2:
        raise ValueError("points: in a plane; a shape has three coordinates")
    return points, np.concatenate(faces) if faces else None


def of_pyvista(what: Any):
    """A PolyData, whose faces are counts and corners in one row."""
    if not hasattr(what, "n_points") or not hasattr(what, "points"):
        return None
    flat = np.asarray(getattr(what, "faces", ()), dtype=np.int64)
    triangles, at = [], 0
    while at < len(flat):
        corners = flat[at + 1 : at + 1 + flat[at]]
        triangles += [(corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1)]
        at += 1 + flat[at]
    return np.asarray(what.points), np.array(triangles) if triangles else None


def is_path(what: Any) -> bool:
    return isinstance(what, (str, os.PathLike))


def name_of(what: Any, otherwise: str) -> str:
    """The name of a file without its ending."""
    return Path(what).stem if is_path(what) else otherwise
