#!/usr/bin/env python3
"""Tests of compact_results.py and of the compact form, and of the results that are kept here."""

import contextlib
import io
import json
import re
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import as_rigid
import compact_results
import fake_isomorph
import gpu
import instant_scaling
import key_methods
import keys
import kills
import matching
import peers
import protocol
import scaling
from isomorph_paper import PaperError, compact, report, runs

RESULTS = Path(__file__).parent / "results"
# Written in parts, so that test_no_machine_paths.py finds no path here.
HOME = "/" + "home/someone"


def entry(method: str, first: int, last: int, error: float, **more) -> dict:
    """What `compare` writes of one method on one pair."""
    return {
        "sequence": "ball",
        "from": first,
        "to": last,
        "method": method,
        "recipe": "[training]\nsteps = 1000\nseed = 7\n",
        "digest": "ab" * 32,
        "command": f"{HOME}/bin/isomorph-a compare --sequence {HOME}/in/ball.anime "
        f"-o {HOME}/checkout/scripts/results/x",
        "training_seconds": 12.3456789,
        "date": "2026-01-01T00:00:00Z",
        "evaluation": fake_isomorph.evaluation(error, first, last, 3),
    } | more


class Portable(unittest.TestCase):
    def test_paths_lose_the_folders_of_the_machine(self):
        shortened = {
            f"{HOME}/bin/isomorph-u compare": "isomorph compare",
            f"{HOME}/data/fox_survey.anime": "fox_survey.anime",
            f"-o {HOME}/a/scripts/results/errors": "-o scripts/results/errors",
            f"{HOME}/a/runs/compare/fox/0-18": "runs/compare/fox/0-18",
            f"data.source={HOME}/.cache/isomorph-paper/fox-0-18/source.ply,loss.strain=0": (
                "data.source=fox-0-18/source.ply,loss.strain=0"
            ),
            f"{HOME}/.cache/isomorph-paper/feet.anime": "feet.anime",
            "C:" + r"\Users\someone\fox.anime": "fox.anime",
        }
        for before, after in shortened.items():
            self.assertEqual(compact.portable([{"a": before}]), [{"a": after}])

    def test_all_else_stays(self):
        for text in ("CD / HD", "a/b/c.ply", "target/release/isomorph", "https://a.b/c", "m/s"):
            self.assertEqual(compact.portable(text), text)
        self.assertEqual(compact.portable(1.5), 1.5)


class Numbers(unittest.TestCase):
    def test_six_digits_are_kept_and_whole_numbers_are_whole(self):
        found = compact.rounded({"a": [0.0123456789, 1.0, 12345678.9, 7, True, None, "x"]})
        self.assertEqual(found, {"a": [0.0123457, 1, 12345700.0, 7, True, None, "x"]})

    def test_columns_and_rows_are_each_others_inverse(self):
        rows = [{"a": 1, "b": {"c": 2}}, None, {"a": 3, "b": None}, {"a": 4, "b": {"c": 5}}]
        found = compact.columns(rows)
        self.assertEqual(found, {"a": [1, None, 3, 4], "b": {"c": [2, None, None, 5]}})
        self.assertEqual(compact.rows_of(found, 4), rows)

    def test_text_is_json_of_short_lines_and_refuses_what_is_no_number(self):
        value = {"a": list(range(100)), "b": [{"c": "x" * 90}, {"c": "y" * 90}], "d": {}, "e": [[]]}
        text = compact.text(value)
        self.assertEqual(json.loads(text), value)
        self.assertEqual(text.count("\n"), 8)
        with self.assertRaises(ValueError):
            compact.text([float("nan")])


class Packing(unittest.TestCase):
    def test_results_come_back_with_the_numbers_of_tables_and_figures(self):
        entries = [entry(name, *pair, 0.0123456789) for pair in ((0, 9), (9, 18)) for name in "ab"]
        content = compact.pack(entries, {"about": "A test."})
        back = compact.unpack(json.loads(compact.text(content)))
        self.assertEqual(len(back), 4)
        for before, after in zip(entries, back, strict=True):
            for key in ("sequence", "from", "to", "method", "date"):
                self.assertEqual(after[key], before[key])
            self.assertEqual(after["training_seconds"], 12.3457)
            self.assertEqual(after["seed"], 7)
            self.assertTrue(after["command"].startswith("isomorph compare"))
            mean = before["evaluation"]["mean"]
            self.assertEqual(after["evaluation"]["mean"], compact.rounded(mean))
            for one, other in zip(
                before["evaluation"]["frames"], after["evaluation"]["frames"], strict=True
            ):
                self.assertEqual(other["frame"], one["frame"])
                for kind in ("surface", "carried", "linear", "floor"):
                    kept = compact.rounded(compact.of_frame(one[kind]))
                    self.assertEqual(other[kind], kept)

    def test_what_methods_share_is_written_once(self):
        one = compact.pack([entry("a", 0, 9, 0.01)], {})
        two = compact.pack([entry("a", 0, 9, 0.01), entry("b", 0, 9, 0.02)], {})
        self.assertEqual(len(two["commands"]), 1)
        self.assertEqual(two["pairs"][0]["linear"], one["pairs"][0]["linear"])
        self.assertNotIn("linear", two["pairs"][0]["methods"][1])

    def test_a_reference_of_its_own_stays_with_its_method(self):
        other = entry("b", 0, 9, 0.02)
        other["evaluation"]["mean"]["linear"]["chamfer_squared"] = 0.5
        back = compact.unpack(compact.pack([entry("a", 0, 9, 0.01), other], {}))
        means = [each["evaluation"]["mean"]["linear"]["chamfer_squared"] for each in back]
        self.assertEqual(means, [compact.rounded(0.05**2), 0.5])

    def test_a_method_without_a_surface_has_none_afterwards(self):
        carried = entry("a", 0, 9, 0.01)
        carried["evaluation"]["mean"]["surface"] = None
        for frame in carried["evaluation"]["frames"]:
            frame["surface"] = None
        (back,) = compact.unpack(compact.pack([carried], {}))
        self.assertIsNone(back["evaluation"]["mean"]["surface"])
        self.assertIsNone(back["evaluation"]["frames"][0]["surface"])

    def test_other_frames_are_not_mixed(self):
        fewer = entry("b", 0, 9, 0.01)
        fewer["evaluation"]["frames"].pop()
        with self.assertRaisesRegex(PaperError, "ball 0-9: 'b' was measured on other frames"):
            compact.pack([entry("a", 0, 9, 0.01), fewer], {})


class Command(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        below = self.folder / "in/ball"
        below.mkdir(parents=True)
        for method, error in (("second", 0.02), ("first", 0.01)):
            for first, last in ((0, 9), (9, 18)):
                text = json.dumps(entry(method, first, last, error))
                (below / f"{first}-{last}.{method}.json").write_text(text)
        pairs = [{"methods": [{"method": "first"}, {"method": "second"}]}]
        (below / "comparison.json").write_text(json.dumps({"pairs": pairs}))

    def call(self, *words) -> tuple[int, str, str]:
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                status = compact_results.main(list(map(str, words)))
            except SystemExit as ended:
                status = ended.code
        return status, out.getvalue(), err.getvalue()

    def test_a_folder_of_compare_becomes_one_table_and_one_small_file(self):
        words = ("--about", "Two methods on a ball.", "--note", "A note.")
        status, out, err = self.call(self.folder / "in", "-o", self.folder / "out", *words)
        self.assertEqual(status, 0, err)
        files = {path.name for path in (self.folder / "out").iterdir()}
        self.assertEqual(files, {"data.json", "table.md"})
        text = (self.folder / "out/table.md").read_text()
        self.assertEqual(out, text + "\n")
        self.assertIn("Two methods on a ball.", text)
        self.assertIn("\nA note.\n", text)
        for wanted in ("## ball, frames 0-9, 9-18", "### ball, frames 9-18", "| first "):
            self.assertIn(wanted, text)
        # Rows stand in the order of the table that `compare` wrote.
        self.assertLess(text.index("| first "), text.index("| second "))
        self.assertIn("| first | - | - | 7 | - | - | - | 2026-01-01 |", text)
        self.assertIn("isomorph compare --sequence ball.anime -o scripts/results/x", text)
        before = sum(path.stat().st_size for path in (self.folder / "in").rglob("*.json"))
        self.assertLess((self.folder / "out/data.json").stat().st_size, before / 2)

    def test_the_table_is_written_again_from_the_small_file_alone(self):
        self.call(self.folder / "in", "-o", self.folder / "out", "--about", "A test.")
        table = self.folder / "out/table.md"
        text = table.read_text()
        table.unlink()
        self.assertEqual(self.call("--table", self.folder / "out")[0], 0)
        self.assertEqual(table.read_text(), text)

    def test_wrong_words_and_folders_are_said(self):
        self.assertEqual(self.call(self.folder / "in")[0], 2)
        status, _, err = self.call(self.folder / "in", "-o", self.folder / "out")
        self.assertEqual(status, 1)
        self.assertIn("--about is needed", err)
        (self.folder / "empty").mkdir()
        words = ("--about", "Nothing.")
        status, _, err = self.call(self.folder / "empty", "-o", self.folder / "out", *words)
        self.assertEqual(status, 1)
        self.assertIn("no results of `isomorph compare`", err)
        status, _, err = self.call("--table", self.folder / "empty")
        self.assertEqual(status, 1)
        self.assertIn("data.json: cannot be read", err)


class Kept(unittest.TestCase):
    """The results of this repository: every table follows from the JSON beside it."""

    def table_of(self, path: Path) -> str:
        content = compact.read(path)
        if "experiment" in content:
            measured = runs.measured([], compact.unpack(content))
            return report.markdown(content["experiment"], content, measured)
        if path.parent.parent.name == "gpu":
            return gpu.markdown(content)
        makers = {
            "as-rigid": as_rigid,
            "instant-scaling": instant_scaling,
            "key-methods": key_methods,
            "keys": keys,
            "kills": kills,
            "matching": matching,
            "peers": peers,
            "scaling": scaling,
        }
        return makers.get(path.parent.name, protocol).markdown(content)

    def test_each_table_is_that_of_its_numbers(self):
        found = sorted(RESULTS.glob("*/*.json")) + sorted(RESULTS.glob("gpu/*/*.json"))
        self.assertGreater(len(found), 20)
        for path in found:
            with self.subTest(path.parent.name):
                name = "table.md" if path.name == compact.NAME else f"{path.stem}.md"
                table = path.with_name(name)
                self.assertEqual(table.read_text("utf-8"), self.table_of(path))

    def test_results_stay_few_and_small(self):
        files = [path for path in RESULTS.rglob("*") if path.is_file()]
        self.assertLess(len(files), 100)
        self.assertLess(sum(path.stat().st_size for path in files), 4_400_000)

    def test_links_of_the_overview_lead_to_files_and_every_file_is_linked(self):
        text = (RESULTS / "README.md").read_text("utf-8")
        links = set(re.findall(r"\]\(([^)#\s]+)", text))
        for link in links:
            self.assertTrue((RESULTS / link).exists(), link)
        shown = {(RESULTS / link).resolve() for link in links}
        for path in RESULTS.rglob("*"):
            if path.suffix in (".md", ".svg", ".png") and path.name != "README.md":
                self.assertIn(path.resolve(), shown, "not linked in results/README.md")


if __name__ == "__main__":
    unittest.main()
