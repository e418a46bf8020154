"""Tests of the package: `pytest` in the project's folder, with the wheel installed."""

import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import isomorph
import numpy as np
import pytest

# Small networks and few points: seconds at most.
SMALL = {
    "training": {"steps": 40, "batch": 100, "correspondence_batch": 20, "guided_until": 0, "log_every": 5},
    "implicit": {"depth": 2, "width": 16},
    "velocity": {"depth": 2, "width": 16},
    "checkpoint.every": 10,
    "result.resolution": 24,
}


def sphere(shift=0.0, rings=12):
    """Vertices and faces of a sphere of radius 1."""
    sectors = 2 * rings
    points = [(0, 0, 1)]
    for ring in range(1, rings):
        polar = np.pi * ring / rings
        for sector in range(sectors):
            angle = 2 * np.pi * sector / sectors
            points.append((np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)))
    points.append((0, 0, -1))
    at = lambda ring, sector: 1 + (ring - 1) * sectors + sector % sectors
    faces = []
    for sector in range(sectors):
        faces.append((0, at(1, sector), at(1, sector + 1)))
        for ring in range(1, rings - 1):
            a, b, c, d = at(ring, sector), at(ring, sector + 1), at(ring + 1, sector), at(ring + 1, sector + 1)
            faces += [(a, c, d), (a, d, b)]
        faces.append((len(points) - 1, at(rings - 1, sector + 1), at(rings - 1, sector)))
    return np.array(points, float) + [shift, 0, 0], np.array(faces)


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A sphere that moves by 0.5 along x, solved with splines."""
    folder = tmp_path_factory.mktemp("shared") / "moved"
    return isomorph.morph(sphere(), sphere(0.5), run=folder, frames=2, settings={"result.resolution": 32})


def test_arrays_go_in_and_the_motion_comes_out_in_the_users_coordinates(run):
    vertices, faces = run.surface(t=0.5, resolution=48)
    assert vertices.dtype == np.float64 and vertices.shape[1] == faces.shape[1] == 3
    assert faces.max() < len(vertices)
    # A sphere of radius 1 about (0.25, 0, 0): a thousandth of its size is what the grid allows.
    radii = np.linalg.norm(vertices - [0.25, 0, 0], axis=1)
    assert abs(radii.mean() - 1) < 0.01 and radii.std() < 0.01
    points = sphere()[0]
    moved = run.carry(points, 0.0, 1.0)
    assert np.abs(moved - points - [0.5, 0, 0]).max() < 0.02
    assert np.abs(run.velocity(points, 0.0) - [0.5, 0, 0]).max() < 0.05
    distance, gradient = run.distance([[0.25, 0, 0], [1.35, 0, 0]], t=0.5)
    assert distance == pytest.approx([-1, 0.1], abs=0.05)
    assert gradient[1] == pytest.approx([1, 0, 0], abs=0.1)


def test_lists_other_types_and_strides_are_points_too(run):
    points = sphere()[0]
    wanted = run.carry(points, 0.0, 0.3)
    for same in (points.tolist(), points.astype(np.float32), np.asfortranarray(points), points[::-1][::-1]):
        assert np.allclose(run.carry(same, 0.0, 0.3), wanted, atol=1e-6)
    for wrong in (points[:, :2], points.ravel(), "points", [["a", "b", "c"]], 3.0):
        with pytest.raises(ValueError, match="points"):
            run.carry(wrong)
    assert run.carry(np.zeros((0, 3))).shape == (0, 3)


def test_mistakes_are_value_errors_with_the_words_of_the_command_line(run, place):
    with pytest.raises(ValueError, match="time 2: must be 0 to 1"):
        run.surface(2.0)
    with pytest.raises(ValueError, match="no/such.ply: cannot be read"):
        isomorph.morph("no/such.ply", "b.ply")
    with pytest.raises(ValueError, match="not a run"):
        isomorph.open(place)
    with pytest.raises(ValueError, match="did you mean steps"):
        isomorph.morph(sphere(), sphere(1), settings={"training.stesp": 3})
    with pytest.raises(ValueError, match="exists already"):
        isomorph.morph(sphere(), sphere(1), run=run.path)
    with pytest.raises(ValueError, match="no shape"):
        isomorph.morph(object(), sphere())
    with pytest.raises(ValueError, match="faces: 0 to 5: must be 0 to 2"):
        isomorph.Shape(np.eye(3), [[0, 1, 5]])


def test_objects_of_other_packages_are_shapes_by_their_attributes():
    vertices, faces = sphere()
    normals = vertices.copy()
    flat = np.column_stack([np.full(len(faces), 3), faces]).ravel()
    for what, has_faces in (
        (vertices, False),
        ((vertices,), False),
        ((vertices, faces), True),
        (vertices.tolist(), False),
        (SimpleNamespace(vertices=vertices, faces=faces, triangles=vertices[faces]), True),  # trimesh
        (SimpleNamespace(vertices=vertices, triangles=faces), True),  # open3d
        (SimpleNamespace(points=vertices, normals=normals), False),  # open3d
        (SimpleNamespace(points=vertices, cells_dict={"triangle": faces}), True),  # meshio
        (SimpleNamespace(points=vertices, n_points=len(vertices), faces=flat), True),  # pyvista
    ):
        shape = isomorph.Shape.of(what)
        assert np.array_equal(shape.vertices, vertices)
        assert (shape.faces is not None) == has_faces
        if has_faces:
            assert np.array_equal(shape.faces, faces)
    quads = SimpleNamespace(points=vertices, cells_dict={"quad": [[0, 1, 2, 3]]})
    assert isomorph.Shape.of(quads).faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    # An array that is as it must be is taken without a copy.
    assert isomorph.Shape(vertices).vertices is vertices


def test_trimesh_goes_in_and_out():
    trimesh = pytest.importorskip("trimesh")
    source = trimesh.creation.icosphere(subdivisions=3)
    target = source.copy().apply_translation([0.5, 0, 0])
    run = isomorph.morph(source, target, frames=0)
    vertices, faces = run.surface(0.5, 48)
    made = trimesh.Trimesh(vertices, faces)
    assert made.is_watertight
    assert made.volume == pytest.approx(source.volume, rel=0.02)
    assert made.center_mass == pytest.approx([0.25, 0, 0], abs=0.01)


def test_files_shapes_and_normals(place):
    vertices, faces = sphere()
    shape = isomorph.Shape(vertices, faces)
    shape.save("a.ply")
    again = isomorph.Shape.read("a.ply")
    assert np.allclose(again.vertices, vertices, atol=1e-6) and np.array_equal(again.faces, faces)
    assert repr(again) == f"<isomorph mesh of {len(vertices)} vertices and {len(faces)} faces>"
    normals = isomorph.estimate_normals(vertices)
    # Out of the sphere, within the coarseness of its points.
    assert np.sum(normals * vertices, axis=1).min() > 0.9


def test_a_run_that_is_refused_leaves_the_shapes_of_the_one_that_is_there(place):
    run = isomorph.morph(sphere(), sphere(0.5), run="run", frames=0, settings=SMALL | {"preset": "quick"})
    before = {path.name: path.read_bytes() for path in (place / "run.shapes").iterdir()}
    for overwrite, settings, why in ((False, {}, "exists already"), (True, {"training.stesp": 1}, "did you mean")):
        with pytest.raises(ValueError, match=why):
            isomorph.morph(sphere(3), sphere(4), run="run", overwrite=overwrite, settings=settings)
    after = {path.name: path.read_bytes() for path in (place / "run.shapes").iterdir()}
    assert before.items() <= after.items()
    assert isomorph.resume("run", settings={"training.steps": 45}).metrics[-1]["step"] == 45
    assert run.path == Path("run")


def test_pairs_are_found_and_taken(place):
    # No symmetry: a bar with a thorn.
    vertices, faces = sphere(rings=16)
    vertices = vertices * [3, 1, 0.6]
    vertices[:, 2] += 0.4 * np.exp(-((vertices[:, 0] - 1.5) ** 2) * 4)
    turned = vertices @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1.0]])
    pairs, sure = isomorph.match((vertices, faces), (turned, faces))
    assert pairs.shape[1] == 2 and len(sure) == len(pairs) and (sure >= 0.5).all()
    off = np.linalg.norm(turned[pairs[:, 1]] - turned[pairs[:, 0]], axis=1)
    assert np.median(off) < 0.2
    same = np.column_stack([np.arange(50), np.arange(50)])
    run = isomorph.morph((vertices, faces), (turned, faces[::-1]), pairs=same, frames=0)
    assert "50 correspondences" in (run.path / "run.log").read_text()


def test_training_is_heard_and_equals_that_of_the_command_line(place):
    for name, shift in (("a", 0.0), ("b", 0.5)):
        isomorph.Shape(*sphere(shift)).save(f"{name}.ply")
    recipe = {"preset": "quick", "data": {"source": "a.ply", "target": "b.ply", "correspondences": "same-vertices"}}
    events = []
    run = isomorph.train(recipe | {"result": {"frames": 0}}, "run", settings=SMALL, on_event=events.append)
    kinds = [event["event"] for event in events]
    assert kinds.count("tick") == 40 and "started" in kinds and "finished" in kinds
    assert [line["step"] for line in run.metrics][-1] == 40
    program = os.environ.get("ISOMORPH_PROGRAM")
    if program:
        (place / "recipe.toml").write_text(run.recipe)
        subprocess.run([program, "train", "recipe.toml", "--quiet", "--run", "other"], check=True)
        for file in ("ends.mpk", "velocity.mpk"):
            one, other = ((Path(name) / "checkpoints/step-000040" / file).read_bytes() for name in ("run", "other"))
            assert one == other
        points = sphere()[0]
        assert np.array_equal(isomorph.open("other").carry(points), run.carry(points))


@pytest.mark.filterwarnings("ignore::isomorph.IsomorphWarning")
def test_a_bar_of_tqdm_follows_training_surfaces_and_batches(place, capsys):
    pytest.importorskip("tqdm")
    run = isomorph.morph(sphere(), sphere(0.5), preset="quick", run="run", frames=2, settings=SMALL, progress=True)
    assert "40/40" in capsys.readouterr().err
    run.save_glb("motion.glb", frames=3, resolution=16, progress=True)
    assert "surfaces" in capsys.readouterr().err
    settings = {"data.points": 1000, "spline.band": 500, "result.frames": 0}
    isomorph.Batch([(sphere(), sphere(0.5))], folder="many", settings=settings).run(progress=True)
    assert "1/1" in capsys.readouterr().err
    # Nobody looks: no bar.
    run.save_glb("motion.glb", frames=2, resolution=16)
    assert capsys.readouterr().err == ""


def test_a_run_is_resumed_with_more_steps(place):
    for name, shift in (("a", 0.0), ("b", 0.5)):
        isomorph.Shape(*sphere(shift)).save(f"{name}.ply")
    text = 'preset = "quick"\ndata.source = "a.ply"\ndata.target = "b.ply"\ndata.correspondences = "same-vertices"\n'
    isomorph.train(text, "run", settings=SMALL | {"result.frames": 0})
    longer = isomorph.resume("run", settings={"training.steps": 60})
    assert longer.metrics[-1]["step"] == 60
    with pytest.raises(isomorph.TrainingError, match="trained network cannot change its shape"):
        isomorph.resume("run", settings={"implicit.width": 20})


def test_a_run_goes_on_to_shapes_that_are_appended(place):
    files = [f"{k}.ply" for k in range(3)]
    for k, name in enumerate(files):
        isomorph.Shape(*sphere(0.5 * k)).save(name)
    before = isomorph.morph(*files[:2], pairs="same-vertices", run="run", frames=0).metrics[-1]["step"]
    longer = isomorph.resume("run", append=files[2:], times=[3])
    assert longer.times == [0.0, 1.0, 3.0]
    assert longer.metrics[-1]["step"] == before + 10
    moved = longer.carry(sphere()[0], 0, 3)
    assert np.abs(moved - sphere(1.0)[0]).max() < 0.05
    with pytest.raises(ValueError, match="2 times for 1 shapes"):
        isomorph.resume("run", append=files[2:], times=[4, 5])


def test_an_exception_of_a_callback_comes_out_and_leaves_a_checkpoint(place):
    def stop(event):
        if event["event"] == "tick" and event["step"] == 25:
            raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        isomorph.morph(sphere(), sphere(0.5), preset="quick", run="run", frames=0, settings=SMALL, on_event=stop)
    assert isomorph.resume("run").metrics[-1]["step"] == 40


def interrupt(place, call, run):
    """Ctrl-C in the middle of a call that trains far too long on a.ply and b.ply, once `run` has logged something."""
    isomorph.Shape(*sphere()).save("a.ply")
    isomorph.Shape(*sphere(0.5)).save("b.ply")
    settings = SMALL | {"training": SMALL["training"] | {"steps": 100000}, "checkpoint.every": 100000}
    code = f"import isomorph, json\nsettings = json.loads({json.dumps(settings)!r})\n{call}\n"
    child = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
    metrics = place / run / "metrics.jsonl"
    while not (metrics.exists() and metrics.stat().st_size):
        assert child.poll() is None, child.stderr.read()
        time.sleep(0.01)
    child.send_signal(signal.SIGINT)
    _, told = child.communicate(timeout=60)
    assert "KeyboardInterrupt" in told


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_leaves_a_checkpoint_that_is_resumed(place):
    call = "isomorph.morph('a.ply', 'b.ply', preset='quick', run='run', frames=0, settings=settings)"
    interrupt(place, call, "run")
    steps = [int(path.name.removeprefix("step-")) for path in (place / "run/checkpoints").iterdir()]
    assert len(steps) == 1 and 0 < steps[0] < 100000
    run = isomorph.resume("run", settings={"training.steps": steps[0] + 10})
    assert run.metrics[-1]["step"] == steps[0] + 10


def test_the_interpreter_is_free_meanwhile_and_threads_share_a_run(run):
    ticks, done = [], threading.Event()

    def count():
        while not done.wait(0.001):
            ticks.append(1)

    counter = threading.Thread(target=count)
    counter.start()
    run.surface(0.5, 96)
    done.set()
    counter.join()
    assert len(ticks) > 5
    points = sphere()[0]
    wanted, found = run.carry(points, 0.0, 0.5), []
    threads = [threading.Thread(target=lambda: found.append(run.carry(points, 0.0, 0.5))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4 and all(np.array_equal(each, wanted) for each in found)


def test_files_for_others(run, place):
    carried = run.save_glb("motion.glb", frames=3, resolution=24)
    assert carried.read_bytes()[:4] == b"glTF"
    surface = run.save_glb(place / "deep/surface.glb", what="surface", frames=3, resolution=24)
    assert surface.stat().st_size > 1000
    assert sorted(path.name for path in (place / "deep").iterdir()) == ["surface.glb"]
    with pytest.raises(ValueError, match="must end in .glb"):
        run.save_glb("motion.obj")
    assert "<html" in run.page().read_text("utf-8")[:500]


def test_runs_are_copied_and_pickled_by_their_folder(run):
    points = sphere()[0]
    for same in (pickle.loads(pickle.dumps(run)), copy.copy(run), copy.deepcopy(run)):
        assert np.array_equal(same.carry(points), run.carry(points))
    assert repr(run) == f"<isomorph run {run.path}>" and os.fspath(run) == str(run.path)
    surface = run.surface(0.5, 24)
    again = pickle.loads(pickle.dumps(surface))
    assert np.array_equal(again.vertices, surface.vertices) and np.array_equal(again.normals, surface.normals)


def test_doubts_are_warnings(place):
    plane = np.array([(x, y, 0) for x in range(12) for y in range(12)], float) / 11
    at = lambda x, y: 12 * x + y
    faces = [f for x in range(11) for y in range(11)
             for f in ((at(x, y), at(x + 1, y), at(x + 1, y + 1)), (at(x, y), at(x + 1, y + 1), at(x, y + 1)))]
    small = {"training.steps": 2, "result.resolution": 16, **{k: v for k, v in SMALL.items() if k != "training"}}
    small |= {"training.batch": 100, "training.guided-until": 0}
    with pytest.warns(isomorph.IsomorphWarning):
        run = isomorph.morph((plane, faces), (plane + [0, 0, 0.3], faces), preset="quick", frames=2, settings=small)
    assert any(note.startswith("doubtful: ") for note in run.notes)
    assert any("open sheet" in note for note in run.notes)


def test_three_shapes_are_one_motion_in_their_own_time(place):
    # Faster and faster: x = .02 t^2.
    vertices, faces = sphere()
    at = lambda time: (vertices + [0.02 * time**2, 0, 0], faces)
    settings = {"result.resolution": 24, "spline.band": 1000, "spline.spacing": 0.15, "data.points": 2000}
    run = isomorph.morph(at(0), at(2), at(5), times=[0, 2, 5], frames=2, settings=settings)
    assert run.times == [0.0, 2.0, 5.0]
    # The truth is at .245, natural cubic splines through the three are at .256, straight lines at .29.
    moved = run.carry(vertices, start=0, end=3.5)
    assert 0.24 < (moved - vertices).mean(axis=0)[0] < 0.283
    off = np.linalg.norm(run.carry(vertices) - at(5)[0], axis=1)
    assert off.mean() < 0.03, "from the first to the last"
    assert 0.05 < run.velocity(at(2)[0], t=2).mean(axis=0)[0] < 0.12, "per unit of the times"
    with pytest.raises(ValueError, match="must be 0 to 5"):
        run.surface(t=6)
    with pytest.raises(ValueError, match="2 times for 3 files"):
        isomorph.morph(at(0), at(2), at(5), times=[0, 2], run="other")
    with pytest.raises(ValueError, match="takes two key frames"):
        isomorph.morph(at(0), at(2), at(5), preset="paper", run="other")


def test_a_run_is_measured_against_true_frames(run, place):
    vertices, faces = sphere()
    frames = np.stack([vertices + [0.5 * t, 0, 0] for t in (0.0, 0.25, 0.5, 1.0)])
    found = isomorph.evaluate(run, frames[[0, 2, 3]], faces=faces, samples=2000, resolution=32)
    assert [frame["frame"] for frame in found.frames] == [1]
    assert found.mean["carried"]["tracked_rmse"] < 0.02 and found.mean["surface"]["components"] == 1
    assert "surface" in str(found) and "floor" in repr(found)
    assert json.loads((run.path / "evaluation.json").read_text())["mean"] == found.mean
    # Meshes, files, and numbers of frames say the same.
    (place / "frames").mkdir()
    for number, frame in enumerate(frames):
        isomorph.Shape(frame, faces).save(place / f"frames/frame-{number}.ply")
    again = isomorph.evaluate(run, place / "frames", keys=[0, 3], every=2, samples=2000, resolution=32)
    assert [frame["frame"] for frame in again.frames] == [2]
    meshes = [(frame, faces) for frame in frames]
    assert len(isomorph.evaluate(run, meshes, samples=2000, resolution=32).frames) == 2
    heard = []
    isomorph.evaluate(run, meshes, samples=1000, resolution=32, on_event=heard.append)
    assert heard and all("event" in event for event in heard)
    for given, kept, why in (
        (frames[:2], {"faces": faces}, "at least 3 needed"),
        (frames, {}, "give faces="),
        (frames + [3, 0, 0], {"faces": faces}, "is not"),
        (frames, {"faces": faces + 1}, "must be 0 to"),
        ([*frames[:3], frames[3][1:]], {"faces": faces[faces.max(axis=1) < 50]}, "vertices instead of"),
        (frames, {"faces": faces, "samples": 1}, "samples = 1"),
        (frames, {"faces": faces, "every": 0}, "every = 0"),
        (frames, {"faces": faces, "keys": [2, 9]}, "frames 0 to 3"),
        (place / "nowhere", {}, "nowhere"),
    ):
        with pytest.raises(ValueError, match=why):
            isomorph.evaluate(run, given, **kept)


def test_many_runs_go_on_after_a_failure_and_are_not_done_twice(place):
    isomorph.Shape(*sphere()).save("a.ply")
    (place / "broken.ply").write_text("ply\n")
    jobs = [
        (sphere(), sphere(0.5)),
        {"name": "files", "source": "a.ply", "target": sphere(0.3), "pairs": "same-vertices"},
        {"name": "broken", "source": "a.ply", "target": "broken.ply"},
    ]
    settings = {"data.points": 1000, "spline.band": 500, "result.resolution": 16, "result.frames": 2}
    batch = isomorph.Batch(jobs, folder="runs/many", settings=settings)
    assert len(batch) == 3 and list(batch)[1:] == ["files", "broken"]
    assert [job["state"] for job in batch.status()] == ["waiting"] * 3
    events = []
    with pytest.warns(isomorph.IsomorphWarning, match="broken failed: .*broken.ply"):
        found = batch.run(2, on_event=events.append)
    assert sorted(job["state"] for job in found) == ["done", "done", "failed"]
    assert events[-1]["done"] == 2 and events[-1]["failed"] == 1 and events[-1]["left"] == 0
    moved = batch["files"].carry(sphere()[0])
    assert np.abs(moved - sphere(0.3)[0]).mean() < 0.02
    with pytest.raises(KeyError):
        batch["none"]
    rows = batch.collect()
    assert [row["name"] for row in rows] == batch.names
    assert (batch.folder / "index.html").exists()
    # The fault is mended: only what failed runs again, of a batch that was opened anew.
    isomorph.Shape(*sphere(0.2)).save("broken.ply")
    events.clear()
    again = pickle.loads(pickle.dumps(batch))
    assert {job["state"] for job in again.run(on_event=events.append)} == {"done"}
    assert [event["job"] for event in events if event["event"] == "job_started"] == ["broken"]
    for wrong, why in (([], "has no jobs"), ([{"source": "a.ply"}], "must be source and target")):
        with pytest.raises(ValueError, match=why):
            isomorph.Batch(wrong, folder="runs/wrong")
    with pytest.raises(ValueError, match="jobs_at_a_time = 0"):
        batch.run(0)


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_in_a_batch_leaves_checkpoints_of_what_was_at_work(place):
    call = "isomorph.Batch([('a.ply', 'b.ply')], folder='many', preset='quick', settings=settings).run(1)"
    interrupt(place, call, "many/a-b")
    [job] = isomorph.Batch("many.toml").status()
    assert job["state"] == "interrupted" and 0 < job["step"] < 100000


@pytest.mark.skipif(not hasattr(os, "fork"), reason="systems that fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_works_too(run):
    points = sphere()[0]
    wanted, surface = run.carry(points), run.surface(0.5, 32)
    trained = isomorph.morph(sphere(), sphere(0.5), run="networks", frames=0, preset="quick", settings=SMALL)

    def same():
        assert np.array_equal(run.carry(points), wanted)
        assert np.array_equal(run.surface(0.5, 32).vertices, surface.vertices)
        # Training too, which has threads of its own.
        again = isomorph.morph(sphere(), sphere(0.5), run=f"in-{os.getpid()}", frames=0, preset="quick", settings=SMALL)
        assert np.array_equal(again.carry(points), trained.carry(points))
        found = []
        thread = threading.Thread(target=lambda: found.append(run.carry(points)))
        thread.start()
        thread.join()
        assert np.array_equal(found[0], wanted)
        with pytest.raises(ValueError, match="a forked process cannot use a GPU"):
            isomorph.open(run.path, backend="wgpu")

    def forked(work):
        child = os.fork()
        if child:
            for _ in range(600):
                ended, status = os.waitpid(child, os.WNOHANG)
                if ended:
                    return os.waitstatus_to_exitcode(status)
                time.sleep(0.1)
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return "a forked process did not answer"
        try:
            work()
        except BaseException as error:
            print(repr(error), file=sys.stderr)
            os._exit(1)
        os._exit(0)

    def twice():
        same()
        assert forked(same) == 0

    assert forked(twice) == 0


def test_backends_are_chosen_by_name(run):
    points = sphere()[0]
    other = isomorph.open(run.path, backend="ndarray")
    assert np.allclose(other.carry(points), run.carry(points), atol=1e-5)
    for given, why in (({"backend": "cuda"}, "cuda"), ({"device": "discrete"}, "devices are chosen with the backend wgpu")):
        with pytest.raises(ValueError, match=why):
            isomorph.open(run.path, **given)
        with pytest.raises(ValueError, match=why):
            isomorph.morph(sphere(), sphere(1), run="other", **given)


def test_a_million_points_are_not_copied_on_the_way_in(run):
    import tracemalloc

    points = np.random.default_rng(0).uniform(-0.5, 0.5, (1_000_000, 3))
    assert isomorph.Shape(points).vertices is points
    tracemalloc.start()
    moved = run.carry(points, 0.0, 0.0)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # numpy tells tracemalloc of its arrays: one of the result, which Rust gives, is not its own.
    assert peak < points.nbytes / 4
    assert np.array_equal(moved, points) and moved.flags.c_contiguous
    # Other types and orders are converted once.
    tracemalloc.start()
    run.carry(np.asfortranarray(points[:100_000]), 0.0, 0.0)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak > 100_000 * 24
