#!/usr/bin/env python3
"""Tests of scripts/gpu.py, without isomorph and without a GPU: a fake one answers."""

import contextlib
import io
import json
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import gpu

FAKE = """#!{python} -S
import json, os, sys
words = sys.argv[1:]
with open({log!r}, "a") as log:
    log.write(json.dumps(words) + "\\n")
after = lambda name: words[words.index(name) + 1]
if words == ["--version"]:
    print("isomorph 0.0.0-fake")
elif words[0] == "self-test":
    if {wrong!r} == after("--preset"):
        print("WRONG")
        sys.exit(1)
    checked = {{"what": "matrix product (2 x 3)", "off": 2e-6, "allowed": 1e-4}}
    print(json.dumps({{"device": "Card 9 (driver 1.2)", "seconds": 1.0, "operations": [checked]}}))
elif words[0] == "bench":
    seconds = {{"wgpu": 0.5, "flex": 2.0}}[after("--backend")]
    cost = {{"seconds_per_step": seconds, "first_step_seconds": 9.0, "gflop_per_step": 3.0}}
    print(json.dumps({{"phases": {{"joint": cost}}, "matmul_gflops": 7.0, "peak_bytes": None}}))
else:
    run = after("--run")
    os.makedirs(run)
    line = {{"step": 600, "seconds": 12.5, "total": 0.25, "peak_memory_bytes": 1}}
    open(run + "/metrics.jsonl", "w").write(json.dumps(line) + "\\n")
"""


class Gpu(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_script(self, *words, wrong=""):
        binary = self.folder / "isomorph"
        log = str(self.folder / "log")
        binary.write_text(FAKE.format(python=sys.executable, log=log, wrong=wrong))
        binary.chmod(0o755)
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            places = ["--out", str(self.folder / "out"), "--binary", str(binary)]
            status = gpu.main([*words, *places])
        return status, out.getvalue(), err.getvalue()

    def calls(self):
        return [json.loads(line) for line in (self.folder / "log").read_text().splitlines()]

    def test_a_device_has_a_folder_with_its_name_and_a_table_of_all_that_was_measured(self):
        status, out, err = self.run_script("--sizes", "quick,paper")
        self.assertEqual(status, 0, err)
        table = (self.folder / "out/card-9/table.md").read_text()
        self.assertIn(table, out)
        self.assertTrue(table.startswith("# Card 9 (driver 1.2)\n"))
        for line in (
            "| quick | matrix product (2 x 3) | 2.0e-06 | 1e-04 |",
            "| paper | 0.5000 | 2.0000 | 4.00 | 9.0 | 3.0 |",
            "| human | flex | 600 | 12.5 | ",
        ):
            self.assertIn(line, table)
        kinds = [words[0] for words in self.calls() if words != ["--version"]]
        self.assertEqual(kinds, ["self-test"] * 2 + ["bench"] * 4 + ["train"] * 4)
        self.assertNotIn(str(self.folder), (self.folder / "out/card-9/data.json").read_text())

    def test_the_table_alone_measures_nothing(self):
        self.run_script("--sizes", "quick")
        table = self.folder / "out/card-9/table.md"
        first = table.read_text()
        table.unlink()
        before = len(self.calls())
        status, _, err = self.run_script("--table")
        self.assertEqual((status, table.read_text(), len(self.calls())), (0, first, before), err)

    def test_a_device_that_computes_wrong_numbers_is_not_measured(self):
        status, _, err = self.run_script(wrong="paper")
        self.assertEqual(status, 1)
        self.assertIn("WRONG", err)
        self.assertFalse((self.folder / "out").exists())
        self.assertNotIn("bench", [words[0] for words in self.calls()])

    def test_bad_options_are_refused(self):
        with self.assertRaises(SystemExit) as ended:
            self.run_script("--sizes", "huge")
        self.assertEqual(ended.exception.code, 2)
        status, _, err = self.run_script("--table")
        self.assertEqual(status, 1)
        self.assertIn("no results", err)


if __name__ == "__main__":
    unittest.main()
