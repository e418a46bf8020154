#!/usr/bin/env python3
"""What planning, submitting, looking at and collecting ten thousand runs takes, with made-up run folders.

    python3 scripts/batch_scale.py [--binary PATH] [--files 142]

Trains one small run, copies what `isomorph batch` reads of it for all pairs of the files (142 files are 10,011 pairs), and
prints seconds and peak memory of each command. It also counts the files of a run, and its writes per minute.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from slurm_test import ROOT, write_shapes

READ = ("recipe.toml", "metrics.jsonl", "run.log", "meshes/frames.json", "report.html")


def measured(command: list[str], folder: Path) -> tuple[float, int]:
    """Wall seconds and peak resident bytes of a command."""
    begun = time.monotonic()
    with open(os.devnull, "wb") as nowhere:
        child = subprocess.Popen(command, cwd=folder, stdout=nowhere)
        _, status, usage = os.wait4(child.pid, 0)
    if status:
        raise SystemExit(f"{' '.join(command)} failed")
    return time.monotonic() - begun, usage.ru_maxrss * 1024


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default=str(ROOT / "target/release/isomorph"))
    parser.add_argument("--files", type=int, default=142)
    options = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_shapes(folder / "made")
        (folder / "shapes").mkdir()
        for k in range(options.files):
            (folder / f"shapes/s{k:03}.obj").symlink_to(folder / f"made/shape-{k % 10}.obj")
        jobs = folder / "jobs.toml"
        jobs.write_text(
            'folder = "runs"\nset = ["result.frames=5", "data.correspondences=same-vertices"]\n'
            '[all-pairs]\nfiles = "shapes/*.obj"\n'
        )
        first = folder / "runs/s000-s001"
        run = [options.binary, "batch", "run", str(jobs), "--share", f"0/{10**6}", "--quiet"]
        seconds, _ = measured(run, folder)
        files = [path for path in first.rglob("*") if path.is_file()]
        size = sum(path.stat().st_size for path in files)
        print(f"a run: {len(files)} files, {size / 1e6:.1f} MB, {seconds:.1f} s")
        checkpoint = sorted((first / "checkpoints").iterdir())[-1].name
        names = [f"s{i:03}-s{j:03}" for i in range(options.files) for j in range(i + 1, options.files)]
        for name in names[1:]:
            place = folder / "runs" / name
            (place / "meshes").mkdir(parents=True)
            (place / "checkpoints" / checkpoint).mkdir(parents=True)
            for file in READ:
                shutil.copyfile(first / file, place / file)
        print(f"{len(names)} runs")
        for command in (["plan"], ["status"], ["collect"], ["submit", "--dry-run"], ["run", "--quiet"]):
            words = [options.binary, "batch", command[0], str(jobs), *command[1:]]
            seconds, peak = measured(words, folder)
            print(f"batch {' '.join(command):18} {seconds:6.2f} s {peak / 2**20:6.0f} MiB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
