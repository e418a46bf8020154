"""Whether pairs over three frames show which of them are wrong: a cycle closes, or it does not.

A pair from the first frame to the second goes on with the nearest pair from there to the third. The nearest pair from the
first to the third directly must arrive at the same place. A pair whose cycle misses by more than `MOST` would be dropped.
The same goes for pairs from the second frame to the third, from where they begin.
"""

import subprocess
from pathlib import Path

import numpy as np

from . import PaperError, degrade
from .sequences import Sequence, area_vectors, unit, write_cloud

SEQUENCES = ("bear_walk", "fox_survey", "human_raise_arms")
FRAMES = ((0, 10, 20), (0, 27, 54))
# From where each of the three frames is seen, degrees about the vertical axis; none: from all sides.
VIEWS = ((None,) * 3, (90, 90, 90), (60, 90, 120), (0, 60, 120))
POINTS = 20_000
# What faces away from the eye by more than this, as a cosine, is not seen.
GRAZING = -0.1
# Above the horizon, as a tangent.
ELEVATION = 0.2
# A pair is wrong beyond this, and a cycle does not close, in normalised units.
MOST = 0.1
# A cycle is checked where the next pair begins this near.
NEAR = 0.05
HOPS = ((0, 1), (1, 2), (0, 2))

ABOUT = """\
## Cycles over three frames

Clouds of 20,000 points, sampled anew, whole or as they are seen from one side. The views turn about the vertical axis.
Wrong: more than .1 from the true place. Dropped: pairs whose cycle misses by more than .1."""


def seen(sequence: Sequence, frame: int, view: float | None) -> degrade.Samples:
    """Places on a frame, uniform by area, of which those stay that face the eye."""
    vertices, triangles = sequence.frames[frame], sequence.triangles
    places = degrade.sampled(vertices, triangles, POINTS, degrade.generator(0, "cycles", frame))
    if view is None:
        return places
    angle = np.radians(view)
    eye = unit(np.array([[np.cos(angle), ELEVATION, np.sin(angle)]]))[0]
    return places.take(unit(area_vectors(vertices, places.triangles)) @ eye > GRAZING)


def study(binary: str, sequence: Sequence, frames: tuple[int, ...], views: tuple, folder: Path) -> list[dict]:
    """The rows of both hops of three frames."""
    places = [seen(sequence, frame, view) for frame, view in zip(frames, views)]
    clouds = [each.on(sequence.frames[frame]) for each, frame in zip(places, frames)]
    for k, (each, frame) in enumerate(zip(places, frames)):
        normals = unit(area_vectors(sequence.frames[frame], each.triangles))
        write_cloud(folder / f"{k}.ply", clouds[k], normals)
    pairs = {hop: matched(binary, hop, folder) for hop in HOPS}
    scale = sequence.unit_scale((frames[0], frames[1]))
    checks = ((0, 1), first_hop), ((1, 2), second_hop)
    rows = []
    for (i, j), check in checks:
        own = pairs[i, j]
        truth = places[i].on(sequence.frames[frames[j]])
        wrong = scale * np.linalg.norm(truth[own[:, 0]] - clouds[j][own[:, 1]], axis=1) > MOST
        miss, near = check(pairs, clouds)
        checked = scale * near < NEAR
        dropped = checked & (scale * miss > MOST)
        rows.append({
            "sequence": sequence.name, "frames": list(frames), "views": list(views), "hop": [frames[i], frames[j]],
            "pairs": len(own), "wrong": float(wrong.mean()), "checked": float(checked.mean()),
            "dropped": float(dropped.mean()), "of_them_wrong": float(wrong[dropped].mean()) if dropped.any() else None,
            "wrong_after": float(wrong[~dropped].mean()) if not dropped.all() else None,
        })
    return rows


def first_hop(pairs: dict, clouds: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """By how much the cycle of each pair from the first frame to the second misses, and how near its next pairs begin."""
    own, on, direct = (pairs[hop] for hop in HOPS)
    next_pair, there = nearest(clouds[1][on[:, 0]], clouds[1][own[:, 1]])
    other, here = nearest(clouds[0][direct[:, 0]], clouds[0][own[:, 0]])
    apart = clouds[2][on[next_pair, 1]] - clouds[2][direct[other, 1]]
    return np.linalg.norm(apart, axis=1), np.maximum(there, here)


def second_hop(pairs: dict, clouds: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The same of each pair from the second frame to the third."""
    before, own, direct = (pairs[hop] for hop in HOPS)
    previous, there = nearest(clouds[1][before[:, 1]], clouds[1][own[:, 0]])
    other, here = nearest(clouds[0][direct[:, 0]], clouds[0][before[previous, 0]])
    apart = clouds[2][own[:, 1]] - clouds[2][direct[other, 1]]
    return np.linalg.norm(apart, axis=1), np.maximum(there, here)


def nearest(places: np.ndarray, query: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nearest place to each query, and how far it is."""
    found = np.empty(len(query), np.int64)
    squared = (places**2).sum(axis=1)
    # Blocks bound the memory of the distance matrix.
    for start in range(0, len(query), 1024):
        block = query[start : start + 1024]
        found[start : start + 1024] = np.argmin(squared - 2 * block @ places.T, axis=1)
    return found, np.linalg.norm(places[found] - query, axis=1)


def matched(binary: str, hop: tuple[int, int], folder: Path) -> np.ndarray:
    """(pairs, 2) indices that `match` finds from one cloud to another."""
    out = folder / "{}-{}.csv".format(*hop)
    command = [binary, "match", f"{hop[0]}.ply", f"{hop[1]}.ply", "-o", out.name, "--quiet"]
    try:
        subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise PaperError(f"match: {str(getattr(error, 'stderr', '') or error).strip()}") from error
    return np.loadtxt(out, delimiter=",", skiprows=1, ndmin=2)[:, :2].astype(np.int64)


def markdown(rows: list[dict]) -> list[str]:
    """The lines of the table."""
    percent = lambda value: "-" if value is None else f"{100 * value:.1f} %"
    lines = [ABOUT, "", "| frames | seen from | hop | pairs | wrong | checked | dropped | of these wrong | wrong after |",
             "|---|---|---|---:|---:|---:|---:|---:|---:|"]
    for row in rows:
        views = "all sides" if row["views"][0] is None else ", ".join(f"{view}°" for view in row["views"])
        cells = [f"{row['sequence']} {', '.join(map(str, row['frames']))}", views, "{}-{}".format(*row["hop"]),
                 str(row["pairs"])]
        cells += [percent(row[key]) for key in ("wrong", "checked", "dropped", "of_them_wrong", "wrong_after")]
        lines.append(f"| {' | '.join(cells)} |")
    return lines
