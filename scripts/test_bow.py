"""Tests of bow.py; they need no isomorph."""

import contextlib
import io
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import bow
from isomorph_paper import sequences
from isomorph_paper.sequences import Sequence, write_sequence
from test_degrade import sphere


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


class Bows(unittest.TestCase):
    def setUp(self):
        self.start = np.array([[1.0, 0, 0], [2.0, 0, 1]])
        self.ends = (self.start, turned(self.start, 1.0))
        self.middle = turned(self.start, 0.5)

    def test_an_arc_bows_across_its_chord_by_the_sagitta(self):
        found = bow.bow(self.ends, 0.5, self.middle, self.middle, self.ends[1])
        sagitta = 1 - np.cos(0.5)
        self.assertAlmostEqual(found.across, sagitta * np.sqrt((1 + 4) / 2))
        self.assertAlmostEqual(found.along, 0)
        self.assertAlmostEqual(found.ours_across, 0)
        self.assertAlmostEqual(found.cosine, 1)

    def test_the_other_side_is_minus_one_and_the_error_twice_the_bow(self):
        line = sum(self.ends) / 2
        found = bow.bow(self.ends, 0.5, self.middle, 2 * line - self.middle, self.ends[1])
        self.assertAlmostEqual(found.cosine, -1)
        self.assertAlmostEqual(found.ours_across, 2 * found.across)

    def test_a_vertex_ahead_of_its_time_is_off_along_its_line(self):
        start, end = self.ends
        found = bow.bow(self.ends, 0.5, 0.25 * start + 0.75 * end, sum(self.ends) / 2, end)
        way = np.linalg.norm(end - start, axis=1)
        self.assertAlmostEqual(found.along, 0.25 * np.sqrt((way**2).mean()))
        self.assertAlmostEqual(found.across, 0)

    def test_what_is_missed_at_the_end_is_told_from_what_is_lost_on_the_way(self):
        miss = np.array([0.02, -0.01, 0.0])
        late = bow.bow(self.ends, 0.5, self.middle, self.middle + miss / 2, self.ends[1] + miss)
        self.assertAlmostEqual(late.ours, np.sqrt((miss**2).sum()) / 2)
        self.assertAlmostEqual(late.ours_but_for_arrival, 0)
        self.assertAlmostEqual(late.line, (1 - np.cos(0.5)) * np.sqrt((1 + 4) / 2))
        lost = bow.bow(self.ends, 0.5, self.middle, self.middle + miss, self.ends[1])
        self.assertAlmostEqual(lost.ours_but_for_arrival, lost.ours)


class Sequences(unittest.TestCase):
    def test_the_numbers_are_in_units_of_mean_area_one(self):
        vertices, triangles = sphere(8)
        frames = np.stack([turned(7.0 * vertices, angle) for angle in (0, 0.5, 1.0)])
        sequence = Sequence(Path("s"), frames, triangles)
        (found,) = bow.bows(sequence, (0, 2), [frames[1], frames[2]])
        reach = np.sqrt((vertices[:, :2] ** 2).sum(axis=1).mean())
        area = sequences.area(vertices, triangles)
        self.assertAlmostEqual(found.across, (1 - np.cos(0.5)) * reach / np.sqrt(area))

    def test_splines_are_exact_where_they_know_and_for_affine_motions(self):
        vertices, _ = sphere(8)
        pushed = vertices + 0.1 * np.sin(3 * vertices[:, ::-1])
        everything = len(np.unique(vertices, axis=0))
        self.assertLess(bow.spline_miss(vertices, pushed, everything), 1e-9)
        few = bow.spline_miss(vertices, pushed, everything // 2)
        # The whole motion is 0.12.
        self.assertTrue(1e-4 < few < 0.1, few)
        sheared = vertices @ np.array([[1.2, 0.3, 0], [0, 0.9, 0], [0.1, 0, 1]]) + 2
        self.assertLess(bow.spline_miss(vertices, sheared, 20), 1e-9)

    def test_an_obj_is_read_by_its_vertices(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "a.obj"
            path.write_text("# a\nv 1 2 3\nvn 0 0 1\nv 4 5 6 0.5 0.5 0.5\nf 1 2 1\n")
            np.testing.assert_array_equal(bow.vertices(path), [[1, 2, 3], [4, 5, 6]])

    def test_bad_frames_and_other_vertices_are_one_line(self):
        vertices, triangles = sphere(8)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "s.anime"
            sequence = write_sequence(path, np.stack([vertices] * 3), triangles)
            errors = io.StringIO()
            with contextlib.redirect_stderr(errors):
                self.assertEqual(bow.main([str(path), "0", "3", "run"]), 1)
            self.assertIn("must be frames of 0 to 2", errors.getvalue())
            with self.assertRaisesRegex(bow.PaperError, "carries 5 vertices"):
                bow.bows(sequence, (0, 2), [vertices[:5], vertices[:5]])


if __name__ == "__main__":
    unittest.main()
