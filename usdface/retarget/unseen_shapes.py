"""Blend shapes of which a take shows nothing: they stay at 0."""

from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.retarget.views import Views

__all__ = ["unseen_shapes", "without_shapes"]

# Of the largest movement: less is rounding.
_NOTHING = 1e-9
# A head that rests half a metre away shows a twentieth to a sixth of what comes straight forward,
# by perspective, which noise hides; one that turns by 20 degrees to either side a quarter.
_ASIDE = 0.2


def unseen_shapes(basis: FloatArray, views: Views | None = None) -> BoolArray:
    """Return which shapes (S,) move no marker, by their offsets (S, M, D).

    Of a take as a camera sees it (D = 3) those that only come forward, and of which its `views`
    show less than a head that turns would.
    """
    flat = np.abs(basis if views is None else basis[..., :2]).max(axis=(1, 2))
    unseen = np.asarray(flat <= _NOTHING * flat.max())
    if views is None or not unseen.any():
        return unseen
    straight = basis[unseen].reshape(int(unseen.sum()), -1)
    count = len(views.slopes)
    seen = views.seen(np.broadcast_to(straight, (count, *straight.shape)))
    shown = np.sqrt((seen**2).sum(axis=(0, 2)) / count)
    unseen[unseen] = shown <= _ASIDE * np.sqrt((straight**2).sum(axis=1))
    return unseen


def without_shapes(model: BlendShapeEvaluator, left_out: BoolArray) -> BlendShapeEvaluator:
    """Return the shapes with some of them (S,) that move nothing."""
    paths = tuple(
        replace(path, displacements=np.where(left_out[path.shape], 0.0, path.displacements))
        for path in model.inbetweens
    )
    offsets = np.where(left_out[:, None], 0.0, model.offsets)
    return replace(model, offsets=offsets, inbetweens=paths)
