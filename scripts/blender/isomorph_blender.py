"""isomorph in Blender: select meshes, press a button, get shape keys that turn the active one into the others.

Install: Edit > Preferences > Add-ons > Install from Disk, this file. The panel is in the sidebar (N) of the 3D view, tab
"isomorph". It needs the program `isomorph`, on the PATH or named in the preferences of the add-on. Blender 4.2 or later.
"""

from __future__ import annotations

import json
import os
import queue
import re
import shutil
import signal
import struct
import subprocess
import tempfile
import threading
from pathlib import Path

import bpy
import numpy as np

bl_info = {
    "name": "isomorph",
    "author": "The developers of isomorph",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "3D View > Sidebar > isomorph",
    "description": "Turns one mesh into another, or through several, as shape keys",
    "category": "Animation",
}

PRESETS = [
    ("instant", "instant", "Seconds"),
    ("quick", "quick", "Under a minute; for noisy scans"),
    ("default", "default", "Minutes; for fingers, paws and ears"),
]


# Files for the program and from it.


def write_ply(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> None:
    """A binary PLY; vertices `(n, 3)`, triangles `(m, 3)`."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    path.write_bytes(header.encode() + vertices.astype("<f8").tobytes() + faces.tobytes())


def read_morph(path: Path) -> np.ndarray:
    """The positions `(frames, n, 3)` of the carried mesh in an animated GLB of isomorph."""
    data = path.read_bytes()
    if data[:4] != b"glTF":
        raise ValueError(f"{path}: is no GLB")
    (length,) = struct.unpack_from("<I", data, 12)
    scene = json.loads(data[20 : 20 + length])
    start = 20 + length + 8

    def array(index: int) -> np.ndarray:
        accessor = scene["accessors"][index]
        view = scene["bufferViews"][accessor["bufferView"]]
        at = start + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return np.frombuffer(data, "<f4", 3 * accessor["count"], at).reshape(-1, 3)

    primitive = scene["meshes"][0]["primitives"][0]
    base = array(primitive["attributes"]["POSITION"]).astype(float)
    moved = [base + array(target["POSITION"]) for target in primitive["targets"]]
    return np.stack([base, *moved])


# Meshes of Blender.


def world_mesh(thing, vertices, mesh) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, and the triangles of a mesh, in the coordinates of the scene."""
    mesh.calc_loop_triangles()
    triangles = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    matrix = np.array(thing.matrix_world)
    return vertices @ matrix[:3, :3].T + matrix[:3, 3], triangles.reshape(-1, 3)


def coordinates(points) -> np.ndarray:
    flat = np.empty(3 * len(points), dtype=np.float32)
    points.foreach_get("co", flat)
    return flat.reshape(-1, 3).astype(float)


def own_mesh(thing) -> tuple[np.ndarray, np.ndarray]:
    """The mesh whose vertices the shape keys move: as it is without keys and modifiers."""
    keys = thing.data.shape_keys
    basis = keys.reference_key.data if keys else thing.data.vertices
    return world_mesh(thing, coordinates(basis), thing.data)


def shown_mesh(thing, depsgraph) -> tuple[np.ndarray, np.ndarray]:
    """The mesh that is seen, with modifiers."""
    shown = thing.evaluated_get(depsgraph)
    mesh = shown.to_mesh()
    try:
        return world_mesh(thing, coordinates(mesh.vertices), mesh)
    finally:
        shown.to_mesh_clear()


def natural(name: str) -> list:
    """`pose.2` before `pose.10`."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def in_order(active, selected) -> list:
    """The active object, then the other selected meshes in the order of their names."""
    others = [thing for thing in selected if thing is not active and thing.type == "MESH"]
    return [active, *sorted(others, key=lambda thing: natural(thing.name))]


def add_shape_keys(thing, positions: np.ndarray, first_frame: int, frames_between: int) -> None:
    """Shape keys, and an animation that shows one after the other.

    positions: `(count, n, 3)` in the coordinates of the scene; the first is that of the mesh itself.
    """
    if positions.shape[1] != len(thing.data.vertices):
        raise ValueError(f"{thing.name}: {positions.shape[1]} vertices came back for {len(thing.data.vertices)}")
    if thing.data.shape_keys:
        thing.shape_key_clear()
    back = np.linalg.inv(np.array(thing.matrix_world))
    thing.shape_key_add(name="Basis", from_mix=False)
    for number in range(1, len(positions)):
        key = thing.shape_key_add(name=f"isomorph {number}", from_mix=False)
        local = positions[number] @ back[:3, :3].T + back[:3, 3]
        key.data.foreach_set("co", local.astype(np.float32).ravel())
        for step, value in ((number - 1, 0.0), (number, 1.0), (number + 1, 0.0)):
            if step < len(positions):
                key.value = value
                key.keyframe_insert("value", frame=first_frame + step * frames_between)
        key.value = 0.0
    action = thing.data.shape_keys.animation_data.action
    for curve in curves_of(action):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    thing.data.update()


def curves_of(action):
    """The curves of an action, in the older form and in that of Blender 4.4 and later."""
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    return [curve for layer in action.layers for strip in layer.strips
            for bag in strip.channelbags for curve in bag.fcurves]


# The program.


def program(given: str) -> str:
    """The path of the program; a sentence if it is not there."""
    found = shutil.which(bpy.path.abspath(given) if given else "isomorph")
    if not found:
        raise FileNotFoundError(
            f"the program {given or 'isomorph'} was not found; install it, or name it in the preferences of the add-on"
        )
    return found


class Work:
    """The program at work; what it says is read beside it."""

    def __init__(self, command: list[str]):
        self.share, self.text, self.doubts = 0.0, "begins", []
        self._said: queue.Queue = queue.Queue()
        self._errors = tempfile.TemporaryFile("w+")
        self._child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self._errors, text=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self._child.stdout:
            self._said.put(line)

    def look(self) -> bool:
        """Takes in what was said; whether the program still works."""
        works = self._child.poll() is None
        if not works:
            self._reader.join(timeout=10)
        while not self._said.empty():
            self._hear(json.loads(self._said.get()))
        return works

    def _hear(self, event: dict) -> None:
        kind = event["event"]
        # Pairs are the first third of the bar, steps the second, surfaces the last.
        if kind == "matching":
            self.text, self.share = f"pairs: {event['stage']}", event["done"] / max(event["total"], 1) / 3
        elif kind == "started":
            self.steps = event["steps"]
        elif kind == "tick":
            self.text = f"step {event['step']} of {self.steps}"
            self.share = (1 + event["step"] / self.steps) / 3
        elif kind == "extracting":
            self.text, self.share = "surfaces", 2 / 3
            self.frames, self.made = event["frames"], 0
        elif kind == "extracted":
            self.made += 1
            self.share = (2 + min(self.made / self.frames, 1)) / 3
        elif kind == "doubtful":
            self.doubts.append(event["finding"])

    def stop(self) -> None:
        """Ctrl-C; a checkpoint is left."""
        if self._child.poll() is None:
            self._child.send_signal(signal.SIGTERM if os.name == "nt" else signal.SIGINT)

    def end(self) -> None:
        """Raises the last line of what went wrong."""
        status = self._child.wait()
        self.look()
        if status:
            self._errors.seek(0)
            lines = [line for line in self._errors.read().splitlines() if line.strip()]
            raise RuntimeError(lines[-1].removeprefix("error: ") if lines else f"isomorph ended with status {status}")


# What is seen.


class IsomorphPreferences(bpy.types.AddonPreferences):
    bl_idname = __name__
    program: bpy.props.StringProperty(
        name="Program", subtype="FILE_PATH", description="The program isomorph; that on the PATH without it"
    )

    def draw(self, _context):
        self.layout.prop(self, "program")


class IsomorphSettings(bpy.types.PropertyGroup):
    preset: bpy.props.EnumProperty(name="Preset", items=PRESETS)
    keys: bpy.props.IntProperty(name="Shape keys", default=12, min=1, max=200, description="Shapes after the first one")
    frames_between: bpy.props.IntProperty(name="Frames between", default=4, min=1, max=1000)
    share: bpy.props.FloatProperty(default=-1.0)
    text: bpy.props.StringProperty()


class ISOMORPH_OT_morph(bpy.types.Operator):
    """Turn the active mesh into the other selected one, or through several in the order of their names"""

    bl_idname = "isomorph.morph"
    bl_label = "Morph"
    bl_options = {"REGISTER", "UNDO"}

    program: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})

    @classmethod
    def poll(cls, context):
        active = context.active_object
        settings = context.scene.isomorph
        return (active is not None and active.type == "MESH" and context.mode == "OBJECT" and settings.share < 0
                and len(in_order(active, context.selected_objects)) > 1)

    def begin(self, context) -> None:
        settings = context.scene.isomorph
        things = in_order(context.active_object, context.selected_objects)
        self.thing = things[0].name
        addon = context.preferences.addons.get(__name__)
        command = [program(self.program or (addon.preferences.program if addon else ""))]
        self.folder = Path(tempfile.mkdtemp(prefix="isomorph-"))
        depsgraph = context.evaluated_depsgraph_get()
        files = []
        for number, thing in enumerate(things):
            mesh = own_mesh(thing) if number == 0 else shown_mesh(thing, depsgraph)
            # What is wrong with a shape is said with the name of its file.
            name = re.sub(r"[^\w.-]", "_", thing.name)
            files.append(self.folder / f"{number}-{name}.ply")
            write_ply(files[-1], *mesh)
        command += ["morph", *map(str, files), "--output", str(self.folder / "run"), "--json"]
        command += ["--frames", str(settings.keys + 1)]
        # Through more than two shapes there is one way, which is the program's own choice.
        if len(files) == 2:
            command += ["--preset", settings.preset]
        self.work = Work(command)

    def finish(self, context) -> set:
        try:
            self.work.end()
            positions = read_morph(self.folder / "run/meshes/carried.glb")
            settings = context.scene.isomorph
            thing = context.scene.objects[self.thing]
            add_shape_keys(thing, positions, context.scene.frame_start, settings.frames_between)
        except (RuntimeError, ValueError, OSError, KeyError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            shutil.rmtree(self.folder, ignore_errors=True)
        for doubt in self.work.doubts:
            self.report({"WARNING"}, f"doubtful: {doubt}")
        self.report({"INFO"}, f"{len(positions) - 1} shape keys")
        return {"FINISHED"}

    def execute(self, context):
        """From a script: until it is done."""
        try:
            self.begin(context)
        except (OSError, ValueError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return self.finish(context)

    def invoke(self, context, _event):
        """From the panel: beside whatever else is done."""
        try:
            self.begin(context)
        except (OSError, ValueError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        manager = context.window_manager
        self.timer = manager.event_timer_add(0.1, window=context.window)
        manager.modal_handler_add(self)
        context.scene.isomorph.share = 0.0
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        settings = context.scene.isomorph
        if event.type == "ESC" and event.value == "PRESS":
            self.work.stop()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        works = self.work.look()
        settings.share, settings.text = self.work.share, self.work.text
        for area in context.screen.areas if context.screen else ():
            area.tag_redraw()
        if works:
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        settings.share = -1.0
        return self.finish(context)


class ISOMORPH_PT_panel(bpy.types.Panel):
    bl_label = "isomorph"
    bl_idname = "ISOMORPH_PT_panel"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "isomorph"

    def draw(self, context):
        layout, settings = self.layout, context.scene.isomorph
        active = context.active_object
        things = in_order(active, context.selected_objects) if active and active.type == "MESH" else []
        if len(things) > 1:
            for number, thing in enumerate(things):
                layout.label(text=f"{number + 1}. {thing.name}", icon="MESH_DATA")
        else:
            layout.label(text="Select two meshes or more", icon="INFO")
            layout.label(text="The active one gets the shape keys")
        row = layout.row()
        row.active = len(things) < 3
        row.prop(settings, "preset")
        layout.prop(settings, "keys")
        layout.prop(settings, "frames_between")
        if settings.share >= 0:
            layout.progress(factor=settings.share, text=settings.text)
            layout.label(text="Esc ends it")
        layout.operator(ISOMORPH_OT_morph.bl_idname)


CLASSES = (IsomorphPreferences, IsomorphSettings, ISOMORPH_OT_morph, ISOMORPH_PT_panel)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.isomorph = bpy.props.PointerProperty(type=IsomorphSettings)


def unregister():
    del bpy.types.Scene.isomorph
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)


if __name__ == "__main__":
    register()
