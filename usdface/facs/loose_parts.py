"""Feature points on pieces of a rig beside the skin: eyeballs, drawn brows and flat irises."""

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.binding.landmarks import FaceLandmarks
from usdface.face.marker_name_places import LANDMARKS
from usdface.face.surface_graph import surface_graph
from usdface.rigs import Mesh, Rig
from usdface.rigs.face_mesh import moved_vertices

__all__ = ["Patches", "eyeballs", "loose_patches"]

_LOOSE = 8.0  # [mm of the average face]: reach from a point on the skin to parts that are no skin
# An eyeball is a piece as deep and high as wide, and as wide as an eye (a ball of 24 mm behind an
# opening of 30 mm; artists make them larger). Its front lies before half its radius.
_ROUND, _NARROW, _WIDE, _FRONT = 1.35, 0.6, 1.8, 0.5
# Part of the way of its vertices that an eyeball goes aside as a whole: turned ones 0.9 on the
# example, one whose pupil widens 0.01 on ICT.
_ASIDE = 0.5

# Index of a mesh and vertices on it, by the name of a feature point.
Patches = dict[str, tuple[int, IntArray]]


def loose_patches(rig: Rig, landmarks: FaceLandmarks, patches: Patches) -> Patches:
    """Return patches of separate pieces near the skin, for points where no shape moves the skin.

    Brows of drawn characters are strips of their own, and their irises flat.
    """
    moved = [moved_vertices(mesh) for mesh in rig.meshes]
    skin = np.zeros(len(landmarks.surface.mesh.points), dtype=bool)
    skin[landmarks.surface.vertices] = True
    face, _ = next(iter(patches.values()))
    places = {
        point: rig.meshes[which].points[vertices].mean(axis=0)
        for point, (which, vertices) in patches.items()
        if not moved[which][vertices].any()
    }
    places |= {f"{half} eyeball": centre for half, (centre, _) in _eyes(landmarks).items()}
    found: Patches = {}
    for which, mesh in enumerate(rig.meshes):
        own = np.flatnonzero(moved[which] & ~skin if which == face else moved[which])
        if not len(own):
            continue
        tree = cKDTree(mesh.points[own])
        for point, place in places.items():
            reach = _LOOSE * landmarks.unit
            near = own[tree.query_ball_point(place, reach)]
            if point.endswith("eyeball"):
                parts = [np.intersect1d(piece, near) for piece in _pieces(mesh, moved[which])]
                turned = [part for part in parts if _goes_aside(mesh, part)]
                near = np.concatenate([*turned, near[:0]])
            if len(near) and point not in found:
                found[point] = (which, np.sort(near))
    return found


def _eyes(landmarks: FaceLandmarks) -> dict[str, tuple[FloatArray, float]]:
    """Return the centre and the width of each eye's opening [m]."""
    average, found = landmarks.average.tolist(), {}
    for half, sign in (("left", 1), ("right", -1)):
        inner, outer = (
            landmarks.points[average.index([sign * LANDMARKS[name][0], LANDMARKS[name][1]])]
            for name in ("eye inner", "eye outer")
        )
        found[half] = (0.5 * (inner + outer), abs(float((outer - inner)[0])))
    return found


def eyeballs(rig: Rig, landmarks: FaceLandmarks) -> Patches:
    """Return the fronts of the eyeballs that a blend shape turns; wider pupils are no gaze."""
    found: Patches = {}
    for half, (centre, width) in _eyes(landmarks).items():
        for which, mesh in enumerate(rig.meshes):
            moved = moved_vertices(mesh)
            for vertices in _pieces(mesh, moved):
                at = mesh.points[vertices]
                low, high = at.min(axis=0), at.max(axis=0)
                size, middle = high - low, 0.5 * (low + high)
                beside = np.abs(middle - centre)[:2].max() < 0.5 * width
                ball = size.max() < _ROUND * size.min()
                fits = _NARROW * width < size.max() < _WIDE * width
                if beside and ball and fits and f"{half} eyeball" not in found:
                    front = vertices[at[:, 2] > middle[2] + _FRONT * 0.5 * size[2]]
                    if _goes_aside(mesh, front):
                        found[f"{half} eyeball"] = (which, front)
    return found


def _goes_aside(mesh: Mesh, vertices: IntArray) -> bool:
    """Return whether a blend shape moves vertices sideways or up and down, all the same way."""
    if not len(vertices):
        return False
    offsets = mesh.offsets_at(vertices)
    together = np.linalg.norm(offsets.mean(axis=1)[:, :2], axis=1)
    each = np.sqrt((offsets**2).sum(axis=2).mean(axis=1))
    return bool((together > _ASIDE * each).any())


def _pieces(mesh: Mesh, moved: BoolArray) -> list[IntArray]:
    """Return the connected pieces of a mesh that blend shapes move: vertices of each."""
    if not moved.any():
        return []
    _, piece = connected_components(surface_graph(mesh), directed=False)
    order = np.argsort(piece, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(piece[order])) + 1)
    return [part for part in parts if moved[part].any()]
