"""Options that several commands of this folder share."""

import argparse
import os
from pathlib import Path

from . import PaperError

ROOT = Path(__file__).resolve().parents[2]


def parser(about: str) -> argparse.ArgumentParser:
    """A parser that shows a script's own text as it stands, and guesses no abbreviation."""
    return argparse.ArgumentParser(
        description=about,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )


def add_binary(to: argparse.ArgumentParser) -> None:
    to.add_argument(
        "--binary", default=str(ROOT / "target/release/isomorph"), help="the isomorph to call"
    )


# The variable that names the folder of the sequences.
SEQUENCES = "ISOMORPH_SEQUENCES"


def add_sequences(to: argparse.ArgumentParser) -> None:
    to.add_argument(
        "--sequences",
        type=Path,
        help=f"the folder of the .anime files (default: the variable {SEQUENCES})",
    )


def sequences(options: argparse.Namespace) -> Path:
    """The folder of the sequences; a PaperError where neither option nor variable names it."""
    given = options.sequences or os.environ.get(SEQUENCES)
    if not given:
        raise PaperError(
            f"no folder of sequences: set --sequences or {SEQUENCES} to the folder of the .anime "
            "files; data/README.md says where they come from, scripts/results/README.md which "
            "ones an experiment needs"
        )
    return Path(given)


def add_work(to: argparse.ArgumentParser) -> None:
    to.add_argument(
        "--work",
        type=Path,
        default=ROOT / "runs/results",
        help="where single measurements go; what is there is not measured again",
    )


def add_table(to: argparse.ArgumentParser) -> None:
    to.add_argument(
        "--table",
        action="store_true",
        help="measure nothing: write the table again from the numbers in --out",
    )
