#!/usr/bin/env python3
"""Tests of scripts/instant_scaling.py, without isomorph: a fake one answers."""

import contextlib
import io
import json
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import instant_scaling
import recipe_keys

FAKE = """#!{python} -S
import json, sys
vertices = int(sys.argv[sys.argv.index("--vertices") + 1])
stages = [{{"name": "read files", "seconds": vertices / 1e4}}, {{"name": "steps", "seconds": 1.0}}]
whole = {{"seconds": vertices / 1e4 + 1.0, "cpu_seconds": None}}
print(json.dumps({{"stages": stages, "whole": whole, "peak_bytes": None}}))
"""


class InstantScaling(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.binary = self.folder / "isomorph"
        self.binary.write_text(FAKE.format(python=sys.executable))
        self.binary.chmod(0o755)

    def run_script(self, *words):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            places = ["--out", str(self.folder / "out"), "--binary", str(self.binary)]
            status = instant_scaling.main([*words, *places])
        return status, err.getvalue()

    def test_the_base_lies_on_every_sweep_and_keys_are_those_of_the_recipe(self):
        for name, values in instant_scaling.SWEEPS.items():
            self.assertIn(instant_scaling.BASE[name], values)
        known = recipe_keys.declared()
        for name in ("spacing", "resolution"):
            self.assertIn(instant_scaling.WORDS[name](1)[1].split("=")[0], known)

    def test_all_sweeps_leave_table_numbers_and_figure(self):
        status, err = self.run_script()
        self.assertEqual(status, 0, err)
        folder = self.folder / "out/instant-scaling"
        rows = json.loads((folder / "data.json").read_text())["rows"]
        self.assertEqual(len(rows), sum(map(len, instant_scaling.SWEEPS.values())))
        table = (folder / "table.md").read_text()
        self.assertIn("| 20000 | 2.00 | 0.00 | 0.00 | 1.00 | 0.00 | 0.00 | 3.00 | unknown |", table)
        self.assertEqual(xml.fromstring((folder / "figure.svg").read_bytes()).tag[-3:], "svg")
        (folder / "table.md").unlink()
        status, _ = self.run_script("--table")
        self.assertEqual((status, (folder / "table.md").read_text()), (0, table))

    def test_a_program_that_fails_is_named(self):
        self.binary.write_text("#!/bin/sh\necho no such size >&2\nexit 2\n")
        status, err = self.run_script()
        self.assertEqual(status, 1)
        self.assertIn("no such size", err)


if __name__ == "__main__":
    unittest.main()
