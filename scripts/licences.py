#!/usr/bin/env python3
"""Checks licences and sources of all dependencies against deny.toml, where cargo-deny is not installed.

    python3 scripts/licences.py

Reads `cargo tree`, `cargo metadata` and the same lists that `cargo deny check licenses sources bans` does. Advisories need
cargo-deny and its database: a line says that they were not checked. Needs Python 3.11.
Exit status: 0 all is allowed, 1 something is not.
"""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
REGISTRY = "registry+"


# All features and systems, as deny.toml has it.
TREE = "cargo tree --locked --workspace --all-features --target all --edges all --prefix none --format".split()
METADATA = "cargo metadata --locked --format-version 1 --all-features".split()


def main() -> int:
    rules = tomllib.loads((ROOT / "deny.toml").read_text())
    try:
        packages = used(json.loads(output(METADATA))["packages"], output([*TREE, "{p}"]))
    except subprocess.CalledProcessError as failed:
        print(f"licences.py: {failed.stderr.strip()}", file=sys.stderr)
        return 1
    wrong = [line for package in packages for line in refused(package, rules)]
    for line in wrong:
        print(f"licences.py: {line}", file=sys.stderr)
    print(f"{len(packages)} packages: licences and sources checked; advisories NOT checked (they need cargo-deny)")
    return 1 if wrong else 0


def output(words: list[str]) -> str:
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout


def used(packages: list[dict], tree: str) -> list[dict]:
    """The packages that ours are built with; the lock file and the metadata have more."""
    lines = (line.split() for line in tree.splitlines())
    named = {(words[0], words[1].removeprefix("v")) for words in lines if len(words) > 1}
    return [package for package in packages if (package["name"], package["version"]) in named]


def refused(package: dict, rules: dict) -> list[str]:
    """What is not allowed about a package, in sentences."""
    name = f"{package['name']} {package['version']}"
    found = []
    allowed = set(rules["licenses"]["allow"])
    for exception in rules["licenses"].get("exceptions", []):
        if exception["crate"] == package["name"]:
            allowed |= set(exception["allow"])
    licence = package["license"]
    if not licence:
        found.append(f"{name}: no licence is stated")
    elif not permits(licence, allowed):
        found.append(f"{name}: licence {licence}: none that deny.toml allows")
    # Without a source it is a package of this repository.
    source = package["source"]
    if source and source.removeprefix(REGISTRY) not in rules["sources"]["allow-registry"]:
        found.append(f"{name}: comes from {source}, which deny.toml does not allow")
    return found


def permits(expression: str, allowed: set[str]) -> bool:
    """Whether an SPDX expression is met by allowed licences; `/` is an old way to write OR."""
    tokens = re.findall(r"\(|\)|[^\s()/]+|/", expression)
    at = 0

    def peek() -> str | None:
        return tokens[at] if at < len(tokens) else None

    def take() -> str:
        nonlocal at
        if at == len(tokens):
            raise ValueError(f"{expression!r}: not an SPDX expression")
        at += 1
        return tokens[at - 1]

    def one() -> bool:
        token = take()
        if token == "(":
            value = either()
            if take() != ")":
                raise ValueError(f"{expression!r}: not an SPDX expression")
            return value
        if peek() == "WITH":
            take()
            token = f"{token} WITH {take()}"
            # An exception only adds permissions.
            return token in allowed or token.partition(" WITH ")[0] in allowed
        return token in allowed

    def both() -> bool:
        value = one()
        while peek() == "AND":
            take()
            value = one() and value
        return value

    def either() -> bool:
        value = both()
        while peek() in ("OR", "/"):
            take()
            value = both() or value
        return value

    value = either()
    if peek() is not None:
        raise ValueError(f"{expression!r}: not an SPDX expression")
    return value


if __name__ == "__main__":
    sys.exit(main())
