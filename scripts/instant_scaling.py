#!/usr/bin/env python3
"""Measures how a whole run of the preset `instant` scales, by calling `isomorph bench --size instant`.

    python3 scripts/instant_scaling.py [--binary PATH] [--repeats N] [--out DIR] [--table]

A rod is bent. One thing is varied at a time: vertices of the two meshes, cells of the spline's
grid, the angle of the bend, and the resolution of the surfaces. The results go to
DIR/instant-scaling: table.md, figure.svg, and data.json with all numbers, command, date, machine and
version. With --table nothing is measured: table and figure are made again from data.json.

The machine should do nothing else. All points take about four minutes on two cores.

Needs numpy and matplotlib. Exit status: 0 done, 1 failed, 2 usage.
"""

import argparse
import shlex
import sys
from pathlib import Path

from isomorph_paper import PaperError, command_line, compact, figures, record
from isomorph_paper.command_line import ROOT
from isomorph_paper.runs import answer
from isomorph_paper.sequences import write_atomically

# What each is where another is varied.
BASE = {"vertices": 5000, "spacing": 0.05, "bend": 60, "resolution": 192}

# The values that each is given.
SWEEPS = {
    "vertices": (1000, 5000, 20000, 80000, 300000),
    "spacing": (0.1, 0.07, 0.05, 0.035),
    "bend": (0, 30, 60, 120, 180),
    "resolution": (64, 96, 128, 192, 256, 384),
}

# How each is given to `bench`.
WORDS = {
    "vertices": lambda value: ["--vertices", str(value)],
    "spacing": lambda value: ["--set", f"spline.spacing={value}"],
    "bend": lambda value: ["--bend", str(value)],
    "resolution": lambda value: ["--set", f"result.resolution={value}"],
}

AXES = {
    "vertices": "vertices of each mesh",
    "spacing": "edge of a cell (normalised)",
    "bend": "bend [degrees]",
    "resolution": "resolution of the surfaces",
}

STAGES = ("read files", "points and normals", "exact distances", "steps", "surfaces", "picture and page")


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    command_line.add_binary(parser)
    add("--repeats", type=int, default=3, help="runs at each point (default: 3)")
    add("--out", type=Path, default=ROOT / "scripts/results", help="where results go")
    command_line.add_table(parser)
    options = parser.parse_args(words)
    if not 1 <= options.repeats <= 1000:
        parser.error(f"--repeats = {options.repeats}: must be 1 to 1000")
    return options


def main(words: list[str]) -> int:
    options = arguments(words)
    folder = options.out / "instant-scaling"
    try:
        figures.check()
        if not options.table:
            content = measured(options, shlex.join(["scripts/instant_scaling.py", *words]))
            compact.write(folder / compact.NAME, content)
        content = compact.read(folder / compact.NAME)
    except PaperError as error:
        print(f"instant_scaling.py: {error}", file=sys.stderr)
        return 1
    text = markdown(content)
    write_atomically(folder / "table.md", text.encode())
    write_atomically(folder / "figure.svg", draw(content["rows"]))
    print(f"{folder / 'table.md'}\n\n{text}")
    return 0


def measured(options: argparse.Namespace, command: str) -> dict:
    """All points, and how they were measured."""
    rows = [
        row(sweep, at, options) for sweep, values in SWEEPS.items() for at in values
    ]
    return {
        "settings": {"experiment": "instant-scaling", "base": BASE, "repeats": options.repeats},
        **record.of(command, options.binary),
        "rows": rows,
    }


def row(sweep: str, at: float, options: argparse.Namespace) -> dict:
    """The costs at one point."""
    command = [options.binary, "bench", "--json", "--size", "instant"]
    command += ["--repeats", str(options.repeats)]
    for name, value in {**BASE, sweep: at}.items():
        command += WORDS[name](value)
    bench = answer(command)
    try:
        stages = {stage["name"]: stage["seconds"] for stage in bench["stages"]}
        whole = bench["whole"]
        return {
            "sweep": sweep,
            "at": at,
            "seconds": whole["seconds"],
            "cpu_seconds": whole["cpu_seconds"],
            "peak_bytes": bench["peak_bytes"],
            "stages": [stages.get(name, 0.0) for name in STAGES],
        }
    except (KeyError, TypeError) as reason:
        raise PaperError(
            f"isomorph bench: an answer that is not understood ({reason!r}); "
            "does the binary fit these scripts?"
        ) from reason


def cell(value: float | None, digits: int = 2) -> str:
    return "unknown" if value is None else f"{value:.{digits}f}"


def markdown(content: dict) -> str:
    """The table for people: a section for each sweep."""
    base = ", ".join(f"{name} {value}" for name, value in BASE.items())
    lines = [
        "# How a run of `instant` scales",
        "",
        "Five surfaces with picture. `isomorph bench --size instant`, median of"
        f" {content['settings']['repeats']}; where not varied: {base}. Seconds by wall clock; memory is the peak.",
        "",
        record.made_by(content),
    ]
    for sweep, values in SWEEPS.items():
        titles = [*STAGES, "whole", "processor time", "memory [MB]"]
        lines += ["", f"## {AXES[sweep]}", "", f"| {AXES[sweep]} | {' | '.join(titles)} |"]
        lines.append("|---" * (1 + len(titles)) + "|")
        for found in (r for r in content["rows"] if r["sweep"] == sweep):
            memory = found["peak_bytes"] and found["peak_bytes"] / 1e6
            cells = [cell(seconds) for seconds in found["stages"]]
            cells += [cell(found["seconds"]), cell(found["cpu_seconds"]), cell(memory, 0)]
            lines.append(f"| {found['at']:g} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def draw(rows: list[dict]) -> bytes:
    """Seconds of each stage against what is varied, as SVG."""
    plot = figures.pyplot()
    figure, axes = plot.subplots(
        1, len(SWEEPS), figsize=(2.6 * len(SWEEPS) + 1.6, 2.8), squeeze=False, layout="constrained"
    )
    for panel, (sweep, values) in zip(axes[0], SWEEPS.items(), strict=True):
        mine = [found for found in rows if found["sweep"] == sweep]
        places = [found["at"] for found in mine]
        panel.plot(places, [found["seconds"] for found in mine], label="whole run", **figures.style(6))
        for look, name in enumerate(STAGES[1:]):
            seconds = [found["stages"][look + 1] for found in mine]
            panel.plot(places, seconds, label=name, **figures.style(look))
        if sweep != "bend":
            panel.set_xscale("log")
        panel.axvline(BASE[sweep], ls=":", lw=1, color=figures.GREY)
        panel.minorticks_off()
        panel.set_xticks(values, [f"{at:g}" for at in values], fontsize=7)
        panel.set_ylim(bottom=0)
        panel.set_xlabel(AXES[sweep])
    axes[0][0].set_ylabel("seconds")
    figures.legend(figure, axes)
    return figures.svg(figure)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
