"""Expression poses learned from the solved weights of labelled examples."""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.rule_learning.examples import Examples
from usdface.setup.expression import Expression

__all__ = ["learned_poses"]

# Smaller weights are taken for residue of the solve; chosen by hand, no experiment.
_LEAST_WEIGHT = 0.05
# Written weights are rounded for readability.
_DIGITS = 4


def learned_poses(
    examples: Examples, weights: FloatArray, shape_names: Sequence[str]
) -> tuple[Expression, ...]:
    """Return a pose for each emotion: the weights common to its variants, at full intensity.

    The minimum over the variants of the mean of each: with an open and a closed mouth among the
    variants the pose does not open the mouth, so that it fits both.

    Parameters
    ----------
    examples : Examples
    weights : (N, S) float64
        Solved weights of the examples.
    shape_names : sequence of str, length S
    """
    whole = np.clip(weights / examples.intensities[:, None], 0.0, 1.0)
    poses = []
    for emotion in examples.names:
        variants = examples.variants_of(emotion)
        means = [whole[examples.rows(emotion, variant)].mean(axis=0) for variant in variants]
        pose = np.round(np.min(means, axis=0), _DIGITS)
        shown = np.flatnonzero(pose >= _LEAST_WEIGHT).tolist()
        poses.append(Expression(emotion, tuple(shape_names[s] for s in shown), pose[shown]))
    return tuple(poses)
