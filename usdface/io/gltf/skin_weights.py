"""Skin weights as the programs that play glTF read them: none negative, of sum 1.

Source: glTF 2.0 specification, section 3.7.3.3: weights are not negative and their sum is 1.
three.js and Blender normalise other sums to 1 when they load a file; UsdSkel uses weights as
authored.
"""

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding

__all__ = ["normalised_weights"]

_ROUNDED = 1e-6  # of a sum: rounding of float32 and of 16-bit weights
_REPORTED = 1e-3


def normalised_weights(weights: FloatArray, name: str) -> tuple[FloatArray, list[Finding]]:
    """Return the weights (V, K) of a mesh with sums of 1.

    Negative ones are taken as 0; a point that nothing holds goes to its first joint.

    Returns
    -------
    (V, K) float64
    list of Finding
        SKIN_WEIGHTS_NORMALISED by how much sums were off; FEATURE_APPROXIMATED where some weights
        were negative, which programs read in different ways.
    """
    if not weights.size:
        return weights, []
    found = []
    if (weights < 0).any():
        message = "{point_count} points have negative skin weights; taken as 0"
        found.append(
            finding(
                "FEATURE_APPROXIMATED",
                name,
                message,
                int((weights < 0).any(axis=1).sum()),
                feature="negative_skin_weights",
            )
        )
    held = weights.clip(min=0)
    held[~held.any(axis=1), 0] = 1.0
    total = held.sum(axis=1, keepdims=True)
    off = np.abs(weights.sum(axis=1) - 1)
    if off.max() > _REPORTED:
        message = (
            "skin weights of {point_count} points add up to 1 only now; sums were off by up to "
            "{error:.3g}"
        )
        count = int((off > _REPORTED).sum())
        found.append(finding("SKIN_WEIGHTS_NORMALISED", name, message, count, off.max()))
    return np.where(np.abs(total - 1) > _ROUNDED, held / total, held), found
