"""Joint frames that UsdSkel can hold: SkelAnimations have 16-bit scales."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.clips import Clip, JointsTake
from usdface.findings import Finding, finding
from usdface.io.transforms import decompose
from usdface.rigs import Skeleton

__all__ = ["with_unit_scales"]

_FLOAT32 = 1e-7  # of a scale: the rounding of float32
_COARSE = 1e-6  # of a size, 8 such roundings


def with_unit_scales(
    skeleton: Skeleton, clips: Sequence[Clip]
) -> tuple[Skeleton, tuple[Clip, ...], list[Finding]]:
    """Measure joint frames in units in which the joints have the scale 1 at rest.

    The shown points stay as they are, as only the motion of a joint relative to its bind pose
    moves them. Frames stay as they are where 16 bits hold their scales already. A joint that
    has children keeps its non-uniform scale: their frames would shear.

    Returns
    -------
    Skeleton
    tuple of Clip
    list of Finding
        SCALE_ROUNDED for clips with scales that still lie between the 16-bit numbers.
    """
    _, _, scales = decompose(skeleton.rest)
    if not np.allclose(scales, _half(scales), rtol=_FLOAT32, atol=0):
        skeleton, clips = _measured(skeleton, clips, scales)
    found = []
    for clip in clips:
        sizes = np.zeros(0) if clip.joints is None else clip.joints.scales
        off = np.abs(_half(sizes) - sizes).max(initial=0.0)
        if off > _COARSE * max(1.0, np.abs(sizes).max(initial=0.0)):
            message = "scales of joints are off by up to {error:.1e} in UsdSkel's 16-bit numbers"
            found.append(finding("SCALE_ROUNDED", clip.name, message, off))
    return skeleton, tuple(clips), found


def _half(scales: FloatArray) -> FloatArray:
    return scales.clip(-65504, 65504).astype(np.float16).astype(np.float64)


def _measured(
    skeleton: Skeleton, clips: Sequence[Clip], scales: FloatArray
) -> tuple[Skeleton, list[Clip]]:
    place = {joint: k for k, joint in enumerate(skeleton.joints)}
    parents = skeleton.parents
    units = np.ones((len(parents), 3))  # of each joint's frame, in units of the frame before
    above = np.ones(len(parents))
    for k, parent in enumerate(parents):
        above[k] = units[parent, 0] if parent >= 0 else 1.0
        own = np.abs(scales[k]) * above[k]
        if not own.all():
            own = np.full(3, above[k])
        elif k in parents:
            own = np.full(3, np.cbrt(own.prod()))
        units[k] = own
    wide = np.concatenate([units, np.ones((len(units), 1))], 1)
    up = np.concatenate([np.repeat(above[:, None], 3, 1), np.ones((len(above), 1))], 1)
    measured = replace(
        skeleton,
        bind=skeleton.bind / wide[:, :, None],
        rest=skeleton.rest / wide[:, :, None] * up[:, None, :],
    )
    return measured, [
        clip
        if clip.joints is None
        else replace(clip, joints=_in_units(clip.joints, place, units, above))
        for clip in clips
    ]


def _in_units(
    take: JointsTake, place: dict[str, int], units: FloatArray, above: FloatArray
) -> JointsTake:
    own = [place[joint] for joint in take.joints]
    return replace(
        take,
        translations=take.translations * above[own, None],
        scales=take.scales * above[own, None] / units[own],
    )
