#!/usr/bin/env python3
"""Tests of scripts/keys.py, without isomorph: a fake one answers."""

import contextlib
import io
import json
import shutil
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np

import keys
from isomorph_paper.sequences import read_sequence, write_sequence

FAKE = """#!{python} -S
import json, os, sys
words = sys.argv[1:]
given = lambda name: words[words.index(name) + 1]
if words[0] == "train":
    recipe = open(words[1]).read()
    assert 'preset = "instant"' in recipe or 'preset = "default"' in recipe
    os.makedirs(given("--run"), exist_ok=True)
    open(given("--run") + "/metrics.jsonl", "w").write('{{"step": 1, "seconds": 1.0}}\\n{{"step": 10, "seconds": 2.5}}\\n')
    sys.exit()
if words[0] == "resume":
    assert given("--set") == "data.keys=[0, 10, 18, 28, 39, 47, 54]"
    assert "keys = [0, 10, 18, 28, 39, 47]\\n" in open(os.path.dirname(words[1]) + "/recipe.toml").read()
    open(words[1] + "/metrics.jsonl", "a").write('{{"step": 20, "seconds": 4.0}}\\n')
    sys.exit()
frames = [int(key) for key in given("--keys").split(",")]
# The error of carried vertices is a tenth of that of straight lines, and half of it at other numbers of key frames.
carried = 0.001 if len(frames) == 7 else 0.002
if "default" in words[1]:
    carried = 0.003
def metrics(error):
    return {{"chamfer": error, "chamfer_squared": error, "hausdorff": error, "tracked_rmse": error, "area_ratio": 1.0}}
segments = [{{"frames": [{{"frame": frame, "surface": metrics(0.003), "carried": metrics(carried),
    "linear": metrics(0.01), "natural": metrics(0.004), "floor": metrics(0.0)}} for frame in range(a + 1, b)]}}
    for a, b in zip(frames, frames[1:])]
print(json.dumps({{"keys": frames, "segments": segments,
    "drift": {{"mean": 0.002, "last": 0.003, "there_and_back": 1e-5}}}}))
"""


class Keys(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.binary = self.folder / "isomorph"
        self.binary.write_text(FAKE.format(python=sys.executable))
        self.binary.chmod(0o755)
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
        faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
        frames = corners[None] + 0.01 * np.arange(55)[:, None, None]
        for name in keys.SEQUENCES:
            write_sequence(self.folder / f"{name}.anime", frames, faces)

    def run_script(self, *words):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            places = ["--out", str(self.folder / "out"), "--work", str(self.folder / "work")]
            places += ["--binary", str(self.binary), "--sequences", str(self.folder)]
            status = keys.main([*words, *places])
        return status, err.getvalue()

    def test_all_rows_are_measured_once_and_the_table_has_their_ratios(self):
        status, err = self.run_script("--seeds", "2")
        self.assertEqual(status, 0, err)
        folder = self.folder / "out/keys"
        content = json.loads((folder / "data.json").read_text())
        # Two seeds and the pairs of three sequences, and three rows of 14 key frames on two of them.
        self.assertEqual(len(content["rows"]), 3 * 3 + 6)
        table = (folder / "table.md").read_text()
        self.assertIn("| bear_walk | one field | 2 | 2.5 | 0.100 | 0.25 | 1.000 | 0.400 |", table)
        # Six runs of a pair, each with its seconds.
        self.assertIn("| bear_walk | pairs | 1 | 15.0 | 0.200 | 0.50 |", table)
        self.assertIn("* one field: vertices 0.100, 0.25 of natural; CD 3.000, 0.30 of linear.", table)
        self.assertEqual(xml.fromstring((folder / "figure.svg").read_bytes()).tag[-3:], "svg")
        # What is measured already is not measured again, and the table follows from the numbers alone.
        self.binary.write_text("#!/bin/false\n")
        status, err = self.run_script("--seeds", "2")
        self.assertEqual(status, 0, err)
        (folder / "table.md").unlink()
        status, _ = self.run_script("--table")
        self.assertEqual((status, (folder / "table.md").read_text()), (0, table))

    def test_rows_of_networks_are_put_beside_the_others(self):
        self.assertEqual(self.run_script("--networks")[0], 1, "there are no others yet")
        self.run_script("--seeds", "1")
        status, err = self.run_script("--networks", "--seeds", "2")
        self.assertEqual(status, 0, err)
        folder = self.folder / "out/keys"
        content = json.loads((folder / "data.json").read_text())
        self.assertEqual(len(content["rows"]), 3 * 2 + 6 + 3 * 2)
        table = (folder / "table.md").read_text()
        self.assertIn("| bear_walk | one field | 1 | 2.5 | 0.100 |", table)
        self.assertIn("| bear_walk | networks (`default`) | 2 | 2.5 | 0.300 | 0.75 |", table)
        self.assertIn("Networks: made by `scripts/keys.py --networks --seeds 2", table)
        # Measured again, they take the place of those before.
        self.run_script("--networks", "--seeds", "1")
        self.assertEqual(len(json.loads((folder / "data.json").read_text())["rows"]), 3 * 2 + 6 + 3)

    def test_a_key_frame_is_appended_and_its_seconds_are_counted_alone(self):
        self.run_script("--seeds", "1")
        status, err = self.run_script("--grown")
        self.assertEqual(status, 0, err)
        table = (self.folder / "out/keys/table.md").read_text()
        self.assertIn("| bear_walk | one field, last key frame appended | 1 | 1.5 | 0.100 | 0.25 |", table)
        self.assertIn("| human_raise_arms | networks (`default`), last key frame appended | 1 | 1.5 | 0.300 |", table)
        self.assertNotIn("| bear_walk | networks", table)
        self.assertIn("* one field, last key frame appended: vertices 0.100, 0.25 of natural", table)
        self.assertNotIn("* networks", table)
        self.assertIn("Last key frame appended: made by `scripts/keys.py --grown", table)

    def test_rows_of_14_key_frames_are_measured_alone(self):
        self.run_script("--seeds", "1")
        shutil.rmtree(self.folder / "work")
        self.binary.write_text(self.binary.read_text().replace("else 0.002", "else 0.006"))
        status, err = self.run_script("--many")
        self.assertEqual(status, 0, err)
        folder = self.folder / "out/keys"
        self.assertEqual(len(json.loads((folder / "data.json").read_text())["rows"]), 3 * 2 + 6)
        table = (folder / "table.md").read_text()
        self.assertIn("| bear_walk | one field | 1 | 2.5 | 0.100 |", table)
        self.assertIn("| bear_walk | 14 keys, clouds, match | 2.5 | 0.600 | 1.00 |", table)
        self.assertIn("Made by `scripts/keys.py --many", table)

    def test_clouds_are_sampled_anew_at_each_key_frame_on_its_surface(self):
        options = keys.arguments(["--work", str(self.folder)])
        bench = keys.Bench(options, read_sequence(self.folder / "bear_walk.anime"))
        (first, normals), (second, _) = bench.sampled(0), bench.sampled(4)
        self.assertEqual(first.shape, (keys.POINTS, 3))
        self.assertTrue(np.allclose(np.linalg.norm(normals, axis=1), 1))
        # Each point is on a face: at the distance of it along its normal.
        on = np.einsum("ij,ij->i", first, normals)
        self.assertTrue(np.all(np.minimum(np.abs(on), np.abs(on - 3**-0.5)) < 1e-9))
        self.assertGreater(np.abs(second - 0.04 - first).max(), 0.1)

    def test_a_missing_sequence_is_an_error_and_nothing_is_written(self):
        (self.folder / "fox_survey.anime").unlink()
        status, err = self.run_script()
        self.assertEqual(status, 1)
        self.assertIn("fox_survey.anime", err)
        self.assertFalse((self.folder / "out").exists())


if __name__ == "__main__":
    unittest.main()
