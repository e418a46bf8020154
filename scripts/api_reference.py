#!/usr/bin/env python3
"""Writes the reference of the package for Python from its docstrings: `python3 scripts/api_reference.py`.

It goes to src/guide/python_api.md. With --check nothing is written, and the status is 1 if the file is not what the
docstrings give. The sources are read, not run, so nothing has to be built. It needs Python 3.10.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import dedent, fill

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src/python/isomorph"
PAGE = ROOT / "src/guide/python_api.md"
COLUMNS = 120

HEAD = """# Python reference

What the package `isomorph` offers, by `scripts/api_reference.py` from its docstrings. The chapter [python] shows it at
work. `(n, 3)` is the shape of an array.

A mistake in an argument or a file is a `ValueError`. Work that failed, as on a full disk, is an
`isomorph.TrainingError`. Ctrl-C is a `KeyboardInterrupt`. Doubts about a result are warnings, `isomorph.IsomorphWarning`.
"""
# They have no more to say than their names and the lines above.
SHORT = {"IsomorphWarning", "ShapeLike", "TrainingError"}
# Where the name of a special method says nothing, its use does.
SPECIAL = {"__getitem__": "[name]"}


@dataclass
class Doc:
    """A docstring in its parts."""

    text: str
    sections: dict[str, list[tuple[str, str]]] = field(default_factory=dict)


def parsed(docstring: str) -> Doc:
    """The text, and the entries of the sections Args, Returns and Raises: a name and its text, or the text alone."""
    head, *tail = docstring.strip().split("\n", 1)
    lines = (head + "\n" + dedent(tail[0] if tail else "")).split("\n")
    doc, section = Doc(""), None
    for line in lines:
        title = re.fullmatch(r"(Args|Returns|Raises):", line)
        if title:
            section = doc.sections.setdefault(title[1], [])
        elif section is None:
            doc.text += line + "\n"
        elif re.match(r"    \S", line):
            name = re.match(r"    ([\w.]+): (.*)", line)
            if doc.sections.get("Returns") is section or not name:
                section.append(("", line.strip()))
            else:
                section.append((name[1], name[2]))
        elif line.strip():
            name, before = section.pop()
            section.append((name, f"{before} {line.strip()}"))
    doc.text = doc.text.strip()
    if "Returns" in doc.sections:
        doc.sections["Returns"] = [("", " ".join(text for _, text in doc.sections["Returns"]))]
    return doc


def signature(function: ast.FunctionDef) -> str:
    """Its arguments without their types, which the text has in words."""
    given = function.args
    words, defaults = [], [None] * (len(given.args) - len(given.defaults)) + given.defaults
    for argument, default in zip(given.args, defaults):
        if argument.arg not in ("self", "cls"):
            words.append(argument.arg + (f"={ast.unparse(default)}" if default else ""))
    if given.vararg:
        words.append(f"*{given.vararg.arg}")
    elif given.kwonlyargs:
        words.append("*")
    for argument, default in zip(given.kwonlyargs, given.kw_defaults):
        words.append(argument.arg + (f"={ast.unparse(default)}" if default else ""))
    return f"({', '.join(words)})"


def broken(title: str) -> str:
    """A long call with an argument to a line."""
    if len(title) <= COLUMNS:
        return title
    name, given = title[:-1].split("(", 1)
    return f"{name}(\n" + "".join(f"    {argument},\n" for argument in given.split(", ")) + ")"


def wrapped(text: str, before: str = "") -> str:
    return fill(text, COLUMNS, subsequent_indent=before, break_long_words=False, break_on_hyphens=False) + "\n"


def names(function: ast.FunctionDef) -> list[str]:
    given = function.args
    all_of_them = [*given.args, *([given.vararg] if given.vararg else []), *given.kwonlyargs]
    return [argument.arg for argument in all_of_them if argument.arg not in ("self", "cls")]


def is_public(node: ast.AST) -> bool:
    return isinstance(node, ast.FunctionDef) and (not node.name.startswith("_") or node.name in SPECIAL)


def is_property(node: ast.FunctionDef) -> bool:
    return any(isinstance(each, ast.Name) and each.id == "property" for each in node.decorator_list)


def entry(level: int, title: str, docstring: str | None, arguments: list[str], problems: list[str]) -> str:
    """A heading, the text, and a list of arguments; what is missing goes to `problems`."""
    if not docstring:
        problems.append(f"{title}: no docstring")
        return ""
    doc = parsed(docstring)
    given = [name for name, _ in doc.sections.get("Args", [])]
    if given != arguments:
        problems.append(f"{title}: documents {given} of {arguments}")
    name, _, rest = title.partition("(")
    page = f"\n{'#' * level} `{name}`\n\n"
    if rest:
        page += f"```python\n{broken(title)}\n```\n\n"
    page += f"{doc.text}\n"
    for section, word in (("Args", "Arguments"), ("Returns", "Returns"), ("Raises", "Raises")):
        entries = doc.sections.get(section)
        if not entries:
            continue
        if section == "Returns":
            page += "\n" + wrapped(f"{word}: {entries[0][1]}")
            continue
        page += f"\n{word}:\n\n"
        for name, text in entries:
            page += wrapped(f"* `{name}`: {text}", "  ")
    return page


def of_class(node: ast.ClassDef, problems: list[str]) -> str:
    body = [each for each in node.body if isinstance(each, ast.FunctionDef)]
    made = next((each for each in body if each.name == "__init__"), None)
    docstring = ast.get_docstring(node, clean=False)
    documented = docstring is not None and "Args:" in docstring
    title = f"isomorph.{node.name}" + (signature(made) if made and documented else "")
    page = entry(2, title, docstring, names(made) if made and documented else [], problems)
    for each in filter(is_public, body):
        if is_property(each):
            title = f"{node.name}.{each.name}"
        elif each.name in SPECIAL:
            title = f"{node.name}{SPECIAL[each.name]}"
        else:
            title = f"{node.name}.{each.name}{signature(each)}"
        arguments = [] if is_property(each) or each.name in SPECIAL else names(each)
        page += entry(3, title, ast.get_docstring(each, clean=False), arguments, problems)
    return page


def reference(package: Path = PACKAGE) -> tuple[str, list[str]]:
    """The page, and what is missing in docstrings."""
    trees = [ast.parse(path.read_text("utf-8")) for path in sorted(package.glob("_*.py"))]
    top = {node.name: node for tree in trees for node in tree.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    init = ast.parse((package / "__init__.py").read_text("utf-8"))
    [offered] = [ast.literal_eval(node.value) for node in init.body if isinstance(node, ast.Assign)]
    offered = [name for name in offered if name not in SHORT]
    # What others call comes first, then what they get.
    order = sorted(offered, key=lambda name: (not isinstance(top.get(name), ast.FunctionDef), name))
    page, problems = HEAD, []
    for name in order:
        node = top.get(name)
        if node is None:
            problems.append(f"{name}: is offered, and defined nowhere")
        if isinstance(node, ast.FunctionDef):
            docstring = ast.get_docstring(node, clean=False)
            page += entry(2, f"isomorph.{name}{signature(node)}", docstring, names(node), problems)
        elif isinstance(node, ast.ClassDef):
            page += of_class(node, problems)
    return page, problems


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--check", action="store_true", help="write nothing; status 1 if the file is another")
    given = arguments.parse_args()
    page, problems = reference()
    for problem in problems:
        print(problem, file=sys.stderr)
    if given.check:
        if PAGE.read_text("utf-8") != page:
            print(f"{PAGE.relative_to(ROOT)}: is old; run python3 scripts/api_reference.py", file=sys.stderr)
            return 1
    else:
        PAGE.write_text(page, "utf-8")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
