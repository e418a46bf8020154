#!/usr/bin/env python3
"""Tests of scripts/kills.py: that it finds what is not whole, and what is told wrongly."""

import json
import sys
import tempfile
import unittest
import zlib
from pathlib import Path
from types import SimpleNamespace

sys.path.insert(0, str(Path(__file__).parent))

import kills

PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty uchar red\n"
    b"element face 2\nproperty list uchar int vertex_indices\nend_header\n"
)


class Kills(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.place = Path(folder.name)

    def write(self, name, content):
        path = self.place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        return path

    def is_whole(self):
        try:
            kills.check_whole(SimpleNamespace(place=self.place), "train")
        except kills.Lost:
            return False
        return True

    def test_a_checkpoint_must_fit_its_checksums(self):
        content = b"weights"
        digest = {"bytes": len(content), "crc32": zlib.crc32(content)}
        self.write("run/checkpoints/step-1/velocity.mpk", content)
        self.write("run/checkpoints/step-1/state.json", json.dumps({"files": {"velocity.mpk": digest}}).encode())
        self.assertTrue(self.is_whole())
        self.write("run/checkpoints/step-1/velocity.mpk", b"weightS")
        self.assertFalse(self.is_whole())
        (self.place / "run/checkpoints/step-1/velocity.mpk").unlink()
        self.assertFalse(self.is_whole())

    def test_files_cut_anywhere_are_not_whole(self):
        whole = PLY + b"\0" * 10 + b"\3" + b"\0" * 12 + b"\4" + b"\0" * 16
        for name, content, cut in (
            ("a.ply", whole, whole[:-1]),
            ("frames.json", b'[{"time": 0}]', b'[{"time": 0}'),
            ("metrics.jsonl", b'{"step": 1}\n{"st', b'{"step": 1\n{"step": 2}\n'),
            ("preview.png", b"\x89PNG IEND\xaeB`\x82", b"\x89PNG IDAT\xaeB`\x82"),
            ("report.html", b"<html></html>\n", b"<html></ht"),
            ("recipe.toml", b"[data]\n", b""),
        ):
            with self.subTest(name):
                path = self.write(name, content)
                self.assertTrue(self.is_whole())
                path.write_bytes(cut)
                self.assertFalse(self.is_whole())
                path.unlink()

    def test_what_has_a_temporary_name_may_be_torn(self):
        self.write(".isomorph-x1/frames.json", b"[{")
        self.write("run/.step-000020-old/state.json", b"{")
        self.assertTrue(self.is_whole())

    def test_a_failure_is_one_line_of_error_and_no_panic(self):
        kills.check_told("train", "write", "error=ENOSPC", 1, "error: run: no space left on device\n")
        kills.check_told("train", "unlink", "error=EIO", 0, "")
        for status, told in ((101, "thread 'main' panicked at"), (1, ""), (1, "Killed"), (-11, "")):
            with self.assertRaises(kills.Lost):
                kills.check_told("train", "write", "error=ENOSPC", status, told)

    def test_seconds_in_a_table_are_no_difference_and_numbers_are(self):
        one = "| method | CD ↓ | training (s) ↓ |\n| ------ | ---: | -------------: |\n| quick | 1.2 | **0** |\n\nText.\n"
        other = one.replace("**0**", "12").replace("------", "--------")
        work = SimpleNamespace(place=self.place, wanted_results={})
        self.write("whole/table.md", one.encode())
        work.wanted_results = kills.all_files(self.place / "whole")
        self.write("results-again/table.md", other.encode())
        kills.check_end(work, "compare")
        self.write("results-again/table.md", other.replace("1.2", "1.3").encode())
        with self.assertRaisesRegex(kills.Lost, "1.3.*1.2"):
            kills.check_end(work, "compare")

    def test_other_files_than_the_undisturbed_ones_are_a_loss(self):
        self.write("out/surface.ply", b"one")
        work = SimpleNamespace(place=self.place, wanted_out={"surface.ply": b"one"})
        kills.check_end(work, "extract")
        for name, content in (("surface.ply", b"two"), ("more.ply", b"")):
            path = self.write(f"out/{name}", content)
            with self.assertRaises(kills.Lost):
                kills.check_end(work, "extract")
            path.unlink()
            self.write("out/surface.ply", b"one")


if __name__ == "__main__":
    unittest.main()
