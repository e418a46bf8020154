#!/usr/bin/env python3
"""Makes the sample pairs in data/: two frames of a sequence each, and 5 % of their correspondences.

    python3 scripts/sample_data.py SEQUENCES [DATA]

SEQUENCES is the folder that holds fox_survey.anime and human_raise_arms.anime (their provenance:
data/README.md); DATA is where the pairs go (default: data/ beside scripts/). Standard library only.
The same sequences give the same bytes. Layout of .anime: src/formats/anime.rs.

scan/ holds what a scanner gives: clouds of the fox with points that are none.

arms/ holds the key frames of a motion: the same mesh in seven poses, at uneven times.

Per pair: source.ply and target.ply (binary, with faces, without normals) and pairs.csv. The
sequences are vertex-consistent, which no scan is; so that the files give away no more than
pairs.csv says, the vertices and the triangles of the target are in a random order of their own.
"""

import bisect
import itertools
import math
import random
import struct
import sys
from pathlib import Path

# 5 % of the 20,000 points that the evaluation protocol samples.
PAIRS = 1000
SAMPLES = [
    # folder, sequence, first and last frame of a motion that goes one way
    ("fox", "fox_survey.anime", 0, 18),
    ("human", "human_raise_arms.anime", 0, 26),
]


def read_sequence(path, wanted):
    """The wanted frames as lists of (x, y, z), and the triangles as lists of (i, j, k)."""
    data = path.read_bytes()
    frames, vertices, triangles = struct.unpack_from("<3i", data)
    rows = lambda form, start, count: list(
        struct.iter_unpack(form, data[start : start + 12 * count])
    )
    first = rows("<3f", 12, vertices)
    faces = rows("<3i", 12 + 12 * vertices, triangles)
    offsets_start = 12 + 12 * (vertices + triangles)

    def frame(k):
        if not 0 <= k < frames:
            sys.exit(f"{path}: frame {k} (the sequence has frames 0 to {frames - 1})")
        if k == 0:
            return first
        offsets = rows("<3f", offsets_start + 12 * vertices * (k - 1), vertices)
        return [tuple(a + d for a, d in zip(at, by)) for at, by in zip(first, offsets)]

    return [frame(k) for k in wanted], faces


def write_ply(path, vertices, faces, comment):
    """A binary little-endian PLY of float32 positions, and of triangles if there are any."""
    of_faces = f"element face {len(faces)}\nproperty list uchar int vertex_indices\n" if faces else ""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"comment {comment}\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"{of_faces}end_header\n"
    )
    body = b"".join(struct.pack("<3f", *vertex) for vertex in vertices)
    body += b"".join(struct.pack("<B3i", 3, *face) for face in faces)
    path.write_bytes(header.encode("ascii") + body)


def shuffled_target(vertices, faces, rng):
    """The target in an order of its own, and where each of its old vertices went."""
    order = list(range(len(vertices)))
    rng.shuffle(order)
    place = [0] * len(order)
    for new, old in enumerate(order):
        place[old] = new
    moved = []
    for face in faces:
        corners = [place[corner] for corner in face]
        # Starting at another corner leaves the winding.
        turn = rng.randrange(3)
        moved.append(corners[turn:] + corners[:turn])
    rng.shuffle(moved)
    return [vertices[old] for old in order], moved, place


def make(folder, sequence, first, last):
    """Writes one sample pair."""
    rng = random.Random(f"isomorph {folder.name} {first} {last}")
    (source, target), faces = read_sequence(sequence, (first, last))
    target, target_faces, place = shuffled_target(target, faces, rng)
    chosen = sorted(rng.sample(range(len(source)), PAIRS))
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{sequence.name} frame"
    write_ply(folder / "source.ply", source, faces, f"{name} {first}, see data/README.md")
    write_ply(folder / "target.ply", target, target_faces, f"{name} {last}, see data/README.md")
    lines = [f"{vertex},{place[vertex]}" for vertex in chosen]
    (folder / "pairs.csv").write_text("\n".join(["source_index,target_index", *lines]) + "\n")
    print(f"{folder}: {len(source)} vertices, {len(faces)} triangles, {PAIRS} pairs")


def surface_points(vertices, faces, count, rng):
    """Points uniform over the area."""
    corners = [[vertices[corner] for corner in face] for face in faces]

    def area(a, b, c):
        u, v = ([q - p for p, q in zip(a, end)] for end in (b, c))
        cross = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        return math.sqrt(sum(part * part for part in cross))

    running = list(itertools.accumulate(area(*triangle) for triangle in corners))

    def point():
        a, b, c = corners[bisect.bisect(running, rng.random() * running[-1]) % len(corners)]
        root, split = math.sqrt(rng.random()), rng.random()
        weights = (1 - root, root * (1 - split), root * split)
        return tuple(sum(w * p for w, p in zip(weights, at)) for at in zip(a, b, c))

    return [point() for _ in range(count)]


def raw_scan(points, rng):
    """The points as a depth camera gives them: some without a place, some at the camera, some astray."""
    low, high = (tuple(least(at) for at in zip(*points)) for least in (min, max))
    nothing = (math.nan,) * 3
    camera = (high[0] + 400.0, low[1], 0.0)
    astray = lambda: tuple(rng.uniform(a - 20, b + 20) for a, b in zip(low, high))
    rows = [*points, *[nothing] * 250, *[camera] * 150, *(astray() for _ in range(50))]
    rng.shuffle(rows)
    return rows


def make_scans(folder, sequence):
    """Writes two raw scans of the fox, and a scan of its front alone."""
    rng = random.Random("isomorph scan")
    (first, last), faces = read_sequence(sequence, (0, 18))
    scans = [surface_points(frame, faces, 5000, rng) for frame in (first, last)]
    folder.mkdir(parents=True, exist_ok=True)
    for name, points in zip(("a.ply", "b.ply"), scans):
        write_ply(folder / name, raw_scan(points, rng), [], "see data/README.md")
    # The long axis of the fox is z, and its head is at the far end.
    low, high = (least(at[2] for at in scans[1]) for least in (min, max))
    front = [at for at in scans[1] if at[2] > low + 0.4 * (high - low)]
    write_ply(folder / "part.ply", front, [], "see data/README.md")
    print(f"{folder}: two raw scans, and {len(front)} points of a part")


# The key frames that the authors of the paper name.
KEYS = [0, 10, 18, 28, 39, 47, 54]


def make_keys(folder, sequence):
    """Writes key frames: the same mesh in each."""
    frames, faces = read_sequence(sequence, KEYS)
    folder.mkdir(parents=True, exist_ok=True)
    for number, vertices in zip(KEYS, frames):
        comment = f"{sequence.name} frame {number}, see data/README.md"
        write_ply(folder / f"key-{number:02}.ply", vertices, faces, comment)
    print(f"{folder}: {len(KEYS)} key frames of {len(frames[0])} vertices")


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    sequences = Path(sys.argv[1])
    data = Path(sys.argv[2]) if len(sys.argv) == 3 else Path(__file__).parents[1] / "data"
    for name, sequence, first, last in SAMPLES:
        make(data / name, sequences / sequence, first, last)
    make_scans(data / "scan", sequences / "fox_survey.anime")
    make_keys(data / "arms", sequences / "human_raise_arms.anime")


if __name__ == "__main__":
    main()
