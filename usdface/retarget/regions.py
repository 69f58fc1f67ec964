"""Regions of a face, by what its blend shapes do: where a marker sits, in words and by error.

The shapes say by their names which region they are of, and by what they move where that is. A
vertex belongs to the nearest region: of each, the middles of five parts from right to left count.
"""

import re
from typing import Any

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.retarget.solution import Solution
from usdface.retarget_setup import Binding
from usdface.rigs import Mesh

__all__ = ["place_names", "region_errors", "region_residuals", "regions_of"]

# Words in the names of shapes, the more telling first: a cheek squints, too.
_WORDS = (
    ("cheeks", r"cheek|puff"),
    ("brows", r"brow|forehead"),
    ("nose", r"nose|nostril|sneer"),
    ("jaw", r"jaw|chin"),
    ("eyes", r"eye|lid|blink|wink|squint"),
    ("mouth", r"mouth|lip|smile|frown|pucker|funnel|dimple|viseme|tongue"),
)
_ONE = {"cheeks": "cheek", "brows": "brow", "eyes": "eye"}
_ELSEWHERE = "face"
_SHARED = 0.1  # of a region's largest energy
_PARTS = 5
_PAIRED = ("cheeks", "eyes")  # nothing in the middle
# A marker is left or right of the middle from so much of the face's width on.
_MIDDLE = 0.06


def regions_of(mesh: Mesh, vertices: IntArray) -> tuple[str, ...]:
    """Return the region of each vertex of a mesh: brows, eyes, nose, mouth, jaw or cheeks.

    "face" where no blend shape has the name of a region.
    """
    energies = _energies(mesh)
    if not energies:
        return (_ELSEWHERE,) * len(vertices)
    labels: list[str] = []
    centres: list[FloatArray] = []
    for region, energy in energies.items():
        # What others take along of the lips is the mouth's.
        if region in ("cheeks", "jaw", "nose") and "mouth" in energies:
            energy = np.where(energies["mouth"] > _SHARED * energies["mouth"].max(), 0.0, energy)
        for part in _parts(mesh.points, energy, region in _PAIRED):
            labels.append(region)
            centres.append(part)
    if not centres:
        return (_ELSEWHERE,) * len(vertices)
    away = np.linalg.norm(mesh.points[vertices, None] - np.array(centres), axis=2)
    return tuple(labels[k] for k in away.argmin(axis=1).tolist())


def _energies(mesh: Mesh) -> dict[str, FloatArray]:
    """Return, for each region that shapes are named after, how much these move each vertex."""
    energies: dict[str, FloatArray] = {}
    for shape in mesh.shapes:
        region = _region_of_name(shape.name)
        squares = (shape.offsets**2).sum(axis=1)
        if region is None or not squares.any():
            continue
        energy = energies.setdefault(region, np.zeros(len(mesh.points)))
        np.maximum.at(energy, shape.indices, squares / squares.max())
    return energies


def _parts(points: FloatArray, energy: FloatArray, paired: bool) -> list[FloatArray]:
    """Return the middles of the parts of what is moved, from right to left: (3,) each."""
    moved = energy > _SHARED
    if not moved.any():
        return []
    low, high = points[moved, 0].min(), points[moved, 0].max()
    part = np.digitize(points[:, 0], np.linspace(low, high, _PARTS + 1)[1:-1])
    chosen = [moved & (part == k) for k in range(_PARTS) if not (paired and k == _PARTS // 2)]
    return [np.average(points[one], axis=0, weights=energy[one]) for one in chosen if one.any()]


def _region_of_name(name: str) -> str | None:
    return next((region for region, words in _WORDS if re.search(words, name.lower())), None)


def region_residuals(mesh: Mesh, binding: Binding, solution: Solution) -> dict[str, FloatArray]:
    """Return, for each region, the RMS distance of its seen markers from the solved face.

    Returns
    -------
    dict of str to (F,) float64 [m]
        0 in frames that show none of a region's markers.
    """
    return {region: _rms(own) for region, own in _distances(mesh, binding, solution).items()}


def region_errors(mesh: Mesh, binding: Binding, solution: Solution) -> dict[str, dict[str, Any]]:
    """Return the residual of each region for a report [mm]: over the take, and frame by frame."""
    result = {}
    for region, own in _distances(mesh, binding, solution).items():
        curve = _rms(own)
        result[region] = {
            "markers": own.shape[1],
            "rms": round(1000.0 * float(np.sqrt(np.nanmean(own**2))), 3),
            "worst": round(1000.0 * float(curve.max()), 3),
            "worst frame": int(curve.argmax()),
            "frames": np.round(1000.0 * curve, 3).tolist(),
        }
    return result


def _distances(mesh: Mesh, binding: Binding, solution: Solution) -> dict[str, FloatArray]:
    """Return how far the markers of each region are from the solved face: (F, m), NaN = unseen."""
    vertex = dict(zip(binding.markers, binding.points.tolist(), strict=True))
    regions = np.array(regions_of(mesh, np.array([vertex[name] for name in solution.markers])))
    return {str(region): solution.distances[:, regions == region] for region in np.unique(regions)}


def _rms(distances: FloatArray) -> FloatArray:
    """Return the RMS of what each frame shows, 0 where that is nothing: (F,)."""
    seen = ~np.isnan(distances)
    squares = np.where(seen, distances, 0.0) ** 2
    return np.asarray(np.sqrt(squares.sum(axis=1) / np.maximum(seen.sum(axis=1), 1)))


def place_names(mesh: Mesh, vertices: IntArray, binding: Binding) -> tuple[str, ...]:
    """Return where vertices are, for people: "left cheek, 14 mm from marker m7 (vertex 310)".

    Left is the character's.
    """
    moved = np.unique(np.concatenate([s.indices for s in mesh.shapes]))
    low, high = mesh.points[moved, 0].min(), mesh.points[moved, 0].max()
    asides = (mesh.points[vertices, 0] - (low + high) / 2) / max(high - low, 1e-12)
    regions = regions_of(mesh, vertices)
    return tuple(
        _place_name(mesh, vertex, binding, region, aside)
        for vertex, region, aside in zip(vertices.tolist(), regions, asides.tolist(), strict=True)
    )


def _place_name(mesh: Mesh, vertex: int, binding: Binding, region: str, aside: float) -> str:
    side = "" if abs(aside) < _MIDDLE else ("left " if aside > 0 else "right ")
    # In the middle there is no one brow.
    named = f"{side}{_ONE.get(region, region)}" if side else f"middle of the {region}"
    if not binding.markers:
        return f"{named} (vertex {vertex})"
    away = np.linalg.norm(mesh.points[binding.points] - mesh.points[vertex], axis=1)
    nearest = int(away.argmin())
    distance = f"{1000 * away[nearest]:.0f} mm from marker {binding.markers[nearest]}"
    return f"{named}, {distance} (vertex {vertex})"
