#!/usr/bin/env python3
"""Kills isomorph at random moments, and makes its writes fail, and checks that nothing is lost.

    python3 scripts/kills.py [--binary PATH] [--kills N] [--seed N] [--out DIR | --no-results] [--table]

A tiny pair is trained, extracted and compared without any disturbance. Then the same is done again and again:

* `train` and `resume`, `extract` and `compare` are killed (SIGKILL) after a random time;
* `train` and `extract` are killed at a random write, flush, rename, creation or removal of a file, which strace
  counts: inside of checkpoints too;
* one of these calls fails as on a full disk (ENOSPC), a read-only one (EROFS) or a broken one (EIO).

After each kill every file under a final name must be whole: checkpoints fit their checksums, surfaces have all
their triangles, JSON parses. After each failure the command must end with status 1 and one line that is no
panic. What goes on afterwards must end in the files of the undisturbed run, to the last byte; times of day and
durations alone may differ.

Needs strace (Debian: strace) and Linux. Results go to DIR/kills: table.md and data.json.
Exit status: 0 all was well, 1 something was lost, 2 usage.
"""

import argparse
import json
import os
import random
import re
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from collections import Counter
from itertools import zip_longest
from math import cos, pi, sin
from pathlib import Path

from isomorph_paper import PaperError, command_line, compact, record
from isomorph_paper.command_line import ROOT
from isomorph_paper.sequences import write_atomically

# What changes a file system.
CALLS = ("write", "fsync", "rename", "openat", "mkdir", "unlink", "unlinkat", "rmdir")
FAULTS = ("ENOSPC", "EROFS", "EIO")
# A run of about two seconds on one thread, with a checkpoint every few hundredths.
KEYS = {
    "preset": '"quick"',
    "data.correspondences": '"same-vertices"',
    "training.steps": "400",
    "training.batch": "100",
    "training.log-every": "7",
    "training.guided-until": "0",
    "training.correspondence-batch": "20",
    "implicit.depth": "2",
    "implicit.width": "8",
    "velocity.depth": "2",
    "velocity.width": "8",
    "checkpoint.every": "20",
    "checkpoint.keep": "2",
    "result.frames": "3",
    "result.resolution": "24",
}
SECONDS = re.compile(r'"(?:seconds|training_seconds|evaluation_seconds|date|peak_memory_bytes)": ?[^,}\n]*')


class Lost(Exception):
    """Something that a kill or a failure did harm to."""


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    command_line.add_binary(parser)
    add("--kills", type=int, default=200, help="kills at random moments; calls and failures are as many again")
    add("--seed", type=int, default=0, help="of the random moments")
    add("--out", type=Path, default=ROOT / "scripts/results", help="where results go")
    add("--no-results", action="store_true", help="write no results")
    command_line.add_table(parser)
    options = parser.parse_args(words)
    if options.kills < 1:
        parser.error(f"--kills = {options.kills}: must be 1 or more")
    return options


def main(words: list[str]) -> int:
    options = arguments(words)
    folder = options.out / "kills"
    try:
        if not options.table:
            if not shutil.which("strace"):
                raise PaperError("strace: not installed; on Debian: apt-get install strace")
            with tempfile.TemporaryDirectory() as place:
                content = measured(options, Path(place), shlex.join(["scripts/kills.py", *words]))
            if options.no_results:
                print(markdown(content))
                return 0
            compact.write(folder / compact.NAME, content)
        text = markdown(compact.read(folder / compact.NAME))
        write_atomically(folder / "table.md", text.encode())
        print(text)
    except (Lost, PaperError) as error:
        print(f"kills.py: {error}", file=sys.stderr)
        return 1
    return 0


class Workplace:
    """A folder with a tiny pair, and what becomes of it undisturbed."""

    def __init__(self, place: Path, binary: str):
        self.place, self.binary = place, str(Path(binary).resolve())
        self.counts = Counter()
        source, target = sphere(0.0), sphere(1.0)
        (place / "source.ply").write_text(ply(*source))
        (place / "target.ply").write_text(ply(*target))
        lines = ['data.source = "source.ply"', 'data.target = "target.ply"']
        # The preset first: it is no section's.
        recipe = [f"{key} = {value}" for key, value in KEYS.items()]
        (place / "recipe.toml").write_text("\n".join([*recipe, *lines]) + "\n")
        frames = place / "frames"
        frames.mkdir()
        for number in range(4):
            (frames / f"{number}.ply").write_text(ply(*sphere(number / 3)))
        self.run(["train", "recipe.toml", "--quiet", "--run", "whole"])
        self.extract_whole = ["extract", "whole", "--quiet", "--frames", "9", "--carry", "-o", "out-whole"]
        self.run(self.extract_whole)
        self.run(self.compare("whole"))
        self.wanted_run = run_files(place / "whole")
        self.wanted_out = all_files(place / "out-whole")
        self.wanted_results = all_files(place / "results-whole")

    def command(self, words: list[str]) -> list[str]:
        return [self.binary, *words]

    def start(self, words: list[str], before: list[str] = ()) -> subprocess.Popen:
        return subprocess.Popen(
            [*before, *self.command(words)],
            cwd=self.place,
            env={**os.environ, "RAYON_NUM_THREADS": "1"},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def run(self, words: list[str]) -> float:
        """Does something undisturbed; the seconds that it took."""
        clock = time.monotonic()
        child = self.start(words)
        _, told = child.communicate()
        if child.returncode:
            raise Lost(f"isomorph {shlex.join(words)}: status {child.returncode}: {told.strip()}")
        return time.monotonic() - clock

    def compare(self, name: str) -> list[str]:
        words = ["compare", "--sequence", "frames", "--pairs", "0-3", "--methods", "quick,mlp", "--quiet"]
        words += ["--samples", "500", "--resolution", "16", "-o", f"results-{name}", "--work", f"work-{name}"]
        sizes = [f"{key}={value}" for key, value in KEYS.items() if key.startswith(("implicit", "training.batch"))]
        for each in ["training.steps=60", "checkpoint.every=20", *sizes]:
            words += ["--set", each]
        return words

    def train(self) -> list[str]:
        """What goes on with the disturbed run: it is begun, or resumed."""
        if (self.place / "run/recipe.toml").exists():
            return ["resume", "run", "--quiet"]
        return ["train", "recipe.toml", "--quiet", "--run", "run"]

    def again(self) -> None:
        """Deletes what was disturbed."""
        for name in ("run", "out", "results-again", "work-again"):
            shutil.rmtree(self.place / name, ignore_errors=True)


def measured(options: argparse.Namespace, place: Path, command: str) -> dict:
    """All kills and failures, and what was counted."""
    chance = random.Random(options.seed)
    work = Workplace(place, options.binary)
    jobs = {"compare": 0.25, "train and resume": 0.5, "extract": 0.25}
    rows = []
    for name, share in jobs.items():
        kills = max(1, round(share * options.kills))
        rows.append({"what": name, "how": "killed after a random time", **by_time(work, name, kills, chance)})
    if not can_trace():
        print("kills.py: this system lets no process be traced, so calls were NOT disturbed", file=sys.stderr)
        jobs = {}
    else:
        jobs = {"train and resume": 0.6, "extract": 0.4}
    for name, share in jobs.items():
        kills = max(1, round(share * options.kills / 2))
        rows.append({"what": name, "how": "killed at a call", **by_call(work, name, kills, chance, None)})
        rows.append({"what": name, "how": "a call failed", **by_call(work, name, kills, chance, FAULTS)})
    return {
        "settings": {"experiment": "kills", "kills": options.kills, "seed": options.seed},
        **record.of(command, options.binary),
        "rows": rows,
    }


def can_trace() -> bool:
    """Whether strace may do its work here; some containers forbid it."""
    return subprocess.run(["strace", "-o", os.devnull, "true"], capture_output=True).returncode == 0


def words_of(work: Workplace, name: str) -> list[str]:
    return {
        "train and resume": work.train,
        "extract": lambda: [*work.extract_whole[:-1], "out"],
        "compare": lambda: work.compare("again"),
    }[name]()


def by_time(work: Workplace, name: str, kills: int, chance: random.Random) -> dict:
    """Kills a command `kills` times, each time after a time of its own, and lets it finish every few times."""
    work.again()
    work.run(words_of(work, name))
    work.again()
    # As long as it takes alone, at most: later kills meet what has gone on since.
    longest = work.run(words_of(work, name))
    work.again()
    killed = finished = 0
    while killed < kills:
        child = work.start(words_of(work, name))
        try:
            _, told = child.communicate(timeout=chance.uniform(0.0, longest))
            if child.returncode:
                raise Lost(f"{name}: ended with {child.returncode}: {told.strip()}")
            check_end(work, name)
            work.again()
            finished += 1
        except subprocess.TimeoutExpired:
            child.kill()
            child.communicate()
            killed += 1
            check_whole(work, name)
            # Training gets further with every attempt; the others begin again.
            if chance.random() < 0.1:
                work.run(words_of(work, name))
                check_end(work, name)
                work.again()
                finished += 1
            progress(name, killed, kills)
    work.run(words_of(work, name))
    check_end(work, name)
    work.again()
    return {"times": killed, "ends compared": finished + 1}


def by_call(work: Workplace, name: str, times: int, chance: random.Random, faults) -> dict:
    """Kills a command at one of its calls, or makes the call fail, `times` times."""
    work.again()
    counts = calls_of(work, words_of(work, name))
    work.again()
    done, finished, by = 0, 0, Counter()
    while done < times:
        call = chance.choice([call for call in CALLS if counts[call]])
        # A call that comes after the end of what is left to do disturbs nothing, and is not counted.
        when = chance.randint(1, counts[call])
        what = f"error={chance.choice(faults)}" if faults else "signal=SIGKILL"
        child = work.start(
            words_of(work, name),
            traced(work, call, f"inject={call}:{what}:when={when}"),
        )
        _, told = child.communicate()
        disturbed = "(INJECTED)" in (work.place / "trace").read_text() or child.returncode in (-9, 137)
        if disturbed:
            done += 1
            by[call] += 1
            if faults:
                check_told(name, call, what, child.returncode, told)
            check_whole(work, name)
            progress(f"{name}, {call}", done, times)
        elif child.returncode:
            raise Lost(f"{name}: ended with {child.returncode}: {told.strip()}")
        if not disturbed or chance.random() < 0.3:
            work.run(words_of(work, name))
            check_end(work, name)
            work.again()
            finished += 1
    work.run(words_of(work, name))
    check_end(work, name)
    work.again()
    return {"times": done, "ends compared": finished + 1, "calls": dict(sorted(by.items()))}


def calls_of(work: Workplace, words: list[str]) -> Counter:
    """How often an undisturbed command makes each call."""
    trace = work.place / "trace"
    child = work.start(words, traced(work, ",".join(CALLS)))
    _, told = child.communicate()
    if child.returncode:
        raise Lost(f"strace: status {child.returncode}: {told.strip()}")
    return Counter(re.findall(r"^\d+ +(\w+)\(", trace.read_text(), re.MULTILINE))


def traced(work: Workplace, calls: str, *expressions: str) -> list[str]:
    """What strace is called with."""
    words = ["strace", "-f", "-qq", "-o", str(work.place / "trace"), "-e", f"trace={calls}"]
    for each in expressions:
        words += ["-e", each]
    return words


def check_told(name: str, call: str, what: str, status: int, told: str) -> None:
    """A failure is told in a line, and is no panic; what can be done without has none."""
    if status not in (0, 1, 2):
        raise Lost(f"{name}, {what} of {call}: status {status}: {told.strip()}")
    lines = [line for line in told.splitlines() if line.strip()]
    if "panicked" in told or (status and (not lines or not lines[-1].startswith("error: "))):
        raise Lost(f"{name}, {what} of {call}: told {told.strip()!r}")


def check_whole(work: Workplace, name: str) -> None:
    """Every file under a final name is whole."""
    for path in work.place.rglob("*"):
        hidden = any(part.startswith(".") for part in path.relative_to(work.place).parts)
        if hidden or not path.is_file() or path.name == "trace":
            continue
        try:
            check_file(path)
        except (ValueError, KeyError, IndexError, OSError, struct.error) as reason:
            raise Lost(f"{name}: {path.relative_to(work.place)}: not whole ({reason!r})") from reason


def check_file(path: Path) -> None:
    """A ValueError if a file is not whole."""
    content = path.read_bytes()
    if path.name == "state.json":
        for file, wanted in json.loads(content)["files"].items():
            found = (path.parent / file).read_bytes()
            if (len(found), zlib.crc32(found)) != (wanted["bytes"], wanted["crc32"]):
                raise ValueError(f"{file} is not what state.json says")
    elif path.suffix == ".json":
        json.loads(content)
    elif path.suffix == ".jsonl":
        # A line that was being written has no end; all before it are whole.
        for line in content.split(b"\n")[:-1]:
            json.loads(line)
    elif path.suffix == ".ply" and b"binary_little_endian" in content[:200]:
        check_ply(content)
    elif path.suffix == ".png" and content[-8:-4] != b"IEND":
        raise ValueError("a picture without its end")
    elif path.suffix == ".html" and not content.rstrip().endswith(b"</html>"):
        raise ValueError("a page without its end")
    elif not content and path.suffix not in (".log", ".lock"):
        raise ValueError("empty")


def check_ply(content: bytes) -> None:
    """The elements of a binary PLY fill it to its end."""
    head, _, body = content.partition(b"end_header\n")
    sizes = {"float": 4, "double": 8, "uchar": 1, "int": 4, "uint": 4}
    at = 0
    elements = []
    for line in head.decode().splitlines():
        words = line.split()
        if words[0] == "element":
            elements.append([words[1], int(words[2]), 0])
        elif words[0] == "property" and words[1] != "list":
            elements[-1][2] += sizes[words[1]]
    for kind, count, each in elements:
        if kind == "face":
            for _ in range(count):
                at += 1 + 4 * body[at] + each
        else:
            at += count * each
    if at != len(body):
        raise ValueError(f"{len(body)} bytes after the header, {at} counted")


def check_end(work: Workplace, name: str) -> None:
    """What went on ends in the files of what was never disturbed."""
    if name == "compare":
        found, wanted = all_files(work.place / "results-again"), work.wanted_results
    elif name == "extract":
        found, wanted = all_files(work.place / "out"), work.wanted_out
    else:
        found, wanted = run_files(work.place / "run"), work.wanted_run
    if found.keys() != wanted.keys():
        raise Lost(f"{name}: ends with {sorted(found)}, and not with {sorted(wanted)}")
    for file, content in wanted.items():
        if found[file] != content:
            raise Lost(f"{name}: {file} is not that of the undisturbed run{first_difference(content, found[file])}")


def first_difference(wanted: bytes, found: bytes) -> str:
    """The first line of a text that is another, in words for the end of a sentence."""
    for number, (one, other) in enumerate(zip_longest(wanted.splitlines(), found.splitlines()), 1):
        if one != other:
            return f"; line {number} is {(other or b'')[:200]!r}, and was {(one or b'')[:200]!r}"
    return ""


def run_files(run: Path) -> dict:
    """The files of a run that depend on nothing but its recipe."""
    files = all_files(run)
    # The page holds the times of the steps, and the log those of the day.
    return {name: text for name, text in files.items() if name not in ("report.html", "run.log", ".lock")}


def all_files(folder: Path) -> dict:
    """All files of a folder by name, without the times in them."""
    found = {}
    for path in sorted(folder.rglob("*")):
        # That figure shows quality over the time of training.
        # Files under a temporary name are no results; extraction deletes them when they are an hour old.
        if path.is_file() and path.name not in (".lock", "quality.svg") and not path.name.startswith(".isomorph-"):
            content = path.read_bytes()
            if path.suffix in (".json", ".jsonl", ".md", ".svg"):
                text = SECONDS.sub("", content.decode())
                # Tables have seconds in them; figures dates.
                text = re.sub(r"\b\d+(\.\d+)? ?s\b", "", without_times(text))
                content = text.replace("-again", "").replace("-whole", "").encode()
            found[str(path.relative_to(folder))] = content
    return found


def without_times(text: str) -> str:
    """A text whose Markdown tables have no column of seconds or dates, and no padding, which depends on them."""
    lines, kept = [], None
    for line in text.splitlines(keepends=True):
        if not line.startswith("|"):
            lines.append(line)
            kept = None
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if kept is None:
            kept = [at for at, cell in enumerate(cells) if not re.search(r"\(s\)|^dates$", cell)]
        # The line under the heading is as long as the widest cell.
        cells = ["-" if re.fullmatch(r":?-+:?", cell) else cell for cell in cells]
        lines.append("|".join(cells[at] for at in kept if at < len(cells)) + "\n")
    return "".join(lines)


def sphere(shift: float) -> tuple[list, list]:
    """A coarse sphere of radius 1."""
    rings, sectors = 9, 14
    points = [(shift, 0.0, 1.0)]
    for ring in range(1, rings):
        polar = pi * ring / rings
        for sector in range(sectors):
            angle = 2 * pi * sector / sectors
            points.append((shift + sin(polar) * cos(angle), sin(polar) * sin(angle), cos(polar)))
    points.append((shift, 0.0, -1.0))
    at = lambda ring, sector: 1 + (ring - 1) * sectors + sector % sectors
    faces = []
    for sector in range(sectors):
        faces.append((0, at(1, sector), at(1, sector + 1)))
        for ring in range(1, rings - 1):
            a, b = at(ring, sector), at(ring, sector + 1)
            c, d = at(ring + 1, sector), at(ring + 1, sector + 1)
            faces += [(a, c, d), (a, d, b)]
        faces.append((len(points) - 1, at(rings - 1, sector + 1), at(rings - 1, sector)))
    return points, faces


def ply(points: list, faces: list) -> str:
    lines = ["ply", "format ascii 1.0", f"element vertex {len(points)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(repr, point)) for point in points]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces]
    return "\n".join(lines) + "\n"


def progress(what: str, done: int, of: int) -> None:
    if done % 10 == 0 or done == of:
        print(f"{what}: {done} of {of}", file=sys.stderr, flush=True)


def markdown(content: dict) -> str:
    """The table for people."""
    total = sum(row["times"] for row in content["rows"])
    ends = sum(row["ends compared"] for row in content["rows"])
    lines = [
        "# Kills and failing disks",
        "",
        f"{total} kills and failures. After each, every file under a final name was whole. {ends} times the command"
        " then went on to its end, and its files were those of an undisturbed run to the last byte.",
        "",
        record.made_by(content),
        "",
        "| command | how it was disturbed | times | ends compared | calls |",
        "|---|---|---|---|---|",
    ]
    for row in content["rows"]:
        calls = ", ".join(f"{call} {count}" for call, count in row.get("calls", {}).items())
        lines.append(f"| {row['what']} | {row['how']} | {row['times']} | {row['ends compared']} | {calls} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
