#!/usr/bin/env python3
"""Turns the folder that `isomorph compare` leaves into one table and one small JSON file.

    python3 scripts/compact_results.py FOLDER -o DIR --about TEXT [--note TEXT]...
    python3 scripts/compact_results.py --table DIR

FOLDER is what `isomorph compare -o FOLDER` wrote: a folder for each sequence with a file for each
pair and method. Written to DIR: data.json and table.md. data.json has no paths of this machine and
six digits of each number; isomorph_paper/compact.py describes it. With --table only data.json is
read, and table.md is written again.

`paper.py` and `protocol.py` do this themselves. This is for comparisons that are made by hand.

Needs numpy. Exit status: 0 done, 1 failed, 2 usage.
"""

import argparse
import json
import sys
from pathlib import Path

from isomorph_paper import (
    PaperError,
    command_line,
    compact,
    experiments,
    inputs,
    record,
    report,
    runs,
)
from isomorph_paper.sequences import write_atomically


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("folder", type=Path, help="the folder to read")
    add("-o", "--out", type=Path, help="where data.json and table.md go")
    add("--about", help="one sentence on what is compared")
    add("--note", action="append", default=[], help="a paragraph below the table; may be repeated")
    add("--table", action="store_true", help="FOLDER has a data.json: write its table again")
    command_line.add_sequences(parser)
    options = parser.parse_args(words)
    if not options.table and options.out is None:
        parser.error("-o DIR is needed, for the results; or --table, to write a table again")
    return options


def record_of(folder: Path) -> dict:
    """What paper.py recorded of the folder, without what only this machine can use."""
    path = folder / record.NAME
    if not path.exists():
        return {}
    found = json.loads(path.read_text("utf-8"))
    return {key: value for key, value in found.items() if key not in ("binary", "calls", "state")}


def experiment_of(how: dict) -> experiments.Experiment | None:
    """The experiment that a record is of."""
    name = how.get("settings", {}).get("experiment")
    return experiments.named(name) if name else None


def entries_of(folder: Path, experiment: experiments.Experiment | None) -> list[dict]:
    """All results in the order of their table: by sequence, pair and row."""
    subjects = (*(experiment.subjects if experiment else ()), *experiments.PROTOCOL)
    known = list(dict.fromkeys(subject.sequence for subject in subjects))
    place = lambda path: (known.index(path.name) if path.name in known else len(known), path.name)
    found = []
    for below in sorted((path for path in folder.iterdir() if path.is_dir()), key=place):
        entries = list(runs.read_entries(below).values())
        rank = ranks(below, [each["method"] for each in entries], experiment)
        key = lambda each: (each["from"], each["to"], rank(each["method"]), each.get("date", ""))
        found += sorted(entries, key=key)
    if not found:
        raise PaperError(f"{folder}: no results of `isomorph compare`; name the folder of its -o")
    return found


def ranks(folder: Path, labels: list[str], experiment: experiments.Experiment | None):
    """The place of a row in the table that `compare` wrote, or in the experiment; else the last."""
    path, order = folder / "comparison.json", []
    if path.exists():
        pairs = json.loads(path.read_text("utf-8"))["pairs"]
        order = list(dict.fromkeys(each["method"] for pair in pairs for each in pair["methods"]))
    if not set(labels) <= set(order):
        order = [row.label for row in experiment.rows] if experiment else []
    return lambda label: order.index(label) if label in order else len(order)


def volumes(experiment: experiments.Experiment | None, options: argparse.Namespace) -> dict:
    """The true volumes, where the figure of an experiment shows them."""
    if experiment is None or experiment.figure != "volume":
        return {}
    folder = command_line.sequences(options)
    truths = {
        each.sequence: inputs.sequence_of(each, folder, options.out) for each in experiment.subjects
    }
    return inputs.true_volumes(experiment.subjects, truths)


def packed(options: argparse.Namespace) -> dict:
    """The compact form of a folder."""
    how = record_of(options.folder)
    experiment = experiment_of(how)
    about = options.about or (experiment.about if experiment else None)
    if about is None:
        raise PaperError("--about is needed: one sentence on what is compared")
    name = experiment.name if experiment else options.out.resolve().name
    how = {"experiment": name, "about": about, **how}
    if options.note:
        how["notes"] = options.note
    entries = entries_of(options.folder, experiment)
    return compact.pack(entries, how, volumes(experiment, options))


def write_table(folder: Path) -> str:
    """Writes the table of a compact form from nothing else; returns it."""
    content = compact.read(folder / compact.NAME)
    measured = runs.measured([], compact.unpack(content))
    text = report.markdown(content["experiment"], content, measured)
    write_atomically(folder / "table.md", text.encode())
    return text


def main(words: list[str]) -> int:
    options = arguments(words)
    folder = options.folder if options.table else options.out
    try:
        if not options.table:
            compact.write(folder / compact.NAME, packed(options))
        print(write_table(folder))
    except PaperError as error:
        print(f"compact_results.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
