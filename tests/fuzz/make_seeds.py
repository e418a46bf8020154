#!/usr/bin/env python3
"""Writes the seeds of the fuzz targets: small valid files of each kind.

    python3 tests/fuzz/make_seeds.py NETWORK SOLVED

NETWORK and SOLVED are the folders of two small runs between two shapes, source.ply and target.ply beside them, by
tests/fuzz/runs/network/recipe.toml and tests/fuzz/runs/solved/recipe.toml. The recipe, metrics and state of the first and the checkpoints of both become seeds. The
target `checkpoint` has their files in it, from tests/fuzz/runs. Needs numpy.
"""

import io
import json
import struct
import sys
import zipfile
from pathlib import Path

import numpy as np

SEEDS = Path(__file__).parent / "seeds"
RUNS = Path(__file__).parent / "runs"
VERTICES = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)]
FACES = [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
TRIANGLES = [(0, 3, 2), (0, 2, 1), *FACES[1:]]


def write(target, name, content):
    path = SEEDS / target / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


def ply():
    def head(kind, extra=""):
        return (
            f"ply\nformat {kind} 1.0\ncomment a pyramid\nelement vertex 5\nproperty float x\nproperty float y\n"
            f"property float z\n{extra}element face 5\nproperty list uchar int vertex_indices\nend_header\n"
        )

    body = "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES)
    faces = "".join(f"{len(f)} {' '.join(map(str, f))}\n" for f in FACES)
    write("ply", "ascii.ply", head("ascii") + body + faces)
    write("ply", "crlf.ply", (head("ascii") + body + faces).replace("\n", "\r\n"))
    for name, mark in (("little", "<"), ("big", ">")):
        data = b"".join(struct.pack(f"{mark}3f", *v) for v in VERTICES)
        data += b"".join(struct.pack(f"{mark}B{len(f)}i", len(f), *f) for f in FACES)
        write("ply", f"{name}.ply", head(f"binary_{name}_endian").encode() + data)
    normals = "property double nx\nproperty double ny\nproperty double nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
    rows = "".join(f"{x} {y} {z} 0 0 1 255 0 7\n" for x, y, z in VERTICES)
    write("ply", "colours.ply", head("ascii", normals) + rows + faces)
    cloud = head("ascii").replace("element face 5\nproperty list uchar int vertex_indices\n", "")
    write("ply", "cloud.ply", cloud + body + "nan 0 0\n")
    strips = head("ascii").replace("element face 5\nproperty list uchar int vertex_indices", "element tristrips 1\nproperty list int int vertex_indices")
    write("ply", "strips.ply", strips + body + "7 0 1 4 2 -1 3 0\n")


def obj():
    body = "".join(f"v {x} {y} {z}\n" for x, y, z in VERTICES)
    plain = "".join(f"f {' '.join(str(i + 1) for i in f)}\n" for f in FACES)
    write("obj", "plain.obj", "# a pyramid\n" + body + plain)
    rich = "mtllib a.mtl\no one\ng walls\nusemtl red\nvn 0 0 1\nvt 0 1\n" + body
    rich += "".join(f"f {' '.join(f'{i + 1}/1/1' for i in f)}\n" for f in FACES)
    write("obj", "rich.obj", rich + "s off\nl 1 2\np 3\n")
    negative = body + "f -5 -2 \\\n-3 -4\nf -5//1 -4//1 -1//1\n"
    write("obj", "negative.obj", negative)
    write("obj", "colours.obj", "".join(f"v {x} {y} {z} 0.5 1 0\n" for x, y, z in VERTICES) + plain)


def off():
    body = "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES)
    faces = "".join(f"{len(f)} {' '.join(map(str, f))}\n" for f in FACES)
    write("off", "plain.off", f"OFF\n5 5 0\n{body}{faces}")
    normals = "".join(f"{x} {y} {z} 0 0 1\n" for x, y, z in VERTICES)
    write("off", "normals.off", f"NOFF\n# pyramid\n5 5 8\n{normals}{faces}")
    write("off", "colours.off", f"COFF 5 5 0\n" + normals.replace("\n", " 1\n") + faces)


def stl():
    triangle = lambda f: [VERTICES[i] for i in f]
    text = "solid a\n"
    for f in TRIANGLES:
        text += " facet normal 0 0 1\n  outer loop\n"
        text += "".join(f"   vertex {x} {y} {z}\n" for x, y, z in triangle(f))
        text += "  endloop\n endfacet\n"
    write("stl", "ascii.stl", text + "endsolid a\n")
    data = b"pyramid".ljust(80, b"\0") + struct.pack("<I", len(TRIANGLES))
    for f in TRIANGLES:
        data += struct.pack("<12fH", 0, 0, 1, *np.ravel(triangle(f)), 0)
    write("stl", "binary.stl", data)


def xyz():
    rows = [" ".join(map(str, v)) for v in VERTICES]
    write("xyz", "plain.xyz", "\n".join(rows) + "\n")
    write("xyz", "count.xyz", "5\nmade by hand\n" + "\n".join(rows) + "\n")
    write("xyz", "semicolons.xyz", "x;y;z;nx;ny;nz\n" + "\n".join("0,5;1,0;2e-3;0;0;1" for _ in rows) + "\n")
    write("xyz", "commas.xyz", "# cloud\n" + "\n".join(",".join(map(str, v)) for v in VERTICES) + "\n")


def array(values, **how):
    out = io.BytesIO()
    np.save(out, np.asarray(values, **how))
    return out.getvalue()


def npy():
    write("npy", "double.npy", array(VERTICES, dtype="<f8"))
    write("npy", "single-fortran.npy", array(np.asfortranarray(np.array(VERTICES, dtype=">f4"))))
    write("npy", "half.npy", array(VERTICES, dtype="<f2"))
    write("npy", "six.npy", array([(*v, 0, 0, 1) for v in VERTICES], dtype="<f4"))
    for name, compression in (("stored", zipfile.ZIP_STORED), ("deflated", zipfile.ZIP_DEFLATED)):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w", compression) as archive:
            archive.writestr("vertices.npy", array(VERTICES, dtype="<f4"))
            archive.writestr("faces.npy", array(TRIANGLES, dtype="<i4"))
        write("npz", f"{name}.npz", out.getvalue())


def glb():
    points = np.array(VERTICES, "<f4").tobytes()
    corners = np.array(TRIANGLES, "<u2").tobytes()
    corners += b"\0" * (-len(corners) % 4)
    asset = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [0, 1, 0], "rotation": [0, 0, 0, 1], "scale": [1, 2, 1]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(points) + len(corners)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(corners)},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 18, "type": "SCALAR"},
        ],
    }
    text = json.dumps(asset).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(points + corners), 0x004E4942) + points + corners
    write("glb", "mesh.glb", struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def anime():
    frames = np.array([VERTICES, VERTICES, VERTICES], "<f4")
    frames[1:] += 0.1
    data = struct.pack("<3i", 3, 5, len(TRIANGLES)) + frames[0].tobytes()
    data += np.array(TRIANGLES, "<i4").tobytes() + (frames[1:] - frames[0]).tobytes()
    write("anime", "pyramid.anime", data)


def pairs():
    write("pairs", "csv", b"\0source,target\n0,1\n2,3\n4,5\n")
    write("pairs", "index", b"\0,source,target\n0,0.0,1.0\n1,2.0,3.0\n")
    write("pairs", "npy", b"\1" + array([(0, 1), (2, 3)], dtype="<i8"))
    write("pairs", "vts", b"\2 3\n1\n 2\n3\n")
    write("pairs", "txt", b"\3\xef\xbb\xbf0\t1\r\n2\t3\r\n")
    write("pairs", "points", b"\0x,y,z,x,y,z\n0,0,0,1,1,1\n")


def recipe(root):
    for path in sorted((root / "data").glob("*/*.toml")):
        write("recipe", f"{path.parent.name}-{path.name}", path.read_bytes())


def cleaned(folder, file):
    """The content of a file in a run, without a path of a machine."""
    return file.read_bytes().replace(str(folder.parent.resolve()).encode(), b"/place")


def newest(folder):
    return sorted((folder / "checkpoints").iterdir())[-1]


def run(folder):
    metrics = (folder / "metrics.jsonl").read_bytes().splitlines(keepends=True)[:2]
    stored = cleaned(folder, folder / "recipe.toml")
    state = cleaned(folder, newest(folder) / "state.json")
    write("recipe", "stored.toml", stored)
    write("run", "whole", stored + b"\0" + b"".join(metrics) + b"\0" + state)


def checkpoints(folders):
    """Their files, and a seed of each: its place among all, as in the target, and its content."""
    place = 0
    for name, folder in folders.items():
        kept = RUNS / name
        kept.mkdir(parents=True, exist_ok=True)
        for file in (folder / "recipe.toml", newest(folder) / "state.json"):
            (kept / file.name).write_bytes(cleaned(folder, file))
        for file in sorted(newest(folder).glob("*.mpk")):
            (kept / file.name).write_bytes(file.read_bytes())
            write("checkpoint", f"{name}-{file.stem}", bytes([place]) + file.read_bytes())
            place += 1


def main():
    ply(), obj(), off(), stl(), xyz(), npy(), glb(), anime(), pairs()
    recipe(Path(__file__).parents[2])
    network, solved = map(Path, sys.argv[1:3])
    run(network)
    checkpoints({"network": network, "solved": solved})


if __name__ == "__main__":
    main()
