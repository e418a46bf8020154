#!/usr/bin/env python3
"""Tests of what scripts/paper.py does to its inputs, on spheres: every degradation, every file."""

import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from isomorph_paper import PaperError, degrade, sequences, topology


def sphere(radius=1.0, centre=(0.0, 0.0, 0.0), rings=14, around=24):
    """A closed, outward mesh of a sphere: (vertices, triangles)."""
    polar = np.pi * np.arange(1, rings) / rings
    turn = 2 * np.pi * np.arange(around) / around
    grid = np.stack(
        [
            np.outer(np.sin(polar), np.cos(turn)),
            np.outer(np.sin(polar), np.sin(turn)),
            np.outer(np.cos(polar), np.ones(around)),
        ],
        axis=2,
    ).reshape(-1, 3)
    vertices = radius * np.concatenate([grid, [[0, 0, 1], [0, 0, -1]]]) + np.asarray(centre)
    north, south = len(grid), len(grid) + 1
    triangles = []
    for k in range(around):
        right = (k + 1) % around
        triangles.append((north, k, right))
        for ring in range(rings - 2):
            a, b = ring * around + k, ring * around + right
            triangles += [(a, a + around, b + around), (a, b + around, b)]
        last = (rings - 2) * around
        triangles.append((last + k, south, last + right))
    return vertices, np.array(triangles)


def two_spheres(distance):
    """Two unit spheres as one mesh, their centres so far apart."""
    one, triangles = sphere(rings=24, around=40)
    other = one + [distance, 0, 0]
    return np.concatenate([one, other]), np.concatenate([triangles, triangles + len(one)])


class Degradations(unittest.TestCase):
    def setUp(self):
        self.rng = degrade.generator(7, "tests")
        self.vertices, self.triangles = sphere(rings=26, around=44)
        self.pairs = degrade.same_vertex_pairs(len(self.vertices), 1000, self.rng)

    def test_the_same_seed_and_purpose_give_the_same_numbers_and_others_do_not(self):
        draw = lambda *of: degrade.generator(*of).random()
        self.assertEqual(draw(1, "a"), draw(1, "a"))
        self.assertNotEqual(draw(1, "a"), draw(2, "a"))
        self.assertNotEqual(draw(1, "a"), draw(1, "b"))

    def test_pairs_are_of_different_vertices_with_themselves(self):
        self.assertEqual(len(np.unique(self.pairs[:, 0])), 1000)
        np.testing.assert_array_equal(self.pairs[:, 0], self.pairs[:, 1])
        with self.assertRaisesRegex(PaperError, "11 pairs wanted, 10 vertices there"):
            degrade.same_vertex_pairs(10, 11, self.rng)

    def test_exactly_the_share_is_swapped_and_nothing_else_changes(self):
        for share in (0, 0.01, 0.05, 0.2):
            local = degrade.locally_swapped(self.pairs, self.vertices, share, self.rng)
            far = degrade.globally_swapped(self.pairs, share, self.rng)
            for swapped in (local, far):
                np.testing.assert_array_equal(swapped[:, 0], self.pairs[:, 0])
                wrong = swapped[:, 1] != self.pairs[:, 1]
                self.assertEqual(wrong.sum(), round(share * 1000))
            # A permutation loses no target.
            np.testing.assert_array_equal(np.sort(far[:, 1]), np.sort(self.pairs[:, 1]))

    def test_larger_shares_of_one_seed_hold_the_smaller_ones(self):
        wrong = []
        for share in (0.05, 0.1):
            rng = degrade.generator(3, "nested")
            swapped = degrade.locally_swapped(self.pairs, self.vertices, share, rng)
            wrong.append(set(np.flatnonzero(swapped[:, 1] != self.pairs[:, 1])))
        self.assertLess(wrong[0], wrong[1])

    def test_the_fifth_neighbour_is_the_fifth_by_distance_among_the_known_targets(self):
        # On a line of growing steps the neighbours of 0 are 1, 2, 3, ... in order; vertex 6 is
        # not of a known pair, so the fifth neighbour of pair 0 is vertex 5 and of pair 5 vertex 0.
        target = np.zeros((7, 3))
        target[:, 0] = [0, 1, 3, 6, 10, 15, 0.1]
        pairs = np.stack([np.arange(6)] * 2, axis=1)
        swapped = degrade.locally_swapped(pairs, target, 1.0, self.rng)
        self.assertEqual(swapped[0].tolist(), [0, 5])
        self.assertEqual(swapped[5].tolist(), [5, 0])
        # From 10: 6 at 4, 15 at 5, 3 at 7, 1 at 9, 0 at 10.
        self.assertEqual(swapped[4].tolist(), [4, 0])

    def test_impossible_shares_are_refused(self):
        with self.assertRaisesRegex(PaperError, "must be 0 to 1"):
            degrade.globally_swapped(self.pairs, 1.5, self.rng)
        with self.assertRaisesRegex(PaperError, "one pair"):
            degrade.globally_swapped(self.pairs[:10], 0.1, self.rng)
        with self.assertRaisesRegex(PaperError, "neighbour 5 of 5 pairs"):
            degrade.locally_swapped(self.pairs[:5], self.vertices, 0.5, self.rng)

    def test_clouds_have_the_counts_asked_for_and_their_pairs_correspond(self):
        moved = 2 * self.vertices + [0, 0, 5]
        made = degrade.corresponding_clouds(
            (self.vertices, moved), self.triangles, (5000, 2000), 300, self.rng
        )
        self.assertEqual((len(made.source[0]), len(made.target[0])), (5000, 2000))
        self.assertEqual(len(np.unique(made.pairs, axis=0)), 300)
        source, target = made.source[0][made.pairs[:, 0]], made.target[0][made.pairs[:, 1]]
        # The motion is linear, so it holds between vertices too, to rounding.
        np.testing.assert_allclose(target, 2 * source + [0, 0, 5], atol=1e-12)
        # A sphere's normals are its points; 24 rings are within 0.02 of that.
        np.testing.assert_allclose(made.source[1], degrade.unit(made.source[0]), atol=0.02)

    def test_a_sparser_target_is_part_of_the_denser_one(self):
        clouds = [
            degrade.corresponding_clouds(
                (self.vertices, self.vertices),
                self.triangles,
                (5000, count),
                100,
                degrade.generator(1, "sparse"),
            )
            for count in (5000, 2000)
        ]
        np.testing.assert_array_equal(clouds[0].target[0][:2000], clouds[1].target[0])
        np.testing.assert_array_equal(clouds[0].source[0], clouds[1].source[0])

    def test_samples_are_uniform_by_area(self):
        places = degrade.sampled(self.vertices, self.triangles, 40_000, self.rng).on(self.vertices)
        # A band of a sphere has the area of its height; 40,000 samples scatter by 0.0025.
        for low, high in ((-1, -0.5), (-0.25, 0.25), (0.5, 1)):
            share = ((places[:, 2] > low) & (places[:, 2] < high)).mean()
            self.assertAlmostEqual(share, (high - low) / 2, delta=0.012)

    def test_holes_are_empty_and_in_different_places(self):
        frames = (self.vertices, self.vertices)
        cut = degrade.different_holes(frames, self.triangles, 3, 0.4, self.rng)
        keep = [lambda p, n, side=side: degrade.outside(side, p, n) for side in cut]
        made = degrade.corresponding_clouds(
            frames, self.triangles, (4000, 4000), 200, self.rng, tuple(keep)
        )
        gaps = []
        for (points, _), side in zip((made.source, made.target), cut, strict=True):
            self.assertEqual(len(points), 4000)
            for hole in side:
                away = np.linalg.norm(points - hole.centre, axis=1)
                self.assertGreaterEqual(away.min(), 0.4)
            gaps.append(np.array([hole.centre for hole in side]))
        between = np.linalg.norm(gaps[0][:, None] - gaps[1][None], axis=2)
        self.assertGreaterEqual(between.min(), 2.2 * 0.4)
        # What one lacks the other has: 4000 points leave no cap of radius 0.3 empty.
        for centre in gaps[0]:
            away = np.linalg.norm(made.target[0] - centre, axis=1)
            self.assertLess(away.min(), 0.3)

    def test_a_hole_leaves_the_other_side_of_a_thin_limb(self):
        hole = degrade.Hole(np.zeros(3), np.array([0.0, 0, 1]), 1.0)
        points = np.array([[0.1, 0, 0], [0.1, 0, -0.2], [2, 0, 0]])
        normals = np.array([[0.0, 0, 1], [0, 0, -1], [0, 0, 1]])
        self.assertEqual(hole.holds(points, normals).tolist(), [True, False, False])

    def test_holes_that_do_not_fit_are_refused(self):
        with self.assertRaisesRegex(PaperError, "do not fit"):
            degrade.different_holes((self.vertices,) * 2, self.triangles, 50, 0.5, self.rng)


class Topology(unittest.TestCase):
    def test_the_winding_number_counts_the_parts_that_enclose_a_point(self):
        vertices, triangles = two_spheres(1.0)
        points = np.array([[0.5, 0, 0], [-0.7, 0, 0], [1.7, 0.1, 0], [0, 0, 3.0]])
        found = topology.winding_number(vertices, triangles, points)
        # Solid angles of a closed mesh sum to whole turns but for rounding.
        np.testing.assert_allclose(found, [2, 1, 1, 0], atol=1e-9)

    def test_only_what_lies_within_another_part_is_not_outside(self):
        vertices, triangles = two_spheres(1.0)
        rng = degrade.generator(0, "overlap")
        places = degrade.sampled(vertices, triangles, 1500, rng)
        normals = places.on(sequences.vertex_normals(vertices, triangles))
        points = places.on(vertices)
        kept = topology.on_outside(vertices, triangles, points, normals)
        # Of unit spheres 1 apart a quarter of each lies in the other; samples scatter by 0.011.
        self.assertAlmostEqual(kept.mean(), 0.75, delta=0.05)
        nearer = np.minimum(*(np.linalg.norm(points - [x, 0, 0], axis=1) for x in (0, 1)))
        # The facets of a mesh of 24 rings are up to 0.01 within the sphere.
        self.assertTrue((nearer[kept] > 0.98).all())
        self.assertTrue((nearer[~kept] < 1.01).all())

    def test_the_feet_meet_in_the_last_frame_and_the_volume_stays(self):
        legs = np.concatenate([sphere(0.1, (x, y, 0))[0] for x in (-0.2, 0.2) for y in (-0.7, 0.3)])
        triangles = sphere()[1]
        parts = len(legs) // 4
        mesh = np.concatenate([triangles + k * parts for k in range(4)])
        human = sequences.Sequence(Path("human"), np.repeat(legs[None], 30, axis=0), mesh)
        frames = topology.feet_together(human)
        self.assertEqual(len(frames), topology.RAISED + 1)
        np.testing.assert_array_equal(frames[0], legs)
        np.testing.assert_array_equal(frames[-1][parts : 2 * parts], legs[parts : 2 * parts])
        feet = frames[-1][:parts, 0].max() - frames[-1][2 * parts : 3 * parts, 0].min()
        self.assertGreater(feet, 0.05)
        volumes = [sequences.volume(frame, mesh) for frame in (frames[0], frames[-1])]
        # Exact for a linear shear; the curve bends facets of a tenth of a metre by under 1 %.
        self.assertAlmostEqual(volumes[1] / volumes[0], 1, delta=0.01)


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.vertices, self.triangles = sphere()

    def test_a_sequence_is_read_as_it_was_written(self):
        frames = np.stack([self.vertices * scale for scale in (1.0, 1.5, 2.0)])
        read = sequences.write_sequence(self.folder / "ball.anime", frames, self.triangles)
        self.assertEqual(read.name, "ball")
        # float32 of numbers up to 2.
        np.testing.assert_allclose(read.frames, frames, atol=5e-7)
        np.testing.assert_array_equal(read.triangles, self.triangles)
        self.assertAlmostEqual(read.volume(2) / read.volume(0), 8, delta=1e-5)
        self.assertEqual([path.name for path in self.folder.iterdir()], ["ball.anime"])

    def test_what_is_no_sequence_is_refused_by_name(self):
        for data in (b"", b"not a sequence at all", np.array([2, 9, 9], "<i4").tobytes()):
            path = self.folder / "bad.anime"
            path.write_bytes(data)
            with self.assertRaisesRegex(PaperError, "bad.anime: .*not an .anime"):
                sequences.read_sequence(path)
        with self.assertRaisesRegex(PaperError, "cannot be read.*--sequences"):
            sequences.read_sequence(self.folder / "none.anime")

    def test_clouds_and_meshes_are_binary_ply_of_the_size_their_header_says(self):
        normals = sequences.vertex_normals(self.vertices, self.triangles)
        sequences.write_cloud(self.folder / "cloud.ply", self.vertices, normals)
        sequences.write_mesh(self.folder / "mesh.ply", self.vertices, self.triangles)
        header, _, body = (self.folder / "cloud.ply").read_bytes().partition(b"end_header\n")
        self.assertIn(b"element vertex %d\n" % len(self.vertices), header)
        rows = np.frombuffer(body, "<f4").reshape(-1, 6)
        np.testing.assert_array_equal(rows[:, :3], self.vertices.astype("<f4"))
        np.testing.assert_array_equal(rows[:, 3:], normals.astype("<f4"))
        header, _, body = (self.folder / "mesh.ply").read_bytes().partition(b"end_header\n")
        self.assertIn(b"element face %d\n" % len(self.triangles), header)
        faces = np.frombuffer(body[12 * len(self.vertices) :], [("n", "u1"), ("of", "<i4", 3)])
        self.assertTrue((faces["n"] == 3).all())
        np.testing.assert_array_equal(faces["of"], self.triangles)

    def test_pairs_have_their_header_and_one_line_each(self):
        sequences.write_pairs(self.folder / "pairs.csv", np.array([[3, 4], [0, 9]]))
        text = (self.folder / "pairs.csv").read_text()
        self.assertEqual(text, "source_index,target_index\n3,4\n0,9\n")


if __name__ == "__main__":
    unittest.main()
