#!/usr/bin/env python3
"""Tests of scripts/protocol.py, with the program of fake_isomorph.py instead of isomorph."""

import contextlib
import io
import json
import os
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import fake_isomorph
import protocol
from isomorph_paper import experiments, sequences
from test_degrade import sphere


class Protocol(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        vertices, triangles = sphere()
        # Volumes that grow evenly from 1 to 2.
        sizes = np.cbrt(np.linspace(1.0, 2.0, 54))
        frames = np.stack([size * vertices for size in sizes])
        for subject in experiments.PROTOCOL:
            path = self.folder / "in" / f"{subject.sequence}.anime"
            self.sequence = sequences.write_sequence(path, frames, triangles)
        self.binary, self.log = fake_isomorph.install(self, self.folder)

    def protocol(self, *words):
        """The status, stdout and stderr of a command."""
        places = ["--sequences", self.folder / "in", "--out", self.folder / "out"]
        places += ["--work", self.folder / "work"]
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = protocol.main([*words, *map(str, [*places, "--binary", self.binary])])
        return status, out.getvalue(), err.getvalue()

    def test_every_pair_and_seed_is_measured_and_tabled(self):
        status, out, err = self.protocol()
        self.assertEqual(status, 0, err)
        calls = [json.loads(line) for line in self.log.read_text().splitlines()]
        self.assertEqual(len(calls), 3)
        pairs = [call[call.index("--pairs") + 1] for call in calls]
        self.assertEqual(pairs, ["0-18,20-47", "0-16,16-30,30-47", "0-26,26-53"])
        self.assertIn("default=default", calls[0])
        self.assertIn("default: seed 2=default,training.seed=2", calls[0])
        text = (self.folder / "out/default.md").read_text()
        self.assertIn(text, out)
        # Errors follow from the labels' lengths: .017 for seed 0, .025 for the others; squared
        # .289e-3 and .625e-3, their mean with the second twice .513e-3; the lines' .05 squared.
        row = next(line for line in text.splitlines() if line.startswith("| bear_walk 16-30"))
        self.assertIn("| 3 | 0.5130 (0.2890 to 0.6250) | 2.5000 | 0.0670 (0.0510 to 0.0750) |", row)
        found = json.loads((self.folder / "out/default.json").read_text())
        self.assertEqual([len(pair["methods"]) for pair in found["pairs"]], [3] * 7)

    def test_goals_that_are_missed_are_named_with_the_size_of_the_miss(self):
        self.protocol("--seeds", "0")
        text = (self.folder / "out/default.md").read_text()
        # Of the fake's errors only the volume, 1.1, misses; on the bear's pairs as on the others.
        self.assertIn("Goals met: 42 of 49", text)
        self.assertIn("* fox_survey 20-47: volume: 1.100, within 0.01 of 1", text)
        entry = {"evaluation": {"mean": fake_mean(0.9, 0.7), "frames": [{"surface": pieces(2)}]}}
        measured = protocol.Measured("ball", (0, 9), {0: entry}, 1.0)
        wanted = ["CD x10^3: 0.81", "HD: 0.90", "vertices aligned x10^2: 0.70"]
        shown = " ".join(protocol.misses(measured))
        for each in wanted:
            self.assertNotIn(each, shown)
        self.assertIn("pieces: up to 2", shown)
        entry = {"evaluation": {"mean": fake_mean(1.1, 0.9), "frames": [{"surface": pieces(1)}]}}
        shown = " ".join(protocol.misses(protocol.Measured("ball", (0, 9), {0: entry}, 1.0)))
        for each in [
            "CD x10^3: 1.21",
            "HD: 1.10",
            "vertices aligned x10^2: 0.90 of the lines', at most 0.8",
        ]:
            self.assertIn(each, shown)

    def test_an_even_growth_does_not_swell(self):
        # Vertices are float32: 1e-6 is a few of its roundings.
        self.assertAlmostEqual(protocol.swell(self.sequence, (0, 53), [13, 40]), 1.0, delta=1e-6)
        wider = sequences.Sequence(
            self.sequence.path, self.sequence.frames.copy(), self.sequence.triangles
        )
        wider.frames[13] *= 1.1
        self.assertAlmostEqual(protocol.swell(wider, (0, 53), [13]), 1.1**3, delta=1e-5)

    def test_a_table_trains_nothing_and_says_where_nothing_is(self):
        status, _, err = self.protocol("--table")
        self.assertEqual(status, 1)
        self.assertIn("default.json: cannot be read", err)
        self.assertFalse(self.log.exists())
        self.protocol("--seeds", "0")
        calls = self.log.read_text()
        status, out, _ = self.protocol("--table")
        self.assertEqual((status, self.log.read_text()), (0, calls))
        self.assertIn("| fox_survey 0-18 | 1 |", out)

    def test_failures_and_bad_words(self):
        os.environ["FAKE_FAILS"] = "1"
        self.assertEqual(self.protocol()[0], 1)
        os.environ["FAKE_FAILS"] = "130"
        self.assertEqual(self.protocol()[0], 130)
        for words in (["--seeds", "x"], ["--seeds", "-1"], ["--every", "0"]):
            with self.assertRaises(SystemExit) as stopped:
                self.protocol(*words)
            self.assertEqual(stopped.exception.code, 2)


def pieces(count):
    return {"components": float(count)}


def fake_mean(share, carried):
    """Errors of these shares of the lines', the squared Chamfer distance of their squares."""
    lines = {"chamfer_squared": 1e-4, "hausdorff": 0.01, "tracked_rmse": 0.01}
    ours = {
        "chamfer_squared": 1e-4 * share**2,
        "hausdorff": 0.01 * share,
        "tracked_rmse": 0.01 * carried,
    }
    whole = lambda numbers: {**numbers, "volume_ratio": 1.0, "aligned": numbers}
    return {"surface": whole(ours), "carried": whole(ours), "linear": whole(lines)}


if __name__ == "__main__":
    unittest.main()
