#!/usr/bin/env python3
"""Tests of scripts/api_reference.py, and of the reference that is committed."""

import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import api_reference

SOURCE = '''
class Thing:
    """A thing.

    Args:
        size: how large, and this goes on
            over a line.
    """

    def __init__(self, size, *, kind="a"):
        pass

    @property
    def area(self):
        """Its area."""

    def grow(self, by=1.0):
        """Grows it."""

    def _own(self):
        pass


def make(size, *more, kind="a"):
    """Makes some.

    Args:
        size: of the first.
        more: of others.
        kind: a word.

    Returns:
        The things: all
        of them.

    Raises:
        ValueError: a size below 0.
    """


def hidden():
    pass
'''


class ApiReference(unittest.TestCase):
    def reference(self, source, offered):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "__init__.py").write_text(f"__all__ = {offered!r}\n")
            (Path(folder) / "_a.py").write_text(source)
            return api_reference.reference(Path(folder))

    def test_the_committed_page_is_what_the_docstrings_give_and_nothing_is_missing(self):
        page, problems = api_reference.reference()
        self.assertEqual(problems, [])
        committed = api_reference.PAGE.read_text("utf-8")
        self.assertEqual(page, committed, "run python3 scripts/api_reference.py")
        for name in ("isomorph.morph", "isomorph.Run", "Run.surface", "Shape.of", "Batch[name]", "isomorph.evaluate"):
            self.assertIn(f"# `{name}`", committed)

    def test_functions_and_classes(self):
        page, problems = self.reference(SOURCE, ["Thing", "make"])
        for part in (
            "## `isomorph.make`\n\n```python\nisomorph.make(size, *more, kind='a')\n```\n\nMakes some.",
            "* `more`: of others.\n",
            "Returns: The things: all of them.\n",
            "* `ValueError`: a size below 0.\n",
            "* `size`: how large, and this goes on over a line.\n",
            "### `Thing.area`\n\nIts area.\n",
        ):
            self.assertIn(part, page)
        self.assertNotIn("_own", page)
        self.assertNotIn("hidden", page)
        self.assertLess(page.index("isomorph.make"), page.index("isomorph.Thing"))
        # What has arguments names all of them.
        self.assertEqual(problems, [
            "isomorph.Thing(size, *, kind='a'): documents ['size'] of ['size', 'kind']",
            "Thing.grow(by=1.0): documents [] of ['by']",
        ])

    def test_what_is_missing_is_said(self):
        _, problems = self.reference(SOURCE, ["hidden", "nowhere"])
        self.assertEqual(problems, ["isomorph.hidden(): no docstring", "nowhere: is offered, and defined nowhere"])

    def test_long_calls_have_an_argument_to_a_line(self):
        call = "a.b(" + ", ".join(f"argument_{k}=None" for k in range(9)) + ")"
        lines = api_reference.broken(call).split("\n")
        self.assertEqual((lines[0], lines[1], lines[-1], len(lines)), ("a.b(", "    argument_0=None,", ")", 11))


if __name__ == "__main__":
    unittest.main()
