"""Exaggeration: how large the solved performance is played, as a factor on its weights.

The factor is on the weights, after the solve, and not on the markers before it: noise, misfit, head
pose and residual stay those of the markers, a neutral face stays neutral, other regions do not
compensate for it, and it applies to a take of weights, too. Weights stay within 0 and 1 and below
the weights that limit them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from usdface.arrays import FloatArray, frozen
from usdface.blend_shapes.combined_weights import with_combinations
from usdface.blend_shapes.evaluator import BlendShapeEvaluator, shape_places
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.known_limits import with_known_limits
from usdface.face.layout import FaceLayout
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.face.regions import GainRegion, shape_regions
from usdface.frozen_mapping import FrozenMapping
from usdface.options import EXAGGERATION_PARTS, SolveLimits, check_exaggeration
from usdface.retarget.pins import faded_at_pins
from usdface.rigs import Mesh
from usdface.setup.pin import Pin
from usdface.takes import WeightsTake

__all__ = ["Exaggeration", "exaggerated", "scaled_weights"]

_ONE = np.ones(1)
# Weights of files are in single precision: a limit is kept within this.
_SINGLE = 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class Exaggeration:
    """Factors on the solved weights: each (F,) over the take, or (1,) where it is constant.

    Attributes
    ----------
    parts : mapping of "face", "brows", "eyes", "mouth" to array
        A blend shape has the factor of the face times that of its region; those not named are 1.
    """

    parts: Mapping[str, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        curves = {part: frozen(curve) for part, curve in self.parts.items()}
        for part, curve in curves.items():
            for factor in np.unique(curve).tolist():
                check_exaggeration(part, factor)
        object.__setattr__(self, "parts", FrozenMapping(curves))

    @classmethod
    def constant(cls, parts: Mapping[str, float]) -> "Exaggeration":
        """Return factors that are the same at all times."""
        return cls({part: np.array([factor]) for part, factor in parts.items()})

    def with_constant(self, parts: Mapping[str, float]) -> "Exaggeration":
        """Return the factors with those of some parts replaced."""
        return Exaggeration({**self.parts, **Exaggeration.constant(parts).parts})

    def mean_of(self, part: str) -> float:
        """Return the mean factor of a region over the take, without that of the face."""
        return float(self.parts.get(part, _ONE).mean())

    @property
    def none(self) -> bool:
        """Whether every factor is 1."""
        return all((curve == 1.0).all() for curve in self.parts.values())

    def of(
        self,
        names: tuple[str, ...],
        regions: Mapping[GainRegion, tuple[str, ...]],
        frames: int,
    ) -> FloatArray:
        """Return the factor of each blend shape in each frame: (frames, len(names))."""
        own = {name: region for region, listed in regions.items() for name in listed}
        factors = np.ones((frames, len(names)))
        for column, name in zip(factors.T, names, strict=True):
            column *= self.parts.get(EXAGGERATION_PARTS[0], _ONE)
            column *= self.parts.get(own.get(name, ""), _ONE)
        return factors


def exaggerated(
    weights: WeightsTake,
    exaggeration: Exaggeration,
    mesh: Mesh,
    layout: FaceLayout,
    *,
    pins: tuple[Pin, ...] = (),
    limits: SolveLimits = "declared",
) -> WeightsTake:
    """Return solved weights (F, T) with their exaggeration.

    Parameters
    ----------
    weights : WeightsTake
        Returned as it is if every factor is 1.
    exaggeration : Exaggeration
    mesh : Mesh
        The bound mesh, which has the inbetweens, combination shapes and limits.
    layout : FaceLayout
        Its regions; where it names none they are found on the mesh.
    pins : tuple of Pin
        Pinned weights are kept, and the exaggeration fades out towards them.
    limits : {"declared", "known"}
        As `usdface.options.SolveOptions.limits`.
    """
    if exaggeration.none:
        return weights
    regions = layout.regions
    if not any(regions.values()):
        regions = shape_regions(mesh, find_lip_lid_contacts(mesh))
    names, before = weights.names, weights.weights
    factors = exaggeration.of(names, regions, len(before))
    inbetween = [shape.indices for shape in mesh.shapes if shape.inbetweens]
    vertices = np.unique(np.concatenate([*inbetween, np.zeros(0, np.int64)]))
    evaluator, _ = evaluator_of(mesh.shapes, vertices)
    if limits == "known":
        evaluator = with_known_limits(evaluator, mesh.shape_names)
    # In the order of the weights, which may be those of the whole rig.
    evaluator = evaluator.reordered(shape_places(names, mesh.shape_names))
    after = scaled_weights(before, factors, evaluator)
    after = faded_at_pins(pins, names, weights.times, before, after)
    return replace(weights, weights=with_combinations(mesh.shapes, names, after))


def scaled_weights(
    weights: FloatArray, factors: FloatArray, evaluator: BlendShapeEvaluator
) -> FloatArray:
    """Return weights (F, T) times factors (F, T), from 0 to 1 and below those that limit them."""
    after = np.where(factors == 1.0, weights, _scaled(weights, factors, evaluator))
    return _limited(weights, after, evaluator)


def _scaled(weights: FloatArray, factors: FloatArray, evaluator: BlendShapeEvaluator) -> FloatArray:
    """Return weights (F, T) at which each shape is `factors` times as far along itself."""
    result = weights * factors
    for path in evaluator.inbetweens:
        column = path.shape
        along = path.shares_of(weights[:, column])
        result[:, column] = path.weights_of(factors[:, column] * along)
    return result.clip(0.0, 1.0)


def _limited(before: FloatArray, after: FloatArray, evaluator: BlendShapeEvaluator) -> FloatArray:
    """Return weights that stay below those that limit them, as far as they did before."""
    after = after.copy()
    for _ in range(len(evaluator.limits)):  # a limit may be limited itself
        for low, high in evaluator.limits.tolist():
            kept = before[:, low] <= before[:, high] + _SINGLE
            least = np.minimum(after[:, low], after[:, high])
            after[:, low] = np.where(kept, least, after[:, low])
    return after
