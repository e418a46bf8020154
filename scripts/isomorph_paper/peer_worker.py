"""Calls one registration in the interpreter that has its package.

    python -m isomorph_paper.peer_worker NAME --check
    python -m isomorph_paper.peer_worker NAME INPUT.npz OUTPUT.npy

The first imports the package and prints its version. The second reads the arrays of `peers.Shapes`,
writes the places of the source's vertices, and prints the seconds of the registration alone. Both
print one JSON object as their last line. What a package prints goes to stderr.
"""

import contextlib
import importlib.metadata
import json
import sys
import time

import numpy as np

from .peers import Shapes, named


def main(words: list[str]) -> int:
    peer = named(words[0])
    with contextlib.redirect_stdout(sys.stderr):
        peer.imports()
        said = {"version": importlib.metadata.version(peer.packages[0])}
        if words[1:] != ["--check"]:
            with np.load(words[1]) as given:
                shapes = Shapes(**given)
            wall, cpu = time.perf_counter(), time.process_time()
            places = np.asarray(peer.register(shapes), np.float64)
            said |= {
                "cpu_seconds": time.process_time() - cpu,
                "wall_seconds": time.perf_counter() - wall,
            }
            if places.shape != shapes.source.shape or not np.isfinite(places).all():
                raise ValueError(f"places of shape {places.shape}, or not all of them finite")
            np.save(words[2], places)
    print(json.dumps(said))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
