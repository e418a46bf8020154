#!/usr/bin/env python3
"""Tests of scripts/matching.py: inputs, truth and table, with a program that answers exactly."""

import json
import sys
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import matching
from isomorph_paper import PaperError, cycles, sequences
from test_degrade import sphere

# Pairs every source vertex with the target vertex at the same place but for 3 along x.
PROGRAM = f"""#!{sys.executable}
import json, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
import numpy as np, matching
source, target = (matching.read_vertices(Path(name)) for name in sys.argv[2:4])
nearest = [int(np.argmin(((target - [3, 0, 0] - x) ** 2).sum(1))) for x in source]
rows = [f"{{i}},{{j}},1.0" for i, j in enumerate(nearest)]
Path("pairs.csv").write_text("\\n".join(["source_index,target_index,confidence", *rows]) + "\\n")
ends = dict(median=0.0, quantile_95=0.0)
print(json.dumps(dict(coverage=dict(source=1.0, target=1.0), cycle=dict(source=ends), seconds=0.5)))
"""


class Matching(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        vertices, triangles = sphere()
        frames = np.stack([vertices, vertices + [3, 0, 0]])
        self.sequence = sequences.write_sequence(self.folder / "ball.anime", frames, triangles)
        self.program = self.folder / "program"
        self.program.write_text(PROGRAM)
        self.program.chmod(0o755)

    def test_the_true_vertices_of_a_mesh_in_another_order_have_no_error(self):
        options = SimpleNamespace(binary=str(self.program), seed=0)
        found = matching.measure(self.sequence, (0, 1), matching.meshes, options)
        self.assertEqual((found["pairs"], found["right"]), (found["of"], 1.0))
        # Positions are float32: 1e-6 is a few of its roundings at 4.
        self.assertLess(found["greatest"], 1e-6)
        self.assertGreater(found["moved"], 0.5)

    def test_the_target_has_the_same_triangles_in_another_order_of_vertices(self):
        truth = matching.meshes(self.sequence, (0, 1), self.folder, 0)
        target = matching.read_vertices(self.folder / "target.ply")
        self.assertFalse(np.allclose(target, truth))
        np.testing.assert_allclose(np.sort(target, axis=0), np.sort(truth, axis=0), atol=1e-6)

    def test_clouds_are_drawn_independently_and_their_truth_lies_on_the_target(self):
        truth = matching.clouds(self.sequence, (0, 1), self.folder, 0)
        source = matching.read_vertices(self.folder / "source.ply")
        target = matching.read_vertices(self.folder / "target.ply")
        self.assertEqual(len(source), matching.POINTS)
        np.testing.assert_allclose(source + [3, 0, 0], truth, atol=1e-5)
        self.assertFalse(np.allclose(target, truth))

    def test_a_program_that_fails_is_named_with_its_reason(self):
        self.program.write_text("#!/bin/sh\necho 'error: no' >&2\nexit 1\n")
        matching.meshes(self.sequence, (0, 1), self.folder, 0)
        with self.assertRaisesRegex(PaperError, "match source.ply target.ply.*error: no"):
            matching.matched(str(self.program), self.folder, 0)

    def test_the_table_has_a_row_for_each_and_a_dash_for_what_has_no_answer(self):
        keys = (key for key, _, _ in matching.COLUMNS)
        found = {key: 0.5 for key in keys} | {"pairs": 7, "right": None}
        row = {"sequence": "fox", "from": 0, "to": 9, "inputs": "clouds", "found": found}
        machine = {"processor": "a processor", "cores": 2}
        how = {"command": "a command", "date": "2001-01-01T00:00:00Z", "machine": machine}
        text = matching.markdown({"rows": [json.loads(json.dumps(row))], **how})
        self.assertIn("| fox 0-9 | clouds | 7 | - | 0.5000 |", text)
        self.assertIn("Made by `a command` on 2001-01-01, a processor, 2 cores.", text)

    def test_a_cycle_that_does_not_close_is_dropped_and_others_stay(self):
        x = np.arange(20.0)[:, None] * [1, 0, 0]
        clouds = [x, x + [0, 1, 0], x + [0, 2, 0]]
        same = np.stack([np.arange(20)] * 2, axis=1)
        wrong = same.copy()
        wrong[3, 1] = 7
        for bad, check, hop in (((0, 1), cycles.first_hop, 0), ((1, 2), cycles.second_hop, 1)):
            pairs = {each: wrong if each == bad else same for each in cycles.HOPS}
            miss, near = check(pairs, clouds)
            self.assertEqual(np.flatnonzero(miss > 0.5).tolist(), [3], hop)
            self.assertEqual(near.max(), 0.0)
        # All where the direct pairs are wrong: three pairs do not say which of them is.
        shifted = np.stack([np.arange(20), np.roll(np.arange(20), 5)], axis=1)
        miss, _ = cycles.first_hop({**dict.fromkeys(cycles.HOPS, same), (0, 2): shifted}, clouds)
        self.assertGreater(miss.min(), 1.0)

    def test_a_view_shows_what_faces_it(self):
        whole, half = (cycles.seen(self.sequence, 0, view) for view in (None, 90))
        self.assertEqual(len(whole.weights), cycles.POINTS)
        share = len(half.weights) / cycles.POINTS
        self.assertTrue(0.5 < share < 0.6, share)
        # Of a sphere the half towards z.
        self.assertGreater(half.on(self.sequence.frames[0])[:, 2].mean(), 0.2)

    def test_the_table_of_cycles_names_views_and_shares(self):
        row = {"sequence": "fox", "frames": [0, 1, 2], "views": [0, 60, 120], "hop": [1, 2], "pairs": 9, "wrong": 0.5,
               "checked": 1.0, "dropped": 0.0, "of_them_wrong": None, "wrong_after": 0.5}
        line = cycles.markdown([row])[-1]
        self.assertEqual(
            line, "| fox 0, 1, 2 | 0°, 60°, 120° | 1-2 | 9 | 50.0 % | 100.0 % | 0.0 % | - | 50.0 % |")


if __name__ == "__main__":
    unittest.main()
