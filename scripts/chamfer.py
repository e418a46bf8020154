#!/usr/bin/env python3
"""Holds extracted surfaces against the true frames in between. A stop-gap until `isomorph evaluate`.

    python3 scripts/chamfer.py MESHES SEQUENCE.anime FROM TO [--json]

MESHES is a folder with frames.json, [{"time": t, "surface": "file.ply", ...}, ...], as `extract`
writes it; SEQUENCE the vertex-consistent sequence whose frames FROM and TO the run was given. Each
surface with 0 < t < 1 is compared with the true frame nearest to its time, and so are the straight
lines between the true vertices of the two ends, at the true frame's time.

Everything is in normalised coordinates (union bounding box of the two ends centred, their mean area
1), on 100,000 area-uniform samples of each surface, all components kept. chamfer_squared is the sum
over both directions of the mean squared distance, shown x1000; hausdorff the larger of the two
greatest distances; floor is chamfer_squared between two samplings of the true frame. Needs numpy
and scipy.
"""

import json
import sys
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

SAMPLES = 100_000
PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip


def read_sequence(path):
    """(frames, vertices, 3) positions and (triangles, 3) indices."""
    data = path.read_bytes()
    frames, vertices, triangles = np.frombuffer(data, "<i4", 3)
    first = np.frombuffer(data, "<f4", 3 * vertices, 12).reshape(-1, 3)
    faces = np.frombuffer(data, "<i4", 3 * triangles, 12 + 12 * vertices).reshape(-1, 3)
    start = 12 + 12 * (vertices + triangles)
    offsets = np.frombuffer(data, "<f4", -1, start).reshape(frames - 1, vertices, 3)
    return np.concatenate([first[None], first + offsets]).astype(float), faces


def read_header(lines):
    """The encoding, and (name, count, [(property, type, length type of a list)]) per element."""
    encoding, elements = None, []
    for line in lines:
        words = line.split()
        if words[0] == "format":
            encoding = words[1]
        elif words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property" and words[1] == "list":
            elements[-1][2].append((words[4], PLY_TYPES[words[3]], PLY_TYPES[words[2]]))
        elif words[0] == "property":
            elements[-1][2].append((words[2], PLY_TYPES[words[1]], None))
    return encoding, elements


def read_ply(path):
    """Vertices and triangles of a triangle mesh, ascii or binary."""
    data = path.read_bytes()
    end = data.index(b"end_header")
    start = data.index(b"\n", end) + 1
    encoding, elements = read_header(data[:end].decode("ascii", "replace").splitlines())
    if encoding == "ascii":
        return read_ascii(data[start:].split(), elements)
    order = "<" if encoding == "binary_little_endian" else ">"
    found = {}
    for name, count, properties in elements:
        fields = []
        for prop, kind, length in properties:
            if length:
                # All faces are triangles, so a list is a length and three corners.
                fields += [(prop + " length", order + length), (prop, order + kind, 3)]
            else:
                fields.append((prop, order + kind))
        rows = np.frombuffer(data, np.dtype(fields), count, start)
        start += rows.nbytes
        for prop, _, length in properties:
            if length and not (rows[prop + " length"] == 3).all():
                sys.exit(f"{path}: {name}: only triangles are read")
        found[name] = rows
    return shape_of(found)


def read_ascii(tokens, elements):
    """The same from the tokens of an ascii payload."""
    found, at = {}, 0
    for name, count, properties in elements:
        width = sum(4 if length else 1 for _, _, length in properties)
        table = np.array(tokens[at : at + count * width], float).reshape(count, width)
        at += count * width
        columns, column = {}, 0
        for prop, _, length in properties:
            columns[prop] = table[:, column + 1 : column + 4] if length else table[:, column]
            column += 4 if length else 1
        found[name] = columns
    return shape_of(found)


def shape_of(found):
    vertex, face = found["vertex"], found["face"]
    names = face.dtype.names if isinstance(face, np.ndarray) else face
    corners = "vertex_indices" if "vertex_indices" in names else "vertex_index"
    points = np.stack([vertex["x"], vertex["y"], vertex["z"]], 1).astype(float)
    return points, np.asarray(face[corners]).astype(np.int64)


def area_vectors(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def area(vertices, faces):
    return np.linalg.norm(area_vectors(vertices, faces), axis=1).sum() / 2


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]] - vertices[0] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def samples(vertices, faces, rng):
    areas = np.linalg.norm(area_vectors(vertices, faces), axis=1)
    chosen = faces[rng.choice(len(faces), SAMPLES, p=areas / areas.sum())]
    root, split = np.sqrt(rng.random((SAMPLES, 1))), rng.random((SAMPLES, 1))
    a, b, c = (vertices[chosen[:, k]] for k in range(3))
    return (1 - root) * a + root * (1 - split) * b + root * split * c


def distances(one, other):
    """chamfer_squared and hausdorff between two sets of points."""
    there = cKDTree(other).query(one, workers=-1)[0]
    back = cKDTree(one).query(other, workers=-1)[0]
    return (there**2).mean() + (back**2).mean(), max(there.max(), back.max())


def topology(vertices, faces):
    """The number of components, and whether every edge is in exactly two triangles."""
    # Vertices that the file repeats at one place are one.
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    faces = same.reshape(-1)[faces]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    size = faces.max() + 1
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (size, size))
    labels = connected_components(graph, directed=False)[1]
    return len(np.unique(labels[faces[:, 0]])), bool((uses == 2).all())


def compare(entry, folder, frames, faces, ends, rng):
    """One row of the table: a surface, the straight lines and the floor against the true frame."""
    first, last, to_normal = ends
    frame = int(np.clip(round(first + entry["time"] * (last - first)), first, last))
    share = (frame - first) / (last - first)
    truth = to_normal(frames[frame])
    straight = to_normal((1 - share) * frames[first] + share * frames[last])
    true_points = samples(truth, faces, rng)
    surface, triangles = read_ply(folder / entry["surface"])
    surface = to_normal(surface)
    components, closed = topology(surface, triangles)
    mine = distances(samples(surface, triangles, rng), true_points)
    line = distances(samples(straight, faces, rng), true_points)
    floor = distances(samples(truth, faces, rng), true_points)
    return {
        "time": entry["time"],
        "frame": frame,
        "chamfer_squared": mine[0],
        "hausdorff": mine[1],
        "linear_chamfer_squared": line[0],
        "linear_hausdorff": line[1],
        "floor_chamfer_squared": floor[0],
        "volume_ratio": volume(surface, triangles) / volume(truth, faces),
        "components": components,
        "closed": closed,
    }


def show(rows):
    print("   time frame | CD x1e3     HD | linear CD     HD |  floor | CD/linear volume parts closed")
    for row in rows:
        ratio = row["chamfer_squared"] / row["linear_chamfer_squared"]
        print(
            f"{row['time']:7.4f} {row['frame']:5.4g} | {1e3 * row['chamfer_squared']:7.4f} "
            f"{row['hausdorff']:6.4f} | {1e3 * row['linear_chamfer_squared']:9.4f} "
            f"{row['linear_hausdorff']:6.4f} | {1e3 * row['floor_chamfer_squared']:6.4f} | "
            f"{ratio:9.3f} {row['volume_ratio']:6.3f} {row['components']:5.3g} {row['closed']}"
        )


def main():
    arguments = [word for word in sys.argv[1:] if word != "--json"]
    if len(arguments) != 4:
        sys.exit(__doc__)
    folder, sequence = Path(arguments[0]), Path(arguments[1])
    first, last = int(arguments[2]), int(arguments[3])
    frames, faces = read_sequence(sequence)
    if not 0 <= first < last < len(frames):
        sys.exit(f"FROM = {first}, TO = {last}: must be 0 <= FROM < TO <= {len(frames) - 1}")
    both = np.concatenate([frames[first], frames[last]])
    centre = (both.min(0) + both.max(0)) / 2
    scale = ((area(frames[first], faces) + area(frames[last], faces)) / 2) ** -0.5
    ends = (first, last, lambda points: (points - centre) * scale)
    entries = json.loads((folder / "frames.json").read_text())
    between = sorted((e for e in entries if 0 < e["time"] < 1), key=lambda e: e["time"])
    if not between:
        sys.exit(f"{folder / 'frames.json'}: no surface with a time between 0 and 1")
    rng = np.random.default_rng(0)
    rows = [compare(entry, folder, frames, faces, ends, rng) for entry in between]
    mean = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    mean["components"] = max(row["components"] for row in rows)
    mean["closed"] = all(row["closed"] for row in rows)
    if "--json" in sys.argv:
        print(json.dumps({"frames": rows, "mean": mean}))
    else:
        show(rows)
        print("mean (components: most, closed: all)")
        show([mean])


if __name__ == "__main__":
    main()
