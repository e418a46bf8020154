#!/usr/bin/env python3
"""Tests of scripts/check with programs that only pretend: its stages, and what a failure does."""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

CHECK = Path(__file__).with_name("check")
# Logs its name and words; fails if they hold the text of FAILS.
PROGRAM = """#!/bin/sh
echo "$(basename "$0") $*" >> "$LOG"
case "$*" in *"$FAILS"*) exit 1 ;; esac
"""


class Check(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        for name in ("cargo", "python"):
            (self.folder / name).write_text(PROGRAM)
            (self.folder / name).chmod(0o755)

    def check(self, *words: str, fails: str = "nothing fails"):
        """What came of the command, and the commands that it called."""
        environment = {
            **os.environ,
            "PATH": f"{self.folder}:{os.environ['PATH']}",
            "PYTHON": str(self.folder / "python"),
            "LOG": str(self.folder / "log"),
            "FAILS": fails,
        }
        log = self.folder / "log"
        log.unlink(missing_ok=True)
        done = subprocess.run([CHECK, *words], capture_output=True, text=True, env=environment)
        return done, log.read_text().splitlines() if log.exists() else []

    def test_the_quick_stages_run_with_their_seconds(self):
        done, calls = self.check()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("cargo fmt --all --check", calls)
        self.assertTrue(any(call.startswith("cargo check --workspace") for call in calls))
        self.assertFalse(any("clippy" in call for call in calls))
        tests = calls[-1]
        self.assertIn("test_no_machine_paths", tests)
        self.assertNotIn("test_paper", tests)
        self.assertRegex(done.stdout, r"== format: \d+ s\n")
        self.assertRegex(done.stdout, r"all passed in \d+ s\n$")

    def test_full_adds_clippy_and_the_slow_tests(self):
        done, calls = self.check("--full")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(any(call.startswith("cargo clippy") for call in calls))
        self.assertIn("test_paper", calls[-1])

    def test_a_failure_is_named_and_the_other_stages_run_all_the_same(self):
        done, calls = self.check(fails="fmt --all")
        self.assertEqual(done.returncode, 1)
        self.assertIn("== format: FAILED", done.stdout)
        self.assertIn("unittest", calls[-1])
        self.assertRegex(done.stderr, r"failed after \d+ s: format\n")
        self.assertEqual(self.check(fails="unittest")[0].returncode, 1)

    def test_other_words_are_refused_and_help_is_shown(self):
        for words in (("--fast",), ("--full", "now")):
            done, calls = self.check(*words)
            self.assertEqual((done.returncode, calls), (2, []))
            self.assertIn("usage: scripts/check [--full]", done.stderr)
        done, calls = self.check("--help")
        self.assertEqual((done.returncode, calls), (0, []))
        self.assertIn("scripts/check [--full]", done.stdout)


if __name__ == "__main__":
    unittest.main()
