#!/usr/bin/env python3
"""Checks the language of the texts that users read: `python3 scripts/language.py [FILE...]`.

Without files it checks the README, the guide, the change log and the notes beside data, tests and benches. It prints
one line per finding, `file:line: what is wrong`, and exits with 1 if there is any.

A sentence has at most 25 words. People and programs may want, tell, ask and know; things may not. A number in brackets
stands at the end of a sentence, not within it. A line has at most 200 columns; the README at most 120 lines of 120.

Only prose is read. Code blocks, tables, headings, comments, pictures and the addresses of links are passed over; inline
code counts as one word. It needs nothing but Python 3.10.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TEXTS = ["README.md", "CHANGELOG.md", "data/README.md", "tests/README.md", "model/benches/README.md"]
GUIDE = "src/guide"

MOST_WORDS = 25
MOST_COLUMNS = 200
README_LINES = 120
README_COLUMNS = 120

# What stands for inline code: a word that no rule looks at.
CODE = "Code"

PEOPLE = {
    "i", "you", "we", "they", "he", "she", "who", "people", "person", "users", "user", "readers", "reader", "nobody",
    "everybody", "anyone", "someone", "authors", "newcomers",
}
WILL = re.compile(r"\b(wants?|wanted|tells?|told|asks?|asked|knows?|knew)\b", re.IGNORECASE)
PHRASES = re.compile(
    r"\b(miss(?:es)? (?:themselves|itself)|(?:is|are) told|prices?|punish(?:es|ed|ing)?)\b", re.IGNORECASE
)
# Verbs between a person and the verb of will: "you do not want", "you may want".
AUXILIARIES = {"do", "does", "did", "not", "may", "might", "can", "could", "will", "would", "must", "also", "already",
               "only", "cannot", "should", "first", "to", "need"}
BRACKETED_NUMBER = re.compile(r"\(\s*(?:about |over |under )?[\d.]+[^()]*\)(?=\s+[a-z])")
ABBREVIATIONS = ("e.g.", "i.e.", "et al.", "vs.", "cf.", "Fig.", "Eq.", "approx.")
END = re.compile(r"""[.!?]["')*_\]]*(?=\s+["'(*_\[]*[A-Z0-9]|\s*$)""")


@dataclass(frozen=True)
class Finding:
    """One thing to mend."""

    line: int
    problem: str


@dataclass(frozen=True)
class Block:
    """A paragraph or a point of a list: its text, and the line of each of its characters."""

    text: str
    lines: list[int]


def is_structure(line: str) -> bool:
    """Whether a line is a heading, a table row, a definition of a link, or HTML alone."""
    bare = line.strip()
    return (
        bare.startswith(("#", "|", "<"))
        or re.fullmatch(r"\[[^\]]+\]:\s.*", bare) is not None
        or re.fullmatch(r"[-*_=]{3,}", bare) is not None
        or re.fullmatch(r"!\[[^\]]*\]\([^)]*\)", bare) is not None
    )


def blocks(text: str) -> Iterator[Block]:
    """The paragraphs and the points of lists, without what is no prose."""
    parts: list[tuple[int, str]] = []
    fence = None
    for number, line in enumerate([*text.splitlines(), ""], start=1):
        opening = re.match(r"\s*(```+|~~~+)", line)
        if fence is not None:
            if opening and line.strip().startswith(fence):
                fence = None
            continue
        point = re.match(r"\s*(?:>\s*)?(?:[-*+]|\d+[.)])\s+", line)
        ends = opening or not line.strip() or is_structure(line) or point
        if ends and parts:
            yield joined(parts)
            parts = []
        if opening:
            fence = opening.group(1)
        elif line.strip() and not is_structure(line):
            parts.append((number, line[point.end():] if point else line.strip()))


def joined(parts: list[tuple[int, str]]) -> Block:
    """Lines as one text, plain: code, links and pictures replaced; each character remembers its line."""
    text, lines = "", []
    for number, line in parts:
        piece = line + " "
        text += piece
        lines += [number] * len(piece)
    for pattern, template in [
        (r"(`+)(?:(?!\1).)+?\1", CODE),
        (r"!\[([^\]]*)\]\([^)]*\)", ""),
        (r"\[([^\]]*)\]\([^)]*\)", r"\1"),
        (r"\[([^\]]*)\]\[[^\]]*\]", r"\1"),
        (r"<https?://[^>]*>|https?://\S+", CODE),
        (r"\*\*|__", ""),
    ]:
        text, lines = substituted(pattern, template, text, lines)
    return Block(text.rstrip(), lines)


def substituted(pattern: str, template: str, text: str, lines: list[int]) -> tuple[str, list[int]]:
    """The text with matches replaced, and the lines that its characters still come from."""
    out, kept, at = "", [], 0
    for match in re.finditer(pattern, text):
        new = match.expand(template)
        out += text[at:match.start()] + new
        kept += lines[at:match.start()] + [lines[match.start()]] * len(new)
        at = match.end()
    return out + text[at:], kept + lines[at:]


def sentences(block: Block) -> Iterator[tuple[int, str]]:
    """The sentences of a block, each with the line on which it begins."""
    start = 0
    for match in END.finditer(block.text):
        if block.text[: match.end()].endswith(ABBREVIATIONS):
            continue
        yield sentence(block, start, match.end())
        start = match.end()
    if block.text[start:].strip():
        yield sentence(block, start, len(block.text))


def sentence(block: Block, start: int, end: int) -> tuple[int, str]:
    """One sentence, from its first character that is not blank."""
    piece = block.text[start:end]
    first = start + len(piece) - len(piece.lstrip())
    return block.lines[first], piece.strip()


def words(text: str) -> list[str]:
    """What counts as a word: anything between blanks that has a letter or a digit."""
    return [word for word in text.split() if re.search(r"\w", word)]


def of_people(before: str) -> bool:
    """Whether the subject right before a verb of will is a person."""
    found = [word.lower().strip(",.;:()*_\"'") for word in words(before)]
    while found and found[-1] in AUXILIARIES:
        found.pop()
    return bool(found) and found[-1] in PEOPLE


def problems_of(text: str) -> Iterator[str]:
    """What is wrong with a sentence."""
    count = len(words(text))
    if count > MOST_WORDS:
        yield f"{count} words, at most {MOST_WORDS}: {shown(text)}"
    for match in WILL.finditer(text):
        if not of_people(text[: match.start()]):
            yield f"\"{match.group()}\" of a thing: {shown(text)}"
    for match in PHRASES.finditer(text):
        yield f"\"{match.group()}\": {shown(text)}"
    for match in BRACKETED_NUMBER.finditer(text):
        yield f"number in brackets within a sentence, {match.group()}: {shown(text)}"


def shown(text: str) -> str:
    """The beginning of a sentence, on one line."""
    return text if len(text) <= 70 else text[:67] + "..."


def check(text: str, readme: bool = False) -> list[Finding]:
    """All findings of a text, in the order of its lines."""
    found = [
        Finding(line, problem)
        for block in blocks(text)
        for line, words_of_it in sentences(block)
        for problem in problems_of(words_of_it)
    ]
    lines = text.splitlines()
    most = README_COLUMNS if readme else MOST_COLUMNS
    for number, line in enumerate(lines, start=1):
        is_table = line.lstrip().startswith("|") and not readme
        if len(line) > most and not is_table:
            found.append(Finding(number, f"{len(line)} columns, at most {most}"))
    if readme and len(lines) > README_LINES:
        found.append(Finding(len(lines), f"{len(lines)} lines, at most {README_LINES}"))
    return sorted(found, key=lambda finding: finding.line)


def texts() -> list[Path]:
    """The texts that are checked when none is named."""
    return [ROOT / name for name in TEXTS] + sorted((ROOT / GUIDE).glob("*.md"))


def main(arguments: list[str] | None = None) -> int:
    """Prints the findings; 1 if there are any."""
    parser = argparse.ArgumentParser(description="Check the language of the texts that users read.")
    parser.add_argument("files", nargs="*", type=Path, help="Markdown files [default: all of the project's]")
    count = 0
    for path in parser.parse_args(arguments).files or texts():
        whole = path.resolve()
        name = whole.relative_to(ROOT) if whole.is_relative_to(ROOT) else path
        for finding in check(path.read_text(encoding="utf-8"), readme=str(name) == "README.md"):
            print(f"{name}:{finding.line}: {finding.problem}")
            count += 1
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
