"""Tries the add-on in Blender without a window: python scripts/blender/addon_test.py [PROGRAM] [PICTURE]

Needs Blender as a module, for Python 3.11: pip install bpy==4.5.15 (373 MB, GPL). PROGRAM is target/release/isomorph
without it. PICTURE, a .png, shows the mesh between the two shapes, drawn by Blender.
"""

import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(Path(__file__).parent))
import isomorph_blender as addon  # noqa: E402


def bent(thing, amount):
    """Bends a mesh upwards along x."""
    points = addon.coordinates(thing.data.vertices)
    points[:, 2] += amount * points[:, 0] ** 2
    thing.data.vertices.foreach_set("co", points.astype(np.float32).ravel())


def bar(name, amount, place, turn=0.0):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.0, location=place, rotation=(0, 0, turn))
    thing = bpy.context.active_object
    thing.name = name
    points = addon.coordinates(thing.data.vertices) * [2.0, 0.5, 0.3]
    thing.data.vertices.foreach_set("co", points.astype(np.float32).ravel())
    bent(thing, amount)
    bpy.context.view_layer.update()
    return thing


def select(active, *others):
    bpy.ops.object.select_all(action="DESELECT")
    for thing in (active, *others):
        thing.select_set(True)
    bpy.context.view_layer.objects.active = active


def seen(thing, frame):
    """World coordinates at a frame of the animation."""
    bpy.context.scene.frame_set(frame)
    return addon.shown_mesh(thing, bpy.context.evaluated_depsgraph_get())[0]


def drawn(path):
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (1.0, -9.0, 1.0), (1.5, 0, 0)
    scene.camera = camera
    scene.render.engine, scene.cycles.samples = "CYCLES", 8
    lamp = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    lamp.rotation_euler = (0.6, 0.2, 0.3)
    scene.collection.objects.link(lamp)
    scene.render.resolution_x, scene.render.resolution_y = 640, 360
    scene.render.filepath = str(Path(path).resolve())
    bpy.ops.render.render(write_still=True)


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "target/release/isomorph")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon.register()
    scene = bpy.context.scene
    scene.isomorph.keys, scene.isomorph.frames_between = 4, 5
    # Objects with places and turns of their own: what counts is where they are in the scene.
    source = bar("source", 0.0, (0.0, 0.0, 0.0), turn=0.3)
    target = bar("target", 0.25, (0.4, 0.0, 0.2), turn=0.3)
    wanted = addon.own_mesh(target)[0]
    before = addon.own_mesh(source)[0]
    select(source, target)
    assert bpy.ops.isomorph.morph.poll()
    assert bpy.ops.isomorph.morph(program=program) == {"FINISHED"}
    keys = source.data.shape_keys.key_blocks
    assert [key.name for key in keys] == ["Basis", *(f"isomorph {k}" for k in range(1, 5))]
    start, end = scene.frame_start, scene.frame_start + 20
    assert np.abs(seen(source, start) - before).max() < 1e-5, "it begins where it is"
    # Vertices at the end lie on the target: the surfaces agree, whatever corresponds to what.
    last = seen(source, end)
    gaps = np.sqrt(((last[:, None] - wanted[None]) ** 2).sum(axis=2)).min(axis=1)
    assert gaps.mean() < 0.05, gaps.mean()
    half = seen(source, (start + end) // 2)
    middle = (before.mean(axis=0) + wanted.mean(axis=0)) / 2
    assert np.abs(half.mean(axis=0) - middle).max() < 0.05
    between = seen(source, start + 12), seen(source, start + 10), seen(source, start + 15)
    assert np.abs(between[0] - (0.6 * between[1] + 0.4 * between[2])).max() < 1e-5, "straight from key to key"
    if len(sys.argv) > 2:
        target.hide_render = True
        scene.frame_set((start + end) // 2)
        drawn(sys.argv[2])

    # A second time it begins from the mesh itself, and goes through three shapes.
    third = bar("target.10", 0.0, (0.8, 0.0, 0.4), turn=0.3)
    assert [each.name for each in addon.in_order(source, [third, target, source])] == ["source", "target", "target.10"]
    select(source, target, third)
    assert bpy.ops.isomorph.morph(program=program) == {"FINISHED"}
    assert np.abs(seen(source, start) - before).max() < 1e-5
    assert abs(seen(source, end)[:, 2].mean() - 0.4) < 0.05

    # What the bar of the panel shows, and Esc.
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{number}.ply" for number in range(2)]
        for file, thing in zip(files, (source, target)):
            addon.write_ply(file, *addon.own_mesh(thing))
        command = [program, "morph", *map(str, files), "--output", f"{folder}/run", "--json"]
        work, shares, texts = addon.Work(command), [0.0], {""}
        while work.look():
            shares.append(work.share)
            texts.add(work.text.split()[0].strip(":"))
            time.sleep(0.01)
        work.end()
        assert shares == sorted(shares) and len(set(shares)) > 5 and work.share == 1.0, shares
        assert {"pairs", "step", "surfaces"} & texts, texts
        stopped = addon.Work([*command, "--force", "--preset", "default"])
        while stopped.look() and "step" not in stopped.text:
            time.sleep(0.01)
        stopped.stop()
        try:
            stopped.end()
            raise AssertionError("it was not stopped")
        except RuntimeError as error:
            assert "stopped" in str(error) or "130" in str(error), error

    # What cannot be done is said, and nothing is changed.
    count = len(source.data.shape_keys.key_blocks)
    flat = bpy.data.objects.new("flat", bpy.data.meshes.new("flat"))
    scene.collection.objects.link(flat)
    for others, given, why in (([target], "no-such-program", "not found"), ([flat], program, "flat.ply: 0 points")):
        select(source, *others)
        try:
            bpy.ops.isomorph.morph(program=given)
            raise AssertionError("it was done")
        except RuntimeError as error:
            assert why in str(error), error
    assert len(source.data.shape_keys.key_blocks) == count
    addon.unregister()
    print(f"add-on: passed in Blender {bpy.app.version_string}")


main()
