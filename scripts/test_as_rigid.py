"""Tests of as_rigid.py and of its interpolation; they need no isomorph."""

import contextlib
import io
import json
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import as_rigid
from isomorph_paper import compact, experiments
from isomorph_paper.rigid import AsRigid
from isomorph_paper.sequences import area, write_sequence
from test_bow import turned
from test_degrade import sphere


def bent(points: np.ndarray, angle: float) -> np.ndarray:
    """A rod from z = -3 to 3 whose middle line becomes an arc of this angle, as long as before."""
    if angle == 0:
        return points
    radius = 6 / angle
    turn = points[:, 2] / radius
    away = radius - points[:, 0]
    return np.stack([radius - away * np.cos(turn), points[:, 1], away * np.sin(turn)], axis=1)


class Interpolation(unittest.TestCase):
    def setUp(self):
        ball, self.triangles = sphere(rings=24)
        self.rod = ball * [0.3, 0.3, 3]

    def test_what_turns_rigidly_turns_evenly_and_keeps_its_size(self):
        path = AsRigid(self.rod, turned(self.rod, 2.0) + [1, 0, 0], self.triangles)
        for time in (0.0, 0.25, 0.5, 1.0):
            wanted = turned(self.rod, 2.0 * time) + [time, 0, 0]
            np.testing.assert_allclose(path.at(time), wanted, atol=1e-6)

    def test_what_grows_grows_evenly(self):
        path = AsRigid(self.rod, 3 * self.rod, self.triangles)
        np.testing.assert_allclose(path.at(0.5), 2 * self.rod, atol=1e-6)

    def test_a_rod_that_bends_goes_through_the_half_bent_one_where_lines_shorten_it(self):
        straight, arc = self.rod, bent(self.rod, 2.0)
        half = AsRigid(straight, arc, self.triangles).at(0.5)
        wanted = bent(self.rod, 1.0)
        centred = lambda points: points - points.mean(axis=0)
        miss = as_rigid.rms(centred(half) - centred(wanted))
        lines = as_rigid.rms(centred((straight + arc) / 2) - centred(wanted))
        self.assertLess(miss, 0.15 * lines)

    def test_both_ends_are_met_and_loose_vertices_follow_their_line(self):
        source = np.concatenate([self.rod, [[5.0, 5, 5]]])
        target = np.concatenate([bent(self.rod, 2.0), [[7.0, 5, 5]]])
        path = AsRigid(source, target, self.triangles)
        np.testing.assert_allclose(path.at(0.0), source, atol=1e-6)
        np.testing.assert_allclose(path.at(1.0), target, atol=1e-6)
        np.testing.assert_allclose(path.at(0.5)[-1], [6, 5, 5])

    def test_a_triangle_without_area_is_passed_over(self):
        triangles = np.concatenate([self.triangles, [[0, 0, 1]]])
        found = AsRigid(self.rod, turned(self.rod, 1.0), triangles).at(0.5)
        np.testing.assert_allclose(found, turned(self.rod, 0.5), atol=1e-6)


class Times(unittest.TestCase):
    def test_the_least_sum_is_found_and_no_frame_goes_back(self):
        # Alone, the frames would choose times 2 and 0.
        costs = np.array([[3.0, 2.0, 0.0], [0.0, 1.5, 2.0]])
        self.assertEqual(as_rigid.in_order(costs).tolist(), [2, 2])
        self.assertEqual(as_rigid.in_order(costs[::-1]).tolist(), [0, 2])

    def test_as_any_search_through_all_choices(self):
        rng = np.random.default_rng(1)
        for _ in range(20):
            costs = rng.random((3, 5))
            sums = [
                costs[0, a] + costs[1, b] + costs[2, c]
                for a in range(5)
                for b in range(a, 5)
                for c in range(b, 5)
            ]
            chosen = as_rigid.in_order(costs)
            self.assertTrue((np.diff(chosen) >= 0).all())
            self.assertAlmostEqual(costs[np.arange(3), chosen].sum(), min(sums))


class Distances(unittest.TestCase):
    def test_of_two_spheres_the_difference_of_their_radii(self):
        vertices, triangles = sphere(rings=40, around=60)
        with mock.patch.object(as_rigid, "SAMPLES", 20_000):
            found = as_rigid.distances(
                vertices, 1.2 * vertices, triangles, np.random.default_rng(0)
            )
        self.assertAlmostEqual(found[0], 2 * 0.2**2, delta=0.02 * 0.08)
        self.assertAlmostEqual(found[1], 0.2, delta=0.01)


class Command(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        ball, triangles = sphere()
        rod = ball * [0.3, 0.3, 3]
        frames = np.stack([turned(rod, 0.1 * k) for k in range(9)])
        write_sequence(self.folder / "turning.anime", frames, triangles)
        self.size = area(rod, triangles) ** -0.5
        subject = experiments.Subject("turning", ((0, 8),))
        for patch in (
            mock.patch.object(experiments, "PROTOCOL", (subject,)),
            mock.patch.object(as_rigid, "SAMPLES", 2_000),
            mock.patch.object(as_rigid, "TIMES", 9),
        ):
            patch.start()
            self.addCleanup(patch.stop)
        mean = {
            "surface": {"chamfer_squared": 0.5e-3, "hausdorff": 0.25},
            "carried": {"tracked_rmse": 0.03, "aligned": {"tracked_rmse": 0.02}},
        }
        frames = {"frame": 4, "time": 0.5, **mean}
        entry = {"sequence": "turning", "from": 0, "to": 8, "method": "default"}
        entry["evaluation"] = {"frames": [frames], "mean": mean}
        self.protocol = self.folder / "default.json"
        compact.write(self.protocol, compact.pack([entry], {"method": "default"}))

    def call(self, *words: str) -> tuple[int, str]:
        said = io.StringIO()
        words = ["--sequences", str(self.folder), "--out", str(self.folder / "out"), *words]
        words += ["--protocol", str(self.protocol)]
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return as_rigid.main(words), said.getvalue()

    def test_a_rigid_turn_is_met_where_lines_cut_the_corner(self):
        status, _ = self.call()
        self.assertEqual(status, 0)
        (row,) = json.loads((self.folder / "out/data.json").read_text())["rows"]
        self.assertEqual(row["frames"], [4])
        self.assertLess(row["as_rigid"]["vertices"], 1e-6)
        self.assertLess(row["as_rigid"]["vertices_aligned"], 1e-6)
        # The sagitta of .4 radians on both sides, of the distance from the axis, normalised.
        away = as_rigid.rms(sphere()[0][:, :2]) * 0.3 * self.size
        self.assertAlmostEqual(row["lines"]["vertices"], away * (1 - np.cos(0.4)), places=6)
        table = (self.folder / "out/table.md").read_text()
        self.assertIn("| 0.500 / 0.250 / 3.00 / 2.00 |", table)
        (self.folder / "out/table.md").unlink()
        self.assertEqual(self.call("--table")[0], 0)
        self.assertEqual((self.folder / "out/table.md").read_text(), table)

    def test_frames_that_leave_none_and_a_strange_file_are_told(self):
        status, said = self.call("--every", "8")
        self.assertEqual(status, 1)
        self.assertIn("--every = 8: no frame of turning 0-8 is left", said)
        self.protocol.write_text("{}")
        status, said = self.call()
        self.assertEqual(status, 1)
        self.assertIn("default.json: not what protocol.py writes", said)


if __name__ == "__main__":
    unittest.main()
