"""Tests of peers.py; the packages of PyPI are needed by none of them."""

import contextlib
import io
import json
import sys
import tempfile
import textwrap
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import as_rigid
import peers
from isomorph_paper import PaperError, compact, experiments
from isomorph_paper import peers as registrations
from isomorph_paper.sequences import read_sequence, rms, write_sequence
from test_bow import turned
from test_degrade import sphere


def turning(folder: Path, name: str = "turning") -> Path:
    """A rod that turns by .8 radians over nine frames."""
    ball, triangles = sphere()
    rod = ball * [0.3, 0.3, 3]
    frames = np.stack([turned(rod, 0.1 * k) for k in range(9)])
    write_sequence(folder / f"{name}.anime", frames, triangles)
    return folder / f"{name}.anime"


def package(folder: Path, name: str, text: str) -> None:
    """A module of this name, with the version that a package would have."""
    (folder / f"{name}.py").write_text(textwrap.dedent(text))
    info = folder / f"{name}-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")


class Shapes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.sequence = read_sequence(turning(Path(folder.name)))
        self.shapes = peers.shapes_of(self.sequence, (0, 8))

    def test_pairs_name_the_same_vertex_of_a_target_in_another_order(self):
        shapes, size = self.shapes, self.sequence.unit_scale((0, 8))
        source, target = shapes.pairs.T
        self.assertLess(np.mean(source == target), 0.2)
        truth = size * self.sequence.frames[8]
        np.testing.assert_allclose(shapes.target[target], truth[source])
        # The triangles of the target are those of its own order.
        np.testing.assert_allclose(
            shapes.target[shapes.target_triangles], truth[self.sequence.triangles]
        )

    def test_thinned_points_have_mean_0_and_size_1_and_the_pairs_first(self):
        pairs = self.shapes.pairs[:40]
        given = registrations.Shapes(**{**vars(self.shapes), "pairs": pairs})
        drift = registrations.drift(given, points=100)
        self.assertEqual((len(drift.source), len(drift.target), drift.pairs), (100, 100, 40))
        np.testing.assert_allclose(drift.all_source.mean(axis=0), 0, atol=1e-12)
        self.assertAlmostEqual(rms(drift.all_source), 1)
        np.testing.assert_allclose(
            drift.back(drift.source[:40]), given.source[pairs[:, 0]], atol=1e-12
        )
        np.testing.assert_allclose(
            drift.back(drift.target[:40]), given.target[pairs[:, 1]], atol=1e-12
        )
        self.assertEqual(len(np.unique(drift.source, axis=0)), 100)

    def test_no_more_points_are_taken_than_there_are(self):
        drift = registrations.drift(self.shapes, points=10**6)
        self.assertEqual(len(drift.source), len(self.shapes.source))

    def test_the_kernel_is_the_gaussian_of_the_distance(self):
        found = registrations.gaussian(np.array([[0.0, 0, 0]]), np.array([[3.0, 0, 4]]), 5.0)
        self.assertAlmostEqual(found[0, 0], np.exp(-0.5))


class Command(unittest.TestCase):
    """The whole command with packages that only pretend, in this very interpreter."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        turning(self.folder)
        subject = experiments.Subject("turning", ((0, 8),))
        for patch in (
            mock.patch.object(experiments, "PROTOCOL", (subject,)),
            mock.patch.object(as_rigid, "SAMPLES", 2_000),
            mock.patch.object(as_rigid, "TIMES", 9),
            mock.patch.object(peers, "interpreter", lambda environment: Path(sys.executable)),
            mock.patch.dict("os.environ", {"PYTHONPATH": str(self.folder)}),
        ):
            patch.start()
            self.addCleanup(patch.stop)
        mean = {
            "surface": {"chamfer_squared": 0.5e-3, "hausdorff": 0.25},
            "carried": {"tracked_rmse": 0.03, "aligned": {"tracked_rmse": 0.02}},
        }
        entry = {"sequence": "turning", "from": 0, "to": 8, "method": "default"}
        entry |= {"training_seconds": 120.0}
        entry["evaluation"] = {"frames": [{"frame": 4, "time": 0.5, **mean}], "mean": mean}
        self.protocol = self.folder / "default.json"
        compact.write(self.protocol, compact.pack([entry], {"method": "default"}))
        # All packages are there and broken, unless a test puts one in order.
        for name in ("pycpd", "probreg", "trimesh"):
            package(self.folder, name, f"raise ImportError('no {name} today')")

    def arrives(self, at: str) -> None:
        """A pycpd whose kernels have the right sum, or not."""
        (self.folder / "pycpd.py").write_text(
            textwrap.dedent(
                f"""
                import numpy as np
                print("packages may print")
                class DeformableRegistration:
                    def __init__(self, X, Y):
                        self.X, self.Y, self.beta = X, Y, 2.0
                    def register(self):
                        {at}
                """
            )
        )

    def call(self, *words: str) -> tuple[int, str]:
        said = io.StringIO()
        words = ["--sequences", str(self.folder), "--out", str(self.folder / "out"), *words]
        words += ["--protocol", str(self.protocol)]
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return peers.main(words), said.getvalue()

    def row(self) -> dict:
        (row,) = json.loads((self.folder / "out/data.json").read_text())["rows"]
        return row

    def test_a_registration_that_moves_nothing_arrives_as_far_as_the_shapes_are_apart(self):
        self.arrives("self.W = np.zeros_like(self.Y)")
        status, said = self.call()
        self.assertEqual(status, 0, said)
        row = self.row()
        self.assertEqual(row["frames"], [4])
        self.assertAlmostEqual(row["cpd"]["arrival"], row["lines"]["arrival"], places=6)
        self.assertGreater(row["cpd"]["vertices"], row["lines"]["vertices"])
        self.assertGreaterEqual(row["cpd"]["cpu_seconds"], 0)
        table = (self.folder / "out/table.md").read_text()
        self.assertIn("| 0.500 / 0.250 / 3.00 / 2.00 |", table)
        self.assertIn("| 120 |", table)
        self.assertIn("* `cpd`: pycpd 1.2; defaults of the package", table)
        self.assertIn("* `cpd-pairs` is left out: ImportError: no probreg today.", table)
        (self.folder / "out/table.md").unlink()
        self.assertEqual(self.call("--table")[0], 0)
        self.assertEqual((self.folder / "out/table.md").read_text(), table)

    def test_a_registration_that_knows_the_way_gives_the_straight_lines(self):
        way = self.folder / "way.npy"
        self.arrives(
            "from isomorph_paper.peers import gaussian; K = gaussian(self.Y, self.Y, self.beta); "
            f"self.W = np.linalg.lstsq(K, np.load({str(way)!r}), rcond=None)[0]"
        )
        sequence = read_sequence(self.folder / "turning.anime")
        drift = registrations.drift(peers.shapes_of(sequence, (0, 8)))
        # Rows of the thinned source, found again among all.
        rows = [int(np.argmin(((drift.all_source - y) ** 2).sum(1))) for y in drift.source]
        truth = sequence.unit_scale((0, 8)) * sequence.frames[8]
        np.save(way, ((truth - drift.centre) / drift.size)[rows] - drift.source)
        self.assertEqual(self.call("--only", "cpd")[0], 0)
        row = self.row()
        # A rotation of a rod, by smooth kernels as wide as twice the shape.
        self.assertLess(row["cpd"]["arrival"], 0.02 * row["lines"]["arrival"])
        self.assertAlmostEqual(row["cpd"]["vertices"], row["lines"]["vertices"], places=3)

    def test_one_that_fails_or_gives_nonsense_is_told_under_the_table(self):
        for at, reason in (
            ("raise ValueError('does not converge')", "ValueError: does not converge"),
            ("self.W = np.full_like(self.Y, np.nan)", "not all of them finite"),
        ):
            self.arrives(at)
            status, said = self.call("--only", "cpd")
            self.assertEqual(status, 0, said)
            self.assertIn(reason, self.row()["cpd"]["failed"])
            table = (self.folder / "out/table.md").read_text()
            self.assertIn("* `cpd` failed on turning 0-8:", table)

    def test_without_any_package_the_message_names_all_and_how_to_get_them(self):
        status, said = self.call()
        self.assertEqual(status, 1)
        self.assertIn("cpd: left out, pycpd cannot be loaded (ImportError: no pycpd today)", said)
        self.assertIn("-m pip install numpy pycpd probreg trimesh", said)
        self.assertFalse((self.folder / "out").exists())

    def test_strange_options_are_refused(self):
        self.arrives("self.W = np.zeros_like(self.Y)")
        for words, told in (
            (("--only", "icp2"), "no registration has this text; there are cpd, cpd-pairs"),
            (("--every", "0"), "--every = 0: must be 1 or more"),
        ):
            with self.assertRaises(SystemExit) as ended:
                self.call(*words)
            self.assertEqual(ended.exception.code, 2, told)
        status, said = self.call("--every", "8")
        self.assertEqual(status, 1)
        self.assertIn("--every = 8: no frame of turning 0-8 is left", said)


class Environment(unittest.TestCase):
    def test_one_that_is_there_is_taken_as_it_is(self):
        with tempfile.TemporaryDirectory() as name:
            python = Path(name) / "bin/python"
            python.parent.mkdir()
            python.touch()
            with mock.patch.object(sys, "platform", "linux"):
                self.assertEqual(peers.interpreter(Path(name)), python)

    def test_one_that_cannot_be_made_is_told(self):
        with tempfile.TemporaryDirectory() as name:
            place = Path(name) / "file"
            place.touch()
            said = io.StringIO()
            with contextlib.redirect_stderr(said), self.assertRaises(PaperError) as told:
                peers.interpreter(place)
            self.assertIn("no environment can be made there", str(told.exception))


if __name__ == "__main__":
    unittest.main()
