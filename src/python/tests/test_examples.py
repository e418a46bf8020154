"""The examples of the guide and of the README run as they are printed, and so does the notebook."""

import json
import re
import shutil
from pathlib import Path

import isomorph
import numpy as np
import pytest
from test_isomorph import sphere

ROOT = Path(__file__).resolve().parents[3]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(page):
    return BLOCK.findall((ROOT / page).read_text("utf-8"))


@pytest.fixture
def things(tmp_path, monkeypatch):
    """The names and files that examples take for granted: each is given a folder with copies of the files."""
    files = tmp_path / "files"
    (files / "frames").mkdir(parents=True)
    vertices, faces = sphere(rings=10)
    # No symmetry, so that points can be matched.
    vertices = vertices * [1.5, 1, 0.7] + 0.3 * np.exp(-2 * (vertices[:, :1] - 1) ** 2) * [0, 0, 1]
    for number, name in enumerate("abc"):
        isomorph.Shape(vertices + [0.2 * number, 0, 0], faces).save(files / f"{name}.ply")
        isomorph.Shape(vertices + [0.2 * number, 0, 0], faces).save(files / f"frames/{number}.ply")
    isomorph.Shape(vertices).save(files / "scan.ply")
    (files / "pair.toml").write_text(
        'preset = "instant"\n[data]\nsource = "a.ply"\ntarget = "b.ply"\n[result]\nframes = 2\nresolution = 24\n'
    )
    (files / "jobs.toml").write_text(
        'set = ["result.frames=2", "result.resolution=24"]\n[all-pairs]\nfiles = "*.ply"\n'.replace("*", "[ab]")
    )
    monkeypatch.setattr("webbrowser.open", lambda address: address.startswith("file:") or pytest.fail(address))
    names = {"points": vertices[:100], "vertices": vertices, "faces": faces}

    def run(code, number):
        place = tmp_path / str(number)
        shutil.copytree(files, place)
        monkeypatch.chdir(place)
        exec(compile(code, f"example {number}", "exec"), names)  # noqa: S102: that is what is tried.

    return run


@pytest.mark.filterwarnings("ignore::isomorph.IsomorphWarning")
@pytest.mark.parametrize("page", ["src/guide/python.md", "README.md"])
def test_examples_run_as_printed(page, things):
    pytest.importorskip("trimesh")
    found = blocks(page)
    assert found, page
    for number, code in enumerate(found):
        # Meshes in STL come from trimesh, which the example has.
        things("import isomorph, numpy as np, trimesh\n" + stl(code) + code, number)


def stl(code):
    """Files that an example reads and nobody has made: an STL."""
    if "a.stl" not in code:
        return ""
    return 'trimesh.Trimesh(*(lambda s: (s.vertices, s.faces))(isomorph.Shape.read("a.ply"))).export("a.stl")\n'


def test_the_notebook_runs(tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("matplotlib")
    path = ROOT / "scripts/notebooks/two_scans.ipynb"
    assert path.stat().st_size < 400_000, "outputs stay small"
    committed = json.loads(path.read_text("utf-8"))
    code = [cell for cell in committed["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] for cell in code[1:]), "it is committed as it was run"
    # Its paths are those of its folder, and what it writes is thrown away.
    folder = tmp_path / "scripts/notebooks"
    folder.mkdir(parents=True)
    shutil.copytree(ROOT / "data/scan", tmp_path / "data/scan")
    notebook = nbformat.reads(path.read_text("utf-8"), as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    made = [cell for cell in notebook.cells if cell.cell_type == "code"]
    for before, after in zip(code, made, strict=True):
        kinds = lambda outputs: [output["output_type"] for output in outputs]
        assert kinds(before["outputs"]) == kinds(after.outputs), after.source
    assert (folder / "runs/scans.glb").read_bytes()[:4] == b"glTF"
