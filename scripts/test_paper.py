#!/usr/bin/env python3
"""Tests of scripts/paper.py, without isomorph: python3 -m unittest discover scripts

A fake `isomorph` writes what `compare` would, so that whole experiments run in seconds. Needs
numpy, and matplotlib for the figures.
"""

import contextlib
import io
import json
import os
import shlex
import shutil
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import fake_isomorph
import paper
import recipe_keys
from isomorph_paper import PaperError, command_line, compact, experiments, inputs, runs, sequences
from test_degrade import sphere

EXPECTED_FILES = {"table.md", "data.json", "figure.svg"}


class Declarations(unittest.TestCase):
    def test_the_paper_is_covered(self):
        names = {experiment.name for experiment in experiments.EXPERIMENTS}
        wanted = "errors correspondences local-swaps global-swaps level-set divergence smoothness "
        wanted += "sparse incomplete topology no-correspondences ablation "
        wanted += "instant-parts instant-inputs instant-volume large-turns"
        self.assertEqual(names, set(wanted.split()))

    def test_labels_are_unique_and_survive_the_command_line(self):
        for experiment in experiments.EXPERIMENTS:
            for size in (experiments.SMALL, experiments.FULL):
                labels = [row.label for row in experiment.rows_at(size)]
                self.assertEqual(len(labels), len(set(labels)), experiment.name)
                for label in labels:
                    self.assertNotRegex(label, "[=,|]", experiment.name)

    def test_keys_are_those_of_the_recipe(self):
        known = recipe_keys.declared()
        for experiment in experiments.EXPERIMENTS:
            rows = [key for row in experiment.rows for key in row.keys]
            for key in [*rows, *experiment.keys, *inputs.keys_of(Path("folder"))]:
                self.assertIn(key.partition("=")[0], known)

    def test_every_key_acts_in_the_geometry_of_its_row(self):
        for experiment in experiments.EXPERIMENTS:
            for size in (experiments.SMALL, experiments.FULL):
                for row in experiment.rows_at(size):
                    words = runs.variant(row, experiment, size, ()).partition("=")[2].split(",")
                    idle = recipe_keys.idle(words[0], words[1:])
                    self.assertEqual(idle, [], f"{experiment.name}: {row.label}")

    def test_sweeps_say_where_each_row_is_and_inputs_have_makers(self):
        for experiment in experiments.EXPERIMENTS:
            for row in experiment.rows:
                self.assertEqual(row.at is not None, experiment.figure == "sweep", row)
                if row.input:
                    self.assertIn(row.input.kind, inputs.MAKERS)
            if any(row.input for row in experiment.rows):
                self.assertTrue(all(len(subject.pairs) == 1 for subject in experiment.subjects))

    def test_a_row_of_one_pair_is_called_first_and_alone(self):
        errors = experiments.named("errors")
        calls = runs.calls(errors, experiments.FOX, Path("fox.anime"), experiments.SMALL)
        self.assertEqual([row.label for row in calls[0].rows], ["nfgp"])
        self.assertEqual([call.pairs for call in calls], [((0, 18),), ((0, 18), (20, 47))])
        bear = runs.calls(errors, experiments.BEAR, Path("bear.anime"), experiments.SMALL)
        self.assertEqual(len(bear), 1)
        self.assertNotIn("nfgp", [row.label for row in bear[0].rows])


class Experiments(unittest.TestCase):
    """Whole experiments on spheres that bear the names of our sequences."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        vertices, triangles = sphere(rings=26, around=44)
        growing = np.stack([vertices * (1 + 0.02 * k) + [0, 0, 0.01 * k] for k in range(48)])
        names = {
            subject.made_from or subject.sequence
            for each in experiments.EXPERIMENTS
            for subject in each.subjects
        }
        for name in names:
            sequences.write_sequence(self.folder / "in" / f"{name}.anime", growing, triangles)
        self.binary, self.log = fake_isomorph.install(self, self.folder)

    def paper(self, *words):
        """The status, stdout and stderr of a command."""
        places = ["--sequences", self.folder / "in", "--cache", self.folder / "cache"]
        places += ["--out", self.folder / "out", "--binary", self.binary]
        places += ["--work", self.folder / "work"]
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = paper.main([*words, *map(str, places)])
        return status, out.getvalue(), err.getvalue()

    def calls(self):
        return [json.loads(line) for line in self.log.read_text().splitlines()]

    def test_errors_leaves_table_numbers_figure_and_record(self):
        status, out, err = self.paper("errors")
        self.assertEqual(status, 0, err)
        folder = self.folder / "out/errors"
        self.assertEqual({path.name for path in folder.iterdir()}, EXPECTED_FILES)
        text = (folder / "table.md").read_text()
        self.assertIn(text, out)
        self.assertIn("## fox_survey, frames 0-18, 20-47", text)
        self.assertIn("## bear_walk, frames 0-16, 16-30, 30-47", text)
        self.assertIn("nfgp (1 of 2 pairs)", text)
        # The error grows with the label: mlp wins, 0.013 squared is 0.169e-3. nfgp has fewer pairs.
        best = [line for line in text.splitlines() if "**0.169**" in line]
        self.assertEqual({line.split("|")[1].strip() for line in best}, {"mlp"})
        entries = compact.unpack(compact.read(folder / "data.json"))
        mlp = next(each for each in entries if each["method"] == "mlp")
        surface = mlp["evaluation"]["mean"]["surface"]
        self.assertAlmostEqual(surface["chamfer_squared"], 0.013**2, delta=1e-12)
        self.assertAlmostEqual(surface["aligned"]["hausdorff"], 3 * 0.013 / 2, delta=1e-12)
        self.assertEqual(mlp["training_seconds"], 12.5)
        # Each pair has a table of its own below that of their mean.
        self.assertEqual(text.count("| mlp "), 2 + 5)
        self.assertIn("### bear_walk, frames 16-30", text)

    def test_straight_lines_that_beat_every_row_are_marked(self):
        # A label of 60 letters has the error 0.07, straight lines 0.05.
        row = experiments.Row("x" * 60)
        other = experiments.Row("y" * 61)
        ours = experiments.Experiment("test", "A test.", (experiments.ARMS,), (row, other))
        with mock.patch.object(experiments, "EXPERIMENTS", (ours,)):
            status, out, err = self.paper("test")
        self.assertEqual(status, 0, err)
        straight = next(line for line in out.splitlines() if line.startswith("| straight"))
        self.assertIn(" 2.500 (!) |", straight)
        self.assertIn(" **4.900** |", next(line for line in out.splitlines() if "xx" in line))
        self.assertEqual(self.paper("errors")[1].count("(!)"), 1)

    def test_the_record_says_how_it_was_made(self):
        self.paper("global-swaps", "--seed", "3")
        record = compact.read(self.folder / "out/global-swaps/data.json")
        self.assertEqual(record["settings"]["seed"], 3)
        self.assertEqual(record["settings"]["steps"], 1000)
        self.assertIn("scripts/paper.py global-swaps --seed 3", record["command"])
        self.assertEqual(record["versions"]["isomorph"], "isomorph 0.0.0-fake")
        self.assertTrue(record["machine"]["processor"] and record["machine"]["cores"] >= 1)
        wrong = {made["wrong pairs"] for made in record["inputs"].values()}
        self.assertEqual(wrong, {0, 10, 50, 100})
        words = self.calls()[0]
        self.assertIn("training.seed=3", words)
        robust = [word for word in words if "loss.matching-scale=" in word]
        self.assertEqual(len(robust), 2)

    def test_divergence_draws_the_true_volume_and_each_row(self):
        status, _, err = self.paper("divergence")
        self.assertEqual(status, 0, err)
        figure = (self.folder / "out/divergence/figure.svg").read_text()
        texts = [each.text for each in xml.fromstring(figure).iter() if each.tag.endswith("text")]
        for label in ("truth", "divergence on", "divergence off", "human_male_to_heavy, 0-10"):
            self.assertEqual(texts.count(label), 1, label)
        variants = [word for word in self.calls()[0] if "divergence off" in word]
        recorded = "training.optimiser=adam,training.guided-until=0"
        keys = "loss.divergence=0,loss.strain=0"
        self.assertEqual(variants, [f"divergence off=quick,{recorded},{keys}"])

    def test_every_other_experiment_runs_to_its_figure(self):
        for name in (
            "correspondences",
            "local-swaps",
            "sparse",
            "incomplete",
            "topology",
            "smoothness",
        ):
            with self.subTest(name):
                status, _, err = self.paper(name)
                self.assertEqual(status, 0, err)
                xml.parse(self.folder / "out" / name / "figure.svg")

    def test_experiments_of_presets_take_them_as_they_are(self):
        status, _, err = self.paper("large-turns")
        self.assertEqual(status, 0, err)
        calls = self.calls()
        self.assertEqual(len(calls), 4)
        words = calls[0]
        self.assertFalse([word for word in words if "training.steps=" in word])
        self.assertIn("quick=quick", words)
        turned = sequences.read_sequence(self.folder / "cache/bar_turn_90.anime")
        ends = turned.frames[0], turned.frames[-1]
        # A quarter turn: the way of a vertex is sqrt(2) times its distance from the axis.
        axis = np.array([1, 2, 3]) / np.sqrt(14)
        away = [end - np.outer(end @ axis, axis) for end in ends]
        self.assertLess(np.abs((away[0] * away[1]).sum(axis=1)).max(), 1e-6)
        self.assertAlmostEqual(turned.volume(0), 0.144, places=6)
        self.assertAlmostEqual(turned.volume(4), 0.144, places=6)
        table = (self.folder / "out/large-turns/table.md").read_text()
        self.assertIn("the steps and points of their presets", table)

    def test_the_same_numbers_give_the_same_bytes(self):
        self.paper("sparse")
        kept = {path: path.read_bytes() for path in (self.folder / "cache").rglob("*.ply")}
        figure = self.folder / "out/sparse/figure.svg"
        before = figure.read_bytes()
        self.paper("sparse")
        self.assertEqual(figure.read_bytes(), before)
        self.assertEqual({path: path.read_bytes() for path in kept}, kept)
        self.assertEqual(len(kept), 8)

    def test_the_full_size_is_the_papers_in_a_folder_of_its_own(self):
        self.assertEqual(self.paper("level-set", "--full", "--backend", "wgpu")[0], 0)
        self.assertTrue((self.folder / "out/level-set-full/table.md").exists())
        words = self.calls()[0]
        for word in ("training.steps=10000", "training.batch=4000", "wgpu"):
            self.assertIn(word, words)
        self.assertNotIn("--every", words)
        self.assertTrue(any("=paper,loss.level-set-form=olse" in word for word in words))

    def test_a_dry_run_prints_the_commands_and_makes_nothing(self):
        before = set(self.folder.rglob("*"))
        status, out, _ = self.paper("all", "--dry-run")
        self.assertEqual(status, 0)
        self.assertEqual(set(self.folder.rglob("*")), before)
        self.assertEqual(out.count(" compare --sequence "), 30)
        self.assertIn("# errors: 46 runs", out)

    def test_the_commands_of_a_dry_run_are_those_that_are_run(self):
        _, out, _ = self.paper("topology", "--dry-run")
        self.paper("topology")
        commands = [shlex.split(line)[1:] for line in out.splitlines()[1:]]
        self.assertEqual(commands, self.calls())

    def test_results_of_other_settings_are_not_mixed(self):
        self.paper("sparse")
        status, _, err = self.paper("sparse", "--seed", "1")
        self.assertEqual(status, 1)
        self.assertRegex(err, "data.json: seed = 0, now 1; set another --out")
        (self.folder / "out/sparse/data.json").unlink()
        status, _, err = self.paper("sparse", "--seed", "1")
        self.assertEqual(status, 1)
        self.assertRegex(err, "run.json: seed = 0, now 1; set another --out")

    def test_a_second_look_at_finished_results_changes_nothing(self):
        self.assertEqual(self.paper("topology")[0], 0)
        record = self.folder / "out/topology/data.json"
        before = json.loads(record.read_text()) | {"date": "2001-01-01"}
        record.write_text(json.dumps(before))
        status, out, _ = self.paper("topology")
        self.assertEqual(status, 0)
        self.assertIn("left as it was", out)
        self.assertEqual(json.loads(record.read_text())["date"], "2001-01-01")
        (self.folder / "out/topology/table.md").unlink()
        self.assertEqual(self.paper("topology")[0], 0)
        self.assertNotEqual(json.loads(record.read_text())["date"], "2001-01-01")

    def test_tables_of_older_rows_are_written_anew(self):
        self.paper("topology")
        table, text = (self.folder / "out/topology" / name for name in ("data.json", "table.md"))
        fresh = text.read_text()
        # As if a row had been run again since.
        table.write_text(table.read_text().replace("chamfer_squared", "chamfer_of_old", 1))
        text.write_text("old")
        _, out, _ = self.paper("topology")
        self.assertNotIn("left as it was", out)
        strip = lambda lines: [line for line in lines.splitlines() if line.startswith("|")]
        self.assertEqual(strip(text.read_text()), strip(fresh))

    def test_a_table_is_made_again_from_the_numbers_alone(self):
        self.paper("divergence")
        folder = self.folder / "out/divergence"
        kept = {name: (folder / name).read_bytes() for name in EXPECTED_FILES}
        for name in ("table.md", "figure.svg"):
            (folder / name).unlink()
        shutil.rmtree(self.folder / "work")
        shutil.rmtree(self.folder / "in")
        calls = self.log.read_text()
        status, _, err = self.paper("divergence", "--table")
        self.assertEqual(status, 0, err)
        self.assertEqual({name: (folder / name).read_bytes() for name in EXPECTED_FILES}, kept)
        self.assertEqual(self.log.read_text(), calls)
        status, _, err = self.paper("sparse", "--table")
        self.assertEqual(status, 1)
        self.assertIn("run without --table first", err)

    def test_rows_that_an_experiment_has_no_more_stay_in_its_table(self):
        self.paper("topology")
        path = self.folder / "out/topology/data.json"
        path.write_text(path.read_text().replace('"nise"', '"a row of before"'))
        status, out, err = self.paper("topology", "--table")
        self.assertEqual(status, 0, err)
        self.assertIn("| a row of before ", out)

    def test_without_a_folder_of_sequences_it_is_said_how_to_name_one(self):
        err = io.StringIO()
        with (
            mock.patch.dict(os.environ),
            contextlib.redirect_stderr(err),
            contextlib.redirect_stdout(io.StringIO()),
        ):
            os.environ.pop(command_line.SEQUENCES, None)
            self.assertEqual(paper.main(["sparse", "--dry-run"]), 1)
            self.assertRegex(err.getvalue(), "set --sequences or ISOMORPH_SEQUENCES.*README")
            os.environ[command_line.SEQUENCES] = str(self.folder / "in")
            self.assertEqual(paper.main(["sparse", "--dry-run"]), 0)

    def test_a_failed_run_is_said_and_leaves_no_table(self):
        os.environ["FAKE_FAILS"] = "1"
        status, _, err = self.paper("sparse")
        self.assertEqual(status, 1)
        self.assertIn("compare: failed (status 1)", err)
        self.assertFalse((self.folder / "out/sparse/table.md").exists())
        os.environ["FAKE_FAILS"] = "130"
        self.assertEqual(self.paper("all")[0], 130)

    def test_missing_binaries_and_unknown_names_are_said(self):
        self.binary.unlink()
        status, _, err = self.paper("level-set")
        self.assertEqual(status, 1)
        self.assertRegex(err, "cannot be started.*--binary")
        status, _, err = self.paper("erors")
        self.assertEqual(status, 2)
        self.assertIn("no such experiment; there are errors, correspondences", err)

    def test_the_newest_result_of_a_row_counts(self):
        folder = self.folder / "entries"
        folder.mkdir()
        entry = {"method": "a", "from": 0, "to": 5, "evaluation": {"frames": [], "mean": {}}}
        for name, date in (("1", "2026-02-01"), ("2", "2026-01-01")):
            (folder / f"{name}.json").write_text(json.dumps(entry | {"date": date, "name": name}))
        (folder / "comparison.json").write_text('{"pairs": []}')
        entries = runs.read_entries(folder)
        self.assertEqual([found["name"] for found in entries.values()], ["1"])
        (folder / "3.json").write_text("{")
        with self.assertRaisesRegex(PaperError, "3.json: not JSON"):
            runs.read_entries(folder)


if __name__ == "__main__":
    unittest.main()
