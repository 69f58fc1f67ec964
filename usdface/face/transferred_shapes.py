"""The character's blend shapes transferred to another face, of which only markers are known.

The other face is the character's, moved by the field between the two at rest: smooth along the
skin, so that lips and lids, which are near each other in space, stay apart. Its shapes are the
character's by deformation transfer, where example-based rigs start from, too (H. Li, T. Weise and
M. Pauly, "Example-Based Facial Rigging", SIGGRAPH 2010).
"""

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.blend_shape import BlendShape, Inbetween
from usdface.face.marker_surface import MarkerSurface, PlacedMarkers

__all__ = ["transferred_surface"]

# Numbers in the shapes of a patch: a bound on time and memory, some 4 s and 0.5 GB. The ICT face
# has 2 million.
_MOST = 12_000_000


def transferred_surface(
    surface: MarkerSurface, placed: PlacedMarkers, rest: FloatArray
) -> MarkerSurface | None:
    """Return the character's skin with the blend shapes of another face.

    Parameters
    ----------
    surface : MarkerSurface
        The character's, B bound vertices.
    placed : PlacedMarkers
        Where the markers sit on it.
    rest : (B, 3) float64 [m]
        Where they rest on the other face, aligned with the character.

    Returns
    -------
    MarkerSurface or None
        None where a marker has no faces around it, or the mesh is too fine.
    """
    patch, shapes = surface.patch, surface.mesh.shapes
    held = patch.place_of[placed.vertices]
    count = sum(1 + len(shape.inbetweens) for shape in shapes)
    if (held < 0).any() or 3 * count * len(patch.vertices) > _MOST:
        return None
    target = patch.points + patch.field(held, rest - placed.points)
    size = len(surface.mesh.points)  # a fine mesh is dense one shape at a time
    known = np.concatenate([_dense(shape, size)[:, patch.vertices] for shape in shapes])
    transferred = patch.transferred(target, known)
    inside = np.flatnonzero(patch.place_of >= 0)
    moved, done = [], 0
    for shape in shapes:
        own = _dense(shape, size)
        own[:, inside] = transferred[done : done + len(own), patch.place_of[inside]]
        moved.append(_sparse(shape, own))
        done += len(own)
    return surface.with_shapes(tuple(moved))


def _dense(shape: BlendShape, count: int) -> FloatArray:
    """Return the offsets of a shape and its inbetweens at all vertices: (1 + I, count, 3)."""
    dense = np.zeros((1 + len(shape.inbetweens), count, 3))
    known = (shape.offsets, *(inbetween.offsets for inbetween in shape.inbetweens))
    for row, offsets in zip(dense, known, strict=True):
        row[shape.indices] = offsets
    return dense


def _sparse(shape: BlendShape, dense: FloatArray) -> BlendShape:
    """Return a shape with other offsets (1 + I, V, 3), and no normals."""
    indices = np.flatnonzero(dense.any(axis=(0, 2)))
    offsets = dense[:, indices]
    inbetweens = tuple(
        Inbetween(inbetween.name, inbetween.weight, own)
        for inbetween, own in zip(shape.inbetweens, offsets[1:], strict=True)
    )
    return BlendShape(
        shape.name, indices, offsets[0], inbetweens=inbetweens, combination=shape.combination
    )
