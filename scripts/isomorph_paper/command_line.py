"""What the commands of this folder are asked in the same words."""

import argparse
from pathlib import Path

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


def add_sequences(to: argparse.ArgumentParser) -> None:
    to.add_argument(
        "--sequences",
        type=Path,
        default=ROOT.parent / "shared/data",
        help="the folder of the .anime files",
    )
