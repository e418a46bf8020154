#!/usr/bin/env python3
"""The table of the paper: methods on the key frames that its authors name, pair by pair.

    python3 scripts/key_methods.py [--binary PATH] [--sequences DIR] [--methods A,B] [--samples N] [--every N]
        [--out DIR] [--work DIR] [--table]

Frames 0, 10, 18, 28, 39, 47 and 54 of `fox_survey` and `bear_walk` are given, 1000 points of them with
correspondences. Each method is trained on each two neighbours by `isomorph compare`, and measured on all frames
between: CD is the squared Chamfer distance x 10^3, HD the squared Hausdorff distance x 10^2, as the paper's are
understood here. Beside them stand the paper's own figures. Its shapes, samples and scale are
its own, so that ratios to its method are what can be compared.

The rows of one motion through all key frames come from DIR/keys (scripts/keys.py), where they are there.

Results go to DIR/key-methods: table.md and data.json. What is in the work folder is not measured again. All of it took
three quarters of an hour on two cores, with --samples 30000 --every 2. Needs numpy. Exit status: 0 done, 1 failed, 2 usage.
"""

import argparse
import json
import shlex
import sys
from pathlib import Path

from isomorph_paper import PaperError, command_line, compact, record
from isomorph_paper.command_line import ROOT
from isomorph_paper.runs import output
from isomorph_paper.sequences import write_atomically
from keys import KEYS

SEQUENCES = ("fox_survey", "bear_walk")
METHODS = ("mlp", "lipmlp", "nise", "instant")
METRICS = ("chamfer_squared", "hausdorff_squared")
# Table 1 of the paper, CD and HD of fox and bear; those of the MLP stand in its source alone.
PAPER = {
    "mlp": ((0.127, 0.251), (0.294, 0.463)),
    "lipmlp": ((1.745, 2.456), (2.649, 1.401)),
    "nise": ((0.178, 0.262), (0.366, 0.560)),
    "the paper's own": ((0.108, 0.114), (0.260, 0.265)),
}
OWN = "the paper's own"


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    command_line.add_binary(parser)
    command_line.add_sequences(parser)
    command_line.add_work(parser)
    add("--methods", default=",".join(METHODS), help="methods of `isomorph compare` (default: %(default)s)")
    add("--samples", type=int, default=100_000, help="points on each surface (default: 100000)")
    add("--every", type=int, default=1, help="measure every N-th frame only (default: 1)")
    add("--out", type=Path, default=ROOT / "scripts/results", help="where results go")
    command_line.add_table(parser)
    return parser.parse_args(words)


def main(words: list[str]) -> int:
    options = arguments(words)
    folder = options.out / "key-methods"
    try:
        if not options.table:
            compact.write(folder / compact.NAME, measured(options, shlex.join(["scripts/key_methods.py", *words])))
        content = compact.read(folder / compact.NAME)
    except PaperError as error:
        print(f"key_methods.py: {error}", file=sys.stderr)
        return 1
    text = markdown(content)
    write_atomically(folder / "table.md", text.encode())
    print(f"{folder / 'table.md'}\n\n{text}")
    return 0


def measured(options: argparse.Namespace, command: str) -> dict:
    """All rows, and how they were measured."""
    place, work = command_line.sequences(options), options.work / "key-methods"
    rows = []
    for name in SEQUENCES:
        pairs = ",".join(f"{first}-{last}" for first, last in zip(KEYS, KEYS[1:]))
        path = place / f"{name}.anime"
        output([options.binary, "compare", "--sequence", str(path), "--pairs", pairs, "--methods", options.methods,
                "--samples", str(options.samples), "--every", str(options.every), "--quiet",
                "-o", str(work / "results"), "--work", str(work / "runs")])
        found = json.loads((work / "results" / name / "comparison.json").read_text("utf-8"))
        rows += rows_of(name, found)
    rows += through_all(options.out / "keys" / compact.NAME)
    return {
        "settings": {"experiment": "key-methods", "keys": KEYS, "samples": options.samples, "every": options.every},
        **record.of(command, options.binary),
        "rows": rows,
    }


def rows_of(name: str, found: dict) -> list[dict]:
    """The means of each method over all frames that were measured, whatever pair they belong to."""
    sums: dict[str, dict] = {}
    for pair in found["pairs"]:
        for method in pair["methods"]:
            kinds = {method["method"]: "surface", "linear": "linear", "floor": "floor"}
            for label, kind in kinds.items():
                # The same straight lines are in the results of every method.
                of = sums.setdefault(label, {}).setdefault((pair["from"], pair["to"]), {})
                mean, frames = method["mean"][kind], method["frames"]
                of.update({metric: mean[metric] for metric in METRICS}, frames=frames)
    rows = []
    for label, pairs in sums.items():
        frames = sum(of["frames"] for of in pairs.values())
        means = {metric: sum(of["frames"] * of[metric] for of in pairs.values()) / frames for metric in METRICS}
        rows.append({"sequence": name, "method": label, "frames": frames, **means})
    return rows


def through_all(path: Path) -> list[dict]:
    """The Chamfer distance of one motion through all key frames, if it was measured."""
    try:
        content = compact.read(path)
    except PaperError:
        return []
    rows = []
    for name in SEQUENCES:
        for variant, label in (("one field", "instant, one motion"), ("networks (`default`)", "default, one motion")):
            own = [row for row in content["rows"] if (row["sequence"], row["variant"]) == (name, variant)]
            if own:
                mean = sum(row["surface_chamfer_squared"] for row in own) / len(own)
                rows.append({"sequence": name, "method": label, "chamfer_squared": mean})
    return rows


def markdown(content: dict) -> str:
    """The table for people."""
    of = {(row["sequence"], row["method"]): row for row in content["rows"]}
    labels = list(dict.fromkeys(row["method"] for row in content["rows"]))
    # What is given the truth comes last.
    labels.sort(key=lambda label: label in ("linear", "floor"))
    settings = content["settings"]
    every = "all frames" if settings["every"] == 1 else f"one frame in {settings['every']}"
    lines = [
        "# Methods on the authors' key frames",
        "",
        f"Key frames {', '.join(map(str, settings['keys']))} of 55, pair by pair, measured on {every} between with"
        f" {settings['samples']:,} points. CD: squared Chamfer distance x 10^3. HD: squared Hausdorff distance x 10^2."
        " `linear` is given all true vertices, and `floor` is the noise of the samples. In brackets: the paper's"
        " figure, on its own samples and scale, in the same units.",
        "",
        record.made_by(content),
        "",
        "| method | fox CD | fox HD | bear CD | bear HD |",
        "|---" * 5 + "|",
    ]
    for label in labels:
        cells = [label]
        for at, name in enumerate(SEQUENCES):
            row = of.get((name, label), {})
            for metric, scale, k in (("chamfer_squared", 1e3, 0), ("hausdorff_squared", 1e2, 1)):
                paper = f" ({PAPER[label][at][k]:.3f})" if label in PAPER else ""
                cells.append(f"{scale * row[metric]:.3f}{paper}" if metric in row else "-")
        lines.append("| " + " | ".join(cells) + " |")
    own = [f"({value:.3f})" for two in PAPER[OWN] for value in two]
    lines.append("| " + " | ".join([OWN, *own]) + " |")
    lines += ["", *ratios(of)]
    return "\n".join(lines) + "\n"


def ratios(of: dict) -> list[str]:
    """How many times as far off the others are: here and in the paper."""
    lines = ["CD of the others over that of `instant` by pairs, and in the paper over that of its method:", ""]
    for label in PAPER:
        cells = []
        for at, name in enumerate(SEQUENCES):
            rows = [of.get((name, which)) for which in (label, "instant")]
            if label != OWN and all(rows):
                here = rows[0]["chamfer_squared"] / rows[1]["chamfer_squared"]
                there = PAPER[label][at][0] / PAPER[OWN][at][0]
                cells.append(f"{name} {here:.1f} ({there:.1f})")
        if cells:
            lines.append(f"* {label}: {', '.join(cells)}")
    return lines


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
