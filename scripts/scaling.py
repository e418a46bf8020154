#!/usr/bin/env python3
"""Measures how a training step scales, by calling `isomorph bench`.

    python3 scripts/scaling.py [--backend B] [--binary PATH] [--repeats N] [--threads 1,2]
                               [--sweep NAME]... [--out DIR] [--table] [--dry-run]

From the size `shipped` with forward derivatives, one thing is varied at a time: points, width,
depth, and time steps of a trajectory, each on one thread and on two. The results go to DIR/scaling
(DIR/scaling-B for a backend other than flex): table.md, figure.svg, and data.json with all numbers,
command lines, machine, date and versions. What `bench` printed goes to --work, a file for each
point. What is measured is not measured again, by the same binary: an interrupted run goes on where
it stopped when the same command is given again, and points on several sweeps are measured once.
With --table nothing is measured: table and figure are made again from data.json.

The machine should do nothing else: table.md says how busy other programs kept it (Linux only). All
points take about half an hour on two cores.

Needs numpy and matplotlib. Exit status: 0 done, 1 failed, 2 usage, 130 interrupted.
"""

import argparse
import json
import os
import resource
import shlex
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from isomorph_paper import PaperError, command_line, compact, figures, record
from isomorph_paper.command_line import ROOT
from isomorph_paper.sequences import digest, write_atomically

# What `bench --size shipped` is, by name.
BASE = {"points": 4086, "width": 256, "depth": 8, "time-steps": 10}

# The values that each is given while the others keep those of the base.
SWEEPS = {
    "points": (500, 1000, 2000, 4086, 8000, 16000),
    "width": (64, 128, 256, 512),
    "depth": (2, 4, 8, 12),
    "time-steps": (2, 5, 10, 20, 40),
}

# The keys of the recipe behind each name: f and V alike.
KEYS = {
    "points": ("training.batch",),
    "width": ("implicit.width", "velocity.width"),
    "depth": ("implicit.depth", "velocity.depth"),
    "time-steps": ("training.time-steps",),
}

AXES = {
    "points": "points",
    "width": "columns of a layer",
    "depth": "hidden layers",
    "time-steps": "time steps T",
}


@dataclass(frozen=True)
class Point:
    """A step to measure."""

    sweep: str
    at: int
    threads: int

    @property
    def shape(self) -> dict[str, int]:
        """All four, the varied one among them."""
        return {**BASE, self.sweep: self.at}

    @property
    def file(self) -> str:
        """The same for the same step, whichever sweep it lies on."""
        return "-".join(map(str, self.shape.values())) + f"-threads-{self.threads}.json"

    def command(self, binary: str, backend: str, repeats: int) -> list[str]:
        words = [binary, "bench", "--json", "--backend", backend, "--size", "shipped"]
        words += ["--derivatives", "forward", "--repeats", str(repeats)]
        for name, value in self.shape.items():
            for key in KEYS[name]:
                words += ["--set", f"{key}={value}"]
        return words


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--backend", choices=("flex", "ndarray", "wgpu"), default="flex", help="default: flex")
    command_line.add_binary(parser)
    add("--repeats", type=int, default=5, help="steps timed at each point (default: 5)")
    add("--threads", default="1,2", help="numbers of threads (default: 1,2)")
    add("--sweep", action="append", choices=SWEEPS, help="only this one; may be repeated")
    add("--out", type=Path, default=ROOT / "scripts/results", help="where results go")
    command_line.add_work(parser)
    command_line.add_table(parser)
    add("--dry-run", action="store_true", help="print the commands, measure nothing")
    options = parser.parse_args(words)
    if not 1 <= options.repeats <= 1000:
        parser.error(f"--repeats = {options.repeats}: must be 1 to 1000")
    counts = options.threads.split(",")
    if not all(count.isdecimal() and 1 <= int(count) <= 1024 for count in counts):
        parser.error(f"--threads = {options.threads}: must be numbers of 1 to 1024, such as 1,2")
    options.threads = sorted({int(count) for count in counts})
    options.sweep = [name for name in SWEEPS if name in (options.sweep or SWEEPS)]
    return options


def main(words: list[str]) -> int:
    options = arguments(words)
    points = [
        Point(sweep, at, threads)
        for sweep in options.sweep
        for at in SWEEPS[sweep]
        for threads in options.threads
    ]
    try:
        if options.dry_run:
            for point in {point.file: point for point in points}.values():
                command = point.command(options.binary, options.backend, options.repeats)
                print(f"RAYON_NUM_THREADS={point.threads} {shlex.join(command)}")
        else:
            run(points, options, shlex.join(["scripts/scaling.py", *words]))
    except PaperError as error:
        print(f"scaling.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("scaling.py: interrupted; the same command goes on from here", file=sys.stderr)
        return 130
    return 0


def run(points: list[Point], options: argparse.Namespace, command: str) -> None:
    """From the first point to the figure."""
    figures.check()
    name = "scaling" if options.backend == "flex" else f"scaling-{options.backend}"
    folder = options.out / name
    if not options.table:
        compact.write(folder / compact.NAME, measured(points, options, command, name))
    content = compact.read(folder / compact.NAME)
    text = markdown(content)
    write_atomically(folder / "table.md", text.encode())
    write_atomically(folder / "figure.svg", draw(content["rows"]))
    print(f"{folder / 'table.md'}\n\n{text}")


def measured(points: list[Point], options: argparse.Namespace, command: str, name: str) -> dict:
    """All points, measured now or before, and how."""
    wanted, work = settings(options), options.work / name
    record.check(options.out / name / compact.NAME, wanted)
    record.begin(work, wanted)
    entries = {}
    for point in points:
        path = work / point.file
        if not path.exists():
            entry = measure(point, options)
            write_atomically(path, (json.dumps(entry, indent=1) + "\n").encode())
        entries[point] = read(path)
    calls = [
        {key: entry[key] for key in ("command", "threads", "date", "seconds", "others")}
        for entry in {point.file: entry for point, entry in entries.items()}.values()
    ]
    return {
        "settings": wanted,
        **record.of(command, options.binary),
        "rows": [row(point, entry) for point, entry in entries.items()],
        "calls": calls,
    }


def settings(options: argparse.Namespace) -> dict:
    """What must be the same for all points of one table: times of two builds are not compared."""
    found = shutil.which(options.binary)
    if found is None:
        raise PaperError(
            f"{options.binary}: not a program; "
            "build it with `cargo build --release` or name it with --binary"
        )
    return {
        "experiment": "scaling",
        "base": BASE,
        "backend": options.backend,
        "repeats": options.repeats,
        "processor": record.processor(),
        "binary sha256": digest(Path(found)),
    }


def measure(point: Point, options: argparse.Namespace) -> dict:
    """What `bench` prints, and how it was called."""
    command = point.command(options.binary, options.backend, options.repeats)
    shown = f"RAYON_NUM_THREADS={point.threads} {shlex.join(command)}"
    print(f"$ {shown}", file=sys.stderr, flush=True)
    started, busy, own = time.monotonic(), busy_seconds(), children_seconds()
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            env={**os.environ, "RAYON_NUM_THREADS": str(point.threads)},
        )
    except OSError as reason:
        raise PaperError(f"{command[0]}: cannot be started ({reason.strerror})") from reason
    seconds = time.monotonic() - started
    # 130 is isomorph's own status after an interruption, -2 that of a signal that it did not take.
    if done.returncode in (130, -2):
        raise KeyboardInterrupt
    if done.returncode:
        raise PaperError(f"{shown}: failed (status {done.returncode}): {done.stderr.strip()}")
    others = None
    if busy is not None:
        others = max(busy_seconds() - busy - (children_seconds() - own), 0.0) / seconds
    bench = answer(done.stdout, point)
    return {
        "command": shown,
        "threads": point.threads,
        "date": record.now(),
        "seconds": round(seconds, 1),
        "others": None if others is None else round(others, 2),
        "bench": bench,
    }


def answer(text: str, point: Point) -> dict:
    """The JSON of `bench`; a PaperError if it is not what was asked for."""
    try:
        bench = json.loads(text)
        _ = [bench["phases"]["joint"][key] for key in ("seconds_per_step", "efficiency")]
        threads = bench["threads"]
    except (ValueError, KeyError, TypeError) as reason:
        raise PaperError(
            f"isomorph bench: an answer that is not understood ({reason!r}); "
            "does the binary fit these scripts?"
        ) from reason
    if threads != point.threads:
        raise PaperError(f"isomorph bench: ran on {threads} threads, not on {point.threads}")
    return bench


def busy_seconds() -> float | None:
    """Processor time that all programs have taken; None where the system does not say."""
    try:
        fields = Path("/proc/stat").read_text().splitlines()[0].split()[1:]
    except OSError:
        return None
    user, nice, system, _idle, _wait, *interrupts = map(int, fields[:7])
    return (user + nice + system + sum(interrupts)) / os.sysconf("SC_CLK_TCK")


def children_seconds() -> float:
    """Processor time that our own calls have taken."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def read(path: Path) -> dict:
    """What was measured at a point before."""
    try:
        return json.loads(path.read_text("utf-8"))
    except ValueError as reason:
        raise PaperError(f"{path}: not JSON ({reason}); delete it and run again") from reason


def row(point: Point, entry: dict) -> dict:
    """A point's row of data.json."""
    bench = entry["bench"]
    return {
        "sweep": point.sweep,
        "at": point.at,
        "threads": point.threads,
        **{f"joint_{key}": value for key, value in bench["phases"]["joint"].items()},
        **{f"warm_up_{key}": value for key, value in bench["phases"]["warm_up"].items()},
        "peak_bytes": bench["peak_bytes"],
        "matmul_gflops": bench["matmul_gflops"],
        "others": entry["others"],
    }


def peak_gigabytes(row: dict) -> float | None:
    return None if row["peak_bytes"] is None else row["peak_bytes"] / 1e9


# Title, the number of a row, digits.
COLUMNS = (
    ("step [s]", lambda row: row["joint_seconds_per_step"], 4),
    ("efficiency", lambda row: row["joint_efficiency"], 2),
    ("peak memory [GB]", peak_gigabytes, 2),
)


def markdown(content: dict) -> str:
    """The table for people: a section for each sweep."""
    rows, wanted = content["rows"], content["settings"]
    counts = sorted({row["threads"] for row in rows})
    base = ", ".join(f"{name} {value}" for name, value in BASE.items())
    lines = [
        "# How a training step scales",
        "",
        "Joint step of `isomorph bench --size shipped --derivatives forward` on "
        f"{wanted['backend']}, median of {wanted['repeats']}; where not varied: {base}."
        " The 1000 correspondences are"
        " carried whatever the number of points. Efficiency: the rate of the step's matrix products"
        " over that of one large product on as many threads. Peak memory: of the whole process.",
        "",
        record.made_by(content),
        others_line(rows),
    ]
    for sweep in dict.fromkeys(row["sweep"] for row in rows):
        titles = [f"{title}, {count} thr." for count in counts for title, *_ in COLUMNS]
        lines += ["", f"## {AXES[sweep]}", "", f"| {AXES[sweep]} | {' | '.join(titles)} |"]
        lines.append("|---" * (1 + len(titles)) + "|")
        for at in SWEEPS[sweep]:
            mine = {r["threads"]: r for r in rows if (r["sweep"], r["at"]) == (sweep, at)}
            cells = [
                cell(number(mine[count]), digits)
                for count in counts
                for _, number, digits in COLUMNS
            ]
            lines.append(f"| {at} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def cell(value: float | None, digits: int) -> str:
    return "unknown" if value is None else f"{value:.{digits}f}"


def others_line(rows: list[dict]) -> str:
    """How quiet the machine was."""
    known = [row["others"] for row in rows if row["others"] is not None]
    if not known:
        return "How busy other programs kept the machine is unknown on this system."
    return (
        f"Other programs kept {max(known):.2f} cores busy at the busiest point,"
        f" {sum(known) / len(known):.2f} on average."
    )


def draw(rows: list[dict]) -> bytes:
    """Step time, efficiency and peak memory against what is varied, as SVG."""
    plot = figures.pyplot()
    sweeps = list(dict.fromkeys(row["sweep"] for row in rows))
    threads = sorted({row["threads"] for row in rows})
    size = (2.3 * len(sweeps) + 1.2, 1.8 * len(COLUMNS))
    figure, axes = plot.subplots(
        len(COLUMNS), len(sweeps), figsize=size, squeeze=False, layout="constrained", sharex="col"
    )
    for across, (title, number, _) in zip(axes, COLUMNS, strict=True):
        across[0].set_ylabel(title)
        for panel, sweep in zip(across, sweeps, strict=True):
            for look, count in enumerate(threads):
                mine = [r for r in rows if (r["sweep"], r["threads"]) == (sweep, count)]
                known = [(r["at"], number(r)) for r in mine if number(r) is not None]
                label = f"{count} thread{'s' if count > 1 else ''}"
                places, values = zip(*known) if known else ((), ())
                panel.plot(places, values, label=label, **figures.style(look))
            panel.axvline(BASE[sweep], ls=":", lw=1, color=figures.GREY)
            panel.set_xscale("log")
            if title.startswith("step"):
                panel.set_yscale("log")
            else:
                panel.set_ylim(bottom=0)
            panel.minorticks_off()
            panel.set_xticks(SWEEPS[sweep], [f"{at:g}" for at in SWEEPS[sweep]], fontsize=7)
    for panel, sweep in zip(axes[-1], sweeps, strict=True):
        panel.set_xlabel(AXES[sweep])
    figures.legend(figure, axes)
    return figures.svg(figure)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
