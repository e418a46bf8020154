#!/usr/bin/env python3
"""What registrations from PyPI give on the pairs of the protocol, as most people would use them.

    python3 scripts/peers.py [--environment DIR] [--only TEXT] [--every N] [--out DIR]
                             [--sequences DIR] [--protocol FILE] [--table]

Each registration is given the two end meshes of a pair and 1000 known pairs of vertices, as the
presets are. The target's vertices are in a random order. The source's vertices then go on straight
lines to where the registration takes them, and are measured against the true frames between, as
as_rigid.py measures. Beside them stand the straight lines to the true places of all vertices, and
what protocol.py has measured of a preset. Written to DIR: table.md and data.json. With --table the
table is made again from data.json.

The packages (pycpd, probreg, trimesh) live in an environment of their own. It is made where
--environment says if there is none, which takes the net. A package that cannot be installed or
loaded is left out, and the output says why.

CPU seconds are those of the registration alone, of all its threads together. Needs numpy and scipy.
Exit status: 0 done, 1 failed, 2 usage.
"""

import argparse
import json
import shlex
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import numpy as np

import as_rigid
from isomorph_paper import PaperError, command_line, compact, degrade, experiments, record
from isomorph_paper.command_line import ROOT
from isomorph_paper.peers import PEERS, Peer, Shapes
from isomorph_paper.report import mean_of
from isomorph_paper.sequences import Sequence, digest, read_sequence, rms, write_atomically

ABOUT = "Registrations from PyPI, and straight lines to where they take the vertices."
NOTE = """\
Each cell: Chamfer squared x 10^3 / Hausdorff / error of the vertices x 10^2 / the same at the best
times, means over the frames between. "Lines" are given where every vertex ends. The registrations
and the preset are given 1000 vertices, but `cpd` none."""
SECONDS_NOTE = """\
Each cell: error of the vertices at the target x 10^2 / CPU seconds of the registration / wall
seconds. Of the preset: wall seconds of the training, mean over the seeds, when protocol.py ran. The
first number of the lines is the distance from the source to the target."""


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add(
        "--environment",
        type=Path,
        default=ROOT / "target/peers-python",
        help="the Python environment of the packages; made if it is not there",
    )
    add("--only", default="", help="the registrations whose name holds this text")
    add("--every", type=int, default=4, help="every so many frames are measured")
    add("--out", type=Path, default=ROOT / "scripts/results/peers", help="where results go")
    command_line.add_sequences(parser)
    command_line.add_table(parser)
    add(
        "--protocol",
        type=Path,
        default=ROOT / "scripts/results/protocol/default.json",
        help="what protocol.py measured of a preset, to stand beside",
    )
    options = parser.parse_args(words)
    if options.every < 1:
        parser.error(f"--every = {options.every}: must be 1 or more")
    if not any(options.only in peer.name for peer in PEERS):
        names = ", ".join(peer.name for peer in PEERS)
        parser.error(f"--only = {options.only}: no registration has this text; there are {names}")
    return options


def interpreter(environment: Path) -> Path:
    """The Python of an environment, which is made with its packages if there is none."""
    inside = "Scripts/python.exe" if sys.platform == "win32" else "bin/python"
    python = environment.absolute() / inside
    if python.exists():
        return python
    print(f"{environment}: making an environment for the packages", file=sys.stderr)
    try:
        venv.create(environment, with_pip=True)
    except (OSError, ValueError, subprocess.CalledProcessError) as reason:
        raise PaperError(f"{environment}: no environment can be made there ({reason})") from reason
    # One by one, so that a package that cannot be installed stops no other.
    for packages in dict.fromkeys(("numpy", *peer.packages) for peer in PEERS):
        command = [str(python), "-m", "pip", "install", "--quiet", *packages]
        if subprocess.run(command, stdout=sys.stderr).returncode != 0:
            print(f"{environment}: {packages[1]} could not be installed", file=sys.stderr)
    return python


def call(python: Path, peer: Peer, *words: str) -> dict:
    """What the worker says; a PaperError with its last line where it fails."""
    command = [str(python), "-m", "isomorph_paper.peer_worker", peer.name, *words]
    try:
        done = subprocess.run(command, cwd=ROOT / "scripts", capture_output=True, text=True)
    except OSError as reason:
        raise PaperError(f"{python}: cannot be run ({reason.strerror})") from reason
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
        raise PaperError(lines[-1].strip())
    return json.loads(done.stdout.splitlines()[-1])


def present(python: Path, only: str) -> tuple[dict[str, str], dict[str, str]]:
    """The versions of the registrations that can be called, and what is wrong with the others."""
    versions, absent = {}, {}
    for peer in PEERS:
        if only not in peer.name:
            continue
        try:
            package = peer.packages[0]
            versions[peer.name] = f"{package} {call(python, peer, '--check')['version']}"
        except PaperError as reason:
            absent[peer.name] = str(reason)
            packages = " ".join(peer.packages)
            print(
                f"{peer.name}: left out, {package} cannot be loaded ({reason}); install what it "
                f"names, or `{python} -m pip install {packages}`",
                file=sys.stderr,
            )
    if not versions:
        packages = " ".join(dict.fromkeys(name for peer in PEERS for name in peer.packages))
        raise PaperError(
            f"{python}: no registration can be loaded; `{python} -m pip install numpy {packages}`, "
            "or name another --environment"
        )
    return versions, absent


def shapes_of(sequence: Sequence, pair: tuple[int, int]) -> Shapes:
    """The two ends as a registration is given them, the target's vertices in a random order."""
    size = sequence.unit_scale(pair)
    source, target = (size * sequence.frames[frame] for frame in pair)
    rng = degrade.generator(0, "peers", sequence.name, *pair)
    order = rng.permutation(len(target))
    place = np.argsort(order)
    pairs = degrade.same_vertex_pairs(len(source), min(experiments.PAIRS, len(source)), rng)
    pairs[:, 1] = place[pairs[:, 1]]
    triangles = sequence.triangles
    return Shapes(source, triangles, target[order], place[triangles], pairs)


def registered(python: Path, peer: Peer, shapes: Shapes) -> tuple[np.ndarray, dict]:
    """Where the source's vertices go, and the seconds."""
    with tempfile.TemporaryDirectory() as name:
        given, made = Path(name) / "given.npz", Path(name) / "made.npy"
        np.savez(given, **vars(shapes))
        said = call(python, peer, str(given), str(made))
        return np.load(made), said


def pair_of(sequence: Sequence, pair: tuple[int, int], every: int, python: Path, names) -> dict:
    """All registrations on one pair, and straight lines to the true places."""
    first, last = pair
    frames = list(range(first + every, last, every))
    if not frames:
        raise PaperError(f"--every = {every}: no frame of {sequence.name} {first}-{last} is left")
    size = sequence.unit_scale(pair)
    source, target = (size * sequence.frames[frame] for frame in pair)
    truth = [size * sequence.frames[frame] for frame in frames]
    times = [(frame - first) / (last - first) for frame in frames]
    rng = degrade.generator(0, "peers-metrics", sequence.name, *pair)

    def measured(places: np.ndarray) -> dict:
        path = lambda time: (1 - time) * source + time * places
        found = as_rigid.measure(path, truth, times, sequence.triangles, rng)
        return found | {"arrival": rms(places - target)}

    row = {"sequence": sequence.name, "from": first, "to": last, "frames": frames}
    row["lines"] = measured(target) | {"arrival": rms(source - target)}
    shapes = shapes_of(sequence, pair)
    for peer in PEERS:
        if peer.name not in names:
            continue
        try:
            places, said = registered(python, peer, shapes)
        except PaperError as reason:
            row[peer.name] = {"failed": str(reason)}
            continue
        row[peer.name] = measured(places) | {
            key: said[key] for key in ("cpu_seconds", "wall_seconds")
        }
    return row


def training_seconds(protocol: Path) -> dict:
    """The mean wall seconds of a preset's trainings by sequence and pair."""
    seconds: dict[tuple, list[float]] = {}
    for each in compact.unpack(compact.read(protocol)):
        if each.get("training_seconds") is not None:
            key = (each["sequence"], each["from"], each["to"])
            seconds.setdefault(key, []).append(each["training_seconds"])
    return {key: mean_of(values) for key, values in seconds.items()}


def measured(options: argparse.Namespace, words: list[str]) -> dict:
    """All pairs of the protocol, and how they were measured."""
    preset, means = as_rigid.preset_of(options.protocol)
    seconds = training_seconds(options.protocol)
    python = interpreter(options.environment)
    versions, absent = present(python, options.only)
    rows, sequences = [], {}
    for subject in experiments.PROTOCOL:
        path = command_line.sequences(options) / f"{subject.sequence}.anime"
        sequence = read_sequence(path)
        sequences[sequence.name] = f"sha256 {digest(sequence.path)}"
        for pair in subject.pairs:
            row = pair_of(sequence, pair, options.every, python, versions)
            key = (sequence.name, *pair)
            row["preset"] = means.get(key)
            row["preset_seconds"] = seconds.get(key)
            rows.append(row)
            print(json.dumps(row), file=sys.stderr, flush=True)
    return {
        "command": shlex.join(["python3", "scripts/peers.py", *words]),
        "preset": preset,
        "peers": versions,
        "absent": absent,
        "rows": rows,
        "sequences": sequences,
        "date": record.now(),
        "machine": record.machine(),
    }


def failed(found: dict | None) -> bool:
    return found is None or "failed" in found


def quality_cells(row: dict, names: list[str]) -> list[str]:
    found = [row["lines"], *(row[name] for name in names), row["preset"]]
    return ["-" if failed(each) else as_rigid.cell(each) for each in found]


def seconds_cells(row: dict, names: list[str]) -> list[str]:
    arrival = lambda found: f"{1e2 * found['arrival']:.2f}"
    cells = [arrival(row["lines"])]
    for found in (row[name] for name in names):
        seconds = "" if failed(found) else f"{found['cpu_seconds']:.1f} / {found['wall_seconds']:.1f}"
        cells.append("-" if failed(found) else f"{arrival(found)} / {seconds}")
    training = row["preset_seconds"]
    return [*cells, "-" if training is None else f"{training:.0f}"]


def table(content: dict, cells) -> list[str]:
    names = list(content["peers"])
    titles = ["frames", "lines", *(f"`{name}`" for name in names), f"`{content['preset']}`"]
    lines = [f"| {' | '.join(titles)} |", "| --- |" + " ---: |" * (len(titles) - 1)]
    for row in content["rows"]:
        pair = f"{row['sequence']} {row['from']}-{row['to']}"
        lines.append(f"| {' | '.join([pair, *cells(row, names)])} |")
    return lines


def remarks(content: dict) -> list[str]:
    """What each registration is, which were left out, and which failed on a pair."""
    settings = {peer.name: peer.settings for peer in PEERS}
    said = [f"* `{name}`: {of}; {settings[name]}." for name, of in content["peers"].items()]
    said += [f"* `{name}` is left out: {why}." for name, why in content["absent"].items()]
    for row in content["rows"]:
        pair = f"{row['sequence']} {row['from']}-{row['to']}"
        for name in content["peers"]:
            if failed(row[name]):
                said.append(f"* `{name}` failed on {pair}: {row[name]['failed']}.")
    return said


def markdown(content: dict) -> str:
    """The tables of data.json."""
    parts = [
        "# Registrations from PyPI",
        ABOUT,
        "\n".join(table(content, quality_cells)),
        NOTE,
        "\n".join(table(content, seconds_cells)),
        SECONDS_NOTE,
        "\n".join(remarks(content)),
        record.made_by(content),
    ]
    return "\n\n".join(parts) + "\n"


def run(options: argparse.Namespace, words: list[str]) -> None:
    numbers = options.out / compact.NAME
    if not options.table:
        compact.write(numbers, measured(options, words))
    text = markdown(compact.read(numbers))
    write_atomically(options.out / "table.md", text.encode())
    print(text)


def main(words: list[str]) -> int:
    options = arguments(words)
    try:
        run(options, words)
    except PaperError as error:
        print(f"peers.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
