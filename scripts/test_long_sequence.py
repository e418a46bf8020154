#!/usr/bin/env python3
"""Tests of scripts/long_sequence.py."""

import contextlib
import io
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np

import long_sequence
from isomorph_paper.sequences import write_sequence


class LongSequence(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_script(self, *words):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = long_sequence.main(["--sequences", str(self.folder), *words, str(self.folder / "out")])
        return status, out.getvalue() + err.getvalue()

    def test_clouds_are_the_same_places_at_even_times(self):
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
        faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
        write_sequence(self.folder / long_sequence.NAME, np.stack([corners, corners + 1, corners + 3]), faces)
        status, said = self.run_script("--keys", "5", "--points", "64")
        self.assertEqual(status, 0, said)
        names = sorted(path.name for path in (self.folder / "out").iterdir())
        self.assertEqual(names, [f"cloud-{key}.ply" for key in range(5)] + ["recipe.toml"])

        def points(key):
            data = (self.folder / f"out/cloud-{key}.ply").read_bytes().split(b"end_header\n")[1]
            return np.frombuffer(data, "<f4").reshape(64, 6)[:, :3]

        # Half-way between frames that are 1 and 2 apart.
        for key, shift in enumerate((0, 0.5, 1, 2, 3)):
            self.assertTrue(np.allclose(points(key) - points(0), shift, atol=1e-6))

    def test_a_missing_sequence_is_an_error(self):
        status, said = self.run_script()
        self.assertEqual(status, 1)
        self.assertIn(long_sequence.NAME, said)


if __name__ == "__main__":
    unittest.main()
