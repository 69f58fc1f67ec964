"""Brows, eyes, mouth: where on the face each blend shape is."""

import numpy as np

from usdface.arrays import IntArray
from usdface.face.expression_poses import units_of
from usdface.face.lip_lid_contacts import LipLidContacts
from usdface.options import REGIONS, Region
from usdface.rigs import Mesh

__all__ = ["shape_regions"]

# Heights above the eyes, in distances from mouth to eyes: brows begin, eyes (with the cheeks that
# push the lower lid) end.
_BROWS, _EYES = 0.2, -0.4
# Facial action units that are not of the mouth (FACS).
_UNITS: dict[Region, tuple[int, ...]] = {"brows": (1, 2, 4), "eyes": (5, 6, 7, 43, 61, 62, 63, 64)}


def shape_regions(mesh: Mesh, seams: LipLidContacts) -> dict[Region, tuple[str, ...]]:
    """Return the shapes of each region.

    A shape whose name says an action unit belongs where the unit does; any other by the height at
    which it moves the skin, between the lips and the lids, or nowhere where these were not found.
    """
    found: dict[Region, list[str]] = {region: [] for region in REGIONS}
    units = units_of(mesh.shape_names)
    placed = len(seams.lips) > 0 and len(seams.lids) > 0
    mouth, eyes = (_height(mesh, pairs) for pairs in seams) if placed else (0.0, 0.0)
    for shape in mesh.shapes:
        energy = (shape.offsets**2).sum(axis=1)
        if shape.name in units:
            named = [r for r, listed in _UNITS.items() if units[shape.name] & set(listed)]
            found[named[0] if named else "mouth"].append(shape.name)
        elif placed and energy.sum() > 0:
            height = float(np.average(mesh.points[shape.indices, 1], weights=energy))
            found[_region((height - eyes) / max(eyes - mouth, 1e-12))].append(shape.name)
    return {region: tuple(names) for region, names in found.items()}


def _height(mesh: Mesh, pairs: IntArray) -> float:
    return float(mesh.points[pairs, 1].mean())


def _region(height: float) -> Region:
    if height > _BROWS:
        return "brows"
    return "eyes" if height > _EYES else "mouth"
