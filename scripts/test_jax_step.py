#!/usr/bin/env python3
"""Tests of what needs no JAX in the yardstick; `jax_step.py --check` tests the rest."""

import contextlib
import io
import sys
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import jax_step
from isomorph_jax import YardstickError, samples
from isomorph_jax.sizes import SIZES, Samples, flop_per_step


def said(words):
    """Exit status and what went to the standard error."""
    error = io.StringIO()
    with contextlib.redirect_stderr(error):
        try:
            status = jax_step.main(words)
        except SystemExit as ended:
            status = ended.code
    return status, error.getvalue()


class Arguments(unittest.TestCase):
    def test_the_small_size_and_both_phases_are_the_defaults(self):
        options = jax_step.arguments([])
        self.assertEqual((options.size, options.repeats, options.threads), ("small", 5, None))
        self.assertEqual(jax_step.phases(options), ["warm_up", "joint"])
        self.assertEqual(jax_step.phases(jax_step.arguments(["--phase", "warm-up"])), ["warm_up"])
        self.assertEqual(jax_step.phases(jax_step.arguments(["--phase", "joint"])), ["joint"])

    def test_a_size_or_number_that_is_not_there_is_a_usage_error_that_names_what_is(self):
        status, error = said(["--size", "huge"])
        self.assertEqual(status, 2)
        for size in ("small", "shipped", "paper"):
            self.assertIn(size, error)
        status, error = said(["--repeats", "0"])
        self.assertEqual(status, 2)
        self.assertIn("--repeats = 0: must be 1 to 1000", error)

    def test_without_jax_the_error_names_the_command_that_installs_it(self):
        with mock.patch("importlib.util.find_spec", return_value=None):
            status, error = said([])
        self.assertEqual(status, 1)
        self.assertIn("jax: not installed", error)
        self.assertIn(f"pip install jax=={jax_step.TESTED}", error)

    def test_more_threads_than_cores_are_refused_and_fewer_bind_the_process(self):
        with (
            mock.patch("os.sched_getaffinity", return_value={3, 5, 7}, create=True),
            mock.patch("os.sched_setaffinity", create=True) as bind,
        ):
            self.assertEqual(jax_step.keep_to(None), 3)
            bind.assert_not_called()
            with self.assertRaisesRegex(YardstickError, "--threads = 4.*3 cores"):
                jax_step.keep_to(4)
            self.assertEqual(jax_step.keep_to(2), 2)
            bind.assert_called_once_with(0, [3, 5])


class Sizes(unittest.TestCase):
    def test_the_numbers_of_samples_are_those_counted_by_hand(self):
        # small: 2000 / 11 = 181.8, 3000 / 22 = 136.4, 1000 - 2 (181 + 136) = 366, of which 274.5.
        wanted = {
            "small": Samples(ends=181, carried=136, band=275, uniform=91, matched=1000),
            "shipped": Samples(ends=742, carried=557, band=1116, uniform=372, matched=1000),
            "paper": Samples(ends=727, carried=545, band=1092, uniform=364, matched=1000),
        }
        self.assertEqual({name: size.samples for name, size in SIZES.items()}, wanted)
        self.assertEqual([s.samples.total() for s in SIZES.values()], [1000, 4086, 4000])

    def test_the_networks_are_those_of_the_preset(self):
        paper = SIZES["paper"]
        # 39 columns: 3 coordinates, and a sine and a cosine of each in 6 octaves.
        self.assertEqual(paper.v.layers(), [(39, 256), *[(256, 256)] * 7, (256, 3)])
        self.assertEqual(paper.f.layers(), [(40, 512), *[(512, 512)] * 7, (512, 1)])

    def test_the_operations_of_a_small_step_are_those_counted_by_hand(self):
        small = SIZES["small"]
        # 39 * 128 + 5 * 128^2 + 128 * 3 products, and 40 * 128 + 5 * 128^2 + 128.
        unit_v, unit_f = 174_592, 174_336
        self.assertEqual((small.v.flop_per_point(), small.f.flop_per_point()), (unit_v, unit_f))
        jet, constants, matched = 5 * 366, 5 * 272, 5 * 2000
        warm_up = unit_v * (constants + 3 * matched + 3 * jet)
        self.assertEqual(flop_per_step(small, "warm_up"), warm_up)
        joint = warm_up + unit_v * 3 * constants + unit_f * 6 * 1000
        self.assertEqual(flop_per_step(small, "joint"), joint)
        self.assertEqual(flop_per_step(small, "joint", shared=True), joint - unit_v * constants)


class Batches(unittest.TestCase):
    def test_a_batch_holds_all_samples_where_they_belong(self):
        size = SIZES["small"].samples
        batch = samples.draw(size, np.random.default_rng(2))
        rows = {name: len(values) for name, values in batch.items()}
        self.assertEqual(rows["ends"], 2 * size.ends)
        self.assertEqual(rows["starts"], rows["stops"])
        self.assertEqual(rows["stops"], 2 * size.carried)
        self.assertEqual((rows["offsets"], rows["uniform"]), (size.band, size.uniform))
        self.assertEqual((rows["matched_source"], rows["matched_target"]), (1000, 1000))
        self.assertTrue(all(values.dtype == np.float32 for values in batch.values()))
        centres = np.where(batch["end_times"] == 0, -0.1, 0.1) * [1, 0, 0]
        # float32 of numbers below 1.
        outwards = batch["ends"] - centres
        np.testing.assert_allclose(outwards, 0.28 * batch["end_normals"], atol=1e-6)
        apart = batch["matched_target"] - batch["matched_source"]
        np.testing.assert_allclose(apart, np.tile([0.2, 0, 0], (1000, 1)), atol=1e-6)
        self.assertTrue(((batch["stops"] >= 0) & (batch["stops"] <= 1)).all())


if __name__ == "__main__":
    unittest.main()
