#!/usr/bin/env python3
"""Measures isomorph on the GPU of this machine beside its processor. `scripts/gpu.sh` builds and calls it.

    python3 scripts/gpu.py [--binary PATH] [--sizes quick,...] [--steps N] [--out DIR] [--table]

First `isomorph self-test` compares the GPU with the processor. A device that computes wrong numbers is not
measured. Then `isomorph bench` measures a step of each size on the backends wgpu and flex, and `isomorph train`
trains the presets `quick` of data/fox and data/human on both. The results go to DIR/NAME, NAME being the
device's: table.md, and data.json with all numbers, command, date, machine and version. With --table nothing is
measured: the tables are made again.

Exit status: 0 done, 1 failed, 2 usage.
"""

import argparse
import json
import re
import shlex
import sys
import tempfile
import time
from pathlib import Path

from isomorph_paper import PaperError, command_line, compact, record
from isomorph_paper.command_line import ROOT
from isomorph_paper.runs import answer, output
from isomorph_paper.sequences import write_atomically

SIZES = ("quick", "default", "small", "shipped", "paper")
BACKENDS = ("wgpu", "flex")
SAMPLES = ("fox", "human")


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    command_line.add_binary(parser)
    add("--sizes", default=",".join(SIZES), help=f"steps to measure (default: {','.join(SIZES)})")
    add("--repeats", type=int, default=5, help="steps timed at each size (default: 5)")
    add("--steps", type=int, help="steps of each training (default: those of the preset)")
    add("--out", type=Path, default=ROOT / "scripts/results/gpu", help="where results go")
    command_line.add_table(parser)
    options = parser.parse_args(words)
    options.sizes = [size for size in options.sizes.split(",") if size]
    for size in options.sizes:
        if size not in SIZES:
            parser.error(f"--sizes: {size}: must be some of {','.join(SIZES)}")
    return options


def main(words: list[str]) -> int:
    options = arguments(words)
    try:
        if options.table:
            folders = sorted(path.parent for path in options.out.glob(f"*/{compact.NAME}"))
            if not folders:
                raise PaperError(f"{options.out}: no results in it")
        else:
            content = measured(options, shlex.join(["scripts/gpu.sh", *words]))
            folders = [options.out / folder_name(content["device"])]
            compact.write(folders[0] / compact.NAME, content)
        for folder in folders:
            text = markdown(compact.read(folder / compact.NAME))
            write_atomically(folder / "table.md", text.encode())
            print(f"{folder / 'table.md'}\n\n{text}")
    except PaperError as error:
        print(f"gpu.py: {error}", file=sys.stderr)
        return 1
    return 0


def folder_name(device: str) -> str:
    """The device's name without its driver, as the name of a folder."""
    name = device.partition(" (")[0].lower()
    return re.sub(r"[^a-z0-9]+", "-", name).strip("-") or "unknown"


def measured(options: argparse.Namespace, command: str) -> dict:
    """Everything, and how it was measured."""
    tests = {preset: self_test(options, preset) for preset in ("quick", "paper")}
    device = tests["quick"]["device"]
    steps = [
        {"size": size, "backend": backend, **bench(options, size, backend)}
        for size in options.sizes
        for backend in BACKENDS
    ]
    runs = [
        {"sample": sample, "backend": backend, **train(options, sample, backend)}
        for sample in SAMPLES
        for backend in BACKENDS
    ]
    return {
        "settings": {"experiment": "gpu", "repeats": options.repeats, "steps": options.steps},
        **record.of(command, options.binary),
        "device": device,
        "self-test": tests,
        "steps": steps,
        "runs": runs,
    }


def self_test(options: argparse.Namespace, preset: str) -> dict:
    return answer([options.binary, "self-test", "--json", "--preset", preset])


def bench(options: argparse.Namespace, size: str, backend: str) -> dict:
    """A joint step of a size."""
    words = [options.binary, "bench", "--json", "--size", size, "--backend", backend]
    found = answer([*words, "--derivatives", "forward", "--repeats", str(options.repeats)])
    try:
        joint = found["phases"]["joint"]
        return {
            "seconds": joint["seconds_per_step"],
            "first": joint["first_step_seconds"],
            "gflop": joint["gflop_per_step"],
            "product": found["matmul_gflops"],
            "peak_bytes": found["peak_bytes"],
        }
    except (KeyError, TypeError) as reason:
        raise PaperError(f"isomorph bench: no {reason} in its answer") from reason


def train(options: argparse.Namespace, sample: str, backend: str) -> dict:
    """A whole run of `quick`: seconds of training and of everything, and the last objective."""
    with tempfile.TemporaryDirectory() as place:
        run = Path(place) / "run"
        words = [options.binary, "train", str(ROOT / f"data/{sample}/quick.toml"), "--run", str(run)]
        words += ["--backend", backend, "--quiet"]
        if options.steps:
            words += ["--set", f"training.steps={options.steps}"]
        clock = time.monotonic()
        output(words)
        whole = time.monotonic() - clock
        try:
            last = json.loads((run / "metrics.jsonl").read_text().splitlines()[-1])
            return {
                "training": last["seconds"],
                "whole": whole,
                "steps": last["step"],
                "total": last["total"],
                "peak_bytes": last["peak_memory_bytes"],
            }
        except (OSError, ValueError, KeyError, IndexError) as reason:
            raise PaperError(f"{run}: no metrics in it ({reason!r})") from reason


def markdown(content: dict) -> str:
    """The tables for people."""
    lines = [
        f"# {content['device']}",
        "",
        f"{record.made_by(content)} The processor of that machine is what flex runs on.",
        "",
        "## Self-test",
        "",
        "The difference to the processor, relative to the processor's result.",
        "",
        "| preset | operation | off by | allowed |",
        "|---|---|---|---|",
    ]
    for preset, test in content["self-test"].items():
        for each in test["operations"]:
            lines.append(f"| {preset} | {each['what']} | {each['off']:.1e} | {each['allowed']:.0e} |")
    repeats = content["settings"]["repeats"]
    lines += [
        "",
        "## A step",
        "",
        f"`isomorph bench --derivatives forward`, the joint step, median of {repeats}. The first step compiles the"
        " kernels of the GPU.",
        "",
        "| size | wgpu [s] | flex [s] | flex / wgpu | first step on wgpu [s] | GFLOP |",
        "|---|---|---|---|---|---|",
    ]
    for wgpu, flex in pairs(content["steps"], "size"):
        lines.append(
            f"| {wgpu['size']} | {wgpu['seconds']:.4f} | {flex['seconds']:.4f} "
            f"| {flex['seconds'] / wgpu['seconds']:.2f} | {wgpu['first']:.1f} | {wgpu['gflop']:.1f} |"
        )
    lines += [
        "",
        "## A run of `quick`",
        "",
        "| sample | backend | steps | training [s] | with surfaces and page [s] | last objective |",
        "|---|---|---|---|---|---|",
    ]
    for run in content["runs"]:
        lines.append(
            f"| {run['sample']} | {run['backend']} | {run['steps']} | {run['training']:.1f} | {run['whole']:.1f} "
            f"| {run['total']:.4f} |"
        )
    return "\n".join(lines) + "\n"


def pairs(rows: list[dict], key: str) -> list[tuple[dict, dict]]:
    """The rows of both backends at the same value of `key`, in order."""
    values = dict.fromkeys(row[key] for row in rows)
    at = {(row[key], row["backend"]): row for row in rows}
    return [tuple(at[value, backend] for backend in BACKENDS) for value in values]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
