#!/usr/bin/env python3
"""Makes a table or figure of the paper on our sequences, by calling `isomorph compare`.

    python3 scripts/paper.py NAME [--full] [--binary PATH] [--backend B] [--out DIR] [--table]

NAME is an experiment (`list` names them) or `all`. The results go to DIR/NAME, with --full to
DIR/NAME-full: table.md, figure.svg, and data.json with all numbers, command lines, seed, machine,
date, versions and statistics of the inputs. What `compare` writes goes to --work. An interrupted
experiment goes on where it stopped when the same command is given again. With --table nothing is
trained: table and figure are made again from data.json.

Without --full, a run is 1000 steps of 2200 points of the preset `quick`: 1 to 2 minutes on two
cores. With it, 10,000 steps of 4000 points of the preset `paper`, as printed: hours. The experiments of
`instant` have the presets as they are, with --full too.

Needs numpy and matplotlib. Exit status: 0 done, 1 failed, 2 usage, 130 interrupted.
"""

import argparse
import os
import shlex
import sys
from pathlib import Path

from isomorph_paper import (
    PaperError,
    command_line,
    compact,
    experiments,
    figures,
    inputs,
    record,
    report,
    runs,
)
from isomorph_paper.command_line import ROOT
from isomorph_paper.sequences import digest, write_atomically


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "isomorph-paper"
    add = parser.add_argument
    add("name", metavar="NAME", help="an experiment, `all` or `list`")
    add("--full", action="store_true", help="the paper's size instead of one for two cores")
    command_line.add_binary(parser)
    add("--backend", help="handed on to isomorph")
    add("--out", type=Path, default=ROOT / "scripts/results", help="where results go")
    command_line.add_work(parser)
    command_line.add_table(parser)
    add("--dry-run", action="store_true", help="print the commands, make nothing")
    command_line.add_sequences(parser)
    add(
        "--cache",
        type=Path,
        default=cache,
        help="where made inputs go; large, and made again at need",
    )
    add("--seed", type=int, default=0, help="of the inputs and of the training")
    add("--steps", type=int, help="other steps than the size has")
    add("--batch", type=int, help="another batch than the size has")
    options = parser.parse_args(words)
    for name, least in (("seed", 0), ("steps", 1), ("batch", 64)):
        value = getattr(options, name)
        if value is not None and value < least:
            parser.error(f"--{name} = {value}: must be {least} or more")
    return options


def main(words: list[str]) -> int:
    options = arguments(words)
    try:
        if options.name == "list":
            show_list()
            return 0
        names = (
            [each.name for each in experiments.EXPERIMENTS]
            if options.name == "all"
            else [options.name]
        )
        chosen = [experiments.named(name) for name in names]
    except PaperError as error:
        print(f"paper.py: {error}", file=sys.stderr)
        return 2
    failed = []
    for experiment in chosen:
        try:
            run(experiment, options, ["scripts/paper.py", *words])
        except PaperError as error:
            print(f"paper.py: {experiment.name}: {error}", file=sys.stderr)
            failed.append(experiment.name)
        except KeyboardInterrupt:
            print("paper.py: interrupted; the same command goes on from here", file=sys.stderr)
            return 130
    if failed and len(chosen) > 1:
        print(f"paper.py: failed: {', '.join(failed)} of {len(chosen)}", file=sys.stderr)
    return 1 if failed else 0


def show_list() -> None:
    for each in experiments.EXPERIMENTS:
        count = f"{experiments.runs_of(each, each.sizes[0])} runs"
        print(f"{each.name:<20} {count:<8} {each.about}")


def run(experiment: experiments.Experiment, options: argparse.Namespace, words: list[str]) -> None:
    """One experiment from its inputs to its figure."""
    size = experiment.sizes[options.full]
    name = f"{experiment.name}-full" if options.full else experiment.name
    folder = options.out / name
    if options.table:
        leave(experiment, compact.read(folder / compact.NAME), folder)
        return
    budget = runs.Budget(
        size,
        options.steps or size.steps,
        options.batch or size.batch,
        options.seed,
        options.backend,
    )
    places = command_line.sequences(options).resolve(), options.cache.resolve()
    paths = runs.Paths(*places, options.work.resolve() / name)
    plan = {
        subject: runs.planned(options.binary, experiment, subject, budget, paths)
        for subject in experiment.subjects
    }
    if options.dry_run:
        print(f"# {experiment.name}: {experiments.runs_of(experiment, size)} runs")
        for command in (each for commands in plan.values() for each in commands):
            print(shlex.join(command))
        return
    figures.check()
    wanted = record.settings(experiment.name, budget)
    record.check(folder / compact.NAME, wanted)
    record.begin(paths.results, wanted)
    statistics, truths = carry_out(experiment, plan, budget, paths)
    how = {
        "experiment": experiment.name,
        "about": experiment.about,
        "settings": wanted,
        **record.of(shlex.join(words), options.binary),
        "sequences": sequence_digests(truths),
        "inputs": statistics,
    }
    volumes = experiment.figure == "volume"
    more = inputs.true_volumes(experiment.subjects, truths) if volumes else {}
    content = compact.pack(runs.collect(experiment, size, paths.results), how, more)
    if is_there(content, folder):
        # The date on record is that of the runs, not of this look at them.
        print(f"{folder}: all rows were there already; left as it was")
        return
    compact.write(folder / compact.NAME, content)
    leave(experiment, content, folder)


def is_there(content: dict, folder: Path) -> bool:
    """Whether the table that is there is of these numbers."""
    path = folder / compact.NAME
    there = path.exists() and (folder / "table.md").exists()
    return there and compact.read(path).get("pairs") == content["pairs"]


def carry_out(experiment, plan, budget, paths) -> tuple[dict, dict]:
    """Makes the inputs and runs the commands; statistics of the inputs, and the sequences."""
    statistics, truths = {}, {}
    for subject, commands in plan.items():
        sequence = inputs.sequence_of(subject, paths.sequences, paths.cache)
        truths[subject.sequence] = sequence
        rows = experiment.rows_at(budget.size)
        made = inputs.make_all(rows, subject, sequence, budget.seed, paths.cache)
        for files in made.values():
            statistics[files.folder.name] = files.statistics
        for command in commands:
            runs.call_binary(command)
    return statistics, truths


def sequence_digests(truths: dict) -> dict:
    return {name: f"sha256 {digest(sequence.path)}" for name, sequence in truths.items()}


def leave(experiment: experiments.Experiment, content: dict, folder: Path) -> None:
    """Writes the table and the figure of a compact form, and nothing that is not in it."""
    figures.check()
    measured = runs.measured(list(experiment.rows), compact.unpack(content))
    text = report.markdown(experiment.name, content, measured)
    write_atomically(folder / "table.md", text.encode())
    write_atomically(folder / "figure.svg", figures.draw(experiment, measured, content))
    print(f"{folder / 'table.md'}\n\n{text}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
