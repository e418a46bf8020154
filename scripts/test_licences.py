#!/usr/bin/env python3
"""Tests of scripts/licences.py."""

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import licences

RULES = {
    "licenses": {"allow": ["MIT", "Apache-2.0"], "exceptions": [{"crate": "odd", "allow": ["MPL-2.0"]}]},
    "sources": {"allow-registry": ["https://github.com/rust-lang/crates.io-index"]},
}
REGISTRY = "registry+https://github.com/rust-lang/crates.io-index"


def package(name="a", licence="MIT", source=REGISTRY):
    return {"name": name, "version": "1.0.0", "license": licence, "source": source}


class Licences(unittest.TestCase):
    def test_expressions(self):
        for expression, allowed in (
            ("MIT", True),
            ("GPL-3.0", False),
            ("MIT OR GPL-3.0", True),
            ("MIT/GPL-3.0", True),
            ("MIT AND GPL-3.0", False),
            ("(MIT OR GPL-3.0) AND Apache-2.0", True),
            ("GPL-3.0 OR MIT AND BSD-3-Clause", False),
            ("Apache-2.0 WITH LLVM-exception", True),
            ("GPL-2.0 WITH Classpath-exception-2.0", False),
        ):
            self.assertEqual(licences.permits(expression, {"MIT", "Apache-2.0"}), allowed, expression)
        for expression in ("", "MIT OR", "(MIT", "MIT Apache-2.0"):
            with self.assertRaises(ValueError, msg=expression):
                licences.permits(expression, {"MIT"})

    def test_packages_that_are_not_built_are_left_out(self):
        packages = [package("a"), package("b"), package("c")]
        tree = "a v1.0.0 (/somewhere)\nb v1.0.0 (*)\n\nc v2.0.0\n"
        self.assertEqual([each["name"] for each in licences.used(packages, tree)], ["a", "b"])

    def test_packages(self):
        self.assertEqual(licences.refused(package(), RULES), [])
        self.assertEqual(licences.refused(package(source=None), RULES), [])
        self.assertEqual(licences.refused(package("odd", "MPL-2.0"), RULES), [])
        for wrong, word in (
            (package("other", "MPL-2.0"), "MPL-2.0"),
            (package(licence=None), "no licence"),
            (package(source="git+https://example.org/a"), "comes from git+"),
            (package(source="registry+https://example.org/index"), "comes from registry+"),
        ):
            found = licences.refused(wrong, RULES)
            self.assertEqual(len(found), 1, wrong)
            self.assertIn(word, found[0])


if __name__ == "__main__":
    unittest.main()
