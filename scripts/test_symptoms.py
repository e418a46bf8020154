"""Tests of the picture of symptoms; they need no isomorph."""

import tempfile
import unittest
from pathlib import Path

import numpy as np

import symptoms
from gallery import read_ply


class Symptoms(unittest.TestCase):
    def test_every_row_has_its_files_its_number_and_two_different_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            rows = symptoms.symptoms(Path(folder))
            for row in rows:
                self.assertTrue(all(Path(shape).is_file() for shape in row.shapes), row.text)
                self.assertNotEqual(row.wrong, row.right)
            self.assertEqual([row.number for row in rows], list(range(1, len(rows) + 1)))
            guide = Path(symptoms.ROOT / "src/guide/troubleshooting.md").read_text("utf-8")
            for row in rows:
                self.assertIn(f"{row.text} (picture, {row.number})", guide)

    def test_the_faults_are_what_they_say(self):
        with tempfile.TemporaryDirectory() as folder:
            work = Path(folder)
            file = symptoms.clouds(work, "strays", symptoms.strays)[0]
            self.assertEqual(len(np.loadtxt(file)), 12_150)
            rows = np.loadtxt(symptoms.clouds(work, "unoriented", symptoms.unoriented)[0])
            points, triangles = read_ply(Path(symptoms.FOX[0]))
            middle = points[triangles].mean(axis=(0, 1))
            outwards = ((rows[:, :3] - middle) * rows[:, 3:]).sum(axis=1) > 0
            self.assertLess(abs(outwards.mean() - 0.5), 0.03)
            turned = np.array(
                [
                    line.split()[1:]
                    for line in Path(symptoms.turned_fox(work)).read_text().splitlines()
                    if line.startswith("v ")
                ],
                float,
            )
            self.assertEqual(turned.shape, read_ply(Path(symptoms.FOX[1]))[0].shape)

    def test_the_picture_has_all_rows(self):
        corner = np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1]], float)
        mesh = corner, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        with tempfile.TemporaryDirectory() as folder:
            rows = [(row, mesh, mesh) for row in symptoms.symptoms(Path(folder))[:3]]
            path = Path(folder) / "out.png"
            symptoms.picture(rows, path)
            from PIL import Image

            self.assertEqual(Image.open(path).size, (1120, 480))


if __name__ == "__main__":
    unittest.main()
