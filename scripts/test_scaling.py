#!/usr/bin/env python3
"""Tests of scripts/scaling.py, without isomorph: a fake one answers by a formula."""

import contextlib
import io
import json
import os
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).parent))

import recipe_keys
import scaling
from isomorph_jax.sizes import SIZES

FAKE = Path(__file__).with_name("fake_bench.py")

# Points on the four sweeps, of which the base is counted once: 6 + 4 + 4 + 5 - 3.
STEPS = 16


def joint_gflop(points=4086, width=256, depth=8, time_steps=10):
    """What fake_bench.py makes of a shape."""
    return points / 1000 * (width / 100) ** 2 * depth * time_steps


class Declarations(unittest.TestCase):
    def test_the_base_is_the_size_shipped_and_lies_on_every_sweep(self):
        shipped = SIZES["shipped"]
        self.assertEqual(shipped.width_f, shipped.width_v)
        known = (shipped.batch, shipped.width_v, shipped.depth, shipped.time_steps)
        self.assertEqual(tuple(scaling.BASE.values()), known)
        for name, values in scaling.SWEEPS.items():
            self.assertIn(scaling.BASE[name], values)
            self.assertEqual(list(values), sorted(set(values)))
        self.assertEqual(set(scaling.SWEEPS), set(scaling.KEYS))

    def test_keys_are_those_of_the_recipe(self):
        known = recipe_keys.declared()
        for key in (key for keys in scaling.KEYS.values() for key in keys):
            self.assertIn(key, known)


class Scaling(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.binary = self.folder / "isomorph"
        self.binary.write_text(f'#!/bin/sh\nexec "{sys.executable}" -S "{FAKE}" "$@"\n')
        self.binary.chmod(0o755)
        self.log = self.folder / "log"
        environment = mock.patch.dict(os.environ, {"FAKE_LOG": str(self.log)})
        environment.start()
        self.addCleanup(environment.stop)

    def scaling(self, *words):
        """The status, stdout and stderr of a command."""
        out, err = io.StringIO(), io.StringIO()
        places = ["--out", str(self.folder / "out"), "--binary", str(self.binary)]
        places += ["--work", str(self.folder / "work")]
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                status = scaling.main([*words, *places])
            except SystemExit as ended:
                status = ended.code
        return status, out.getvalue(), err.getvalue()

    def calls(self):
        if not self.log.exists():
            return []
        return [json.loads(line) for line in self.log.read_text().splitlines()]

    def test_all_sweeps_leave_table_numbers_figure_and_record(self):
        status, out, err = self.scaling()
        self.assertEqual(status, 0, err)
        folder = self.folder / "out/scaling"
        wanted = {"table.md", "data.json", "figure.svg"}
        self.assertEqual({path.name for path in folder.iterdir()}, wanted)
        # The base is measured once for each number of threads.
        self.assertEqual(len(self.calls()), 2 * STEPS)
        kept = json.loads((folder / "data.json").read_text())
        rows = kept["rows"]
        self.assertEqual(len(rows), 2 * (STEPS + 3))
        for row in rows:
            shape = {row["sweep"].replace("-", "_"): row["at"]}
            seconds = joint_gflop(**shape) / row["threads"]
            # Six digits are kept.
            self.assertAlmostEqual(row["joint_seconds_per_step"] / seconds, 1, delta=1e-5)
        text = (folder / "table.md").read_text()
        self.assertIn(text, out)
        for axis in scaling.AXES.values():
            self.assertIn(f"## {axis}", text)
        # 16 thousand points: 16 * 2.56^2 * 80 seconds on one thread, half of that on two, 16 GB.
        self.assertIn("| 16000 | 8388.6100 | 0.50 | 16.00 | 4194.3000 | 0.50 | 16.00 |", text)
        self.assertEqual(self.scaling("--table")[1], out)
        self.assertEqual(len(self.calls()), 2 * STEPS)
        self.assertEqual(len(kept["calls"]), 2 * STEPS)
        self.assertEqual(kept["versions"]["isomorph"], "isomorph 0.0.0-fake")
        self.assertEqual(kept["command"].split()[0], "scripts/scaling.py")
        self.assertIn("date", kept)
        self.assertIn("processor", kept["machine"])

    def test_the_figure_has_a_panel_for_each_sweep_and_number(self):
        self.assertEqual(self.scaling()[0], 0)
        root = xml.parse(self.folder / "out/scaling/figure.svg").getroot()
        panels = [g for g in root.iter() if (g.get("id") or "").startswith("axes_")]
        self.assertEqual(len(panels), len(scaling.SWEEPS) * len(scaling.COLUMNS))
        words = "".join(root.itertext())
        for label in ("1 thread", "2 threads", *scaling.AXES.values()):
            self.assertIn(label, words)

    def test_a_point_that_is_done_is_not_measured_again(self):
        with mock.patch.dict(os.environ, {"FAKE_FAILS": "implicit.width=128"}):
            status, _, err = self.scaling("--sweep", "width", "--threads", "1")
        self.assertEqual(status, 1)
        self.assertIn("no memory", err)
        work = self.folder / "work/scaling"
        self.assertEqual(len(list(work.glob("*-threads-*.json"))), 1)
        self.assertFalse((self.folder / "out/scaling").exists())
        self.assertEqual(json.loads((work / "run.json").read_text())["state"], "unfinished")
        # The one of width 64 is there, 128 is tried again.
        self.assertEqual(self.scaling("--sweep", "width", "--threads", "1")[0], 0)
        self.assertEqual(len(self.calls()), 2 + 3)
        self.assertEqual(self.scaling("--sweep", "width", "--threads", "1")[0], 0)
        self.assertEqual(len(self.calls()), 2 + 3)

    def test_results_of_another_build_are_not_mixed_in(self):
        self.assertEqual(self.scaling("--sweep", "depth")[0], 0)
        with self.binary.open("a") as more:
            more.write("# built again\n")
        status, _, err = self.scaling("--sweep", "depth")
        self.assertEqual(status, 1)
        self.assertIn("binary sha256", err)
        self.assertIn("set another --out and --work, or delete the folder", err)

    def test_another_backend_has_a_folder_of_its_own(self):
        words = ("--sweep", "depth", "--threads", "1")
        self.assertEqual(self.scaling(*words, "--backend", "ndarray")[0], 0)
        self.assertTrue((self.folder / "out/scaling-ndarray/table.md").exists())
        self.assertTrue(all("ndarray" in call for call in self.calls()))

    def test_memory_that_the_system_does_not_tell_is_unknown(self):
        with mock.patch.dict(os.environ, {"FAKE_PEAK": ""}):
            status, out, err = self.scaling("--sweep", "depth", "--threads", "2")
        self.assertEqual(status, 0, err)
        self.assertIn("| 0.50 | unknown |", out)

    def test_an_answer_on_other_threads_than_asked_for_is_refused(self):
        with mock.patch.dict(os.environ, {"FAKE_THREADS": "3"}):
            status, _, err = self.scaling("--sweep", "depth", "--threads", "2")
        self.assertEqual(status, 1)
        self.assertIn("ran on 3 threads, not on 2", err)
        self.assertEqual(list((self.folder / "work/scaling").glob("*-threads-*.json")), [])

    def test_dry_run_prints_each_command_once_and_makes_nothing(self):
        status, out, _ = self.scaling("--dry-run")
        self.assertEqual(status, 0)
        lines = out.splitlines()
        self.assertEqual(len(lines), len(set(lines)))
        self.assertEqual(len(lines), 2 * STEPS)
        self.assertIn("RAYON_NUM_THREADS=1 ", lines[0])
        self.assertEqual(self.calls(), [])
        self.assertFalse((self.folder / "out").exists())

    def test_wrong_usage_names_what_is_allowed(self):
        for words, wanted in (
            (("--repeats", "0"), "--repeats = 0: must be 1 to 1000"),
            (("--threads", "1,0"), "--threads = 1,0: must be numbers of 1 to 1024"),
            (("--sweep", "height"), "points"),
        ):
            status, _, err = self.scaling(*words)
            self.assertEqual(status, 2)
            self.assertIn(wanted, err)

    def test_a_binary_that_is_not_there_is_named_with_the_cure(self):
        self.binary.unlink()
        status, _, err = self.scaling()
        self.assertEqual(status, 1)
        self.assertIn("cargo build --release", err)
        self.assertFalse((self.folder / "out").exists())


if __name__ == "__main__":
    unittest.main()
