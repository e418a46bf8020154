#!/usr/bin/env python3
"""Writes a long sequence of clouds, to see what memory and time many key frames take.

    python3 scripts/long_sequence.py [--sequences DIR] [--keys N] [--points N] FOLDER
    isomorph train FOLDER/recipe.toml

The clouds are the surface of `human_raise_arms` at even times, between whose frames vertices are
interpolated straight. All have the same places on it, so that points of equal number correspond.

Needs numpy. Exit status: 0 done, 1 failed, 2 usage.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from isomorph_paper import PaperError, command_line, degrade
from isomorph_paper.sequences import (
    area_vectors,
    read_sequence,
    unit,
    write_atomically,
    write_cloud,
)

NAME = "human_raise_arms.anime"
RECIPE = """# Many key frames, made by scripts/long_sequence.py.
preset = "instant"

[data]
sequence = "cloud-*.ply"
correspondences = "same-vertices"
"""


def arguments(words: list[str]) -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    command_line.add_sequences(parser)
    parser.add_argument("--keys", type=int, default=200, help="key frames (default: 200)")
    parser.add_argument("--points", type=int, default=20_000, help="points of each (default: 20000)")
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    options = parser.parse_args(words)
    for name, least in (("keys", 2), ("points", 64)):
        if not least <= getattr(options, name) <= 10_000_000:
            parser.error(f"--{name} = {getattr(options, name)}: must be {least} to 10000000")
    return options


def main(words: list[str]) -> int:
    options = arguments(words)
    try:
        sequence = read_sequence(command_line.sequences(options) / NAME)
    except PaperError as error:
        print(f"long_sequence.py: {error}", file=sys.stderr)
        return 1
    frames, triangles = sequence.frames, sequence.triangles
    places = degrade.sampled(frames[0], triangles, options.points, np.random.default_rng(5))
    for key, at in enumerate(np.linspace(0, len(frames) - 1, options.keys)):
        before = min(int(at), len(frames) - 2)
        vertices = frames[before] + (at - before) * (frames[before + 1] - frames[before])
        normals = unit(area_vectors(vertices, places.triangles))
        write_cloud(options.folder / f"cloud-{key}.ply", places.on(vertices), normals)
    write_atomically(options.folder / "recipe.toml", RECIPE.encode())
    print(options.folder / "recipe.toml")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
