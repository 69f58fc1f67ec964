"""Full-face expressions: those that move both brows and mouth, so neither half shows them alone."""

import numpy as np

from usdface.face.bound_face import BoundFace
from usdface.face.regions import named_regions
from usdface.setup.expression import Expression

__all__ = ["moves_brows_and_mouth"]

# Where no blend shape's name has a region: a half that moves by more than this share of the
# other is needed, too. Chosen by hand.
_BOTH_HALVES = 0.5


def moves_brows_and_mouth(face: BoundFace, expression: Expression) -> bool:
    """Whether an expression moves both the brows and the mouth.

    By the names of its blend shapes; where these name no region, by how far the markers above and
    below the nose tip move relative to it.
    """
    regions = named_regions(face.shape_names)
    named = {r: set(names) & set(expression.shapes) for r, names in regions.items()}
    if any(named.values()):
        return bool(named["brows"] and named["mouth"])
    moved = face.displacements(expression.pose(face.shape_names)[None])[0]
    reach = np.abs(moved - moved[face.nose]).max(axis=1)
    upper = face.neutral[:, 1] > face.neutral[face.nose, 1]
    above, below = (float(reach[half].max(initial=0.0)) for half in (upper, ~upper))
    return min(above, below) > _BOTH_HALVES * max(above, below)
