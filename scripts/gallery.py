#!/usr/bin/env python3
"""Methods side by side in one picture: a row for each, a column for each time, the truth on top.

    python3 scripts/gallery.py SEQUENCE.anime FROM TO --runs runs/compare/fox_survey/0-18 \\
        --methods quick,mlp,sdf-blend -o gallery.png [--binary PATH] [--columns 5]

RUNS is where `isomorph compare` leaves a folder per method; LABEL=FOLDER shows one under another
name. The surfaces are extracted by `isomorph
extract`; the first and the last column are the ends, which every method was given. Needs numpy and
matplotlib, which brings Pillow.
"""

import argparse
import io
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from isomorph_paper.sequences import Sequence, read_sequence

Mesh = tuple[np.ndarray, np.ndarray]


def read_ply(path: Path) -> Mesh:
    """Vertices and triangles of a binary PLY as `isomorph extract` writes it."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    counts, kinds, element = {}, [], None
    sizes = {"float": "<f4", "double": "<f8"}
    for words in map(str.split, data[:end].decode("ascii").splitlines()):
        if words[0] == "element":
            element, counts[words[1]] = words[1], int(words[2])
        elif words[0] == "property" and element == "vertex":
            kinds.append((words[2], sizes[words[1]]))
    vertex = np.dtype(kinds)
    vertices = np.frombuffer(data, vertex, counts["vertex"], end)
    face = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
    faces = np.frombuffer(data, face, counts["face"], end + vertices.nbytes)
    points = np.stack([vertices[axis] for axis in "xyz"], axis=1).astype(float)
    return points, faces["corners"]


def true_meshes(sequence: Sequence, pair: tuple[int, int], times: np.ndarray) -> list[Mesh]:
    """The frames nearest to the times."""
    frames = [round(pair[0] + time * (pair[1] - pair[0])) for time in times]
    return [(np.asarray(sequence.frames[frame], float), sequence.triangles) for frame in frames]


def extracted(binary: str, run: Path, times: np.ndarray) -> list[Mesh]:
    """The surfaces of a run at the times."""
    with tempfile.TemporaryDirectory() as folder:
        text = ",".join(f"{time:.6f}" for time in times)
        command = [binary, "extract", str(run), "--times", text, "--quiet", "-o", folder]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        entries = json.loads((Path(folder) / "frames.json").read_text())
        return [read_ply(Path(folder) / entry["surface"]) for entry in entries]


def view_of(meshes: list[Mesh]) -> np.ndarray:
    """Right, up and towards the eye: the axes of the shapes, widest to thinnest, turned a little."""
    points = np.concatenate([vertices for vertices, _ in meshes])
    wide, high, thin = np.argsort(-np.ptp(points, axis=0))
    # A figure is taller than wide: what stands up stays up if the widest axis is y.
    if wide == 1:
        wide, high = high, wide
    basis = np.zeros((3, 3))
    basis[0, wide] = basis[1, high] = basis[2, thin] = 1.0
    basis[2] *= np.sign(np.linalg.det(basis))
    turn = np.radians(25.0)
    around = np.array(
        [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
    )
    return around @ basis


def draw(axes, mesh: Mesh, view: np.ndarray, box: np.ndarray) -> None:
    """Triangles that face the eye, the far ones first, shaded by their normals."""
    from matplotlib.collections import PolyCollection

    vertices, triangles = mesh
    corners = (vertices @ view.T)[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-30
    seen = normals[:, 2] > 0
    order = np.argsort(corners[seen].mean(axis=1)[:, 2])
    light = np.array([0.35, 0.55, 0.76])
    shade = 0.3 + 0.7 * np.clip(normals[seen] @ light, 0, 1)[order]
    colours = np.outer(shade, [0.98, 0.78, 0.55])
    outlines = corners[seen][order][:, :, :2]
    look = {"facecolors": colours, "edgecolors": colours, "linewidths": 0.2}
    axes.add_collection(PolyCollection(outlines, **look))
    axes.set_xlim(box[0, 0], box[1, 0])
    axes.set_ylim(box[0, 1], box[1, 1])
    axes.set_aspect("equal")
    axes.set_axis_off()


def gallery(rows: list[tuple[str, list[Mesh]]], times: np.ndarray, path: Path) -> None:
    """Draws all rows into one PNG."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from PIL import Image

    truth = rows[0][1]
    view = view_of(truth)
    points = np.concatenate([vertices for vertices, _ in truth]) @ view.T
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.06 * (high - low).max()
    box = np.array([low - margin, high + margin])
    shape = (box[1] - box[0])[:2]
    width = 2.1
    figure, grid = plt.subplots(
        len(rows),
        len(times),
        figsize=(width * len(times) + 1.2, width * len(rows) * shape[1] / shape[0]),
        squeeze=False,
    )
    figure.subplots_adjust(left=0.11, right=1, bottom=0, top=0.96, wspace=0, hspace=0)
    for line, (label, meshes) in zip(grid, rows):
        for axes, mesh in zip(line, meshes):
            draw(axes, mesh, view, box)
        middle = line[0].get_position()
        figure.text(0.005, (middle.y0 + middle.y1) / 2, label, va="center", fontsize=9)
    for axes, time in zip(grid[0], times):
        axes.set_title(f"t = {time:.2f}", fontsize=9)
    picture = io.BytesIO()
    figure.savefig(picture, dpi=110)
    plt.close(figure)
    # Shades of one colour: a palette takes a sixth of the bytes.
    colours = Image.open(picture).convert("RGB").quantize(96)
    colours.save(path, format="PNG", optimize=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sequence", type=Path)
    parser.add_argument("pair", type=int, nargs=2, metavar=("FROM", "TO"))
    parser.add_argument("--runs", type=Path, required=True)
    parser.add_argument("--methods", required=True)
    parser.add_argument("--binary", default="isomorph")
    parser.add_argument("--columns", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path, required=True)
    given = parser.parse_args()
    sequence = read_sequence(given.sequence)
    from_, to = given.pair
    # At the times of true frames, so that the top row is the truth and not the nearest frame.
    frames = np.unique(np.linspace(from_, to, given.columns).round())
    times = (frames - from_) / (to - from_)
    rows = [("truth", true_meshes(sequence, (from_, to), times))]
    for method in given.methods.split(","):
        label, _, folder = method.partition("=")
        rows.append((label, extracted(given.binary, given.runs / (folder or label), times)))
        print(label, file=sys.stderr)
    gallery(rows, times, given.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
