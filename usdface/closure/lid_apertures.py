"""The aperture between the lids of an eye, measured on the rig.

Lids that meet are two surfaces, whose vertices need not face each other. In the pose in which the
eye is closed, points of each rim are paired with the nearest point of the other one (`rims`). The
aperture of a pair is its distance along the normal there, negative where one lid is inside the
other. Near contact that is their signed distance, and it is as linear in the weights as the
vertices are.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray, freeze
from usdface.blend_shapes.evaluator import BlendShapeEvaluator, shape_places
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.closure.rims import RimPairs, rim_pairs
from usdface.face.bound_face import BoundFace
from usdface.face.expression_poses import units_of
from usdface.face.eye_sides import is_left_lid
from usdface.rigs import Mesh

__all__ = ["EYES", "Eye", "LidApertures", "lid_apertures_of"]

Eye = Literal["left", "right"]
EYES: tuple[Eye, Eye] = ("left", "right")

# Places along an eye at each of which it has to be closed: a corner can part while the middle is
# shut.
_PLACES = 6
# A shape closes an eye if it brings the lids to this part of their distance (those of ICT,
# MakeHuman and the example: 0.08 to 0.29).
_CLOSED = 0.4
# In openings of the eye. A rim is 0.05 to 0.2 thick on the three faces: points further apart in
# the closed eye do not touch.
_RIM = 0.25
# Pairs nearer than this on the neutral face lie in a corner of the eye, where the skin folds.
_CORNER = 0.5
# A shape that changes the opening by less does not move the lids.
_STILL = 0.02
# Weights of a shape at which the distance of the lids is measured.
_STEPS = np.linspace(0.0, 1.0, 21)
# FACS: 5 raises the upper lid, 7 tightens the lower one, 6 raises the cheek below it (P. Ekman, W.
# Friesen, J. Hager, "Facial Action Coding System", 2002).
_RAISED, _TIGHTENED, _CHEEK_RAISED = 5, 7, 6


@dataclass(frozen=True, eq=False)
class LidApertures:
    """The apertures of one eye at K pairs of points, for weights of T blend shapes.

    Attributes
    ----------
    eye : {"left", "right"}
    neutral : (K,) float64 [m]
        On the neutral face.
    evaluator : BlendShapeEvaluator
        By how much the shapes change the apertures: N = K.
    place : (K,) int64
        The place along the eye of each pair, rising.
    opening : float [m]
        Mean distance of the lids on the neutral face.
    closer : int
        The blend shape that closes the eye.
    tighteners : tuple of int
        Blend shapes that raise the lower lid.
    cheek_raisers : tuple of int
        Blend shapes that raise the cheek, and the lower lid with it.
    raisers : tuple of int
        Blend shapes that raise the upper lid.
    movers : (T,) bool
        Blend shapes that bring the lids together.
    """

    eye: Eye
    neutral: FloatArray
    evaluator: BlendShapeEvaluator
    place: IntArray
    opening: float
    closer: int
    tighteners: tuple[int, ...]
    cheek_raisers: tuple[int, ...]
    raisers: tuple[int, ...]
    movers: BoolArray

    def __post_init__(self) -> None:
        freeze(self, "neutral")
        freeze(self, "place", dtype=np.int64)

    def at(self, weights: FloatArray) -> FloatArray:
        """Return the apertures (F, K) [m] at weights (F, T)."""
        combined = self.evaluator.combined(weights)
        return np.asarray(self.neutral + self.evaluator.displacements(combined))

    def least(self, weights: FloatArray) -> FloatArray:
        """Return the least aperture (F,) [m]; where the lids cross, how far, negative."""
        return np.asarray(self.at(weights).min(axis=1))

    def widest(self, weights: FloatArray) -> FloatArray:
        """Return the aperture at the place that is open widest: (F,) [m]."""
        return self.ends(weights)[1]

    def ends(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the least aperture, and the aperture at the widest place: (F,) each [m]."""
        return self.ends_of(self.at(weights))

    def ends_of(self, apertures: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the least of apertures (F, K), and that at the widest place: (F,) each [m]."""
        first = np.flatnonzero(np.diff(self.place, prepend=-1))
        places = np.minimum.reduceat(apertures, first, axis=1)
        return places.min(axis=1), places.max(axis=1)

    def between(self, start: FloatArray, end: FloatArray) -> Callable[[FloatArray], FloatArray]:
        """Return a function from shares (F,) of the way between weights to apertures (F, K)."""
        if self.evaluator.linear:
            fixed = self.at(start)
            way = self.at(end) - fixed
            return lambda share: fixed + share[:, None] * way
        return lambda share: self.at(start + share[:, None] * (end - start))


def lid_apertures_of(face: BoundFace, names: tuple[str, ...]) -> dict[Eye, LidApertures]:
    """Measure the lids of each eye of a face that has lids and a shape that closes it.

    Parameters
    ----------
    face : BoundFace
        The lids of its layout are pairs of its mesh's vertices.
    names : tuple of str, length T
        Blend shapes in the order of the weights; the mesh may lack some.
    """
    mesh, lids = face.mesh, face.layout.lids
    if not len(lids):
        return {}
    left = is_left_lid(mesh.points, lids)
    sides: tuple[tuple[Eye, BoolArray], ...] = (("left", left), ("right", ~left))
    measured = {eye: _measure(eye, mesh, lids[own], names) for eye, own in sides if own.any()}
    return {eye: apertures for eye, apertures in measured.items() if apertures is not None}


def _measure(eye: Eye, mesh: Mesh, lids: IntArray, names: tuple[str, ...]) -> LidApertures | None:
    apart = mesh.points[lids[:, 0]] - mesh.points[lids[:, 1]]
    opening = float(np.linalg.norm(apart, axis=1).mean())
    closing = _closing_shape(mesh, lids, names)
    if closing is None:
        return None
    shape, weight = closing
    pairs = rim_pairs(mesh, lids, _posed(mesh, shape, weight), _RIM * opening)
    vertices = pairs.vertices
    neutral = pairs.apertures(vertices, mesh.points[vertices].reshape(-1))
    kept = neutral > _CORNER * opening
    if not kept.any():
        return None
    x = (abs(pairs.points) @ mesh.points[:, 0]) / 2
    order = np.flatnonzero(kept)[np.argsort(x[kept], kind="stable")]
    pairs, neutral = pairs.select(order), neutral[order]
    edges = np.linspace(x[order[0]], x[order[-1]], _PLACES + 1)[1:-1]
    evaluator = _evaluator(mesh, vertices, pairs, names)
    change = evaluator.offsets.mean(axis=1)
    units = units_of(mesh.shape_names)

    def of_unit(unit: int, sign: int) -> tuple[int, ...]:
        moving = sign * change > _STILL * opening
        return tuple(t for t, n in enumerate(names) if moving[t] and unit in units.get(n, set()))

    return LidApertures(
        eye=eye,
        neutral=neutral,
        evaluator=evaluator,
        place=np.searchsorted(edges, x[order]),
        opening=opening,
        closer=names.index(mesh.shape_names[shape]),
        tighteners=of_unit(_TIGHTENED, -1),
        cheek_raisers=of_unit(_CHEEK_RAISED, -1),
        raisers=of_unit(_RAISED, 1),
        movers=change < -_STILL * opening,
    )


def _closing_shape(mesh: Mesh, lids: IntArray, names: tuple[str, ...]) -> tuple[int, float] | None:
    """Return the blend shape that closes an eye best, and the weight at which it does."""
    vertices = lids.T.ravel()
    evaluator = evaluator_of(mesh.shapes, vertices)[0]
    upper, lower = mesh.points[lids[:, 0]], mesh.points[lids[:, 1]]
    across = (upper - lower).sum(axis=0)
    across /= max(float(np.linalg.norm(across)), 1e-12)
    before = float(np.linalg.norm(upper - lower, axis=1).mean())
    best: list[tuple[float, int, int, float]] = []
    for shape in evaluator.free.tolist():
        weights = np.zeros((len(_STEPS), len(mesh.shapes)))
        weights[:, shape] = _STEPS
        moved = evaluator.displacements(evaluator.combined(weights))
        moved = moved.reshape(len(_STEPS), 2, -1, 3)
        apart = (upper - lower) + moved[:, 0] - moved[:, 1]
        distance = np.linalg.norm(apart, axis=2).mean(axis=1)
        shut = (apart @ across).mean(axis=1)
        step = int(np.argmax(shut <= 0)) if (shut <= 0).any() else int(distance.argmin())
        if distance[step] <= _CLOSED * before and mesh.shape_names[shape] in names:
            rank = round(10 * float(distance[step]) / before)
            # Some programs list all vertices, also those that a shape does not move.
            moved_count = int(mesh.shapes[shape].offsets.any(axis=1).sum())
            best.append((rank, moved_count, shape, float(_STEPS[step])))
    # Of shapes that close it alike the one that moves fewest vertices: one eye before both.
    return min(best)[2:] if best else None


def _posed(mesh: Mesh, shape: int, weight: float) -> FloatArray:
    own = replace(mesh.shapes[shape], combination=None)
    evaluator = evaluator_of((own,), own.indices)[0]
    posed = mesh.points.copy()
    posed[own.indices] += evaluator.displacements(np.array([[weight]])).reshape(-1, 3)
    return posed


def _evaluator(
    mesh: Mesh, vertices: IntArray, pairs: RimPairs, names: tuple[str, ...]
) -> BlendShapeEvaluator:
    evaluator = evaluator_of(mesh.shapes, vertices)[0]
    apertures = evaluator.mapped(lambda values: pairs.apertures(vertices, values))
    return apertures.reordered(shape_places(names, mesh.shape_names))
