"""Regions of a face, and the regions of blend shapes and vertices.

The region of a blend shape follows from its name: a word in it, or its FACS action unit. Without
either, the height of its motion between lips and lids decides.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.expression_poses import units_of
from usdface.face.lip_lid_contacts import LipLidContacts
from usdface.rigs import BlendShape, Mesh
from usdface.rigs.face_mesh import vertex_motion

__all__ = [
    "GAIN_REGIONS",
    "REGIONS",
    "GainRegion",
    "Region",
    "gain_region",
    "named_regions",
    "regions_of",
    "shape_regions",
]

Region = Literal["brows", "eyes", "nose", "mouth", "jaw", "cheeks"]
GainRegion = Literal["brows", "eyes", "mouth"]
REGIONS: tuple[Region, ...] = get_args(Region)
GAIN_REGIONS: tuple[GainRegion, ...] = get_args(GainRegion)


@dataclass(frozen=True, slots=True)
class _Row:
    """Blend shapes of one region: words in their names, action units, region of their gain."""

    region: Region
    gain: GainRegion
    words: str
    units: frozenset[int]


# The more specific words first: a cheek squints, too; no lid is in a slide. Units are those of
# FACS. Raised cheeks push the lower lids (AU6, around the eye); it is the lips that hold the air of
# puffed ones (AU34).
_ROWS = (
    _Row("cheeks", "mouth", r"puff", frozenset((34,))),
    _Row("cheeks", "eyes", r"cheek", frozenset((6,))),
    _Row("brows", "brows", r"brow|forehead", frozenset((1, 2, 4))),
    _Row("nose", "mouth", r"nose|nostril|sneer", frozenset((9,))),
    _Row("jaw", "mouth", r"jaw|chin", frozenset((26, 27, 29))),
    _Row("eyes", "eyes", r"eye|(?<!s)lid|blink|wink|squint", frozenset((5, 7, 43, 61, 62, 63, 64))),
    _Row(
        "mouth",
        "mouth",
        r"mouth|lip|smile|frown|pucker|funnel|dimple|viseme|tongue",
        frozenset((10, 12, 14, 15, 16, 17, 18, 20, 22, 23, 24, 25, 28)),
    ),
)
# Heights above the eyes, in distances from mouth to eyes: brows begin, eyes (with the cheeks that
# push the lower lid) end.
_BROWS, _EYES = 0.2, -0.4
_ELSEWHERE = "face"
_SHARED = 0.1  # of a region's largest energy
_PARTS = 5
_PAIRED = ("cheeks", "eyes")  # nothing in the middle


def shape_regions(mesh: Mesh, contacts: LipLidContacts) -> dict[GainRegion, tuple[str, ...]]:
    """Return the blend shapes that follow the gain of each region, at most one each.

    Those without a telling name follow none if lips and lids were not found.
    """
    named = named_regions(mesh.shape_names)
    known = {name for names in named.values() for name in names}
    found = {region: list(names) for region, names in named.items()}
    lips, lids = contacts.mouth, contacts.lids
    placed = len(lips) > 0 and len(lids) > 0
    mouth, eyes = (_height(mesh, pairs) for pairs in (lips, lids)) if placed else (0.0, 0.0)
    for shape in mesh.shapes:
        energy = (shape.offsets**2).sum(axis=1)
        if shape.name not in known and placed and energy.sum() > 0:
            height = float(np.average(mesh.points[shape.indices, 1], weights=energy))
            found[_at_height((height - eyes) / max(eyes - mouth, 1e-12))].append(shape.name)
    order = {name: place for place, name in enumerate(mesh.shape_names)}
    return {region: tuple(sorted(names, key=order.__getitem__)) for region, names in found.items()}


def named_regions(shape_names: Sequence[str]) -> dict[GainRegion, tuple[str, ...]]:
    """Return the blend shapes whose names tell the region of their gain, by region."""
    rows = _rows_of(shape_names)
    return {
        region: tuple(name for name in shape_names if name in rows and rows[name].gain == region)
        for region in GAIN_REGIONS
    }


def gain_region(region: str) -> GainRegion:
    """Return the region of the gains that the blend shapes of a region mostly follow."""
    return "brows" if region == "brows" else "eyes" if region == "eyes" else "mouth"


def regions_of(mesh: Mesh, vertices: IntArray) -> tuple[str, ...]:
    """Return the region of each of some vertices (N,) of a mesh: one of `REGIONS`.

    A vertex belongs to the region with the nearest centre: each region has five centres of the
    motion of its blend shapes, from right to left. "face" if no blend shape has a telling name.
    """
    energies = _energies(mesh)
    labels: list[str] = []
    centres: list[FloatArray] = []
    for region, energy in energies.items():
        # Lips that blend shapes of other regions also move belong to the mouth.
        if region in ("cheeks", "jaw", "nose") and "mouth" in energies:
            energy = np.where(energies["mouth"] > _SHARED * energies["mouth"].max(), 0.0, energy)
        for part in _centres(mesh.points, energy, region in _PAIRED):
            labels.append(region)
            centres.append(part)
    if not centres:
        return (_ELSEWHERE,) * len(vertices)
    away = np.linalg.norm(mesh.points[vertices, None] - np.array(centres), axis=2)
    return tuple(labels[k] for k in away.argmin(axis=1).tolist())


def _rows_of(shape_names: Sequence[str]) -> Mapping[str, _Row]:
    """Return the row of each blend shape with a telling name."""
    units = units_of(shape_names)
    rows = ((name, _row_of(name, units.get(name, frozenset()))) for name in shape_names)
    return {name: row for name, row in rows if row is not None}


def _row_of(name: str, units: frozenset[int]) -> _Row | None:
    by_word = (row for row in _ROWS if re.search(row.words, name.lower()))
    return next(by_word, None) or next((row for row in _ROWS if row.units & units), None)


def _height(mesh: Mesh, pairs: IntArray) -> float:
    return float(mesh.points[pairs, 1].mean())


def _at_height(height: float) -> GainRegion:
    if height > _BROWS:
        return "brows"
    return "eyes" if height > _EYES else "mouth"


def _energies(mesh: Mesh) -> dict[Region, FloatArray]:
    """Return, for each region with named blend shapes that move it, their motion: (V,)."""
    shapes: dict[Region, list[BlendShape]] = {}
    rows = _rows_of(mesh.shape_names)
    for shape in mesh.shapes:
        if shape.name in rows and shape.offsets.any():
            shapes.setdefault(rows[shape.name].region, []).append(shape)
    return {region: vertex_motion(own, len(mesh.points)) for region, own in shapes.items()}


def _centres(points: FloatArray, energy: FloatArray, paired: bool) -> list[FloatArray]:
    """Return the centres of the moved skin in parts from right to left: (3,) each."""
    moved = energy > _SHARED
    if not moved.any():
        return []
    low, high = points[moved, 0].min(), points[moved, 0].max()
    part = np.digitize(points[:, 0], np.linspace(low, high, _PARTS + 1)[1:-1])
    parts = [moved & (part == k) for k in range(_PARTS) if not (paired and k == _PARTS // 2)]
    return [np.average(points[one], axis=0, weights=energy[one]) for one in parts if one.any()]
