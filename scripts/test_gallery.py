"""Tests of the gallery; they need no isomorph."""

import tempfile
import unittest
from pathlib import Path

import numpy as np

import gallery

VERTICES = np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1]], float)
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])

HEADER = """ply
format binary_little_endian 1.0
element vertex 4
property float x
property float y
property float z
property float nx
property float ny
property float nz
element face 4
property list uchar int vertex_indices
end_header
"""


class Gallery(unittest.TestCase):
    def test_a_ply_is_read_past_its_normals(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "a.ply"
            rows = np.hstack([VERTICES, -VERTICES]).astype("<f4").tobytes()
            faces = b"".join(b"\x03" + np.array(row, "<i4").tobytes() for row in TRIANGLES)
            path.write_bytes(HEADER.encode() + rows + faces)
            vertices, triangles = gallery.read_ply(path)
        np.testing.assert_array_equal(vertices, VERTICES)
        np.testing.assert_array_equal(triangles, TRIANGLES)

    def test_the_view_is_a_rotation_with_the_widest_axis_across(self):
        view = gallery.view_of([(VERTICES, TRIANGLES)])
        np.testing.assert_allclose(view @ view.T, np.eye(3), atol=1e-12)
        self.assertAlmostEqual(np.linalg.det(view), 1.0)
        self.assertEqual(np.abs(view[0]).argmax(), 0)

    def test_every_row_and_column_is_drawn_into_one_picture(self):
        rows = [(label, [(VERTICES, TRIANGLES)] * 3) for label in ("truth", "a method")]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "gallery.png"
            gallery.gallery(rows, np.array([0, 0.5, 1]), path)
            self.assertEqual(path.read_bytes()[:4], b"\x89PNG")


if __name__ == "__main__":
    unittest.main()
