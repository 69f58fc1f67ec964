"""Clips: the animations of a rig, as immutable arrays in SI units, Y up."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, freeze, frozen
from usdface.errors import InputError
from usdface.takes import WeightsTake

__all__ = ["Clip", "JointsTake", "check_clip", "chosen_clips"]


@dataclass(frozen=True, eq=False, slots=True)
class JointsTake:
    """Joint transforms over time, each relative to the joint's parent.

    A joint's frame maps to its parent's by scale, then rotation, then translation. Between two
    times translations and scales are linear and rotations follow the shortest arc (slerp).

    Attributes
    ----------
    joints : tuple of str, length J
        Joint paths of the rig's `Skeleton`; a joint that is not named stays at rest.
    times : (F,) float64 [s]
        Strictly increasing.
    translations : (F, J, 3) float64 [m]
    rotations : (F, J, 4) float64 [1]
        Unit quaternions x, y, z, w.
    scales : (F, J, 3) float64 [1]
    rate : float [Hz]
        Nominal frame rate; 0 where unknown.
    """

    joints: tuple[str, ...]
    times: FloatArray
    translations: FloatArray
    rotations: FloatArray
    scales: FloatArray
    rate: float = 0.0

    def __post_init__(self) -> None:
        for field, width in (("translations", 3), ("rotations", 4), ("scales", 3)):
            values = frozen(getattr(self, field))
            object.__setattr__(self, field, values)
            if values.shape != (len(self.times), len(self.joints), width):
                raise InputError(
                    f"the {field} of joints have shape {values.shape}; expected "
                    f"({len(self.times)} times, {len(self.joints)} joints, {width})"
                )
            if not np.isfinite(values).all():
                raise InputError(f"the {field} of joints must be finite")
        freeze(self, "times")
        if len(set(self.joints)) != len(self.joints):
            raise InputError("an animation names a joint twice")
        if not len(self.times) or not np.isfinite(self.times).all():
            raise InputError("the animation of joints has no frames, or times that are not finite")
        if (np.diff(self.times) <= 0).any():
            raise InputError("the times of the animation of joints must increase strictly")


@dataclass(frozen=True, eq=False, slots=True)
class Clip:
    """One animation of a rig: its blend shapes, its joints, or both, on one clock.

    A clip without a name and with one frame is the pose of the face without animation; it may exist
    beside others.

    Attributes
    ----------
    name : str
        Any text.
    weights : WeightsTake or None
        A blend shape that it does not name stays at 0.
    joints : JointsTake or None
        None: the skeleton stays at rest.
    """

    name: str
    weights: WeightsTake | None = None
    joints: JointsTake | None = None

    @property
    def still(self) -> bool:
        """Whether this is a static pose and no animation."""
        return not self.name and len(self.times) <= 1

    @property
    def times(self) -> FloatArray:
        """All times at which weights or joints have keys: (F,) [s]."""
        parts = [part.times for part in (self.weights, self.joints) if part is not None]
        return np.unique(np.concatenate([np.zeros(0), *parts]))

    @property
    def rate(self) -> float:
        """Nominal frame rate [Hz]; 0 where unknown."""
        parts = [part.rate for part in (self.weights, self.joints) if part is not None]
        return max(parts, default=0.0)


def chosen_clips(clips: tuple[Clip, ...], name: str) -> tuple[Clip, ...]:
    """Return the clips of that name; all for "".

    Raises
    ------
    InputError
        If there is none.
    """
    check_clip(name, [clip.name for clip in clips])
    return tuple(clip for clip in clips if name in ("", clip.name))


def check_clip(name: str, known: Collection[str]) -> None:
    """Refuse an unknown name of a clip; "" stands for all.

    Raises
    ------
    InputError
        If it is none.
    """
    if name and name not in known:
        there = ", ".join(map(repr, known)) or "none"
        raise InputError(f"there is no clip {name!r}; the scene has {there}")
