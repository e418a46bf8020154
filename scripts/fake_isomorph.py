#!/usr/bin/env python3
"""Answers like `isomorph compare`, for test_paper.py and test_protocol.py: every error follows from
the row's label.

The error of a row is 0.01 and 0.001 more for each letter of its label, and its volume is 10 % too
large at all times. Every call adds its arguments to the file FAKE_LOG, a JSON list per line; a
status in FAKE_FAILS makes it fail with that.
"""

import json
import os
import re
import sys
from pathlib import Path


def install(case, folder):
    """Makes the program `isomorph` in a folder, for one test case; the program and its log."""
    program, log = folder / "isomorph", folder / "log"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{__file__}" "$@"\n')
    program.chmod(0o755)
    os.environ["FAKE_LOG"] = str(log)
    case.addCleanup(os.environ.pop, "FAKE_FAILS", None)
    return program, log


def metrics(error, time):
    return {
        "time": time,
        "chamfer": error,
        "chamfer_squared": error**2,
        "hausdorff": 3 * error,
        "hausdorff_squared": 9 * error**2,
        "hausdorff95": 2 * error,
        "normal_consistency": 1 - error,
        "volume_ratio": 1.1,
        "area_ratio": 1.0,
        "components": 1.0,
        "outside_largest": 0.0,
    }


def compared(error, time, **more):
    aligned = metrics(error / 2, time) | {name: value / 2 for name, value in more.items()}
    return metrics(error, time) | more | {"aligned": aligned}


def frame(error, time):
    return {
        "surface": compared(error, time),
        "carried": compared(error, time, tracked_rmse=error),
        "linear": compared(0.05, time, tracked_rmse=0.05),
        "floor": metrics(0.001, time),
    }


def evaluation(error, first, last, every):
    frames = []
    for number in range(first + 1, last, every):
        time = (number - first) / (last - first)
        frames.append({"frame": number, "time": time, **frame(error, time)})
    return {"frames": frames, "mean": frame(error, 0.5)}


def main(words):
    if words == ["--version"]:
        print("isomorph 0.0.0-fake")
        return 0
    if "FAKE_FAILS" in os.environ:
        return int(os.environ["FAKE_FAILS"])
    assert words[0] == "compare" and "--quiet" in words, words
    with open(os.environ["FAKE_LOG"], "a") as log:
        log.write(json.dumps(words) + "\n")

    def given(name):
        return [words[at + 1] for at, word in enumerate(words) if word == name]

    sequence = Path(given("--sequence")[0])
    assert sequence.exists(), sequence
    folder = Path(given("-o")[0]) / sequence.stem
    folder.mkdir(parents=True, exist_ok=True)
    every = int((given("--every") or ["1"])[0])
    for variant in given("--variant"):
        label, keys = variant.split("=", 1)
        for path in re.findall(r"data\.\w+=(/[^,]+)", keys):
            assert Path(path).exists(), path
        for pair in given("--pairs")[0].split(","):
            first, last = map(int, pair.split("-"))
            entry = {
                "sequence": sequence.stem,
                "from": first,
                "to": last,
                "method": label,
                "training_seconds": 12.5,
                "date": "2026-01-01T00:00:00Z",
                "evaluation": evaluation(0.01 + 0.001 * len(label), first, last, every),
            }
            name = re.sub("[^a-z0-9]", "-", label.lower())
            (folder / f"{first}-{last}-{name}.json").write_text(json.dumps(entry))
    (folder / "comparison.json").write_text(json.dumps({"sequence": sequence.stem, "pairs": []}))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
