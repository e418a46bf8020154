#!/usr/bin/env python3
"""The picture of the guide's chapter "Troubleshooting": six symptoms, each beside the same shape with its cure.

    python3 scripts/symptoms.py -o scripts/results/symptoms.png [--binary PATH] [--work FOLDER]

Each symptom is made from the sample data by a setting or a file that causes it, and trained twice: with the cause, and
with what the guide says against it. Needs numpy and matplotlib, which brings Pillow. It takes two minutes.
"""

import argparse
import io
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gallery import Mesh, draw, extracted, read_ply, view_of

ROOT = Path(__file__).resolve().parent.parent
FOX = [str(ROOT / "data/fox" / f"{end}.ply") for end in ("source", "target")]
PEOPLE = [str(ROOT / "data/human" / f"{end}.ply") for end in ("source", "target")]


@dataclass
class Symptom:
    """One row: what is seen, its cause and its cure, and how each is made."""

    number: int
    text: str
    shapes: list[str]
    wrong: list[str]
    right: list[str]
    time: float
    names: tuple[str, str]


def turned_fox(work: Path) -> str:
    """The fox's target, turned by 170 degrees about the vertical axis through its middle."""
    points, triangles = read_sample(Path(FOX[1]))
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    angle = np.radians(170.0)
    about = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    return write_obj(work / "turned.obj", (points - middle) @ about.T + middle, triangles)


def samples(path: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points spread over a mesh, and the normals of its faces there."""
    points, triangles = read_sample(Path(path))
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(triangles), 12_000, p=areas / areas.sum())
    weights = rng.dirichlet([1, 1, 1], len(chosen))
    places = np.einsum("nk,nkx->nx", weights, corners[chosen])
    return places, normals[chosen] / areas[chosen, None]


def clouds(work: Path, name: str, rows) -> list[str]:
    """Both foxes as text; `rows` makes the rows of a file from points and normals."""
    rng, files = np.random.default_rng(0), []
    for end, path in zip("ab", FOX):
        file = work / f"{name}-{end}.xyz"
        np.savetxt(file, rows(*samples(path, rng), rng), fmt="%.5f")
        files.append(str(file))
    return files


def strays(points: np.ndarray, _: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Points, and 150 stray ones not far from the surface."""
    away = rng.normal(size=(150, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    way = rng.uniform(0.03, 0.12, (150, 1)) * np.ptp(points, axis=0).max()
    return np.concatenate([points, points[rng.choice(len(points), 150)] + way * away])


def unoriented(points: np.ndarray, normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Points with normals of which half point inwards."""
    signs = rng.choice([-1.0, 1.0], (len(points), 1))
    return np.hstack([points, signs * normals])


def read_sample(path: Path) -> Mesh:
    """A sample's vertices and triangles."""
    return read_ply(path)


def write_obj(path: Path, points: np.ndarray, triangles: np.ndarray) -> str:
    """A mesh as text."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points]
    lines += [f"f {a} {b} {c}" for a, b, c in triangles + 1]
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def symptoms(work: Path) -> list[Symptom]:
    """All rows."""
    turned = [FOX[0], turned_fox(work)]
    raised = [str(ROOT / f"data/arms/key-{key}.ply") for key in ("00", "28")]
    return [
        Symptom(
            1,
            "fingers are missing",
            PEOPLE,
            ["--set", "result.resolution=56"],
            [],
            1.0,
            ("56 cells", "192 cells"),
        ),
        Symptom(
            2,
            "thin parts melt on the way",
            raised,
            ["--pairs", "none"],
            ["--pairs", "match"],
            0.5,
            ("no pairs", "data.correspondences = \"match\""),
        ),
        Symptom(
            3,
            "the shape is torn to pieces",
            FOX,
            ["--pairs", "same-vertices"],
            ["--pairs", "match"],
            0.5,
            ("vertices that do not belong together", "data.correspondences = \"match\""),
        ),
        Symptom(
            4,
            "the surface is crumpled",
            clouds(work, "unoriented", unoriented),
            ["--set", "data.normals=given"],
            [],
            1.0,
            ("normals that point in and out", "data.normals = \"auto\""),
        ),
        Symptom(
            5,
            "blobs stand around the shape",
            clouds(work, "strays", strays),
            ["--pairs", "none", "--set", "data.clean=none"],
            ["--pairs", "none"],
            0.5,
            ("stray points", "data.clean = \"auto\""),
        ),
        Symptom(
            6,
            "the shape collapses in a large turn",
            turned,
            ["--align", "none", "--pairs", "none"],
            ["--align", "auto"],
            0.5,
            ("170 degrees", "data.align = \"auto\""),
        ),
    ]


def surface(binary: str, work: Path, symptom: Symptom, flags: list[str], name: str) -> Mesh:
    """The surface of a row at its time."""
    run = work / f"{symptom.number}-{name}"
    command = [binary, "morph", *symptom.shapes, "-o", str(run), "--frames", "2", "--quiet", *flags]
    print(" ".join(command), flush=True)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return extracted(binary, run, np.array([symptom.time]))[0]


def picture(rows: list[tuple[Symptom, Mesh, Mesh]], path: Path) -> None:
    """Two symptoms in a line, each beside its cure."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from PIL import Image

    lines = (len(rows) + 1) // 2
    figure, grid = plt.subplots(lines, 4, figsize=(11.2, 2.4 * lines), squeeze=False)
    figure.subplots_adjust(left=0.01, right=0.99, bottom=0.05, top=0.94, wspace=0.04, hspace=0.24)
    for k, (symptom, wrong, right) in enumerate(rows):
        view = view_of([right])
        points = np.concatenate([wrong[0], right[0]]) @ view.T
        low, high = points.min(axis=0), points.max(axis=0)
        margin = 0.04 * (high - low).max()
        box = np.array([low - margin, high + margin])
        cells = grid[k // 2][2 * (k % 2) : 2 * (k % 2) + 2]
        for axes, mesh in zip(cells, (wrong, right)):
            draw(axes, mesh, view, box)
        place = cells[0].get_subplotspec().get_position(figure)
        title = f"{symptom.number}. {symptom.text}"
        figure.text(place.x0, place.y1 + 0.014, title, fontsize=10, weight="bold")
        for cell, name in zip(cells, symptom.names):
            place = cell.get_subplotspec().get_position(figure)
            middle = (place.x0 + place.x1) / 2
            figure.text(middle, place.y0 - 0.022, name, fontsize=8, color="#555555", ha="center")
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=100)
    plt.close(figure)
    colours = Image.open(drawn).convert("RGB").quantize(64)
    colours.save(path, format="PNG", optimize=True)


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="the PNG file")
    parser.add_argument("--binary", default=str(ROOT / "target/release/isomorph"))
    parser.add_argument("--work", type=Path, help="keep the runs here")
    options = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as temporary:
        work = options.work or Path(temporary)
        work.mkdir(parents=True, exist_ok=True)
        rows = []
        for symptom in symptoms(work):
            both = ("wrong", symptom.wrong), ("right", symptom.right)
            meshes = [surface(options.binary, work, symptom, flags, name) for name, flags in both]
            rows.append((symptom, *meshes))
        picture(rows, options.output)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
