"""Antagonists: blend shapes that move the same skin in opposite directions."""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array

from usdface.face.expression_poses import units_of
from usdface.rigs import BlendShape, Mesh
from usdface.setup.expression import Expression

__all__ = ["antagonists"]

# Cosine between two displacement fields below which they oppose each other. Chosen by hand, by the
# pairs that it finds on ICT, MakeHuman and the example (docs/constants.md).
_OPPOSED = -0.3
# Action units that oppose each other by their muscles, though their fields hardly do: the corners
# of the mouth go up and out (12, zygomaticus major), or down (15, depressor anguli oris; P. Ekman,
# W. Friesen, J. Hager, "Facial Action Coding System", 2002).
_UNITS = {12, 15}
# Shapes of opposite sides do not overlap: their cosine is about 0.
_SAME_SIDE = -0.05


def antagonists(mesh: Mesh, expressions: Sequence[Expression]) -> tuple[tuple[str, str], ...]:
    """Return the pairs of antagonists among the blend shapes of the expressions.

    Two blend shapes of one expression are no antagonists.
    """
    used = [s for s in mesh.shapes if any(s.name in e.shapes for e in expressions)]
    together = {(a, b) for e in expressions for a in e.shapes for b in e.shapes}
    units = units_of([shape.name for shape in used])
    fields = _directions(used, len(mesh.points))
    cosine = (fields @ fields.T).toarray()
    pairs = []
    for i, j in np.argwhere(np.tril(cosine < _SAME_SIDE, k=-1)):
        a, b = used[i].name, used[j].name
        one, other = (units.get(name, frozenset()) & _UNITS for name in (a, b))
        named = bool(one and other and one != other)
        if (named or cosine[i, j] < _OPPOSED) and (a, b) not in together:
            pairs.append((b, a))
    return tuple(sorted(pairs))


def _directions(shapes: Sequence[BlendShape], count: int) -> csr_array:
    """Return the displacement fields of shapes, each of length 1 or 0: (S, 3 V)."""
    columns = [(3 * shape.indices[:, None] + np.arange(3)).ravel() for shape in shapes]
    unit = []
    for shape in shapes:
        field = shape.offsets.ravel() / max(np.abs(shape.offsets).max(initial=0.0), 1e-300)
        unit.append(field / max(float(np.linalg.norm(field)), 1e-300))
    starts = np.cumsum([0, *(len(own) for own in columns)])
    indices = np.concatenate([*columns, np.zeros(0, dtype=np.int64)])
    values = np.concatenate([*unit, np.zeros(0)])
    return csr_array((values, indices, starts), shape=(len(shapes), 3 * count))
