"""Apertures of lips and lids: how far open they are, measured on the posed mesh.

The aperture of a contact (`usdface.face.lip_lid_contacts`) is measured at a few places along it,
each the mean of its pairs of vertices, across the contact.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.blend_shapes.evaluator import BlendShapeEvaluator, shape_places
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.eye_sides import is_left_lid
from usdface.rigs import Mesh

__all__ = ["Apertures", "apertures_of"]

# Places along the lips, and along each eye: a corner of the mouth (a sixth) or of an eye can part
# while the middle stays closed, as in a one-sided sneer.
_PLACES = {"lips": 6, "lids": 4}
# An open aperture may open further by this much of its opening: an expression at a third of its
# strength can still be raised to the whole (1 / 3 + 2 / 3).
_SLOPE = 2.0


@dataclass(frozen=True, eq=False, slots=True)
class Apertures:
    """Apertures of lips and lids at K places, signed: negative where one is inside the other.

    Attributes
    ----------
    contact : tuple of str, length K
        "lips", "left lids", "right lids".
    neutral : (K,) float64 [m]
        On the neutral face.
    evaluator : BlendShapeEvaluator
        By how much T blend shapes change the apertures: N = K.
    touch : (K,) float64 [m]
        Of contact: the neutral aperture of lips, the aperture of lids in the blend shape that
        closes them.
    floor : (K,) float64 [m]
        Least aperture after a correction: that of the rig's own expressions.
    tolerance : float [m]
    """

    contact: tuple[str, ...]
    neutral: FloatArray
    evaluator: BlendShapeEvaluator
    touch: FloatArray
    floor: FloatArray
    tolerance: float

    def __post_init__(self) -> None:
        freeze(self, "neutral", "touch", "floor")

    def at(self, weights: FloatArray) -> FloatArray:
        """Return the apertures at some weights (F, T): (F, K) [m].

        Combination shapes follow their parents, whatever weight they are given.
        """
        return np.asarray(self.neutral + self._displacements(weights))

    def change(self, solved: FloatArray, corrected: FloatArray) -> FloatArray:
        """Return by how much the apertures change from weights (F, T) to others: (F, K) [m]."""
        if self.evaluator.linear:
            return np.asarray((corrected - solved) @ self.evaluator.offsets)
        return self._displacements(corrected) - self._displacements(solved)

    def slopes(self, solved: FloatArray, corrected: FloatArray) -> FloatArray:
        """Return secant slopes: the change of each aperture by each weight, (F, T, K) [m]."""
        evaluator = self.evaluator
        result = np.zeros((len(solved), *evaluator.offsets.shape))
        ends = (evaluator.combined(weights) for weights in (solved, corrected))
        result[:, evaluator.free] = evaluator.secants(*ends)
        return result

    def _displacements(self, weights: FloatArray) -> FloatArray:
        return self.evaluator.displacements(self.evaluator.combined(weights))

    def limits(self, solved: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the least and largest change of each aperture by a correction: (F, K) each [m].

        An aperture in contact may change by the tolerance, an open one close to contact and open
        further in proportion, a pressed one open to contact.
        """
        opening = np.maximum(solved - self.touch - self.tolerance, 0.0)
        pressed = np.maximum(self.touch - solved, 0.0)
        close = np.maximum(solved - self.floor, 0.0)
        return -self.tolerance - close, self.tolerance + pressed + _SLOPE * opening


def apertures_of(face: BoundFace, names: tuple[str, ...], poses: FloatArray) -> Apertures:
    """Measure the apertures along the contacts of a face.

    Parameters
    ----------
    face : BoundFace
        The pairs of its layout are of its mesh's vertices.
    names : tuple of str, length T
        Blend shapes in the order of the weights; the mesh may lack some.
    poses : (E, T) float64
        The rig's expressions.

    Raises
    ------
    InputError
        If a pair names a vertex that the mesh does not have.
    """
    mesh, layout = face.mesh, face.layout
    _check_pairs(mesh, np.concatenate([layout.lips, layout.lids]))
    contacts = _contacts(mesh, layout.lips, layout.lids)
    pairs = np.concatenate([np.zeros((0, 2), np.int64), *(own for _, own in contacts)])
    directions = [_across(mesh, own) for _, own in contacts]
    ends = np.cumsum([0, *(len(own) for _, own in contacts)]).tolist()
    means = [_mean(mesh, own, _PLACES[kind.split()[-1]]) for kind, own in contacts]

    def across(values: FloatArray) -> FloatArray:
        """Return the apertures (..., K) of upper, then lower vertices (..., 2 P * 3)."""
        upper, lower = np.moveaxis(values.reshape(*values.shape[:-1], 2, len(pairs), 3), -3, 0)
        apertures = [np.zeros((*values.shape[:-1], 0))]
        for (first, last), direction, mean in zip(pairwise(ends), directions, means, strict=True):
            apart = np.ascontiguousarray((upper - lower)[..., first:last, :])
            apertures.append((apart @ direction) @ mean)
        return np.concatenate(apertures, axis=-1)

    vertices = pairs.T.ravel()
    evaluator = evaluator_of(mesh.shapes, vertices)[0].mapped(across)
    evaluator = evaluator.reordered(shape_places(names, mesh.shape_names))
    neutral_apertures = across(mesh.points[vertices].ravel())
    contact = tuple(
        kind for (kind, _), mean in zip(contacts, means, strict=True) for _ in range(mean.shape[1])
    )
    unlimited = Apertures(
        contact, neutral_apertures, evaluator, neutral_apertures, neutral_apertures, face.tolerance
    )
    # Lid margins have a thickness: the aperture in the blend shape that closes them counts as
    # contact.
    closed = unlimited.at(np.eye(len(names))).min(axis=0, initial=np.inf)
    closed = np.clip(np.minimum(neutral_apertures, closed), 0.0, None)
    touch = np.where(np.array(contact, dtype=str) == "lips", neutral_apertures, closed)
    pressed = unlimited.at(poses).min(axis=0, initial=np.inf)
    return replace(unlimited, touch=touch, floor=np.minimum(touch, pressed))


def _check_pairs(mesh: Mesh, pairs: IntArray) -> None:
    outside = (pairs < 0) | (pairs >= len(mesh.points))
    if outside.any():
        raise InputError(
            f"lips or lids touch at vertex {pairs[outside][0]} of {mesh.path or mesh.name}, which "
            f"has vertices 0 to {len(mesh.points) - 1}"
        )


def _contacts(mesh: Mesh, lips: IntArray, lids: IntArray) -> list[tuple[str, IntArray]]:
    left = is_left_lid(mesh.points, lids)
    contacts = [("lips", lips), ("left lids", lids[left]), ("right lids", lids[~left])]
    return [(kind, pairs) for kind, pairs in contacts if len(pairs)]


def _across(mesh: Mesh, pairs: IntArray) -> FloatArray:
    """Return the unit vector across a contact, from lower to upper: (3,)."""
    direction = (mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]]).sum(axis=0)
    return np.asarray(direction / max(float(np.linalg.norm(direction)), 1e-12))


def _mean(mesh: Mesh, pairs: IntArray, places: int) -> FloatArray:
    """Return the share of each pair in the aperture at each place: (P, K)."""
    counts = _places(mesh.points[pairs, 0].mean(axis=1), places)
    return np.asarray(counts / counts.sum(axis=0))


def _places(x: FloatArray, count: int) -> FloatArray:
    """Return the weight of each pair at each place along the contact: (P, K).

    A pair between two places counts for both, so that the aperture is continuous and symmetric.
    """
    step = (x.max() - x.min()) / count
    if not step > 0:
        return np.ones((len(x), 1))
    centres = x.min() + step * (np.arange(count) + 0.5)
    counts = np.maximum(1.0 - np.abs(x[:, None] - centres) / step, 0.0)
    return np.asarray(counts[:, counts.any(axis=0)])
