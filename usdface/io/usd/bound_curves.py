"""Weights and joints of SkelAnimations as takes, on the clock of a clip."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel

from usdface.arrays import FloatArray
from usdface.clips import JointsTake
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.usd.animated_joints import animated_joints
from usdface.io.usd.clip_variants import BoundAnimation
from usdface.io.usd.shared_shapes import ShapeNames
from usdface.io.usd.skeletons import StagedSkeleton
from usdface.takes import WeightsTake, frame_step

__all__ = [
    "ClipClock",
    "joints_of",
    "merged_defaults",
    "merged_weights",
    "shape_names_of",
    "side_by_side",
]

_SAME_WEIGHT = 1e-6  # 8 roundings of float32
_SAME_RATE = 5e-4  # of a rate: half of the way from 30 to 29.97 Hz


@dataclass(frozen=True, slots=True)
class ClipClock:
    """The clock of a clip: time code of its first frame, time codes per second [Hz]."""

    start: float
    rate: float

    def times(self, codes: FloatArray) -> FloatArray:
        """Return time codes (F,) as times of the clip [s]."""
        return np.asarray((codes - self.start) / self.rate)

    def grid(self, times: FloatArray) -> float:
        """Return the frame rate [Hz] of samples at `times`: the stage's or their own."""
        step = frame_step(times)
        if step <= 0 or abs(1 / step - self.rate) < _SAME_RATE * self.rate:
            return self.rate
        return round(1 / step, 6)


def shape_names_of(bound: BoundAnimation, names: ShapeNames) -> tuple[str, ...]:
    """Return the blend shapes that a SkelAnimation moves, as the rig names them."""
    own = names.get(bound.prim.GetPath(), {})
    tokens = map(str, bound.animation.GetBlendShapeOrder())
    return tuple(own.get(token, token) for token in tokens)


def merged_defaults(bounds: Sequence[BoundAnimation], names: ShapeNames) -> WeightsTake | None:
    """Return the weights that all SkelAnimations have without time, if some are not zero."""
    columns: dict[str, float] = {}
    for bound in bounds:
        row = UsdSkel.Animation(bound.animation.GetPrim()).GetBlendShapeWeightsAttr().Get()
        own = shape_names_of(bound, names)
        if row is not None and len(row) == len(own):
            columns = dict(zip(own, map(float, row), strict=True)) | columns
    if not any(columns.values()):
        return None
    return WeightsTake(tuple(columns), np.zeros(1), np.array([[*columns.values()]]))


def _weights(bound: BoundAnimation, names: ShapeNames, clock: ClipClock) -> WeightsTake:
    query, own = bound.animation, shape_names_of(bound, names)
    codes = np.array(query.GetBlendShapeWeightTimeSamples())
    values = UsdSkel.Animation(query.GetPrim()).GetBlendShapeWeightsAttr()
    rows = []
    for code in codes:
        given = values.Get(float(code))  # None where the sample is blocked
        row = np.asarray([] if given is None else given, np.float64)
        if row.shape != (len(own),):
            raise InputError(
                f"{bound.path} has {row.size} blendShapeWeights for {len(own)} "
                f"blendShapes at time code {code:g}",
                "WEIGHTS_LENGTH_WRONG",
            )
        rows.append(row)
    times = clock.times(codes)
    return WeightsTake(own, times, np.array(rows), clock.grid(times))


def merged_weights(
    bounds: Sequence[BoundAnimation], names: ShapeNames, clock: ClipClock
) -> tuple[WeightsTake | None, list[Finding]]:
    """Return the weights of all SkelAnimations that play at once; of equal names the first."""
    takes = [_weights(bound, names, clock) for bound in bounds]
    if len(takes) < 2:
        return (takes[0] if takes else None), []
    times = np.unique(np.concatenate([take.times for take in takes]))
    columns: dict[str, FloatArray] = {}
    found = []
    for bound, take in zip(bounds, takes, strict=True):
        for name, curve in zip(take.names, take.weights.T, strict=True):
            own = np.interp(times, take.times, curve)
            if not np.allclose(columns.setdefault(name, own), own, rtol=0, atol=_SAME_WEIGHT):
                message = "{joint!r} moves otherwise in another SkelAnimation, which comes first"
                found.append(finding("ANIMATION_DROPPED", str(bound.path), message, name))
    weights = np.stack([*columns.values()], 1)
    return WeightsTake(tuple(columns), times, weights, max(t.rate for t in takes)), found


def side_by_side(one: WeightsTake | None, other: WeightsTake) -> WeightsTake:
    """Return takes of different names as one, with the keys of both."""
    if one is None:
        return other
    times = np.union1d(one.times, other.times)
    curves = [
        np.interp(times, take.times, curve) for take in (one, other) for curve in take.weights.T
    ]
    names = (*one.names, *other.names)
    return WeightsTake(names, times, np.stack(curves, 1), max(one.rate, other.rate))


def joints_of(
    binding: BoundAnimation, staged: StagedSkeleton, si: FloatArray, clock: ClipClock
) -> tuple[JointsTake | None, list[Finding]]:
    """Return the animated joints in the rig's frames (`usdface.io.usd.skeleton`)."""
    skeleton, renamed = staged.skeleton, staged.renamed
    where = str(binding.path)
    order = tuple(map(str, binding.animation.GetJointOrder()))
    known = [k for k, joint in enumerate(order) if joint in skeleton.joints]
    found = []
    if len(known) < len(order):
        message = "{joint_count} animated joints are not in the skeleton"
        found.append(finding("ANIMATION_DROPPED", where, message, len(order) - len(known)))
    codes = np.array(binding.animation.GetJointTransformTimeSamples() or [clock.start])
    xforms = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    world = np.array(xforms.GetLocalToWorldTransform(binding.prim), np.float64)
    moved = animated_joints(binding.animation, skeleton, world @ si, codes.tolist())
    if moved is None:
        message = "translations, rotations and scales do not fit the joints"
        return None, [*found, finding("ANIMATION_DROPPED", where, message)]
    times = clock.times(codes)
    joints = tuple(renamed[name] for name in moved.names)
    return JointsTake(joints, times, *moved[1:], clock.grid(times)), found
