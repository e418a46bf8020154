#!/usr/bin/env python3
"""Measures motions through many key frames: the key frames that the authors of the paper name.

    python3 scripts/keys.py [--binary PATH] [--sequences DIR] [--seeds N] [--out DIR] [--work DIR]
        [--networks | --many | --grown | --table]

Frames 0, 10, 18, 28, 39, 47 and 54 of each sequence are given, with 1000 points that are known at
all of them; all other frames are ground truth. `one field` is the preset `instant` through all key
frames, `pairs` the same preset on each two neighbours by themselves. Then 14 key frames: with known
points, and as clouds that are sampled anew at each key frame, with pairs found by `match` or none.

With --networks the preset `default` is trained through the seven key frames instead, which takes about
five minutes for each sequence and seed. With --many only the 14 key frames are measured. With --grown the last of
the seven key frames is appended to a run through the six before it (`isomorph resume`), with `instant` on all sequences
and with `default` on the arms. Such rows are put beside those that are in DIR/keys already.

The results go to DIR/keys: table.md, figure.svg, and data.json with all numbers, command, date,
machine and version. What is in the work folder is not measured again. All of it takes about half an
hour on two cores. With --table nothing is measured: table and figure are made again from data.json.

Needs numpy and matplotlib. Exit status: 0 done, 1 failed, 2 usage.
"""

import argparse
import json
import shlex
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from isomorph_paper import PaperError, command_line, compact, degrade, figures, record
from isomorph_paper.command_line import ROOT
from isomorph_paper.runs import answer, output
from isomorph_paper.sequences import (
    Sequence,
    area_vectors,
    read_sequence,
    unit,
    write_atomically,
    write_cloud,
)

SEQUENCES = ("bear_walk", "fox_survey", "human_raise_arms")
KEYS = (0, 10, 18, 28, 39, 47, 54)
MANY_KEYS = (0, 4, 8, 12, 17, 21, 25, 29, 33, 37, 42, 46, 50, 54)
# The sequences of the 14 key frames.
MANY = ("human_raise_arms", "bear_walk")
POINTS = 20_000

ONE, PAIRS, NETWORKS = "one field", "pairs", "networks (`default`)"
GROWN, GROWN_NETWORKS = "one field, last key frame appended", "networks (`default`), last key frame appended"
# The sequence on which networks grow.
GROWS = "human_raise_arms"
KNOWN, FOUND, NONE = "14 keys", "14 keys, clouds, match", "14 keys, clouds, no pairs"

# What is kept of what `evaluate` says: kind, metric.
COLUMNS = {
    "surface": ("chamfer", "chamfer_squared", "hausdorff"),
    "carried": ("tracked_rmse",),
    "linear": ("chamfer", "chamfer_squared", "hausdorff", "tracked_rmse"),
    "natural": ("tracked_rmse",),
    "floor": ("chamfer", "chamfer_squared", "hausdorff"),
}


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    command_line.add_binary(parser)
    command_line.add_sequences(parser)
    command_line.add_work(parser)
    add("--seeds", type=int, default=3, help="runs of one field on each sequence (default: 3)")
    add("--samples", type=int, default=100_000, help="points on each surface (default: 100000)")
    add("--out", type=Path, default=ROOT / "scripts/results", help="where results go")
    add("--networks", action="store_true", help="measure the preset default, and keep the other rows")
    add("--many", action="store_true", help="measure the 14 key frames, and keep the other rows")
    add("--grown", action="store_true", help="measure runs to which a key frame is appended, and keep the other rows")
    command_line.add_table(parser)
    options = parser.parse_args(words)
    if not 1 <= options.seeds <= 100:
        parser.error(f"--seeds = {options.seeds}: must be 1 to 100")
    return options


def main(words: list[str]) -> int:
    options = arguments(words)
    folder = options.out / "keys"
    try:
        figures.check()
        command = shlex.join(["scripts/keys.py", *words])
        parts = {"networks": with_networks, "many": with_many, "grown": with_grown}
        if chosen := [renew for part, renew in parts.items() if getattr(options, part)]:
            content = chosen[0](compact.read(folder / compact.NAME), options, command)
            compact.write(folder / compact.NAME, content)
        elif not options.table:
            content = measured(options, command)
            compact.write(folder / compact.NAME, content)
        content = compact.read(folder / compact.NAME)
    except PaperError as error:
        print(f"keys.py: {error}", file=sys.stderr)
        return 1
    text = markdown(content)
    write_atomically(folder / "table.md", text.encode())
    write_atomically(folder / "figure.svg", draw(content))
    print(f"{folder / 'table.md'}\n\n{text}")
    return 0


def measured(options: argparse.Namespace, command: str) -> dict:
    """All rows, and how they were measured."""
    place = command_line.sequences(options)
    rows, frames = [], {}
    for name in SEQUENCES:
        bench = Bench(options, read_sequence(place / f"{name}.anime"))
        for seed in range(options.seeds):
            found = bench.run(KEYS, seed)
            rows.append(row(name, ONE, seed, [found]))
            if seed == 0:
                frames[name] = over_time([found])
        apart = [bench.run(two, 0) for two in zip(KEYS, KEYS[1:])]
        rows.append(row(name, PAIRS, 0, apart))
        frames[name][PAIRS] = over_time(apart)[ONE]
        if name in MANY:
            rows += many(bench)
    return {
        "settings": {"experiment": "keys", "keys": KEYS, "many": MANY_KEYS, "samples": options.samples},
        **record.of(command, options.binary),
        "rows": rows,
        "frames": frames,
    }


def many(bench: "Bench") -> list[dict]:
    """The rows of 14 key frames: with known points, and as clouds without."""
    name = bench.sequence.name
    variants = ((KNOWN, None), (FOUND, "match"), (NONE, "none"))
    return [row(name, label, 0, [bench.run(MANY_KEYS, 0, pairs)]) for label, pairs in variants]


def with_many(content: dict, options: argparse.Namespace, command: str) -> dict:
    """The same with new rows of 14 key frames, and how these were measured."""
    return renewed(content, options, command, "many", MANY, (KNOWN, FOUND, NONE), many)


def with_networks(content: dict, options: argparse.Namespace, command: str) -> dict:
    """The same with rows of networks, and how these were measured."""

    def rows(bench: "Bench") -> list[dict]:
        name = bench.sequence.name
        return [row(name, NETWORKS, seed, [bench.run(KEYS, seed, preset="default")]) for seed in range(options.seeds)]

    return renewed(content, options, command, "networks", SEQUENCES, (NETWORKS,), rows)


def with_grown(content: dict, options: argparse.Namespace, command: str) -> dict:
    """The same with rows of runs to which the last key frame is appended, and how these were measured."""

    def rows(bench: "Bench") -> list[dict]:
        name = bench.sequence.name
        presets = ((GROWN, "instant"), (GROWN_NETWORKS, "default"))
        return [row(name, label, 0, [bench.run(KEYS, 0, preset=preset, appended=True)])
                for label, preset in presets if preset == "instant" or name == GROWS]

    return renewed(content, options, command, "grown", SEQUENCES, (GROWN, GROWN_NETWORKS), rows)


def renewed(content: dict, options: argparse.Namespace, command: str, part: str, names: tuple[str, ...],
            variants: tuple[str, ...], measure: Callable[["Bench"], list[dict]]) -> dict:
    """The same with the rows of some variants measured anew on sequences of these names."""
    place = command_line.sequences(options)
    # As many as the other rows were measured with: what distances have of the noise of samples is the same.
    options.samples = content["settings"]["samples"]
    rows = [found for found in content["rows"] if found["variant"] not in variants]
    for name in names:
        rows += measure(Bench(options, read_sequence(place / f"{name}.anime")))
    return {**content, "rows": rows, part: record.of(command, options.binary)}


class Bench:
    """Trains and measures on one sequence."""

    def __init__(self, options: argparse.Namespace, sequence: Sequence):
        self.options = options
        self.sequence = sequence
        self.work = options.work / "keys" / sequence.name

    def run(self, keys: tuple[int, ...], seed: int, pairs: str | None = None, preset: str = "instant",
            appended: bool = False) -> dict:
        """What `evaluate` says of a run through key frames, with the seconds of its training. pairs: of clouds that are
        sampled anew; none for the true vertices. appended: the last key frame is, to a run through the others; the
        seconds are then those of what this takes.
        """
        names = [f"{len(keys)}-{keys[0]}-{keys[-1]}", f"seed-{seed}", pairs or "known"]
        names += [preset] * (preset != "instant") + ["appended"] * appended
        folder = self.work / "-".join(names)
        done = folder / "measured.json"
        if done.exists():
            return json.loads(done.read_text("utf-8"))
        recipe = folder / "recipe.toml"
        first = keys[:-1] if appended else keys
        write_atomically(recipe, self.recipe(first, pairs, folder, preset).encode())
        run = folder / "run"
        binary = self.options.binary
        output([binary, "train", str(recipe), "--run", str(run), "--force", "--quiet", "--set",
                f"training.seed={seed}", "--set", "result.frames=0"])
        before = 0.0
        if appended:
            before = seconds(run)
            output([binary, "resume", str(run), "--quiet", "--set", f"data.keys={list(keys)}"])
        found = answer([binary, "evaluate", str(run), "--ground-truth", str(self.sequence.path), "--json", "--quiet",
                        "--keys", ",".join(map(str, keys)), "--samples", str(self.options.samples)])
        found["seconds"] = seconds(run) - before
        write_atomically(done, json.dumps(found).encode())
        return found

    def recipe(self, keys: tuple[int, ...], pairs: str | None, folder: Path, preset: str) -> str:
        if pairs is None:
            text = f'sequence = "{self.sequence.path.resolve()}"\nkeys = {list(keys)}\n'
            return f'preset = "{preset}"\n[data]\n{text}correspondences = "same-vertices"\n'
        for key in keys:
            write_cloud(folder / f"{key}.ply", *self.sampled(key))
        listed = ", ".join(f'{{ file = "{key}.ply", time = {key} }}' for key in keys)
        return f'preset = "{preset}"\n[data]\ncorrespondences = "{pairs}"\nkeyframe = [{listed}]\n'

    def sampled(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Points uniform over the area of a frame, by random numbers of its own, with normals of the triangles."""
        rng = np.random.default_rng([7, frame])
        vertices, triangles = self.sequence.frames[frame], self.sequence.triangles
        places = degrade.sampled(vertices, triangles, POINTS, rng)
        return places.on(vertices), unit(area_vectors(vertices, places.triangles))


def seconds(run: Path) -> float:
    """The seconds of all training of a run."""
    return json.loads((run / "metrics.jsonl").read_text("utf-8").splitlines()[-1])["seconds"]


def row(name: str, label: str, seed: int, found: list[dict]) -> dict:
    """The numbers of one variant: root mean squares and means over all frames between key frames."""
    frames = [frame for each in found for segment in each["segments"] for frame in segment["frames"]]
    out = {"sequence": name, "variant": label, "seed": seed, "seconds": sum(each["seconds"] for each in found)}
    for kind, metrics in COLUMNS.items():
        for metric in metrics:
            out[f"{kind}_{metric}"] = float(np.mean([frame[kind][metric] for frame in frames]))
    # As the probe measured it: over all vertices and frames of a segment, then the mean of the segments.
    for kind in ("carried", "linear", "natural"):
        errors = [[frame[kind]["tracked_rmse"] for frame in segment["frames"]]
              for each in found for segment in each["segments"]]
        out[f"{kind}_rms"] = float(np.mean([np.sqrt(np.mean(np.square(each))) for each in errors]))
    out["area_deviation"] = float(np.std([frame["surface"]["area_ratio"] for frame in frames]))
    out["drift"] = found[0].get("drift") if len(found) == 1 else None
    return out


def over_time(found: list[dict]) -> dict:
    """The error of vertices at each frame."""
    frames = [frame for each in found for segment in each["segments"] for frame in segment["frames"]]
    at = lambda kind: [frame[kind]["tracked_rmse"] for frame in frames]
    return {"frame": [frame["frame"] for frame in frames], ONE: at("carried"), "linear": at("linear"),
            "natural": at("natural")}


def of(content: dict, name: str, label: str) -> list[dict]:
    return [found for found in content["rows"] if (found["sequence"], found["variant"]) == (name, label)]


def mean(rows: list[dict], column: str) -> float:
    return float(np.mean([found[column] for found in rows]))


def markdown(content: dict) -> str:
    """The table for people."""
    made = [record.made_by(content)]
    labels = [ONE, PAIRS]
    if networks := content.get("networks"):
        labels.append(NETWORKS)
        made[-1] += f" Networks: made by {record.made_by({**content, **networks}).removeprefix('Made by ')}"
    if grown := content.get("grown"):
        labels += [GROWN, GROWN_NETWORKS]
        made[-1] += (f" Last key frame appended: made by {record.made_by({**content, **grown}).removeprefix('Made by ')}"
                     " The seconds are those of what the appended one takes.")
    keys = ", ".join(map(str, content["settings"]["keys"]))
    lines = [
        "# Motions through many key frames",
        "",
        f"Key frames {keys} of 55, the authors' own; 1000 points known at all of them. Vertices: root mean square error"
        " of all vertices carried from the key frame before, mean of the segments, x 10^2. CD and HD: unsquared, of the"
        " surfaces, means over all frames between, x 10^3 and x 10^2. `natural` and `linear` are given all true"
        " vertices. Normalised units.",
        "",
        *made,
        "",
        "| sequence | variant | runs | seconds | vertices | / natural | linear | natural | CD | / linear | floor | HD"
        " | drift mean, last | there and back | area, deviation |",
        "|---" * 15 + "|",
    ]
    wide = []
    for name in SEQUENCES:
        for label in labels:
            if rows := of(content, name, label):
                lines.append(line(content, name, label))
                wide.append((label, rows))
    lines += ["", "Means of the three sequences, over `natural` for vertices and over `linear` for CD:", ""]
    for label in labels:
        mine = [rows for other, rows in wide if other == label]
        if len(mine) < len(SEQUENCES):
            continue
        ones = [rows for other, rows in wide if other == ONE]
        vertices = np.mean([mean(rows, "carried_rms") for rows in mine])
        natural = np.mean([mean(rows, "natural_rms") for rows in ones])
        chamfer = np.mean([mean(rows, "surface_chamfer") for rows in mine])
        linear = np.mean([mean(rows, "linear_chamfer") for rows in ones])
        lines.append(f"* {label}: vertices {100 * vertices:.3f}, {vertices / natural:.2f} of natural;"
                     f" CD {1000 * chamfer:.3f}, {chamfer / linear:.2f} of linear.")
    many = ", ".join(map(str, content["settings"]["many"]))
    lines += [
        "",
        "## Without correspondences",
        "",
        f"Key frames {many}. Clouds are 20,000 points, sampled anew at each key frame.",
        *([record.made_by({**content, **content["many"]})] if "many" in content else []),
        "",
        "| sequence | variant | seconds | vertices | / with known points | CD | drift mean, last |",
        "|---" * 7 + "|",
    ]
    for name in MANY:
        known = mean(of(content, name, KNOWN), "carried_rms")
        for label in (KNOWN, FOUND, NONE):
            (found,) = of(content, name, label)
            drift = found["drift"]
            lines.append(
                f"| {name} | {label} | {found['seconds']:.1f} | {100 * found['carried_rms']:.3f}"
                f" | {found['carried_rms'] / known:.2f} | {1000 * found['surface_chamfer']:.3f}"
                f" | {100 * drift['mean']:.2f}, {100 * drift['last']:.2f} |"
            )
    return "\n".join(lines) + "\n"


def line(content: dict, name: str, label: str) -> str:
    rows, one = of(content, name, label), of(content, name, ONE)
    # A natural spline through two key frames is a straight line: the references are those of all key frames.
    vertices, natural = mean(rows, "carried_rms"), mean(one, "natural_rms")
    chamfer, linear = mean(rows, "surface_chamfer"), mean(one, "linear_chamfer")
    drifts = [found["drift"] for found in rows if found["drift"]]
    drift = back = "-"
    if drifts:
        drift = f"{100 * mean(drifts, 'mean'):.2f}, {100 * mean(drifts, 'last'):.2f}"
        back = f"{100 * mean(drifts, 'there_and_back'):.3f}"
    cells = [
        name, label, str(len(rows)), f"{mean(rows, 'seconds'):.1f}", f"{100 * vertices:.3f}",
        f"{vertices / natural:.2f}", f"{100 * mean(one, 'linear_rms'):.3f}", f"{100 * natural:.3f}",
        f"{1000 * chamfer:.3f}", f"{chamfer / linear:.2f}", f"{1000 * mean(one, 'floor_chamfer'):.3f}",
        f"{100 * mean(rows, 'surface_hausdorff'):.2f}", drift, back, f"{mean(rows, 'area_deviation'):.4f}",
    ]
    return "| " + " | ".join(cells) + " |"


def draw(content: dict) -> bytes:
    """The error of vertices over the frames, with the key frames as lines, as SVG."""
    plot = figures.pyplot()
    figure, axes = plot.subplots(1, len(SEQUENCES), figsize=(11, 2.8), squeeze=False, layout="constrained")
    for panel, name in zip(axes[0], SEQUENCES, strict=True):
        found = content["frames"][name]
        for look, label in enumerate((ONE, PAIRS, "natural", "linear")):
            # A break at each key frame, where the error starts again.
            x, y = broken(found["frame"], found[label], content["settings"]["keys"])
            panel.plot(x, y, label=label, **{**figures.style(look), "marker": ""})
        for key in content["settings"]["keys"]:
            panel.axvline(key, ls=":", lw=1, color=figures.GREY)
        panel.set_title(name, fontsize=9)
        panel.set_xlabel("frame")
        panel.set_ylim(bottom=0)
    axes[0][0].set_ylabel("error of vertices x $10^2$")
    figures.legend(figure, axes)
    return figures.svg(figure)


def broken(frames: list[int], errors: list[float], keys: list[int]) -> tuple[list[float], list[float]]:
    x, y = [], []
    for frame, error in zip(frames, errors, strict=True):
        if x and any(x[-1] < key < frame for key in keys):
            x.append(np.nan)
            y.append(np.nan)
        x.append(frame)
        y.append(100 * error)
    return x, y


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
