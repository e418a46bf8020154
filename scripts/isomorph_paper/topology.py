"""A sequence whose ends differ in topology: a human whose feet merge while the arms rise.

The paper shows shapes with overlapping feet and arms, whose outer surface has another topology than
the other end's. None of our sequences has one, so it is made: the legs of `human_raise_arms` are
sheared towards each other, by

    x -> x - sign(x) reach time (depth / deepest)^2,    depth: how far below the crotch, in y.

The shift depends on y alone, so it keeps the volume. In the last frame the feet overlap: the outer
surface is a ring of legs and feet (genus 1), the first frame's a sphere (genus 0). The frames in
between are the true ones for the evaluation; shortly before the end they overlap themselves too.
"""

import numpy as np

from .sequences import Sequence, area_vectors, unit

# By inspection of human_raise_arms, in its units (metres at a height of 1.73): no leg is above
# CROTCH, no hand below it once the arms are raised; REACH lets the feet overlap, the knees not.
RAISED = 26
CROTCH = 0.0
REACH = 0.19


def feet_together(human: Sequence) -> np.ndarray:
    """(RAISED + 1, vertices, 3) positions: frames 0 to RAISED, the legs sheared together."""
    frames = human.frames[: RAISED + 1].copy()
    # Where a vertex is a leg's is read off the raised frame, in which no hand hangs down.
    depth = np.maximum(CROTCH - frames[RAISED, :, 1], 0)
    shift = np.sign(frames[RAISED, :, 0]) * REACH * (depth / depth.max()) ** 2
    times = np.linspace(0, 1, RAISED + 1)
    frames[:, :, 0] -= times[:, None] * shift[None, :]
    return frames


def winding_number(vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n,) how often a closed mesh encloses points: its triangles' solid angles over 4 pi.

    The solid angle is Van Oosterom and Strackee's (1983):
    tan(angle / 2) = det(a, b, c) / (|a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b|).
    """
    found = np.empty(len(points))
    corners = vertices[triangles]
    # Blocks bound the memory.
    for start in range(0, len(points), 64):
        a, b, c = np.moveaxis(corners[None] - points[start : start + 64, None, None], 2, 0)
        la, lb, lc = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
        dot = lambda one, other: np.einsum("ntd,ntd->nt", one, other)
        below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
        angles = 2 * np.arctan2(dot(a, np.cross(b, c)), below)
        found[start : start + 64] = angles.sum(1) / (4 * np.pi)
    return found


def on_outside(
    vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """(n,) whether points of a mesh that overlaps itself are on its outer surface.

    Just off the surface along the normal the winding number is 0 outside and 1 within another part.
    """
    # A thousandth of the size is far from the own triangle's rounding and well below any gap.
    off = 1e-3 * np.sqrt(np.linalg.norm(area_vectors(vertices, triangles), axis=1).sum() / 2)
    return winding_number(vertices, triangles, points + off * unit(normals)) < 0.5
