#!/usr/bin/env python3
"""Imports animated files into Blender and looks at what it made of them.

    isomorph extract RUN --frames 13 --format glb --carry -o out
    python3 scripts/blender_check.py out/carried.glb out/surface.glb

Needs Blender as a Python package: `pip install bpy==4.5.15`, with Python 3.11 (373 MB to download,
and GPL; it is a tool of this check, and no part of isomorph). So CI does not run it.

For carried.glb: one mesh with a shape key for each time after the first, whose values an action
moves; at the last frame the mesh lies elsewhere than at the first. For surface.glb: one mesh for
each time, of which exactly one has a scale above 0 at the first and the last frame. Exit status:
0 all is as it should be, 1 something is not, 2 usage.
"""

import sys
from pathlib import Path


def imported(bpy, path: Path) -> list:
    """The mesh objects of a file in an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    return [each for each in bpy.context.scene.objects if each.type == "MESH"]


def last_frame(bpy) -> int:
    """The last frame of any action."""
    return int(max((action.frame_range[1] for action in bpy.data.actions), default=0))


def positions(bpy, mesh, frame: int) -> list:
    """Where the vertices lie at a frame."""
    bpy.context.scene.frame_set(frame)
    shown = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return [tuple(mesh.matrix_world @ vertex.co) for vertex in shown.data.vertices]


def carried(bpy, path: Path) -> list[str]:
    """What is wrong with a mesh that has morph targets."""
    meshes = imported(bpy, path)
    if len(meshes) != 1:
        return [f"{len(meshes)} meshes, not one"]
    keys = meshes[0].data.shape_keys
    if keys is None or len(keys.key_blocks) < 2:
        return ["no shape keys"]
    wrong = []
    if keys.animation_data is None or not bpy.data.actions:
        wrong.append("no action moves the shape keys")
    first, last = (positions(bpy, meshes[0], frame) for frame in (0, last_frame(bpy)))
    moved = max(sum((a - b) ** 2 for a, b in zip(p, q)) for p, q in zip(first, last))
    if moved == 0.0:
        wrong.append("nothing moves")
    count, end = len(keys.key_blocks) - 1, last_frame(bpy)
    print(f"{path}: {len(first)} vertices, {count} shape keys, to frame {end}")
    return wrong


def in_turn(bpy, path: Path) -> list[str]:
    """What is wrong with meshes that are shown in turn."""
    meshes = imported(bpy, path)
    wrong = []
    for frame in (0, last_frame(bpy)):
        bpy.context.scene.frame_set(frame)
        shown = [each for each in meshes if min(each.matrix_world.to_scale()) > 1e-6]
        if len(shown) != 1:
            wrong.append(f"{len(shown)} meshes are shown at frame {frame}, not one")
    print(f"{path}: {len(meshes)} meshes in turn, to frame {last_frame(bpy)}")
    return wrong


def main(words: list[str]) -> int:
    if not words or words[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    import bpy  # noqa: PLC0415 - so that the usage can be read without it

    failed = False
    for path in map(Path, words):
        check = in_turn if path.name == "surface.glb" else carried
        for problem in check(bpy, path):
            print(f"{path}: {problem}", file=sys.stderr)
            failed = True
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
