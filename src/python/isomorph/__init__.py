"""isomorph computes the motion between two 3D shapes, and every shape in between.

    import isomorph
    run = isomorph.morph("a.ply", "b.ply")                  # or arrays, or objects of trimesh, open3d, ...
    vertices, faces = run.surface(t=0.5)
    moved = run.carry(points, start=0.0, end=0.3)
    run.save_glb("motion.glb")
    run.show()

Shapes are anything that `Shape.of` takes. Coordinates are the user's own, in and out. A mistake in what was asked for or
in a file is a `ValueError`, work that failed is a `TrainingError`; Ctrl-C leaves a checkpoint, and `resume` goes on.
"""

from ._batch import Batch
from ._evaluation import Evaluation, evaluate
from ._native import TrainingError
from ._run import Run, Surface, open
from ._shape import Shape, ShapeLike
from ._work import IsomorphWarning, estimate_normals, match, morph, resume, train

__all__ = [
    "Batch",
    "Evaluation",
    "IsomorphWarning",
    "Run",
    "Shape",
    "ShapeLike",
    "Surface",
    "TrainingError",
    "estimate_normals",
    "evaluate",
    "match",
    "morph",
    "open",
    "resume",
    "train",
]
