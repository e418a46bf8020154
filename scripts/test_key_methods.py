#!/usr/bin/env python3
"""Tests of scripts/key_methods.py, without isomorph: a fake one answers."""

import contextlib
import io
import json
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import key_methods
from isomorph_paper import compact

FAKE = """#!{python} -S
import json, os, sys
words = sys.argv[1:]
given = lambda name: words[words.index(name) + 1]
assert words[0] == "compare"
name = os.path.basename(given("--sequence")).split(".")[0]
def metrics(error):
    return {{"chamfer_squared": error, "hausdorff_squared": 2 * error}}
def method(label, error, frames):
    mean = {{"surface": metrics(error), "linear": metrics(0.005), "floor": metrics(0.001)}}
    return {{"method": label, "frames": frames, "mean": mean}}
pairs = []
for k, pair in enumerate(given("--pairs").split(",")):
    first, last = map(int, pair.split("-"))
    # The first pair is as far off as no other.
    errors = (0.03, 0.02) if k == 0 else (0.003, 0.002)
    frames = last - first - 1
    methods = [method("nise", errors[0], frames), method("instant", errors[1], frames)]
    pairs.append({{"from": first, "to": last, "methods": methods}})
folder = given("-o") + "/" + name
os.makedirs(folder)
open(folder + "/comparison.json", "w").write(json.dumps({{"pairs": pairs}}))
"""


class KeyMethods(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.binary = self.folder / "isomorph"
        self.binary.write_text(FAKE.format(python=sys.executable))
        self.binary.chmod(0o755)
        for name in key_methods.SEQUENCES:
            (self.folder / f"{name}.anime").write_bytes(b"")

    def run_script(self, *words):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            places = ["--out", str(self.folder / "out"), "--work", str(self.folder / "work")]
            places += ["--binary", str(self.binary), "--sequences", str(self.folder)]
            status = key_methods.main([*words, *places])
        return status, err.getvalue()

    def test_means_are_of_all_frames_and_stand_beside_those_of_the_paper(self):
        rows = [{"sequence": "bear_walk", "variant": "one field", "surface_chamfer_squared": 0.0015}]
        compact.write(self.folder / "out/keys" / compact.NAME, {"rows": rows})
        status, err = self.run_script()
        self.assertEqual(status, 0, err)
        folder = self.folder / "out/key-methods"
        table = (folder / "table.md").read_text()
        # 9 of 48 frames lie in the first pair: (9 * 30 + 39 * 3) / 48.
        self.assertIn("| nise | 8.062 (0.178) | 1.613 (0.262) | 8.062 (0.366) | 1.613 (0.560) |", table)
        self.assertIn("| instant | 5.375 | 1.075 | 5.375 | 1.075 |", table)
        self.assertIn("| instant, one motion | - | - | 1.500 | - |", table)
        self.assertIn("| the paper's own | (0.108) | (0.114) | (0.260) | (0.265) |", table)
        self.assertIn("* nise: fox_survey 1.5 (1.6), bear_walk 1.5 (1.4)", table)
        labels = [line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")]
        self.assertEqual(labels[-3:-1], ["linear", "floor"])
        # The table follows from the numbers alone.
        (folder / "table.md").unlink()
        self.assertEqual(self.run_script("--table")[0], 0)
        self.assertEqual((folder / "table.md").read_text(), table)

    def test_a_command_that_fails_is_an_error_and_nothing_is_written(self):
        self.binary.write_text("#!/bin/sh\necho broken >&2\nexit 1\n")
        status, err = self.run_script()
        self.assertEqual(status, 1)
        self.assertIn("broken", err)
        self.assertFalse((self.folder / "out").exists())


if __name__ == "__main__":
    unittest.main()
