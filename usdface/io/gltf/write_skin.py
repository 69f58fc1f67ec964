"""Skin influences as vertex attributes of glTF, four to a set, the strongest first.

Source: glTF 2.0 specification, section 3.7.3.3 (skinned mesh attributes).
"""

import numpy as np
from numpy.typing import NDArray
from pygltflib import ARRAY_BUFFER

from usdface.arrays import IntArray
from usdface.errors import OutputError
from usdface.findings import Finding, finding
from usdface.io.gltf.buffer import BufferBuilder
from usdface.rigs import Skin

__all__ = ["sorted_influences", "write_influences"]

_SET = 4  # influences
_SUM = 1e-3  # of 1: a sum that is off by more is intended, or an error


def write_influences(
    skin: Skin, source: IntArray, count: int, joints: int, name: str, builder: BufferBuilder
) -> tuple[dict[str, int], list[Finding]]:
    """Append the influences of a mesh; return the accessors by attribute.

    Parameters
    ----------
    skin : Skin
    source : (N,) int64
        Point of each vertex.
    count, joints : int
        Points of the mesh, joints of the skeleton.
    name : str
        The mesh's, for messages.
    builder : BufferBuilder

    Raises
    ------
    OutputError
        If the skin does not fit.
    """
    places, weights = sorted_influences(skin, count, joints, name)
    small = np.uint8 if joints <= 2**8 else np.uint16
    attributes = {}
    for number in range(places.shape[1] // _SET):
        own = slice(_SET * number, _SET * (number + 1))
        held = places[source, own].astype(small), weights[source, own]
        for attribute, values in zip(("JOINTS", "WEIGHTS"), held, strict=True):
            attributes[f"{attribute}_{number}"] = builder.array(values, ARRAY_BUFFER)
    return attributes, _report_weights(skin, name)


def _report_weights(skin: Skin, name: str) -> list[Finding]:
    """Return findings where UsdSkel differs, as it does not normalise weights."""
    held = np.nan_to_num(skin.weights)
    negative = int((held < 0).any(axis=1).sum())
    off = int((np.abs(held.sum(axis=1) - 1) > _SUM).sum())
    found = []
    if negative:
        message = "{point_count} points have negative skin weights; taken as 0"
        found.append(
            finding(
                "FEATURE_APPROXIMATED", name, message, negative, feature="negative_skin_weights"
            )
        )
    if off:
        message = "the skin weights of {point_count} points do not add up to 1; glTF's do"
        found.append(finding("FEATURE_APPROXIMATED", name, message, off, feature="skin_weights"))
    return found


def sorted_influences(
    skin: Skin, count: int, joints: int, name: str
) -> tuple[IntArray, NDArray[np.float32]]:
    """Return the joints (V, K) of each point, strongest first, and weights that sum to 1.

    Joints named twice at a point are summed up, as the specification wants; a point that
    nothing holds goes to the first joint. K is a multiple of four.
    """
    if skin.joints.shape != skin.weights.shape or len(skin.joints) != count:
        raise OutputError(f"the skin of mesh {name!r} does not fit its {count} points")
    if skin.joints.size and not 0 <= skin.joints.min() <= skin.joints.max() < joints:
        raise OutputError(f"the skin of mesh {name!r} names a joint outside 0 to {joints - 1}")
    held = np.nan_to_num(skin.weights).clip(min=0)
    key = (np.arange(count)[:, None] * joints + skin.joints)[held > 0]
    keys, place = np.unique(key, return_inverse=True)
    strength = np.bincount(place, weights=held[held > 0], minlength=len(keys))
    order = np.lexsort((keys, -strength, keys // joints))
    point, joint, strength = keys[order] // joints, keys[order] % joints, strength[order]
    rank = np.arange(len(point)) - np.searchsorted(point, point)
    width = _SET * (1 + int(rank.max(initial=0)) // _SET)
    places = np.zeros((count, width), np.int64)
    weights = np.zeros((count, width))
    places[point, rank], weights[point, rank] = joint, strength
    weights[~weights.any(axis=1), 0] = 1.0
    single = (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)
    places[single == 0] = 0  # an unused slot names joint 0
    single[:, 0] = 1.0 - single[:, 1:].sum(axis=1)  # exactly 1 after rounding
    return places, single
