#!/usr/bin/env python3
"""No file of the repository names a folder of the machine that it was made on.

Such paths say nothing to anyone else, and often a user's name. `isomorph_paper/compact.py` takes
them out of results. A mention that has to stay goes into ALLOWED with its reason.
"""

import re
import subprocess
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

# Homes, work folders and temporary folders. In parts, so that this file does not find itself.
FOLDERS = ("home", "root", "work", "tmp", "Users", "var/tmp", "var/folders", "private/tmp", "mnt")
FOUND = re.compile(
    r"(?<![\w.~$)}\]-])/(?:" + "|".join(FOLDERS) + r")/[\w.~-]" + r"|\b[A-Za-z]:\\{1,2}Users\b"
)
# (file, text of the line): why it may stay.
ALLOWED: dict[tuple[str, str], str] = {}


def tracked() -> list[str]:
    """The files of the repository; of a copy without git all that no build has made."""
    words = ["git", "-C", str(ROOT), "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(words, capture_output=True)
    if done.returncode == 0:
        return [name.decode() for name in done.stdout.split(b"\0") if name]
    skipped = {".git", "target", "runs", "__pycache__"}
    return [
        str(path.relative_to(ROOT))
        for path in ROOT.rglob("*")
        if path.is_file() and not skipped & set(path.relative_to(ROOT).parts)
    ]


def findings(text: str) -> list[int]:
    """The numbers of the lines with a path of a machine."""
    return [at for at, line in enumerate(text.splitlines(), 1) if FOUND.search(line)]


class MachinePaths(unittest.TestCase):
    def test_no_file_of_the_repository_has_one(self):
        wrong = []
        names = tracked()
        self.assertIn("README.md", names)
        for name in names:
            path = ROOT / name
            # A file that was deleted but not yet committed is listed all the same.
            data = path.read_bytes() if path.is_file() else b""
            if b"\0" in data[:8000]:
                continue
            text = data.decode("utf-8", errors="replace")
            lines = text.splitlines()
            for at in findings(text):
                if (name, lines[at - 1].strip()) not in ALLOWED:
                    wrong.append(f"{name}:{at}: {lines[at - 1].strip()[:120]}")
        self.assertEqual(wrong, [], "paths of a machine:\n" + "\n".join(wrong[:20]))

    def test_paths_of_machines_are_found(self):
        for folder in FOLDERS:
            for before in ("", "a ", '"', "'", "=", "(", "file://"):
                self.assertEqual(findings(f"first\n{before}/{folder}/x.ply\n"), [2], before)
        self.assertEqual(findings("C:" + r"\Users\x"), [1])
        self.assertEqual(findings("C:" + r"\\Users\\x"), [1])

    def test_paths_that_are_the_same_everywhere_are_not(self):
        for text in (
            "/usr/share/vulkan/icd.d",
            "/proc/cpuinfo",
            "runs/work/x",
            "~/.cache/isomorph-paper",
            "$HOME/tmp/x",
            "a temporary folder (/tmp)",
            "https://example.org/home/x",
            "at home/work",
        ):
            self.assertEqual(findings(text), [], text)


if __name__ == "__main__":
    unittest.main()
