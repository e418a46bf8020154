"""Vertex-consistent sequences (.anime), and the files that inputs are written to.

The layout of .anime is that of DeformingThings4D, little-endian: int32 frames, vertices, triangles;
float32 vertices of frame 0; int32 triangles; float32 offsets of each later frame from frame 0.
"""

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import PaperError


@dataclass(frozen=True)
class Sequence:
    """Frames that share their vertices and triangles, in the units of the file."""

    path: Path
    frames: np.ndarray
    """(frames, vertices, 3), float64"""
    triangles: np.ndarray
    """(triangles, 3), int64"""

    @property
    def name(self) -> str:
        return self.path.stem

    def volume(self, frame: int) -> float:
        """The enclosed volume of a frame."""
        return volume(self.frames[frame], self.triangles)

    def unit_scale(self, pair: tuple[int, int]) -> float:
        """What brings two frames together to a mean area of 1."""
        return (sum(area(self.frames[frame], self.triangles) for frame in pair) / 2) ** -0.5


def read_sequence(path: Path) -> Sequence:
    """Reads an .anime file; a PaperError names what is wrong with it."""
    try:
        data = path.read_bytes()
    except OSError as reason:
        raise PaperError(
            f"{path}: cannot be read ({reason.strerror}); "
            "--sequences names the folder of the .anime files"
        ) from reason
    # A file without a header is read as one of no frames, which no file is the length of.
    header = data[:12] if len(data) >= 12 else bytes(12)
    frames, vertices, triangles = np.frombuffer(header, "<i4").tolist()
    needed = 12 + 12 * (vertices * frames + triangles)
    if min(frames, vertices, triangles) < 1 or len(data) != needed:
        raise PaperError(f"{path}: {len(data)} bytes, {needed} by its header; not an .anime file")
    first = np.frombuffer(data, "<f4", 3 * vertices, 12).reshape(-1, 3)
    corners = np.frombuffer(data, "<i4", 3 * triangles, 12 + 12 * vertices).reshape(-1, 3)
    offsets = np.frombuffer(data, "<f4", -1, 12 + 12 * (vertices + triangles))
    later = first + offsets.reshape(frames - 1, vertices, 3)
    positions = np.concatenate([first[None], later]).astype(np.float64)
    return Sequence(path, positions, corners.astype(np.int64))


def write_sequence(path: Path, frames: np.ndarray, triangles: np.ndarray) -> Sequence:
    """Writes (frames, vertices, 3) positions as .anime; returns them as the file has them."""
    frames = np.asarray(frames, "<f4")
    header = np.array([len(frames), frames.shape[1], len(triangles)], "<i4")
    offsets = frames[1:] - frames[:1]
    parts = (header, frames[0], np.asarray(triangles, "<i4"), offsets)
    write_atomically(path, b"".join(part.tobytes() for part in parts))
    return read_sequence(path)


def area_vectors(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(triangles, 3) outward normals of twice the length of each triangle's area."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def area(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """The surface area of a mesh."""
    return float(np.linalg.norm(area_vectors(vertices, triangles), axis=1).sum() / 2)


def rms(vectors: np.ndarray) -> float:
    """The root mean square length of (n, dimensions) vectors."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """The enclosed volume of a closed mesh by the divergence theorem."""
    a, b, c = (vertices[triangles[:, corner]] - vertices[0] for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def vertex_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(vertices, 3) unit normals: the mean of the adjacent triangles' by area."""
    normals = np.zeros_like(vertices)
    weighted = area_vectors(vertices, triangles)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], weighted)
    return unit(normals)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors of length 1; a zero vector stays zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)


def write_atomically(path: Path, data: bytes) -> None:
    """Nothing partial is left under the final name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(data)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_cloud(path: Path, points: np.ndarray, normals: np.ndarray) -> None:
    """A binary PLY of points with unit normals."""
    names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    rows = np.concatenate([points, normals], axis=1).astype("<f4")
    write_atomically(path, ply_header(f"element vertex {len(points)}\n{names}") + rows.tobytes())


def write_mesh(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> None:
    """A binary PLY of vertices in their own order, with triangles."""
    rows = np.empty(len(triangles), [("corners", "u1"), ("vertices", "<i4", 3)])
    rows["corners"], rows["vertices"] = 3, triangles
    elements = (
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\n"
    )
    write_atomically(path, ply_header(elements) + vertices.astype("<f4").tobytes() + rows.tobytes())


def ply_header(elements: str) -> bytes:
    return f"ply\nformat binary_little_endian 1.0\n{elements}end_header\n".encode("ascii")


def write_pairs(path: Path, pairs: np.ndarray) -> None:
    """A CSV of (n, 2) source and target indices, as `data.correspondences` reads it."""
    lines = ["source_index,target_index", *(f"{source},{target}" for source, target in pairs)]
    write_atomically(path, ("\n".join(lines) + "\n").encode("ascii"))


def digest(path: Path) -> str:
    """The SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
