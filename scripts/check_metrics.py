#!/usr/bin/env python3
"""The metrics of `isomorph evaluate` a second time, written independently of it.

    python3 scripts/check_metrics.py MESH TRUTH [--ends FROM TO]
    python3 scripts/check_metrics.py --run MESHES SEQUENCE.anime FROM TO

A mesh is a file that trimesh reads (PLY, OBJ, ...) or a frame of a sequence, SEQUENCE.anime:FRAME.

The first form prints, as JSON, what `evaluate` prints of a surface MESH against the true one TRUTH.
With --ends both are brought into the normalised coordinates of the pair FROM, TO (union bounding
box centred, mean area 1), which is what `evaluate` works in; without, they are taken as they are.

The second prints the frames of a run: MESHES is a folder with frames.json, [{"time": t, "surface":
"file.ply", ...}, ...], as `extract` writes it; FROM and TO are the frames that the run was given.
Each surface with 0 < t < 1 is compared with the true frame nearest to its time (extract at the
frames' own times to compare with `evaluate`), with the straight lines and the floor beside it.

100,000 area-uniform samples of each surface, nearest neighbours by scipy.spatial.cKDTree; areas,
volumes and pieces by trimesh. The samples are others than isomorph's, so distances agree within
sampling noise: means within 3 %, maxima within 10 %; ratios and pieces agree to rounding. `closed`
says whether every edge is in exactly two triangles, without which a volume means little. Needs
numpy, scipy and trimesh.
"""

import json
import sys
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

SAMPLES = 100_000


def read_sequence(path):
    """(frames, vertices, 3) positions, (triangles, 3) indices; layout: src/formats/anime.rs."""
    data = Path(path).read_bytes()
    frames, vertices, triangles = np.frombuffer(data, "<i4", 3)
    first = np.frombuffer(data, "<f4", 3 * vertices, 12).reshape(-1, 3)
    faces = np.frombuffer(data, "<i4", 3 * triangles, 12 + 12 * vertices).reshape(-1, 3)
    start = 12 + 12 * (vertices + triangles)
    offsets = np.frombuffer(data, "<f4", -1, start).reshape(frames - 1, vertices, 3)
    return np.concatenate([first[None], first + offsets]).astype(float), faces


def read_mesh(name):
    """A mesh file, or one frame of a sequence; vertices are neither merged nor reordered."""
    path, colon, frame = str(name).rpartition(":")
    if colon and path.endswith(".anime"):
        frames, faces = read_sequence(path)
        return trimesh.Trimesh(frames[int(frame)], faces, process=False)
    return trimesh.load(name, force="mesh", process=False)


def moved(mesh, vertices):
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def frame_of_ends(source, target):
    """The map into normalised coordinates: union bounding box centred, mean area 1."""
    corners = np.concatenate([source.bounds, target.bounds])
    centre = (corners.min(0) + corners.max(0)) / 2
    scale = ((source.area + target.area) / 2) ** -0.5
    return lambda mesh: moved(mesh, (mesh.vertices - centre) * scale)


def samples(mesh, rng):
    """Points and the unit normals of their triangles."""
    normals = np.cross(*(mesh.triangles[:, k] - mesh.triangles[:, 0] for k in (1, 2)))
    lengths = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(lengths), SAMPLES, p=lengths / lengths.sum())
    weights = rng.dirichlet(np.ones(3), SAMPLES)  # uniform over a triangle
    points = np.einsum("ij,ijk->ik", weights, mesh.triangles[chosen])
    return points, normals[chosen] / lengths[chosen, None]


def one_way(one, other):
    """Distances from the samples of one surface to those of another, and how the normals agree."""
    distances, nearest = cKDTree(other[0]).query(one[0], workers=-1)
    return distances, np.abs((one[1] * other[1][nearest]).sum(1)).mean()


def pieces(mesh):
    """The number of connected pieces, the share of the area outside the largest, and closedness."""
    # Vertices that the file repeats at one place are one.
    _, same = np.unique(mesh.vertices, axis=0, return_inverse=True)
    faces = same.reshape(-1)[mesh.faces]
    # Triangles of a piece share at least a vertex.
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    labels = trimesh.graph.connected_component_labels(edges, node_count=same.max() + 1)[faces[:, 0]]
    areas = np.bincount(labels, mesh.area_faces)[np.unique(labels)]
    sides = np.sort(np.concatenate([edges, faces[:, [2, 0]]]), axis=1)
    uses = np.unique(sides, axis=0, return_counts=True)[1]
    return len(areas), 1 - areas.max() / areas.sum(), bool((uses == 2).all())


def compare(mesh, truth, rng):
    """The metrics of `evaluate`, under the same names."""
    one, other = samples(mesh, rng), samples(truth, rng)
    (there, normals_there), (back, normals_back) = one_way(one, other), one_way(other, one)
    hausdorff = max(there.max(), back.max())
    count, outside, closed = pieces(mesh)
    metrics = {
        "chamfer": (there.mean() + back.mean()) / 2,
        "chamfer_squared": (there**2).mean() + (back**2).mean(),
        "hausdorff": hausdorff,
        "hausdorff_squared": hausdorff**2,
        "hausdorff95": max(np.percentile(there, 95), np.percentile(back, 95)),
        "normal_consistency": (normals_there + normals_back) / 2,
        "volume_ratio": mesh.volume / truth.volume if truth.volume else 0.0,
        "area_ratio": mesh.area / truth.area,
        "components": count,
        "outside_largest": outside,
    }
    if np.array_equal(mesh.faces, truth.faces):
        off = mesh.vertices - truth.vertices
        metrics["tracked_rmse"] = np.sqrt((off**2).sum(1).mean())
    return {name: float(value) for name, value in metrics.items()} | {"closed": closed}


def compare_run(folder, sequence, first, last):
    """A row per surface strictly between the ends."""
    frames, faces = read_sequence(sequence)
    if not 0 <= first < last < len(frames):
        sys.exit(f"FROM = {first}, TO = {last}: must be 0 <= FROM < TO <= {len(frames) - 1}")
    entries = json.loads((Path(folder) / "frames.json").read_text())
    entries = sorted((e for e in entries if 0 < e["time"] < 1), key=lambda e: e["time"])
    if not entries:
        sys.exit(f"{folder}/frames.json: no surface with a time between 0 and 1")
    true_mesh = lambda frame: trimesh.Trimesh(frames[frame], faces, process=False)
    ends = true_mesh(first), true_mesh(last)
    to_normal = frame_of_ends(*ends)
    rng = np.random.default_rng(0)
    rows = []
    for entry in entries:
        frame = round(first + entry["time"] * (last - first))
        share = (frame - first) / (last - first)
        truth = to_normal(true_mesh(frame))
        line = moved(truth, (1 - share) * ends[0].vertices + share * ends[1].vertices)
        row = {"frame": frame, "time": entry["time"]}
        for kind in ("surface", "carried"):
            if entry.get(kind):
                mesh = to_normal(read_mesh(Path(folder) / entry[kind]))
                row[kind] = compare(mesh, truth, rng)
        row["linear"] = compare(to_normal(line), truth, rng)
        row["floor"] = compare(truth, truth, rng)
        rows.append(row)
    return {"frames": rows, "mean": mean_of(rows)}


def mean_of(rows):
    """Means entry by entry, of what all rows have."""
    mean = {}
    for kind in ("surface", "carried", "linear", "floor"):
        found = [row[kind] for row in rows if kind in row]
        if len(found) == len(rows):
            names = [name for name in found[0] if all(name in metrics for metrics in found)]
            mean[kind] = {name: float(np.mean([m[name] for m in found])) for name in names}
    return mean


def main():
    words = sys.argv[1:]
    if len(words) == 5 and words[0] == "--run":
        result = compare_run(words[1], words[2], int(words[3]), int(words[4]))
    elif len(words) == 2 or (len(words) == 5 and words[2] == "--ends"):
        mesh, truth = map(read_mesh, words[:2])
        if words[2:]:
            to_normal = frame_of_ends(*map(read_mesh, words[3:]))
            mesh, truth = to_normal(mesh), to_normal(truth)
        result = compare(mesh, truth, np.random.default_rng(0))
    else:
        sys.exit(__doc__)
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
